//! How much of a scan the frame before has seen already.

use nemoral_scene::glam::DVec3;

/// Points nearer than this are of the same place, metres.
pub(crate) const NEAR_M: f64 = 0.1;
/// The most points of a box that are compared one by one.
const FEW: usize = 16;
/// The most steps of a comparison for each point of both scans. Tens are usual; thousands take
/// scans of which nearly all points are just too far from nearly all of the other's.
const MOST_STEPS: u64 = 2000;

/// Points in a box: a node of a k-d tree.
struct Part {
    low: DVec3,
    high: DVec3,
    points: Points,
}

enum Points {
    Few(Vec<DVec3>),
    Halves(Box<[Part; 2]>),
}

impl Part {
    /// The points whose coordinates are finite: nothing is near one that is nowhere.
    fn of(mut points: Vec<DVec3>) -> Self {
        points.retain(|p| p.is_finite());
        Self::new(&mut points)
    }

    /// Points whose coordinates are finite; they are sorted on the way.
    fn new(points: &mut [DVec3]) -> Self {
        let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let points = if points.len() <= FEW {
            Points::Few(points.to_vec())
        } else {
            let axis = (high - low).max_position();
            let middle = points.len() / 2;
            points.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
            let (lower, upper) = points.split_at_mut(middle);
            Points::Halves(Box::new([lower, upper].map(Self::new)))
        };
        Self { low, high, points }
    }

    /// Whether one of the points is near `p`; `steps` grows by the boxes and points looked at.
    ///
    /// Squares of distances to the nearest and to the farthest place of a box are computed as those
    /// to a point are. Each operation rounds the larger of two values to one that is not smaller,
    /// so that they bound those of all points within, to the last bit.
    fn has_near(&self, p: DVec3, steps: &mut u64) -> bool {
        const NEAR_M2: f64 = NEAR_M * NEAR_M;
        *steps += 1;
        let (below_m, above_m) = (self.low - p, p - self.high);
        let nearest_m = below_m.max(above_m).max(DVec3::ZERO);
        if nearest_m.length_squared() > NEAR_M2 {
            return false;
        }
        let farthest_m = below_m.abs().max(above_m.abs());
        if farthest_m.length_squared() <= NEAR_M2 {
            return true;
        }
        match &self.points {
            Points::Few(points) => {
                *steps += points.len() as u64;
                points.iter().any(|q| q.distance_squared(p) <= NEAR_M2)
            }
            Points::Halves(halves) => halves.iter().any(|half| half.has_near(p, steps)),
        }
    }
}

/// How many points are near one of a scan with `count` points; `None` if that takes too many steps.
fn count_near(scan: &Part, count: usize, points: &[DVec3]) -> Option<usize> {
    let most = MOST_STEPS.saturating_mul((count + points.len()) as u64);
    let (mut near, mut steps) = (0, 0);
    for &p in points {
        near += usize::from(p.is_finite() && scan.has_near(p, &mut steps));
        if steps > most {
            return None;
        }
    }
    Some(near)
}

/// Compares each scan with the one before it in the same sequence.
#[derive(Default)]
pub(crate) struct Overlap {
    /// The sequence of the scan before, the number of its points, and these.
    before: Option<(u32, usize, Part)>,
    shares: Vec<f64>,
}

impl Overlap {
    /// Enters the next frame of a sequence, with its points in the world. A frame without points
    /// is passed over; one that was made so that its comparison takes too long has no share.
    pub(crate) fn add(&mut self, sequence: u32, points: Vec<DVec3>) {
        if points.is_empty() {
            return;
        }
        if let Some((of, count, scan)) = &self.before
            && *of == sequence
            && let Some(near) = count_near(scan, *count, &points)
        {
            self.shares.push(near as f64 / points.len() as f64);
        }
        self.before = Some((sequence, points.len(), Part::of(points)));
    }

