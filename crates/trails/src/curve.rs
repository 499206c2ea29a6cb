//! Smooth curves through the plane, and the smooth step from 0 to 1.

use glam::DVec2;

/// The number of pieces whose arc lengths are known.
pub(crate) const PIECES: usize = 128;

/// A cubic with parameter 0..1, by its ends and its derivatives there (Hermite).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cubic {
    pub(crate) ends: [DVec2; 2],
    pub(crate) slopes: [DVec2; 2],
}

impl Cubic {
    /// A smooth cubic between two points with given unit directions.
    ///
    /// Its handles are 2 / (3 (1 + cos α)) of the chord, with which a cubic is closest to a
    /// circular arc, where α is the mean of the angles between directions and chord.
    pub(crate) fn between(ends: [DVec2; 2], directions: [DVec2; 2], max_handle_m: f64) -> Self {
        let chord = ends[1] - ends[0];
        let length = chord.length();
        let along = chord / length.max(f64::MIN_POSITIVE);
        let cos = 0.5 * (directions[0].dot(along) + directions[1].dot(along));
        let handle = (2.0 * length / (3.0 * (1.0 + cos.max(0.0)))).min(max_handle_m);
        Self {
            ends,
            slopes: directions.map(|d| d * (3.0 * handle)),
        }
    }

    /// Position, first and second derivative.
    #[inline]
    pub(crate) fn at(&self, t: f64) -> [DVec2; 3] {
        let [p, q] = self.ends;
        let [m, n] = self.slopes;
        // p + t m + t² c + t³ d. Differences are computed first, so that nothing is lost far from
        // the origin.
        let chord = q - p;
        let c = 3.0 * chord - 2.0 * m - n;
        let d = m + n - 2.0 * chord;
        [
            p + t * (m + t * (c + t * d)),
            m + t * (2.0 * c + 3.0 * t * d),
            2.0 * c + 6.0 * t * d,
        ]
    }

    /// Arc lengths at i / PIECES, by Simpson's rule on the speed.
    pub(crate) fn arcs(&self) -> [f64; PIECES + 1] {
        let at = |i: usize| i as f64 / PIECES as f64;
        let speed = |t: f64| self.at(t)[1].length();
        let mut arcs = [0.0; PIECES + 1];
        for i in 0..PIECES {
            let middle = speed(0.5 * (at(i) + at(i + 1)));
            let mean = (speed(at(i)) + 4.0 * middle + speed(at(i + 1))) / 6.0;
            arcs[i + 1] = arcs[i] + mean / PIECES as f64;
        }
        arcs
    }

    /// Points and unit directions at `n` equal steps of arc length from the start (the end is not
    /// among them), and the length.
    pub(crate) fn walk(&self, step_m: f64) -> (Vec<(DVec2, DVec2)>, f64) {
        let arcs = self.arcs();
        let length = arcs[PIECES];
        let n = (length / step_m).round().max(1.0) as usize;
        let places = (0..n).map(|k| length * k as f64 / n as f64);
        (self.at_arcs(&arcs, places).collect(), length)
    }

    /// Points and unit directions at rising arc lengths.
    pub(crate) fn at_arcs(
        &self,
        arcs: &[f64; PIECES + 1],
        places: impl Iterator<Item = f64>,
    ) -> impl Iterator<Item = (DVec2, DVec2)> {
        let mut i = 0;
        places.map(move |s| {
            while i + 1 < PIECES && arcs[i + 1] <= s {
                i += 1;
            }
            let share = (s - arcs[i]) / (arcs[i + 1] - arcs[i]).max(f64::MIN_POSITIVE);
            let [p, d, _] = self.at((i as f64 + share) / PIECES as f64);
            (p, d / d.length().max(f64::MIN_POSITIVE))
        })
    }

    /// The parameter of the point nearest to `p`, if it is in 0..=1 and `p` is not beyond the
    /// centre of curvature; found by Newton's method from the projections of the ends, exact to
    /// rounding.
    #[inline]
    pub(crate) fn nearest(&self, p: DVec2) -> f64 {
        let chord = self.ends[1] - self.ends[0];
        let mut t = ((p - self.ends[0]).dot(chord) / chord.length_squared().max(f64::MIN_POSITIVE))
            .clamp(0.0, 1.0);
        for _ in 0..8 {
            let [q, d1, d2] = self.at(t);
            let step = ((q - p).dot(d1) / stiffness(p - q, d1, d2)).clamp(-0.5, 0.5);
            t = (t - step).clamp(0.0, 1.0);
            if step.abs() < 1e-13 {
                break;
            }
        }
        t
    }
}

/// Half the second derivative of the squared distance from a point that is `away` from the curve,
/// kept positive.
#[inline]
pub(crate) fn stiffness(away: DVec2, d1: DVec2, d2: DVec2) -> f64 {
    let speed = d1.length_squared();
    (speed - away.dot(d2))
        .max(0.05 * speed)
        .max(f64::MIN_POSITIVE)
}

/// 0 below 0, 1 above 1, and 3t² − 2t³ between.
pub(crate) fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn quarter() -> Cubic {
        let ends = [DVec2::new(25.0, 0.0), DVec2::new(0.0, 25.0)];
        Cubic::between(ends, [DVec2::Y, DVec2::NEG_X], 100.0)
    }

    #[test]
    fn a_quarter_turn_is_nearly_a_circle() {
        let c = quarter();
        for i in 0..=100 {
            let r = c.at(f64::from(i) / 100.0)[0].length();
            assert!((r - 25.0).abs() < 0.01, "{r}");
        }
        let (points, length) = c.walk(1.0);
        assert!((length - 12.5 * std::f64::consts::PI).abs() < 0.01);
        assert_eq!(points.len(), 39);
        let step = length / 39.0;
        for pair in points.windows(2) {
            assert!((pair[0].0.distance(pair[1].0) - step).abs() < 1e-3);
        }
    }

    proptest! {
        #[test]
        fn nearest_is_the_brute_force_answer(x in 14.0_f64..30.0, y in 14.0_f64..30.0) {
            let (c, p) = (quarter(), DVec2::new(x, y));
            let found = c.at(c.nearest(p))[0].distance(p);
            let best = (0..=4000)
                .map(|i| c.at(f64::from(i) / 4000.0)[0].distance(p))
                .fold(f64::INFINITY, f64::min);
            // The samples are 1 cm apart, so a point on the curve may lie between two.
            prop_assert!(found <= best + 1e-9 && found > best - 6e-3, "{} {}", found, best);
        }
    }
}
