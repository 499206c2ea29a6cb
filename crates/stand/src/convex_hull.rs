//! The area that trees stand on: convex hulls on the map.

use nemoral_scene::glam::DVec2;

/// The convex hull of points, counterclockwise, by Andrew's monotone chain (1979).
#[must_use]
pub fn convex_hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(p - b) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        // Its last point is the first of the other half.
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}

/// The area within `margin_m` of a convex polygon, square metres.
#[must_use]
pub fn area_around_m2(hull: &[DVec2], margin_m: f64) -> f64 {
    let edges = || hull.iter().zip(hull.iter().cycle().skip(1));
    let twice: f64 = edges().map(|(a, b)| a.perp_dot(*b)).sum();
    let around: f64 = edges().map(|(a, b)| a.distance(*b)).sum();
    0.5 * twice + margin_m * around + std::f64::consts::PI * margin_m * margin_m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_are_those_of_hulls_with_their_margin() {
        let square = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]].map(DVec2::from);
        assert_eq!(area_around_m2(&square, 0.0), 100.0);
        let round = 100.0 + 4.0 * 10.0 + std::f64::consts::PI;
        assert!((area_around_m2(&square, 1.0) - round).abs() < 1e-9);
        assert!((area_around_m2(&square[..1], 2.0) - 4.0 * std::f64::consts::PI).abs() < 1e-9);
    }
}
