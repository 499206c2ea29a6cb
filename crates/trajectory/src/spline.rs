//! Cubic splines, and the integral of a smooth function.

/// A uniform cubic B-spline: its curvature is continuous. Knot i lies at x = i, where the second to
/// the last but two of the control values pull most; x is from 0 to their number less 3.
#[derive(Clone, Debug)]
pub(crate) struct CubicBSpline<C> {
    /// At least four, of which the first is that of the knot before.
    pub(crate) controls: C,
}

impl<C: AsRef<[f64]>> CubicBSpline<C> {
    fn span(&self, x: f64) -> ([f64; 4], f64) {
        let controls = self.controls.as_ref();
        let i = (x.max(0.0) as usize).min(controls.len() - 4);
        let controls = std::array::from_fn(|k| controls[i + k]);
        (controls, x - i as f64)
    }

    /// The value at x.
    pub(crate) fn at(&self, x: f64) -> f64 {
        let ([a, b, c, d], t) = self.span(x);
        let u = 1.0 - t;
        let weights = [
            u * u * u,
            4.0 - 3.0 * t * t * (1.0 + u),
            4.0 - 3.0 * u * u * (1.0 + t),
            t * t * t,
        ];
        (weights[0] * a + weights[1] * b + weights[2] * c + weights[3] * d) / 6.0
    }

    /// The derivative at x.
    pub(crate) fn slope(&self, x: f64) -> f64 {
        let ([a, b, c, d], t) = self.span(x);
        let u = 1.0 - t;
        0.5 * (u * u * (b - a) + (1.0 + 2.0 * t * u) * (c - b) + t * t * (d - c))
    }
}

/// A natural cubic spline through values at times, which goes straight on outside of them: its
/// second derivative is continuous.
#[derive(Clone, Debug)]
pub(crate) struct NaturalSpline<const N: usize> {
    times: Vec<f64>,
    values: Vec<[f64; N]>,
    /// Second derivatives at the values.
    bends: Vec<[f64; N]>,
}

impl<const N: usize> NaturalSpline<N> {
    /// Through as many values as times, which increase; at least one.
    pub(crate) fn through(times: Vec<f64>, values: Vec<[f64; N]>) -> Self {
        let count = values.len();
        let mut bends = vec![[0.0; N]; count];
        // Thomas' algorithm for the tridiagonal equations of the inner values.
        let mut upper = vec![0.0; count];
        for i in 1..count.saturating_sub(1) {
            let [before, after] = [times[i] - times[i - 1], times[i + 1] - times[i]];
            let pivot = 2.0 * (before + after) - before * upper[i - 1];
            upper[i] = after / pivot;
            bends[i] = std::array::from_fn(|n| {
                let up = (values[i + 1][n] - values[i][n]) / after;
                let down = (values[i][n] - values[i - 1][n]) / before;
                (6.0 * (up - down) - before * bends[i - 1][n]) / pivot
            });
        }
        for i in (1..count.saturating_sub(1)).rev() {
            bends[i] = std::array::from_fn(|n| bends[i][n] - upper[i] * bends[i + 1][n]);
        }
        Self {
            times,
            values,
            bends,
        }
    }

    /// The value at a time.
    pub(crate) fn at(&self, time: f64) -> [f64; N] {
        let last = self.times.len() - 1;
        if last == 0 {
            return self.values[0];
        }
        let after = self.times.partition_point(|&t| t <= time);
        let i = after.clamp(1, last) - 1;
        let step = self.times[i + 1] - self.times[i];
        let t = (time - self.times[i]) / step;
        let inside = t.clamp(0.0, 1.0);
        let (straight, bent) = self.within(i, inside);
        let slope = if t == inside {
            [0.0; N]
        } else {
            self.slope(i, inside)
        };
        std::array::from_fn(|n| straight[n] + bent[n] + slope[n] * (t - inside))
    }

    /// Between value i and the next, at a share of the time: what a straight line would be, and how
    /// far the curve is from it.
    fn within(&self, i: usize, t: f64) -> ([f64; N], [f64; N]) {
        let u = 1.0 - t;
        let sixth = (self.times[i + 1] - self.times[i]).powi(2) / 6.0;
        let (first, last) = (&self.values[i], &self.values[i + 1]);
        let (bend, next) = (&self.bends[i], &self.bends[i + 1]);
        let straight = std::array::from_fn(|n| u * first[n] + t * last[n]);
        let bent = |n: usize| (u * u * u - u) * bend[n] + (t * t * t - t) * next[n];
        (straight, std::array::from_fn(|n| sixth * bent(n)))
    }

