//! What covers the ground of a forest: patches of litter and moss.

use nemoral_scene::ParamError;
use nemoral_scene::glam::DVec2;

use crate::{FieldParams, ScalarField};

/// By how much of the field's range the limit of moss moves between neutral and wettest ground.
const MOSS_SPREAD: f64 = 0.14;

/// What covers the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FloorCover {
    /// Fallen leaves.
    LeafLitter,
    /// Fallen needles.
    NeedleLitter,
    /// Moss and soil.
    Moss,
}

impl FloorCover {
    /// All covers, by [`index`](Self::index).
    pub const ALL: [Self; 3] = [Self::LeafLitter, Self::NeedleLitter, Self::Moss];

    /// The place of the cover in [`ALL`](Self::ALL).
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }
}

/// The field that makes patches of a floor some metres wide.
pub const FLOOR_FIELD: FieldParams = FieldParams {
    octaves: 4,
    scale_m: 14.0,
    lacunarity: 2.1,
    persistence: 0.6,
};

/// Number of places along each side of the grid at which a field's quantiles are sampled.
const SAMPLES: u32 = 48;

/// Distance of these places, metres. It is several patches, so that samples are nearly independent.
const SAMPLE_STEP_M: f64 = 37.0;

/// The cover of each place, from one field that is cut at its own quantiles.
#[derive(Clone, Debug)]
pub struct FloorComposition<F> {
    field: F,
    /// The values of the field between the covers: below the first is the first cover, above the
    /// last the last cover.
    limits: [f64; 2],
}

impl<F: ScalarField> FloorComposition<F> {
    /// A floor on which each of [`FloorCover::ALL`] has its share.
    ///
    /// `shares` are relative to each other; none is negative and their sum is positive. They are
    /// met by the quantiles of the field at 2,304 places.
    ///
    /// # Errors
    /// If a share is negative or not finite, or all are 0.
    pub fn new(shares: [f64; 3], field: F) -> Result<Self, ParamError> {
        for (i, &share) in shares.iter().enumerate() {
            ParamError::check_at_least_zero(&format!("shares[{i}]"), share)?;
        }
        let total: f64 = shares.iter().sum();
        ParamError::check_positive("sum of shares", total)?;
        let places = (0..SAMPLES * SAMPLES)
            .map(|i| DVec2::new(f64::from(i % SAMPLES), f64::from(i / SAMPLES)) * SAMPLE_STEP_M);
        let mut values: Vec<f64> = places.map(|p| field.value(p)).collect();
        values.sort_unstable_by(f64::total_cmp);
        let limit = |share: f64| {
            let rank = share / total * values.len() as f64;
            values.get(rank as usize).copied().unwrap_or(f64::INFINITY)
        };
        let limits = [limit(shares[0]), limit(shares[0] + shares[1])];
        Ok(Self { field, limits })
    }

    /// The cover at a world position, metres, whose ground is wetter than most by `wetness`,
    /// −1..=1: moss, where it has a share, takes places of litter where it is wet and leaves them
    /// where it is dry.
    pub fn cover(&self, world_m: DVec2, wetness: f64) -> FloorCover {
        let value = self.field.value(world_m);
        let [leaves, needles] = self.limits;
        if value >= needles - MOSS_SPREAD * wetness {
            FloorCover::Moss
        } else if value >= leaves {
            FloorCover::NeedleLitter
        } else {
            FloorCover::LeafLitter
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Waves in both directions, from 0 to 1.
    fn waves(p: DVec2) -> f64 {
        0.5 + 0.25 * (libm::sin(p.x * 0.71) + libm::sin(p.y * 0.83))
    }

    #[test]
    fn covers_have_their_shares() {
        let floor = FloorComposition::new([2.0, 1.0, 1.0], waves).expect("shares");
        let mut counts = [0; 3];
        for i in 0..40_000 {
            let p = DVec2::new(f64::from(i % 200), f64::from(i / 200)) * 1.7;
            counts[floor.cover(p, 0.0).index()] += 1;
        }
        for (count, share) in counts.into_iter().zip([0.5, 0.25, 0.25]) {
            let found = f64::from(count) / 40_000.0;
            assert!((found - share).abs() < 0.03, "{counts:?}");
        }
    }

    #[test]
    fn impossible_shares_are_refused() {
        let refused = |shares| {
            let error = FloorComposition::new(shares, waves)
                .err()
                .expect("impossible");
            error.to_string()
        };
        let sum = "sum of shares = 0: must be finite and greater than 0";
        assert_eq!(refused([0.0; 3]), sum);
        for (share, said) in [(f64::NAN, "NaN"), (-1.0, "-1"), (f64::INFINITY, "inf")] {
            let said = format!("shares[1] = {said}: must be finite and at least 0");
            assert_eq!(refused([1.0, share, 1.0]), said);
        }
    }

    #[test]
    fn moss_is_where_it_is_wet() {
        let floor = FloorComposition::new([2.0, 1.0, 1.0], waves).expect("shares");
        let moss = |wetness| {
            let places = (0..10_000)
                .map(|i| DVec2::new(f64::from(i % 100), f64::from(i / 100)) * 1.7)
                .filter(|p| floor.cover(*p, wetness) == FloorCover::Moss);
            places.count()
        };
        assert!(moss(1.0) > moss(0.3) && moss(0.3) > moss(0.0));
        assert!(moss(0.0) > moss(-0.3) && moss(-0.3) > moss(-1.0));
        // Where there is none, wetness makes none.
        let none = FloorComposition::new([1.0, 1.0, 0.0], waves).expect("shares");
        assert_eq!(none.cover(DVec2::ZERO, 1.0), none.cover(DVec2::ZERO, -1.0));
    }

    #[test]
    fn a_cover_without_share_is_nowhere() {
        for i in 0..3 {
            let mut shares = [0.0; 3];
            shares[i] = 7.0;
            let floor = FloorComposition::new(shares, waves).expect("shares");
            for k in 0..1000 {
                let p = DVec2::new(f64::from(k), 3.0) * 0.9;
                // The lowest and highest values may lie outside of the sampled ones.
                let rare = waves(p) < 0.01 || waves(p) > 0.99;
                assert!(rare || floor.cover(p, 0.0) == FloorCover::ALL[i]);
            }
        }
    }
}
