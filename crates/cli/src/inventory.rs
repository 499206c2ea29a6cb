//! The command `inventory`.

use std::path::Path;

use nemoral_pipeline::{InventoryParams, InventoryPlots, SurveyParams};

use crate::arguments::{Inventory, Region};
use crate::failure::Failure;
use crate::request::recorder;
use crate::terminal::{note, say};

/// Side of the square that is surveyed if no region and no plot is named, metres: a hectare.
const SIDE_M: f64 = 100.0;

/// Writes what a forest inventory would find.
pub(crate) fn run(a: &Inventory, program: Option<&Path>) -> Result<bool, Failure> {
    let (recorder, no_cache) = recorder(&a.of, program)?;
    let plots = match (a.plots, &a.plot[..]) {
        (Some(side_m), _) => InventoryPlots::Squares { side_m },
        (None, []) => InventoryPlots::None,
        (None, given) => InventoryPlots::Given(given.to_vec()),
    };
    let region_m = match a.region {
        Some(Region([x0, y0, x1, y1])) => [[x0, y0].into(), [x1, y1].into()],
        None => match plots.region_m(a.cell)? {
            Some(around_plots) => around_plots,
            None => recorder.square_around_start(SIDE_M)?,
        },
    };
    let params = InventoryParams {
        survey: SurveyParams {
            cell_m: a.cell,
            rays_a_side: a.rays,
            layer_m: a.layer,
        },
        min_dbh_m: a.min_dbh,
        min_deadwood_diameter_m: a.min_deadwood_diameter,
        plots,
    };
    let survey = recorder.write_inventory(region_m, &params, &a.out)?;
    let [low_m, high_m] = region_m;
    say(&format!(
        "{} trees, canopy cover {:.0} %, leaf area index {:.1} of all plants on {:.2} ha from {}, \
         {} to {}, {} m in {}",
        survey.trees.len(),
        100.0 * survey.maps.cover(),
        survey.profile.leaf_area_index(),
        survey.maps.grid.area_m2() / 1e4,
        low_m.x,
        low_m.y,
        high_m.x,
        high_m.y,
        a.out.display()
    ))?;
    if let Some(no_cache) = no_cache {
        note(&no_cache);
    }
    Ok(true)
}
