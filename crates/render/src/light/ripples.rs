//! Ripples on liquids: a normal field of the plane.

use glam::{Vec2, Vec3};
use nemoral_scene::Liquid;

/// Waves that ripples are the sum of.
const WAVES: u32 = 9;
/// Length of each wave over that of the one before.
const SHORTER: f32 = 0.74;
/// The golden angle, radians, by which the waves' directions differ.
const TURN: f32 = 2.399_963;
/// Water on a slope is rougher, by this factor for a slope of 1.
const ROUGHER: f32 = 5.0;
/// A wave is gone where a sample is this share of its length.
const UNRESOLVED: f32 = 0.6;

/// The normal of a liquid's surface with its ripples, at a place on the map (metres), where a
/// sample is so wide. `normal` is that of the surface without them, upwards.
pub(crate) fn rippled(liquid: &Liquid, place_m: Vec2, normal: Vec3, sample_m: f32) -> Vec3 {
    if liquid.ripple_slope <= 0.0 || normal.z <= 0.1 {
        return normal;
    }
    let tilt = normal.truncate().length() / normal.z;
    let rms = (liquid.ripple_slope * (1.0 + ROUGHER * tilt)).min(0.35);
    // Places are moved about, so that crests are not straight, and some are calmer than others.
    let broad = place_m / (7.0 * liquid.ripple_m);
    let sin = |x: f32| libm::sinf(x);
    let moved = Vec2::new(
        sin(broad.y * 2.3 + 1.1 * sin(broad.x)),
        sin(broad.x * 1.9 + 1.3 * sin(broad.y * 1.2) + 2.0),
    );
    let place = place_m + moved * (1.1 * liquid.ripple_m);
    let calm = 0.65 + 0.35 * moved.x * moved.y;
    // The mean square of a cosine is a half.
    let each = rms * calm * (2.0 / WAVES as f32).sqrt();
    let (mut slope, mut length_m) = (Vec2::ZERO, liquid.ripple_m);
    for k in 0..WAVES {
        let turn = TURN * k as f32 + 0.7;
        let way = Vec2::new(libm::cosf(turn), sin(turn));
        let resolved = (1.0 - sample_m / (UNRESOLVED * length_m)).clamp(0.0, 1.0);
        if resolved <= 0.0 {
            break;
        }
        let phase = std::f32::consts::TAU * (way.dot(place) / length_m).fract() + 1.7 * k as f32;
        slope += way * (each * resolved * libm::cosf(phase));
        length_m *= SHORTER;
    }
    (normal - slope.extend(0.0)).normalize_or(normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn liquid(ripple_slope: f32) -> Liquid {
        Liquid {
            refractive_index: 1.33,
            absorption_per_m: Vec3::ZERO,
            ripple_slope,
            ripple_m: 0.4,
        }
    }

    #[test]
    fn slopes_are_as_wide_as_asked_and_vanish_far_away() {
        let (mut sum, n) = (0.0, 4000);
        for i in 0..n {
            let place = Vec2::new(0.137 * i as f32, (0.731 * i as f32) % 61.0);
            let normal = rippled(&liquid(0.08), place, Vec3::Z, 0.0);
            assert!((normal.length() - 1.0).abs() < 1e-5);
            sum += normal.truncate().length_squared() / (normal.z * normal.z);
            assert_eq!(rippled(&liquid(0.08), place, Vec3::Z, 5.0), Vec3::Z);
            assert_eq!(rippled(&liquid(0.0), place, Vec3::Z, 0.0), Vec3::Z);
        }
        let rms = (sum / n as f32).sqrt();
        assert!((0.04..0.09).contains(&rms), "{rms}");
    }
}
