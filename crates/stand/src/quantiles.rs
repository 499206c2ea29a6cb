//! A field by the ranks of its values.

use nemoral_scene::glam::DVec2;

use crate::ScalarField;

/// Number of places along each side of the grid at which a field's quantiles are sampled.
const SAMPLES: u32 = 48;
/// Distance of these places, metres. It is more than a stand, so that samples are nearly
/// independent.
const SAMPLE_STEP_M: f64 = 37.0;

/// A field with the distribution of its values.
#[derive(Clone, Debug)]
pub(crate) struct Quantiles<F> {
    field: F,
    sorted: Vec<f64>,
}

impl<F: ScalarField> Quantiles<F> {
    pub(crate) fn of(field: F) -> Self {
        let places = (0..SAMPLES * SAMPLES)
            .map(|i| DVec2::new(f64::from(i % SAMPLES), f64::from(i / SAMPLES)) * SAMPLE_STEP_M);
        let mut sorted: Vec<f64> = places.map(|p| field.value(p)).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        Self { field, sorted }
    }

    /// The share of the plane with lower values than here, 0..1.
    pub(crate) fn rank(&self, world_m: DVec2) -> f64 {
        let value = self.field.value(world_m);
        let below = self.sorted.partition_point(|&v| v < value);
        // Between its neighbours, so that ranks change smoothly.
        let before = below.checked_sub(1).map_or(value, |i| self.sorted[i]);
        let after = self.sorted.get(below).copied().unwrap_or(value);
        let part = if after > before {
            (value - before) / (after - before)
        } else {
            0.5
        };
        let rank = (below as f64 - 1.0 + part) / self.sorted.len() as f64;
        rank.clamp(0.0, 1.0 - f64::EPSILON)
    }
}
