//! Statistics of the positions and diameters of stems.

use std::f64::consts::PI;

use nemoral_scene::glam::DVec2;

/// Clark and Evans's R (1954): the mean distance to the nearest neighbour over that of points at
/// random, ½ λ^-½. It is 1 for random points and 2.15 for a triangular grid. Points nearer to the
/// border of the square `low..low + edge_m` than `guard_m` are neighbours only.
#[must_use]
pub fn clark_evans(points: &[DVec2], low: DVec2, edge_m: f64, guard_m: f64) -> f64 {
    let inside = |p: &DVec2| {
        let d = *p - low;
        d.min_element() >= guard_m && d.max_element() <= edge_m - guard_m
    };
    let nearest = |i: usize| {
        let others = points.iter().enumerate().filter(|(j, _)| *j != i);
        others
            .map(|(_, q)| q.distance_squared(points[i]))
            .fold(f64::INFINITY, f64::min)
            .sqrt()
    };
    let distances: Vec<f64> = (0..points.len())
        .filter(|i| inside(&points[*i]))
        .map(nearest)
        .collect();
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    let density = points.len() as f64 / (edge_m * edge_m);
    2.0 * mean * density.sqrt()
}

/// The pair correlation g(r) in rings of `step_m` (Ripley's translation correction) of points in a
/// square of edge `edge_m`: 1 for independent points, 0 inside a hard core.
#[must_use]
pub fn pair_correlation(points: &[DVec2], edge_m: f64, step_m: f64, rings: usize) -> Vec<f64> {
    let mut sums = vec![0.0; rings];
    for (i, p) in points.iter().enumerate() {
        for q in &points[..i] {
            let d = (*p - *q).abs();
            if let Some(sum) = sums.get_mut((d.length() / step_m) as usize) {
                *sum += 2.0 / ((edge_m - d.x) * (edge_m - d.y));
            }
        }
    }
    let density = points.len() as f64 / (edge_m * edge_m);
    let of_ring = |(i, sum): (usize, f64)| {
        let (low, high) = (i as f64 * step_m, (i + 1) as f64 * step_m);
        sum / (density * density * PI * (high * high - low * low))
    };
    sums.into_iter().enumerate().map(of_ring).collect()
}

/// The power of a wave of this length (m) across a heading in the points, over that of random
/// points: about 1 without rows, and the number of points if all are on rows.
#[must_use]
pub fn row_power(points: &[DVec2], heading_deg: f64, wave_m: f64) -> f64 {
    let (sin, cos) = heading_deg.to_radians().sin_cos();
    let across = DVec2::new(cos, -sin);
    let sum: DVec2 = points
        .iter()
        .map(|p| DVec2::from_angle(2.0 * PI * across.dot(*p) / wave_m))
        .sum();
    sum.length_squared() / points.len() as f64
}

/// Shape and scale of the Weibull distribution that most likely gave these (positive) values:
/// Newton's method on the profile likelihood's derivative.
#[must_use]
pub fn weibull_fit(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean_log = values.iter().map(|v| v.ln()).sum::<f64>() / n;
    let mut shape = 2.0_f64;
    for _ in 0..60 {
        let (mut s0, mut s1, mut s2) = (0.0, 0.0, 0.0);
        for v in values {
            let (power, log) = (v.powf(shape), v.ln());
            s0 += power;
            s1 += power * log;
            s2 += power * log * log;
        }
        let f = s1 / s0 - 1.0 / shape - mean_log;
        let slope = s2 / s0 - (s1 / s0).powi(2) + 1.0 / (shape * shape);
        shape = (shape - f / slope).clamp(0.2, 50.0);
    }
    let mean_power = values.iter().map(|v| v.powf(shape)).sum::<f64>() / n;
    (shape, mean_power.powf(1.0 / shape))
}

/// The mean product of two neighbours' sizes over the square of the mean size, of pairs within
/// `reach_m`: below 1 where neighbours compete, 1 where they are independent.
#[must_use]
pub fn mark_correlation(trees: &[(DVec2, f64)], reach_m: f64) -> f64 {
    let mean = trees.iter().map(|t| t.1).sum::<f64>() / trees.len() as f64;
    let (mut sum, mut pairs) = (0.0, 0);
    for (i, (p, a)) in trees.iter().enumerate() {
        for (q, b) in &trees[..i] {
            if p.distance_squared(*q) < reach_m * reach_m {
                (sum, pairs) = (sum + a * b, pairs + 1);
            }
        }
    }
    sum / f64::from(pairs) / (mean * mean)
}

