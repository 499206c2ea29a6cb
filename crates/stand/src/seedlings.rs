//! Where seedlings of trees come up.

/// How many seedlings come up, and on what grid.
///
/// Each cell of a jittered grid may hold one. They come up in the clusters where saplings stand, if
/// there are any, and where light is; single ones elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seedlings {
    /// Seedlings on a square metre of a cluster in full light.
    pub per_m2: f64,
}

impl Seedlings {
    /// Side of a grid cell, metres.
    pub const CELL_M: f64 = 0.7;

    /// How far a seedling stands from its cell's middle at most, in cells: so far that no row of
    /// the grid is seen.
    pub const JITTER: f64 = 2.0;

    /// The range of scales. The shapes have their own heights, under 0.3 m.
    pub const SCALE: (f64, f64) = (0.9, 1.1);

    /// Nearer to a trail's edge than this, metres, seedlings are driven over or mown.
    pub const VERGE_M: f64 = 0.4;

    /// The share of a cluster's seedlings that comes up outside of clusters.
    const STRAYS: f64 = 0.06;

    /// Under a sky view factor of this there are as many as in full light ...
    const LIGHT_ENOUGH: f64 = 0.4;

    /// ... and in deep shade this share of them: seeds sprout there too, and few live on.
    const IN_SHADE: f64 = 0.1;

    /// The chance that a cell holds a seedling, by the sky view factor 0.3 m above its ground;
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