    /// For each frame but the first of a sequence, the share of its points near one of the frame
    /// before.
    pub(crate) fn shares(self) -> Vec<f64> {
        self.shares
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn points() -> impl Strategy<Value = Vec<DVec3>> {
        // Far from the origin, and so dense that many points have neighbours.
        let at = (-0.6_f64..0.6).prop_map(|x| x - 71_000.0);
        prop::collection::vec(
            [at.clone(), at.clone(), at].prop_map(DVec3::from_array),
            1..150,
        )
    }

    /// Many of these are as far apart as near points may be, and some are equal.
    fn lattice() -> impl Strategy<Value = Vec<DVec3>> {
        let at = (0..33_i32).prop_map(|k| 0.025 * f64::from(k));
        prop::collection::vec(
            [at.clone(), at.clone(), at].prop_map(DVec3::from_array),
            1..100,
        )
    }

    proptest! {
        #[test]
        fn a_part_finds_what_its_points_have(a in lattice(), b in lattice()) {
            let part = Part::of(a.clone());
            for p in b {
                let expected = a.iter().any(|q| q.distance_squared(p) <= NEAR_M * NEAR_M);
                prop_assert_eq!(part.has_near(p, &mut 0), expected, "{}", p);
            }
        }

        #[test]
        fn near_points_are_those_of_all_pairs(a in points(), b in points()) {
            let near = |p: &&DVec3| a.iter().any(|q| q.distance_squared(**p) <= NEAR_M * NEAR_M);
            let expected = b.iter().filter(near).count() as f64 / b.len() as f64;
            let mut overlap = Overlap::default();
            overlap.add(0, a.clone());
            overlap.add(0, b);
            prop_assert_eq!(overlap.shares(), [expected]);
        }
    }

    #[test]
    fn equal_places_take_few_steps() {
        const COUNT: usize = 250_000;
        // A row of a quarter of a millimetre.
        let row = |x_m: f64| -> Vec<DVec3> {
            let at = |i: usize| DVec3::new(x_m + 1e-9 * i as f64, 0.05, 0.05);
            (0..COUNT).map(at).collect()
        };
        let scan = Part::of(row(0.01));
        for (x_m, expected) in [(0.19, 0), (0.05, COUNT)] {
            let (mut near, mut steps) = (0, 0);
            for p in row(x_m) {
                near += usize::from(scan.has_near(p, &mut steps));
            }
            assert_eq!(near, expected);
            // Each point with each takes 6e10.
            assert!(steps < 10 * COUNT as u64, "{steps}");
        }
    }

    /// A sphere of points just too far from those at its centre, of which no box tells anything.
    #[test]
    fn a_scan_made_to_be_slow_has_no_share() {
        const COUNT: usize = 10_000;
        let on_sphere = |i: usize| {
            let z = 1.0 - (2.0 * i as f64 + 1.0) / COUNT as f64;
            let (radius, angle) = ((1.0 - z * z).sqrt(), 2.4 * i as f64);
            (NEAR_M + 1e-6) * DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
        };
        let at_centre = |i: usize| DVec3::X * (1e-11 * i as f64);
        let mut overlap = Overlap::default();
        overlap.add(0, (0..COUNT).map(on_sphere).collect());
        overlap.add(0, (0..COUNT).map(at_centre).collect());
        // The next frame is compared with it again.
        overlap.add(0, vec![DVec3::ZERO, DVec3::ONE]);
        assert_eq!(overlap.shares(), [0.5]);
    }

    #[test]
    fn places_far_beyond_all_scans_are_no_error() {
        let far = || {
            let all = [1.0, 1e38, -1e38, f64::INFINITY, f64::NAN];
            all.map(DVec3::splat).to_vec()
        };
        let mut overlap = Overlap::default();
        overlap.add(0, far());
        overlap.add(0, far());
        assert_eq!(overlap.shares(), [0.6]);
    }

    #[test]
    fn sequences_do_not_overlap() {
        let scan = || vec![DVec3::ONE, DVec3::NEG_ONE];
        let mut overlap = Overlap::default();
        for (sequence, points) in [
            (0, scan()),
            (0, scan()),
            (1, scan()),
            (1, Vec::new()),
            (1, vec![DVec3::ONE, DVec3::ZERO]),
        ] {
            overlap.add(sequence, points);
        }
        assert_eq!(overlap.shares(), [1.0, 0.5]);
    }
}
