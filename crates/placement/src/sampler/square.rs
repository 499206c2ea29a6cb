//! Coordinates on a plane of square tiles.
//!
//! Lengths are in tile edges and positions are relative to a tile's south-west corner. Positions
//! are multiples of 2⁻³⁰, so that sums and differences of positions are exact: two tiles that see
//! the same pair of points from different origins compute with the same bits.

use glam::DVec2;

/// A square of the plane, relative to a tile's corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Square {
    middle: DVec2,
    pub(crate) half_width: f64,
}

impl Square {
    /// The square with a tile's centre.
    pub(crate) fn around_tile(half_width: f64) -> Self {
        Self {
            middle: DVec2::splat(0.5),
            half_width,
        }
    }

    /// The least square that covers a rectangle.
    pub(crate) fn covering(low: DVec2, high: DVec2) -> Self {
        let middle = snap(0.5 * (low + high));
        Self {
            middle,
            half_width: (middle - low).max(high - middle).max_element(),
        }
    }

    /// The least square that covers this one's intersections with others; `None` if there are none.
    pub(crate) fn bounding_intersections(&self, others: &[Self]) -> Option<Self> {
        let intersections = others.iter().filter_map(|other| {
            let (low, high) = (self.low().max(other.low()), self.high().min(other.high()));
            low.cmple(high).all().then_some((low, high))
        });
        intersections
            .reduce(|(low, high), (l, h)| (low.min(l), high.max(h)))
            .map(|(low, high)| Self::covering(low, high))
    }

    pub(crate) fn low(&self) -> DVec2 {
        self.middle - self.half_width
    }

    pub(crate) fn high(&self) -> DVec2 {
        self.middle + self.half_width
    }

    /// The distance from its middle in the maximum norm.
    pub(crate) fn away(&self, p: DVec2) -> f64 {
        (p - self.middle).abs().max_element()
    }

    pub(crate) fn contains(&self, p: DVec2) -> bool {
        self.away(p) <= self.half_width
    }

    pub(crate) fn covers(&self, other: &Self) -> bool {
        self.away(other.middle) + other.half_width <= self.half_width
    }

    /// The same, `margin` wider on all sides.
    pub(crate) fn grown(self, margin: f64) -> Self {
        Self {
            half_width: self.half_width + margin,
            ..self
        }
    }
}

/// Rounds to the nearest multiple of 2⁻³⁰, for magnitudes below 2²¹.
pub(crate) fn snap(p: DVec2) -> DVec2 {
    // Adding 1.5 · 2²² leaves exactly 30 binary places, whatever the sign.
    let shift = DVec2::splat(6_291_456.0);
    (p + shift) - shift
}
