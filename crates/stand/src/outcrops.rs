//! Outcrops and scree: where the ground has hardly any soil.

use crate::GroundConditions;

/// Side of the cells of which each may hold a rock that crops out, metres.
pub const OUTCROP_CELL_M: f64 = 2.0;

/// Rocks are where the soil is thinner than the first, metres, and most where it is thinner than
/// the second.
const THIN_M: [f64; 2] = [0.3, 0.05];
/// Slopes on which there are few, and on which there are most.
const STEEP: [f64; 2] = [0.12, 0.5];

/// The most rocks that crop out in a chunk, if `share` of the cells of bare ground have one: clumps
/// leave a third of it free.
#[must_use]
pub fn most_outcropping_rocks(share: f64, chunk_size_m: f64) -> f64 {
    0.7 * share * chunk_size_m * chunk_size_m / (OUTCROP_CELL_M * OUTCROP_CELL_M)
}

/// The effect of the depth of soil up to which no ground is thin enough for an outcrop.
#[must_use]
pub fn least_soil_effect_of_outcrops() -> f64 {
    1.0 - THIN_M[0] / GroundConditions::NEUTRAL.soil_m
}

/// How readily rock crops out of ground with soil of this depth, 0..=1. The slope is asked for only
/// where the soil is thin.
#[must_use]
pub fn outcrop_chance(soil_m: f64, slope: impl FnOnce() -> f64) -> f64 {
    let thin = (THIN_M[0] - soil_m) / (THIN_M[0] - THIN_M[1]);
    if thin <= 0.0 {
        return 0.0;
    }
    let steep = (slope() - STEEP[0]) / (STEEP[1] - STEEP[0]);
    thin.min(1.0) * (0.3 + 0.7 * steep.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rock_crops_out_where_soil_is_thin_and_most_where_it_is_steep() {
        let chances = [0.05, 0.2, 0.31].map(|soil_m| outcrop_chance(soil_m, || 0.6));
        assert_eq!((chances[0], chances[2]), (1.0, 0.0));
        assert!(
            (0.0..1.0).contains(&chances[1]) && chances[1] > 0.0,
            "{chances:?}"
        );
        assert!(outcrop_chance(0.2, || 0.0) < 0.5 * chances[1]);
        // With this effect, no soil is thinner than that.
        let least = least_soil_effect_of_outcrops();
        let thinnest_m = (1.0 - least) * GroundConditions::NEUTRAL.soil_m;
        assert!(outcrop_chance(thinnest_m + 1e-9, || 0.6) < 1e-6);
        assert!(outcrop_chance(thinnest_m - 0.01, || 0.6) > 0.0);
    }
}
