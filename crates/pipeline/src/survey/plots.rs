//! The plots of a survey.

use nemoral_mensuration::{MapGrid, Plot, PlotCanopy, StandMeasures, StandRow, stand_csv};
use nemoral_scene::TreeRecord;
use nemoral_scene::glam::DVec2;

use super::Survey;
use crate::Error;

/// What is told of a plot's canopy.
const CANOPY_COLUMNS: [&str; 6] = [
    "canopy_cover",
    "canopy_cells",
    "canopy_height_mean_m",
    "canopy_height_p50_m",
    "canopy_height_p95_m",
    "canopy_height_max_m",
];

/// Measures of each plot with its corners, to which `origin_m` is added, and its canopy.
pub(super) fn plots_csv(
    survey: &Survey,
    plots: &MapGrid,
    min_dbh_m: f64,
    origin_m: DVec2,
) -> Result<String, Error> {
    let mut trees: Vec<Vec<&TreeRecord>> = vec![Vec::new(); plots.cells()];
    for tree in &survey.trees {
        if let Some(plot) = plots.cell_at(tree.position_m.truncate()) {
            trees[plot].push(tree);
        }
    }
    let canopies = PlotCanopy::of_plots(&survey.maps, plots);
    let plot = Plot {
        area_m2: plots.cell_m * plots.cell_m,
        min_dbh_m,
    };
    let mut rows = Vec::with_capacity(plots.cells());
    for (number, (trees, canopy)) in trees.into_iter().zip(canopies).enumerate() {
        let low_m = plots.corner_m(number) + origin_m;
        let corners = [low_m, low_m + plots.cell_m];
        let key = corners.iter().flat_map(|corner| corner.to_array());
        let key = key.map(|m| format!("{}", (m * 1e6).round() / 1e6));
        rows.push(StandRow {
            key: key.collect(),
            measures: StandMeasures::of(trees, &plot).map_err(Error::of_stage)?,
            more: columns(canopy),
        });
    }
    let keys = ["west_m", "south_m", "east_m", "north_m"];
    Ok(stand_csv((&keys, &CANOPY_COLUMNS), &rows))
}

/// A canopy in the order of [`CANOPY_COLUMNS`]; empty if there is none.
fn columns(canopy: Option<PlotCanopy>) -> Vec<String> {
    let Some(canopy) = canopy else {
        return vec![String::new(); CANOPY_COLUMNS.len()];
    };
    let [median_m, high_m] = canopy.percentiles_m;
    let PlotCanopy {
        cover,
        cells,
        mean_m,
        highest_m,
        ..
    } = canopy;
    [cover, cells, mean_m, median_m, high_m, highest_m]
        .map(|number| format!("{number:.4}"))
        .to_vec()
}
