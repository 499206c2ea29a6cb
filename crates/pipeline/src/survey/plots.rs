//! The plots of a survey.

use nemoral_mensuration::{MapGrid, Plot, StandMeasures, StandRow, stand_csv};
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

/// Measures of each plot with its corners, to which `origin_m` is added, and its canopy: that of
/// the cells whose middles are in it.
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
    let mut canopies: Vec<Canopy> = vec![Canopy::default(); plots.cells()];
    for (number, cell) in survey.maps.cells.iter().enumerate() {
        if let Some(plot) = plots.cell_at(survey.maps.grid.middle_m(number)) {
            canopies[plot].cover += cell.cover;
            canopies[plot].heights_m.push(cell.height_m);
        }
    }
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
            more: canopy.columns(),
        });
    }
    let keys = ["west_m", "south_m", "east_m", "north_m"];
    Ok(stand_csv((&keys, &CANOPY_COLUMNS), &rows))
}

/// The cells of a plot.
#[derive(Clone, Debug, Default)]
struct Canopy {
    cover: f64,
    heights_m: Vec<f64>,
}

impl Canopy {
    /// In the order of [`CANOPY_COLUMNS`]; empty if no cell has its middle in the plot.
    fn columns(mut self) -> Vec<String> {
        self.heights_m.sort_by(f64::total_cmp);
        let count = self.heights_m.len();
        let Some(&highest_m) = self.heights_m.last() else {
            return vec![String::new(); CANOPY_COLUMNS.len()];
        };
        // The nearest rank.
        let percentile = |share: f64| {
            let rank = (share * count as f64).ceil().max(1.0) as usize;
            self.heights_m[rank - 1]
        };
        let mean_m = self.heights_m.iter().sum::<f64>() / count as f64;
        let cover = self.cover / count as f64;
        let high = self.heights_m.iter().filter(|m| **m >= 2.0).count();
        let cells = high as f64 / count as f64;
        [
            cover,
            cells,
            mean_m,
            percentile(0.5),
            percentile(0.95),
            highest_m,
        ]
        .map(|number| format!("{number:.4}"))
        .to_vec()
    }
}
