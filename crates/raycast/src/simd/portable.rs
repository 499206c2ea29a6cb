//! The instruction set of any processor.

use super::{F8, Isa, Keys, Rows, U8};

/// The instruction set of any processor: loops over arrays.
///
/// They are `#[inline]`, so that the compiler simplifies each loop before it inlines it. With
/// `#[inline(always)]` it is the other way round, and takes the compiler ten times as long.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Portable;

#[inline]
fn zip(a: F8, b: F8, f: impl Fn(f32, f32) -> f32) -> F8 {
    let mut out = [0.0; 8];
    for ((out, a), b) in out.iter_mut().zip(a.0).zip(b.0) {
        *out = f(a, b);
    }
    F8(out)
}

impl Isa for Portable {
    type V = F8;

    #[inline]
    fn load(self, memory: &F8) -> F8 {
        *memory
    }

    #[inline]
    fn store(self, v: F8) -> F8 {
        v
    }

    #[inline]
    fn splat(self, x: f32) -> F8 {
        F8::splat(x)
    }

    #[inline]
    fn widen(self, memory: &U8) -> F8 {
        let mut wide = [0.0; 8];
        for (wide, &narrow) in wide.iter_mut().zip(&memory.0) {
            *wide = f32::from(narrow);
        }
        F8(wide)
    }

    #[inline]
    fn sub(self, a: F8, b: F8) -> F8 {
        zip(a, b, |a, b| a - b)
    }

    #[inline]
    fn mul(self, a: F8, b: F8) -> F8 {
        zip(a, b, |a, b| a * b)
    }

    #[inline]
    fn mul_add(self, a: F8, b: F8, c: F8) -> F8 {
        zip(zip(a, b, |a, b| a * b), c, |ab, c| ab + c)
    }

    #[inline]
    fn mul_sub(self, a: F8, b: F8, c: F8) -> F8 {
        zip(zip(a, b, |a, b| a * b), c, |ab, c| ab - c)
    }

    #[inline]
    fn max(self, a: F8, b: F8) -> F8 {
        zip(a, b, |a, b| if a > b { a } else { b })
    }

    #[inline]
    fn min(self, a: F8, b: F8) -> F8 {
        zip(a, b, |a, b| if a < b { a } else { b })
    }

    #[inline]
    fn le(self, a: F8, b: F8) -> F8 {
        zip(a, b, |a, b| {
            f32::from_bits(if a <= b { u32::MAX } else { 0 })
        })
    }

    #[inline]
    fn and(self, a: F8, b: F8) -> F8 {
        zip(a, b, |a, b| f32::from_bits(a.to_bits() & b.to_bits()))
    }

    #[inline]
    fn xor(self, a: F8, b: F8) -> F8 {
        zip(a, b, |a, b| f32::from_bits(a.to_bits() ^ b.to_bits()))
    }

    #[inline]
    fn signs(self, v: F8) -> u32 {
        let mut mask = 0;
        for (i, lane) in v.0.iter().enumerate() {
            mask |= (lane.to_bits() >> 31) << i;
        }
        mask
    }

    #[inline]
    fn keys(self, distances: F8, mask: F8) -> Keys {
        let mut keys = [0; 8];
        for ((key, distance), mask) in keys.iter_mut().zip(distances.0).zip(mask.0) {
            *key = ((distance.to_bits() | !mask.to_bits()) >> 16) as u16;
        }
        Keys(keys)
    }

    #[inline]
    fn first(self, keys: &Keys) -> usize {
        let least = keys.0.iter().zip(0_u32..);
        let least = least.map(|(&key, lane)| u32::from(key) << 3 | lane).min();
        least.map_or(0, |packed| (packed & 7) as usize)
    }

    #[inline]
    fn only(self, v: F8, mask: F8) -> F8 {
        zip(v, mask, |v, mask| {
            f32::from_bits(v.to_bits() | !mask.to_bits())
        })
    }

    #[inline]
    fn all_keys(self, distances: F8) -> Keys {
        self.keys(distances, F8::splat(f32::from_bits(u32::MAX)))
    }

    #[inline]
    fn columns(self, rows: &Rows) -> [u64; 8] {
        let mut columns = [0; 8];
        for (i, row) in rows.0.iter().enumerate() {
            for (k, column) in columns.iter_mut().enumerate() {
                *column |= u64::from(row >> k & 1) << i;
            }
        }
        columns
    }

    #[inline]
    fn prefetch<T>(self, _: &T) {}
}