/// The greatest distance between the distributions of two samples (Kolmogorov and Smirnov).
#[must_use]
pub fn distribution_distance(a: &[f64], b: &[f64]) -> f64 {
    let sorted = |v: &[f64]| {
        let mut v = v.to_vec();
        v.sort_by(f64::total_cmp);
        v
    };
    let (a, b) = (sorted(a), sorted(b));
    let below = |v: &[f64], x: f64| v.partition_point(|y| *y <= x) as f64 / v.len() as f64;
    let apart = a.iter().chain(&b).map(|&x| below(&a, x) - below(&b, x));
    apart.fold(0.0, |most, d| most.max(d.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_seed::{Draw, Key};

    fn rain(n: usize, edge_m: f64) -> Vec<DVec2> {
        let mut rng = Key::world(3).rng();
        let mut place = || rng.range_f64(0.0, edge_m);
        (0..n).map(|_| DVec2::new(place(), place())).collect()
    }

    /// R tells random points, a grid and clumps apart.
    #[test]
    fn clark_evans_tells_rain_from_grids_and_clumps() {
        let of = |points: &[DVec2]| clark_evans(points, DVec2::ZERO, 200.0, 15.0);
        let scattered = rain(1600, 200.0);
        assert!((of(&scattered) - 1.0).abs() < 0.06, "{}", of(&scattered));
        let grid: Vec<DVec2> = (0..1600)
            .map(|i| DVec2::new(f64::from(i % 40), f64::from(i / 40)) * 5.0)
            .collect();
        assert!((of(&grid) - 2.0).abs() < 0.05, "{}", of(&grid));
        let clumps: Vec<DVec2> = scattered
            .iter()
            .flat_map(|p| [*p, *p + DVec2::new(0.5, 0.3)])
            .collect();
        assert!(of(&clumps) < 0.6, "{}", of(&clumps));
    }

    #[test]
    fn pairs_and_waves_find_rows() {
        let scattered = rain(1600, 200.0);
        let g = pair_correlation(&scattered, 200.0, 1.0, 8);
        assert!(g[1..].iter().all(|g| (g - 1.0).abs() < 0.25), "{g:?}");
        assert!(row_power(&scattered, 30.0, 3.0) < 12.0);
        let rows: Vec<DVec2> = (0..1600)
            .map(|i| {
                let along = DVec2::new(0.5, 0.75_f64.sqrt()) * f64::from(i % 40);
                let across = DVec2::new(0.75_f64.sqrt(), -0.5) * f64::from(i / 40);
                (along + across) * 3.0
            })
            .collect();
        assert!(row_power(&rows, 30.0, 3.0) > 1500.0);
        assert!(row_power(&rows, 50.0, 3.0) < 12.0);
    }

    #[test]
    fn weibulls_are_found_again() {
        let mut rng = Key::world(5).rng();
        let values: Vec<f64> = (0..4000)
            .map(|_| 0.3 * rng.exponential().powf(1.0 / 2.5))
            .collect();
        let (shape, scale) = weibull_fit(&values);
        assert!(
            (shape - 2.5).abs() < 0.12 && (scale - 0.3).abs() < 0.006,
            "{shape} {scale}"
        );
    }

    #[test]
    fn marks_and_distributions_are_told_apart() {
        let trees: Vec<(DVec2, f64)> = (0..400)
            .map(|i| {
                let x = f64::from(i);
                // The pairs are a metre apart, with one large and one small point, or with two of
                // the same size.
                (
                    DVec2::new(10.0 * (x / 2.0).floor() + x % 2.0, 0.0),
                    1.0 + x % 2.0,
                )
            })
            .collect();
        assert!((mark_correlation(&trees, 3.5) - 2.0 / 2.25).abs() < 1e-9);
        let alike: Vec<(DVec2, f64)> = trees
            .iter()
            .map(|(p, _)| (*p, 1.0 + (p.x / 10.0).floor() % 2.0))
            .collect();
        assert!((mark_correlation(&alike, 3.5) - 2.5 / 2.25).abs() < 1e-9);
        let (a, b): (Vec<f64>, Vec<f64>) = (0..100)
            .map(|i| (f64::from(i), f64::from(i) + 20.5))
            .unzip();
        assert!((distribution_distance(&a, &b) - 0.21).abs() < 1e-9);
        assert_eq!(distribution_distance(&a, &a), 0.0);
    }
}