    /// The change from value i to the next at this rate.
    fn slope(&self, i: usize, t: f64) -> [f64; N] {
        let u = 1.0 - t;
        let sixth = (self.times[i + 1] - self.times[i]).powi(2) / 6.0;
        let (bend, next) = (&self.bends[i], &self.bends[i + 1]);
        std::array::from_fn(|n| {
            let bent = (1.0 - 3.0 * u * u) * bend[n] + (3.0 * t * t - 1.0) * next[n];
            self.values[i + 1][n] - self.values[i][n] + sixth * bent
        })
    }
}

/// The integral of a smooth function by five points (Gauss and Legendre).
pub(crate) fn gauss_legendre(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    const POINTS: [(f64, f64); 5] = [
        (0.0, 0.568_888_888_888_888_9),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let sum: f64 = POINTS
        .iter()
        .map(|&(x, weight)| weight * f(middle + half * x))
        .sum();
    half * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_b_spline_follows_cubics_and_is_smooth() {
        // The control values of x² are those of the cubic's blossom: i² - 1/3.
        let controls = std::array::from_fn::<f64, 9, _>(|i| {
            let x = i as f64 - 1.0;
            x * x - 1.0 / 3.0
        });
        let square = CubicBSpline { controls };
        for i in 0..=60 {
            let x = f64::from(i) * 0.1;
            assert!((square.at(x) - x * x).abs() < 1e-12, "{x}");
            assert!((square.slope(x) - 2.0 * x).abs() < 1e-12, "{x}");
        }
        let any = CubicBSpline {
            controls: [0.3, -1.0, 2.0, 0.5, 0.7, -3.0, 1.0],
        };
        for knot in 1..4 {
            let (x, h) = (f64::from(knot), 1e-4);
            let bend = |x: f64| (any.slope(x + h) - any.slope(x - h)) / (2.0 * h);
            assert!(
                (bend(x - 2.0 * h) - bend(x + 2.0 * h)).abs() < 0.01,
                "at {x}"
            );
            let slope = (any.at(x + h) - any.at(x - h)) / (2.0 * h);
            assert!((slope - any.slope(x)).abs() < 1e-7);
        }
    }

    #[test]
    fn a_natural_spline_meets_its_values_with_continuous_curvature() {
        let times = vec![0.0, 0.4, 1.0, 1.1, 3.0];
        let values = vec![[1.0, 0.0], [2.0, 0.4], [0.5, 1.0], [0.7, 1.1], [4.0, 3.0]];
        let spline = NaturalSpline::through(times.clone(), values.clone());
        for (&time, value) in times.iter().zip(values) {
            for (found, wanted) in spline.at(time).iter().zip(value) {
                assert!((found - wanted).abs() < 1e-15);
            }
        }
        let h = 1e-4;
        let bend = |at: f64| {
            let [before, here, after] = [at - h, at, at + h].map(|time| spline.at(time)[0]);
            (after - 2.0 * here + before) / (h * h)
        };
        // At the ends, the curve goes on straight ahead.
        for time in times {
            let [left, right] = [bend(time - 2.0 * h), bend(time + 2.0 * h)];
            assert!(
                (left - right).abs() < 0.05 * (1.0 + left.abs()),
                "{left} {right}"
            );
        }
        assert!(bend(-1.0).abs() < 1e-6 && bend(5.0).abs() < 1e-6);
        // The second component is a straight line everywhere.
        for time in [-2.0, 0.2, 0.7, 1.05, 2.0, 7.0] {
            assert!((spline.at(time)[1] - time).abs() < 1e-12);
        }
        assert_eq!(
            NaturalSpline::through(vec![3.0], vec![[1.0]]).at(9.0),
            [1.0]
        );
    }

    #[test]
    fn five_points_integrate_degree_nine() {
        let found = gauss_legendre(-1.0, 2.0, |x| x.powi(9) + x);
        let exact = (1024.0 - 1.0) / 10.0 + 1.5;
        assert!((found - exact).abs() < 1e-10, "{found} {exact}");
    }
}
