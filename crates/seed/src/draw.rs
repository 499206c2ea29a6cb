//! The distributions that decide the content of a world.

use rand::Rng;

/// Draws with bit-exact, documented algorithms, for every generator.
pub trait Draw: Rng {
    /// Uniform in `[0, 1)`, 53 bits.
    #[inline]
    fn unit_f64(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// Uniform in `[0, 1)`, 24 bits.
    #[inline]
    fn unit_f32(&mut self) -> f32 {
        (self.next_u32() >> 8) as f32 * (1.0 / (1_u32 << 24) as f32)
    }

    /// Uniform from `low` to `high`; `low` if they are equal. The sum is rounded, so that `high`
    /// itself is drawn now and then.
    #[inline]
    fn range_f64(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit_f64()
    }

    /// Uniform from `low` to `high`; `low` if they are equal. The sum is rounded, so that `high`
    /// itself is drawn now and then.
    #[inline]
    fn range_f32(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit_f32()
    }

    /// Uniform in `0..n` without bias (Lemire 2019, "Fast random integer generation in an
    /// interval").
    ///
    /// # Panics
    /// If `n` is 0.
    #[inline]
    fn below(&mut self, n: u32) -> u32 {
        assert!(n > 0, "below(0): there is nothing to choose from");
        let threshold = n.wrapping_neg() % n;
        loop {
            let product = u64::from(self.next_u32()) * u64::from(n);
            if product as u32 >= threshold {
                return (product >> 32) as u32;
            }
        }
    }

    /// Uniform in `low..=high`.
    ///
    /// # Panics
    /// If `low > high`.
    #[inline]
    fn between(&mut self, low: u32, high: u32) -> u32 {
        assert!(low <= high, "between({low}, {high}): the range is empty");
        match (high - low).checked_add(1) {
            Some(n) => low + self.below(n),
            None => self.next_u32(),
        }
    }

    /// One of these, with equal chances.
    ///
    /// # Panics
    /// If there is none.
    #[inline]
    fn choose<'a, T>(&mut self, from: &'a [T]) -> &'a T {
        &from[self.below(from.len() as u32) as usize]
    }

    /// True with probability `p` (never for `p <= 0`, always for `p >= 1`).
    #[inline]
    fn chance(&mut self, p: f64) -> bool {
        self.unit_f64() < p
    }

    /// Standard normal (Box and Muller 1958, the cosine branch, through libm: the same bits on
    /// every platform).
    #[inline]
    fn normal(&mut self) -> f64 {
        let u = 1.0 - self.unit_f64();
        let v = self.unit_f64();
        libm::sqrt(-2.0 * libm::log(u)) * libm::cos(std::f64::consts::TAU * v)
    }

    /// Exponential with mean 1.
    #[inline]
    fn exponential(&mut self) -> f64 {
        -libm::log(1.0 - self.unit_f64())
    }

    /// The index of a weight, with probability proportional to it; `None` if no weight is positive.
    /// Weights of 0, negative ones and NaN are never drawn; the sum of the others must be finite.
    fn weighted(&mut self, weights: &[f64]) -> Option<usize> {
        let total: f64 = weights.iter().filter(|w| **w > 0.0).sum();
        debug_assert!(total.is_finite(), "weights add up to {total}");
        let mut left = self.unit_f64() * total;
        let mut last = None;
        for (i, &w) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            last = Some(i);
            if left < w {
                break;
            }
            left -= w;
        }
        last
    }
}

impl<R: Rng + ?Sized> Draw for R {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Domain, Key};
    use proptest::prelude::*;

    fn rng(seed: u64) -> crate::PhiloxRng {
        Key::world(seed).domain(Domain::new("draw.test")).rng()
    }

    #[test]
    fn value_stability() {
        let mut r = rng(7);
        let got = (
            r.unit_f64(),
            r.unit_f32(),
            r.below(1000),
            r.normal(),
            r.exponential(),
        );
        assert_eq!(format!("{got:?}"), VALUES);
    }
    const VALUES: &str =
        "(0.35949048321432997, 0.26729554, 659, -0.514863691553201, 0.027757200672746053)";

    #[test]
    fn normal_has_mean_zero_and_variance_one() {
        let mut r = rng(1);
        let n = 100_000;
        let draws: Vec<f64> = (0..n).map(|_| r.normal()).collect();
        let mean = draws.iter().sum::<f64>() / f64::from(n);
        let variance = draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / f64::from(n);
        assert!(mean.abs() < 4.0 / f64::from(n).sqrt(), "{mean}");
        assert!(
            (variance - 1.0).abs() < 4.0 * (2.0 / f64::from(n)).sqrt(),
            "{variance}"
        );
    }

    #[test]
    fn weighted_follows_the_weights() {
        let mut r = rng(2);
        let mut counts = [0_u32; 3];
        for _ in 0..40_000 {
            counts[r.weighted(&[1.0, 0.0, 3.0]).expect("a positive weight")] += 1;
        }
        assert_eq!(counts[1], 0);
        assert!((f64::from(counts[0]) - 10_000.0).abs() < 4.0 * (40_000.0 * 0.1875_f64).sqrt());
        assert_eq!(r.weighted(&[]), None);
        assert_eq!(r.weighted(&[0.0, -1.0]), None);
        assert_eq!(r.weighted(&[f64::NAN, 1.0]), Some(1));
    }

    #[cfg(debug_assertions)]
    #[test]
    #[should_panic(expected = "weights add up to inf")]
    fn infinite_weights_are_an_error() {
        rng(2).weighted(&[f64::INFINITY, 1.0]);
    }

    /// As the documentation says: one step of f32 above 1 is all that can be drawn beside 1.
    #[test]
    fn a_range_may_round_up_to_its_end() {
        let (mut r, high) = (rng(3), 1.0 + f32::EPSILON);
        let drawn: Vec<f32> = (0..100).map(|_| r.range_f32(1.0, high)).collect();
        assert!(drawn.contains(&1.0) && drawn.contains(&high));
    }

    proptest! {
        #[test]
        fn ranges_hold(seed: u64, low in -1e6_f64..1e6, width in 0.0_f64..1e6, n in 1_u32..) {
            let mut r = rng(seed);
            let x = r.range_f64(low, low + width);
            prop_assert!(x >= low && x <= low + width);
            prop_assert!(r.below(n) < n);
            prop_assert!((0.0..1.0).contains(&r.unit_f32()));
            prop_assert!(!r.chance(0.0) && r.chance(1.0));
        }
    }
}
