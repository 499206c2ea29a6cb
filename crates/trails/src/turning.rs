//! Loops at the ends of ways, on which vehicles turn.

use std::f64::consts::{FRAC_PI_3, PI};

use glam::DVec2;

/// The length of a loop, in radii: a sixth of a circle to the right, five sixths to the left, and
/// a sixth to the right again.
const LENGTH: f64 = 7.0 * FRAC_PI_3;

/// How far a loop's middle line reaches from its foot, in radii.
const REACH: f64 = 2.732_050_807_568_877;

/// The most that a loop reaches of a chunk's side from the chunk's middle, near which its foot is.
const ROOM: f64 = 0.44;

/// The radius of the loops of a way, as far as a chunk has room for it; `None` where there is no
/// room for one whose radius is the way's width.
pub(crate) fn radius_m(wanted_m: f64, width_m: f64, chunk_size_m: f64) -> Option<f64> {
    let room_m = (ROOM * chunk_size_m - 0.5 * width_m) / REACH;
    let radius_m = wanted_m.min(room_m);
    (wanted_m > 0.0 && radius_m >= width_m).then_some(radius_m)
}

/// A loop that leaves a foot in a unit direction and comes back to it the other way: places about
/// `step_m` apart, with their unit directions and arc lengths, the foot first and last.
pub(crate) fn turning_loop(
    foot: DVec2,
    direction: DVec2,
    radius_m: f64,
    step_m: f64,
) -> Vec<(DVec2, DVec2, f64)> {
    let steps = (LENGTH * radius_m / step_m).ceil().max(12.0);
    let place = |i: u32| {
        let turned = LENGTH * f64::from(i) / steps;
        let (at, heading) = on_loop(turned);
        let heading = DVec2::new(libm::cos(heading), libm::sin(heading));
        let position = foot + radius_m * at.rotate(direction);
        (position, heading.rotate(direction), radius_m * turned)
    };
    (0..=steps as u32).map(place).collect()
}

/// The place at an arc length of a loop of radius 1 along +x, and the angle of its direction.
fn on_loop(s: f64) -> (DVec2, f64) {
    let out = |turned: f64| DVec2::new(libm::sin(turned), 1.0 - libm::cos(turned));
    if s < FRAC_PI_3 {
        return (out(s) * DVec2::new(1.0, -1.0), -s);
    }
    if s > LENGTH - FRAC_PI_3 {
        let left = (LENGTH - s).max(0.0);
        return (out(left), PI + left);
    }
    let round = s - FRAC_PI_3 + 7.0 * PI / 6.0;
    let middle = DVec2::new(libm::sqrt(3.0), 0.0);
    let radial = DVec2::new(libm::cos(round), libm::sin(round));
    (middle + radial, round + 0.5 * PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_is_smooth_and_comes_back() {
        let (foot, direction) = (DVec2::new(300.0, -20.0), DVec2::new(0.6, 0.8));
        let points = turning_loop(foot, direction, 7.0, 1.0);
        let (first, last) = (points[0], points[points.len() - 1]);
        assert!(first.0.distance(foot) < 1e-12 && last.0.distance(foot) < 1e-9);
        assert!(first.1.distance(direction) < 1e-12 && last.1.distance(-direction) < 1e-9);
        for pair in points.windows(2) {
            let (step, turn) = (pair[1].2 - pair[0].2, pair[0].1.angle_to(pair[1].1));
            // A chord of a circle of 7 m.
            let chord = 14.0 * libm::sin(step / 14.0);
            let found = pair[0].0.distance(pair[1].0);
            assert!((found - chord).abs() < 0.01, "{found} {chord}");
            assert!(turn.abs() < step / 7.0 + 1e-9, "{turn}");
            // The direction is that of the curve.
            let along = (pair[1].0 - pair[0].0).normalize();
            assert!(along.dot(pair[0].1) > 0.99);
        }
        let reach = points
            .iter()
            .map(|p| (p.0 - foot).dot(direction))
            .fold(0.0, f64::max);
        assert!((reach / 7.0 - REACH).abs() < 0.01, "{reach}");
    }

    #[test]
    fn a_loop_fits_its_chunk_or_is_none() {
        assert_eq!(radius_m(0.0, 3.6, 50.0), None);
        assert_eq!(radius_m(7.0, 3.6, 50.0), Some(7.0));
        let small = radius_m(7.0, 3.6, 32.0).expect("a smaller one");
        assert!((3.6..5.0).contains(&small), "{small}");
        assert_eq!(radius_m(7.0, 3.6, 20.0), None);
    }
}
