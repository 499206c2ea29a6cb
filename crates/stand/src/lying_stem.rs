//! How a stem lies on the ground: as gravity puts it.

use nemoral_scene::Surface;
use nemoral_scene::glam::{DVec2, DVec3, Mat3};
use nemoral_seed::{Draw, Key};

/// Distance of the places at which the ground under a stem is looked at, metres.
const STEP_M: f64 = 0.25;

/// A stem as a truncated cone along its x-axis, its thick end at negative x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LyingStem {
    /// Its length, metres.
    pub length_m: f64,
    /// Half of its height at its thick and its thin end, metres.
    pub half_height_m: [f64; 2],
}

/// What holds a stem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StemSupport {
    /// It is stiff: it lies on the ground's highest places under it, on both sides of its middle.
    Stiff,
    /// It gives way: it follows the ground as a straight line best can, but is nowhere deeper in it
    /// than half of its height.
    Sagging,
    /// Its thick end is held so high above the ground, metres, and its other end leans on the
    /// ground: it is the stem of a thrown tree on its root plate.
    Held(f64),
}

/// A pose on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LyingPose {
    /// World position of the middle of the axis, metres.
    pub position_m: DVec3,
    /// World axes from the stem's: a rotation.
    pub rotation: Mat3,
}

impl LyingStem {
    /// The stem on a surface, its middle above `middle_m`, its thin end in the direction `heading`
    /// (of length 1), sunk by `sink_m`. Its upper side is away from the ground, turned by
    /// `roll_rad` about its axis.
    pub fn pose_on_ground(
        &self,
        surface: &(impl Surface + ?Sized),
        middle_m: DVec2,
        heading: DVec2,
        support: StemSupport,
        sink_m: f64,
        roll_rad: f64,
    ) -> LyingPose {
        // Its reach on the map, by the slope from end to end.
        let half = 0.5 * self.length_m;
        let height = |s: f64| surface.sample(middle_m + heading * s).height_m;
        let slope = (height(half) - height(-half)) / self.length_m;
        let reach = half / (1.0 + slope * slope).sqrt();
        let axis = self.lowest_axis(surface, middle_m, heading, reach);
        let (rise, at_middle) = match support {
            StemSupport::Stiff => stiff(&axis),
            StemSupport::Sagging => sagging(&axis, self.half_height_m[0]),
            StemSupport::Held(held_m) => held(&axis, height(-reach) + held_m),
        };
        let x = heading.extend(rise).normalize();
        let gradient = surface.sample(middle_m).gradient;
        let normal = (-gradient).extend(1.0);
        let up = (normal - x * normal.dot(x)).normalize_or(DVec3::Z);
        let side = up.cross(x);
        let (sin, cos) = libm::sincos(roll_rad);
        let (y, z) = (side * cos + up * sin, up * cos - side * sin);
        LyingPose {
            position_m: middle_m.extend(at_middle - sink_m),
            rotation: Mat3::from_cols(x.as_vec3(), y.as_vec3(), z.as_vec3()),
        }
    }

    /// How high the axis must be to touch the ground, by the way along it on the map.
    fn lowest_axis(
        &self,
        surface: &(impl Surface + ?Sized),
        middle_m: DVec2,
        heading: DVec2,
        reach: f64,
    ) -> Vec<DVec2> {
        let steps = ((2.0 * reach / STEP_M).ceil() as usize).max(4);
        let [thick, thin] = self.half_height_m;
        let places = (0..=steps).map(|i| {
            let t = i as f64 / steps as f64;
            let s = reach * (2.0 * t - 1.0);
            let ground = surface.sample(middle_m + heading * s);
            // A round stem touches a slope beside its underside.
            let steep = (1.0 + ground.gradient.length_squared()).sqrt();
            DVec2::new(s, ground.height_m + (thick + (thin - thick) * t) * steep)
        });
        places.collect()
    }
}

/// Rise and height in the middle of the lowest line above all places that is held on both sides of
/// the middle: an edge of their upper hull. On a place in the middle it tips over to its thick end.
fn stiff(places: &[DVec2]) -> (f64, f64) {
    let mut best = (0.0, f64::NEG_INFINITY);
    for a in places.iter().filter(|p| p.x < 0.0) {
        for b in places.iter().filter(|p| p.x > 0.0) {
            let rise = (b.y - a.y) / (b.x - a.x);
            let at_middle = a.y - rise * a.x;
            if at_middle > best.1 {
                best = (rise, at_middle);
            }
        }
    }
    match places.iter().find(|p| p.x == 0.0) {
        Some(middle) if middle.y >= best.1 => {
            let thick = places.iter().filter(|p| p.x < 0.0);
            let rises = thick.map(|p| (p.y - middle.y) / p.x);
            (rises.fold(f64::INFINITY, f64::min), middle.y)
        }
        _ => best,
    }
}

/// Rise and height in the middle of the line of least squares, lifted where it would pass the
/// highest places by more than `deepest_m`.
fn sagging(places: &[DVec2], deepest_m: f64) -> (f64, f64) {
    let n = places.len() as f64;
    let mean = places.iter().copied().sum::<DVec2>() / n;
    let (mut xy, mut xx) = (0.0, 0.0);
    for p in places {
        xy += (p.x - mean.x) * (p.y - mean.y);
        xx += (p.x - mean.x) * (p.x - mean.x);
    }
    let rise = xy / xx;
    let at_middle = mean.y - rise * mean.x;
    let below = |p: &DVec2| p.y - (at_middle + rise * p.x);
    let deepest = places.iter().map(below).fold(0.0, f64::max);
    (rise, at_middle + (deepest - deepest_m).max(0.0))
}

