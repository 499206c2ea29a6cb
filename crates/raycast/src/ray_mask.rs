//! Subsets of the rays of a packet.

/// The most rays in a packet.
pub(crate) const MAX_RAYS: usize = 64;

/// A set of rays of a packet: bit `i` for ray `i`.
pub(crate) type RayMask = u64;

/// Takes the lowest ray number out of a set that is not empty.
#[inline(always)]
pub(crate) fn pop_ray(rays: &mut RayMask) -> usize {
    let i = rays.trailing_zeros() as usize & (MAX_RAYS - 1);
    *rays &= rays.wrapping_sub(1);
    i
}
