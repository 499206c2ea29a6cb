//! Unit vectors packed in 32 bits.

use glam::{Vec2, Vec3};

/// A unit vector in 32 bits (Cigolle et al. 2014, "A survey of efficient representations for
/// independent unit vectors"): two signed normalised 16-bit numbers.
pub(crate) fn octahedral(n: Vec3) -> u32 {
    let sum = n.x.abs() + n.y.abs() + n.z.abs();
    if sum.is_nan() || sum <= 0.0 {
        return 0;
    }
    let p = n.truncate() / sum;
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    let p = if n.z >= 0.0 {
        p
    } else {
        Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
    };
    let pack = |x: f32| u32::from((x.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16);
    pack(p.x) | pack(p.y) << 16
}

/// The unit vector that [`octahedral`] packed.
pub(crate) fn from_octahedral(packed: u32) -> Vec3 {
    let unpack = |bits: u32| (f32::from(bits as u16 as i16) / 32767.0).max(-1.0);
    let p = Vec2::new(unpack(packed), unpack(packed >> 16));
    let z = 1.0 - p.x.abs() - p.y.abs();
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    let p = if z >= 0.0 {
        p
    } else {
        Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
    };
    // Its length is at least 1 / sqrt 3.
    let n = p.extend(z);
    n / n.length()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn directions_survive_packing(x in -1.0_f32..1.0, y in -1.0_f32..1.0, z in -1.0_f32..1.0) {
            let n = Vec3::new(x, y, z).normalize_or(Vec3::Z);
            prop_assert!(n.distance(from_octahedral(octahedral(n))) < 1e-4);
        }
    }

    #[test]
    fn poles_and_nothing() {
        for n in [Vec3::Z, -Vec3::Z, Vec3::X, -Vec3::Y] {
            assert!(n.distance(from_octahedral(octahedral(n))) < 1e-4, "{n}");
        }
        assert_eq!(octahedral(Vec3::ZERO), 0);
        assert_eq!(octahedral(Vec3::NAN), 0);
    }
}
