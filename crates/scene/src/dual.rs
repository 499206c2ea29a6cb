//! Numbers with their gradients.

use std::ops::{Add, Mul, Neg, Sub};

use glam::DVec2;

/// A value with its gradient with respect to the place on the map: forward-mode automatic
/// differentiation.
///
/// What is computed from duals has the exact gradient of what is computed from their values, such
/// as the slope of ground that is a sum of terrain, trails and streams.
///
/// ```
/// use nemoral_scene::Dual;
/// use nemoral_scene::glam::DVec2;
///
/// let (x, y) = (Dual::new(3.0, DVec2::X), Dual::new(2.0, DVec2::Y));
/// let product = x * y + Dual::constant(1.0);
/// assert_eq!((product.value, product.gradient), (7.0, DVec2::new(2.0, 3.0)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual {
    /// The value.
    pub value: f64,
    /// Its change per metre to the east and to the north, if places are in metres.
    pub gradient: DVec2,
}

impl Dual {
    /// A value and its gradient.
    #[inline]
    #[must_use]
    pub const fn new(value: f64, gradient: DVec2) -> Self {
        Self { value, gradient }
    }

    /// A value that is the same everywhere.
    #[inline]
    #[must_use]
    pub const fn constant(value: f64) -> Self {
        Self::new(value, DVec2::ZERO)
    }

    /// A function of this, by the function's value and derivative here.
    #[inline]
    #[must_use]
    pub fn chain(self, (value, derivative): (f64, f64)) -> Self {
        Self::new(value, derivative * self.gradient)
    }

    /// The larger, rounded off where they differ by less than `k`, by at most k / 4 (Quilez's
    /// quadratic smooth maximum).
    #[inline]
    #[must_use]
    pub fn smooth_max(self, other: Self, k: Self) -> Self {
        let gap = self - other;
        if gap.value >= k.value {
            return self;
        }
        if gap.value <= -k.value {
            return other;
        }
        // (a + b + (d² + k²) / (2 k)) / 2, with d = a - b.
        let share = gap.value / k.value;
        let bow = Self::new(
            0.5 * (share * gap.value + k.value),
            share * gap.gradient + 0.5 * (1.0 - share * share) * k.gradient,
        );
        (self + other + bow).scale(0.5)
    }

    /// The smaller, rounded off as the larger is by [`smooth_max`](Self::smooth_max).
    #[inline]
    #[must_use]
    pub fn smooth_min(self, other: Self, k: Self) -> Self {
        -(-self).smooth_max(-other, k)
    }

    /// This times a constant.
    #[inline]
    #[must_use]
    pub fn scale(self, factor: f64) -> Self {
        Self::new(factor * self.value, factor * self.gradient)
    }
}

impl Add for Dual {
    type Output = Self;

    #[inline]
    fn add(self, o: Self) -> Self {
        Self::new(self.value + o.value, self.gradient + o.gradient)
    }
}

impl Sub for Dual {
    type Output = Self;

    #[inline]
    fn sub(self, o: Self) -> Self {
        Self::new(self.value - o.value, self.gradient - o.gradient)
    }
}

impl Mul for Dual {
    type Output = Self;

    #[inline]
    fn mul(self, o: Self) -> Self {
        Self::new(
            self.value * o.value,
            self.value * o.gradient + o.value * self.gradient,
        )
    }
}

impl Neg for Dual {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        self.scale(-1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn gradients_are_difference_quotients(x in -2.0_f64..2.0, y in -2.0_f64..2.0) {
            let f = |x: f64, y: f64| {
                let (x, y) = (Dual::new(x, DVec2::X), Dual::new(y, DVec2::Y));
                let k = (x * y).chain((0.3 + 0.1 * (x * y).value.sin(), 0.1 * (x * y).value.cos()));
                (x * x - y.scale(0.7)).smooth_max(x * y, k).smooth_min(y, Dual::constant(0.2))
            };
            let e = 1e-6;
            let expected = DVec2::new(
                (f(x + e, y).value - f(x - e, y).value) / (2.0 * e),
                (f(x, y + e).value - f(x, y - e).value) / (2.0 * e),
            );
            prop_assert!((f(x, y).gradient - expected).length() < 1e-4);
        }

        #[test]
        fn smooth_is_close_to_sharp(a in -2.0_f64..2.0, b in -2.0_f64..2.0, k in 0.01_f64..1.0) {
            let m = Dual::constant(a).smooth_max(Dual::constant(b), Dual::constant(k)).value;
            prop_assert!(m >= a.max(b) && m <= a.max(b) + k / 4.0 + 1e-12);
        }
    }
}