/// Rise and height in the middle of the lowest line above all places from a height at the thick
/// end on; places near that end, which its root plate keeps off the ground, do not count.
fn held(places: &[DVec2], butt_m: f64) -> (f64, f64) {
    let butt = places[0].x;
    let far = places.iter().filter(|p| p.x > 0.0);
    let rise = far
        .map(|p| (p.y - butt_m) / (p.x - butt))
        .fold(f64::NEG_INFINITY, f64::max);
    (rise, butt_m - rise * butt)
}

/// A roll that keeps the upper side up, as moss grows there; by the stem's own key.
#[must_use]
pub fn roll_rad(key: Key) -> f64 {
    key.rng().range_f64(-0.35, 0.35)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::{FlatSurface, SurfaceSample};
    use proptest::prelude::*;

    /// Waves of a few metres.
    #[derive(Debug)]
    struct Waves {
        slope: DVec2,
        amplitude_m: f64,
        turn: f64,
    }

    impl Surface for Waves {
        fn sample(&self, p: DVec2) -> SurfaceSample {
            let (sin, cos) = libm::sincos(1.3 * p.x + 0.7 * p.y + self.turn);
            SurfaceSample {
                height_m: self.slope.dot(p) + self.amplitude_m * sin,
                gradient: self.slope + self.amplitude_m * cos * DVec2::new(1.3, 0.7),
            }
        }
    }

    /// Least and greatest height of the underside above the ground, along the stem.
    fn gaps(stem: &LyingStem, pose: &LyingPose, ground: &impl Surface) -> (f64, f64) {
        let axis = pose.rotation.x_axis.as_dvec3();
        let down = pose.rotation.z_axis.as_dvec3() * -1.0;
        (0..=100).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), i| {
            let t = f64::from(i) / 100.0;
            let [thick, thin] = stem.half_height_m;
            let r = thick + (thin - thick) * t;
            let p = pose.position_m + axis * stem.length_m * (t - 0.5) + down * r;
            let gap = p.z - ground.sample(p.truncate()).height_m;
            (low.min(gap), high.max(gap))
        })
    }

    #[test]
    fn on_an_even_slope_it_lies_all_along() {
        let ground = FlatSurface {
            height_m: 3.0,
            gradient: DVec2::new(0.2, -0.1),
        };
        let stem = LyingStem {
            length_m: 6.0,
            half_height_m: [0.2, 0.1],
        };
        for support in [StemSupport::Stiff, StemSupport::Sagging] {
            let heading = DVec2::from_angle(0.7);
            let pose =
                stem.pose_on_ground(&ground, DVec2::new(5.0, 2.0), heading, support, 0.0, 0.0);
            let (low, high) = gaps(&stem, &pose, &ground);
            assert!(low.abs() < 0.01 && high < 0.02, "{low} {high}");
        }
    }

    #[test]
    fn a_held_stem_leans_from_its_plate_to_the_ground() {
        let stem = LyingStem {
            length_m: 10.0,
            half_height_m: [0.2, 0.1],
        };
        let ground = FlatSurface::default();
        let pose = stem.pose_on_ground(
            &ground,
            DVec2::ZERO,
            DVec2::X,
            StemSupport::Held(0.8),
            0.0,
            0.0,
        );
        let butt = pose.position_m - pose.rotation.x_axis.as_dvec3() * 5.0;
        assert!((butt.z - 0.8).abs() < 0.03, "{butt}");
        let (low, _) = gaps(&stem, &pose, &ground);
        assert!(low.abs() < 0.01, "{low}");
    }

    /// Its middle is on a hump.
    #[test]
    fn a_balanced_stem_tips_over_and_no_end_is_in_the_ground() {
        let ground = Waves {
            slope: DVec2::new(0.215_682_091_134_318_35, -0.104_813_685_670_795_27),
            amplitude_m: 0.248_089_161_301_280_2,
            turn: 5.756_640_013_329_336,
        };
        let stem = LyingStem {
            length_m: 3.260_044_580_595_583,
            half_height_m: [0.05, 0.03],
        };
        let at = DVec2::new(-22.515_120_290_617_094, 36.780_275_244_532_93);
        let heading = DVec2::from_angle(0.714_396_007_037_157_9);
        let pose = stem.pose_on_ground(&ground, at, heading, StemSupport::Stiff, 0.0, 0.0);
        let (low, _) = gaps(&stem, &pose, &ground);
        assert!(low > -0.04, "{low}");
    }

    proptest! {
        #[test]
        fn nothing_floats_and_nothing_is_buried(
            x in -50.0..50.0, y in -50.0..50.0, heading in 0.0..std::f64::consts::TAU,
            slope_x in -0.4..0.4, slope_y in -0.4..0.4, amplitude_m in 0.0..0.25,
            turn in 0.0..6.0, length_m in 1.0..9.0, thick in 0.05..0.3,
        ) {
            let slope = DVec2::new(slope_x, slope_y);
            let ground = Waves { slope, amplitude_m, turn };
            let stem = LyingStem { length_m, half_height_m: [thick, 0.6 * thick] };
            let at = DVec2::new(x, y);
            let heading = DVec2::from_angle(heading);
            let lie = |support| stem.pose_on_ground(&ground, at, heading, support, 0.0, 0.0);
            // A stiff one touches, and is nowhere deep in the ground.
            let (low, _) = gaps(&stem, &lie(StemSupport::Stiff), &ground);
            prop_assert!(low < 0.03 && low > -0.35 * thick - 0.06, "stiff {low}");
            // A sagging one is in the ground and above it, and nowhere deep.
            let (low, high) = gaps(&stem, &lie(StemSupport::Sagging), &ground);
            prop_assert!(low < 0.03 && low > -1.4 * thick - 0.06, "sagging {low}");
            prop_assert!(high < 4.2 * amplitude_m + 0.1, "sagging {high}");
        }
    }
}
