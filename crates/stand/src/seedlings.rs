//! Where tree seedlings grow.

/// The density of seedlings.
///
/// Each cell of a jittered grid may hold one. They grow in the clusters of saplings, if there are
/// any, and where there is light; single ones grow elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seedlings {
    /// Seedlings on a square metre of a cluster in full light.
    pub per_m2: f64,
}

impl Seedlings {
    /// Side of a grid cell, metres.
    pub const CELL_M: f64 = 0.7;

    /// The greatest distance of a seedling from its cell's middle, in cells, large enough that no
    /// row of the grid is visible.
    pub const JITTER: f64 = 2.0;

    /// The range of scales. The shapes have their own heights, under 0.3 m.
    pub const SCALE: (f64, f64) = (0.9, 1.1);

    /// Nearer to a trail's edge than this, metres, seedlings are driven over or mown.
    pub const VERGE_M: f64 = 0.4;

    /// The density outside of clusters relative to that in a cluster.
    const STRAYS: f64 = 0.06;

    /// From this sky view factor on, there are as many as in full light ...
    const LIGHT_ENOUGH: f64 = 0.4;

    /// ... and in deep shade this share of them, as seeds sprout there too, but few seedlings
    /// survive.
    const IN_SHADE: f64 = 0.1;

    /// The probability that a cell holds a seedling, by the sky view factor 0.3 m above its ground;
    /// more than 1 if there is no room for all.
    #[must_use]
    pub fn chance(&self, in_cluster: bool, sky_view: f32) -> f64 {
        let share = if in_cluster { 1.0 } else { Self::STRAYS };
        let most = self.per_m2 * Self::CELL_M * Self::CELL_M * share;
        most * (f64::from(sky_view) / Self::LIGHT_ENOUGH).clamp(Self::IN_SHADE, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seedlings_seek_light_and_company() {
        let seedlings = Seedlings { per_m2: 1.5 };
        let full = 1.5 * 0.7 * 0.7;
        assert!((seedlings.chance(true, 1.0) - full).abs() < 1e-12);
        assert!((seedlings.chance(true, 0.2) - full / 2.0).abs() < 1e-8);
        assert!((seedlings.chance(true, 0.0) - full / 10.0).abs() < 1e-12);
        assert!((seedlings.chance(false, 1.0) - full * 0.06).abs() < 1e-12);
    }
}
