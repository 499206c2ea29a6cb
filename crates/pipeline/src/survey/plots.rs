//! The plots of a survey.

use nemoral_dataset::Crop;
use nemoral_mensuration::{
    CanopyMaps, LyingDeadwood, MapGrid, Plot, PlotCanopy, StandMeasures, StandRow, stand_csv,
};
use nemoral_scene::ParamError;
use nemoral_scene::glam::{DVec2, DVec3};

use super::Survey;
use crate::Error;

/// What says which plot it is. A square has no radius; a circle's borders are those of the square
/// around it.
const KEY_COLUMNS: [&str; 9] = [
    "plot_id", "x_m", "y_m", "radius_m", "west_m", "south_m", "east_m", "north_m", "area_m2",
];

/// What is told of a plot besides its trees: of its dead wood and its canopy.
const MORE_COLUMNS: [&str; 7] = [
    "lying_deadwood_m3_ha",
    "canopy_cover",
    "canopy_cells",
    "canopy_height_mean_m",
    "canopy_height_p50_m",
    "canopy_height_p95_m",
    "canopy_height_max_m",
];

/// A plot is in a region if it is within this of it, metres: sums of decimals are not exact.
const SLACK_M: f64 = 1e-6;

/// The plots of an inventory.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum InventoryPlots {
    /// There are none.
    #[default]
    None,
    /// The squares that the rectangle is cut into.
    Squares {
        /// Their side, 1 to 1000 m.
        side_m: f64,
    },
    /// These parts of the rectangle, which may overlap, in world coordinates.
    Given(Vec<Crop>),
}

impl InventoryPlots {
    /// The corners of the smallest rectangle of whole cells of `cell_m` metres that has all given
    /// plots in it; `None` if no plots are given.
    ///
    /// # Errors
    /// If `cell_m` is not 0.01 to 1000 m.
    pub fn region_m(&self, cell_m: f64) -> Result<Option<[DVec2; 2]>, Error> {
        ParamError::check_within("cell_m", cell_m, 0.01, 1000.0)
            .map_err(|e| Error::request(e.to_string()))?;
        let Self::Given(plots) = self else {
            return Ok(None);
        };
        let bounds = plots.iter().map(Crop::bounds_m);
        let around =
            bounds.reduce(|[low_m, high_m], [from_m, to_m]| [low_m.min(from_m), high_m.max(to_m)]);
        Ok(around.map(|[low_m, high_m]| {
            let whole = [(low_m / cell_m).floor(), (high_m / cell_m).ceil()];
            // The sum turns -0 into 0.
            whole.map(|cells| cells * cell_m + 0.0)
        }))
    }
}

/// Plots that lie in the rectangle of a survey, in their order.
pub(super) enum Plots {
    Squares(MapGrid),
    Given(Vec<Crop>),
}

impl Plots {
    /// Those that are asked for in a rectangle.
    pub(super) fn of(wanted: &InventoryPlots, region_m: [DVec2; 2]) -> Result<Option<Self>, Error> {
        let invalid = |e: ParamError| Error::request(format!("plots: {e}"));
        match wanted {
            InventoryPlots::None => Ok(None),
            InventoryPlots::Squares { side_m } => {
                let [low_m, high_m] = region_m;
                ParamError::check_within("plot_m", *side_m, 1.0, 1000.0).map_err(invalid)?;
                let grid = MapGrid::of(low_m, high_m, *side_m).map_err(invalid)?;
                Ok(Some(Self::Squares(grid)))
            }
            InventoryPlots::Given(plots) => {
                for (plot, number) in plots.iter().zip(1..) {
                    check_inside(plot, number, region_m)?;
                }
                Ok(Some(Self::Given(plots.clone())))
            }
        }
    }

    /// Each as a part of the world.
    pub(super) fn shapes(&self) -> Vec<Crop> {
        match self {
            Self::Squares(grid) => {
                let square = |number: usize| {
                    let low_m = grid.corner_m(number);
                    let high_m = low_m + grid.cell_m;
                    Crop::Rectangle { low_m, high_m }
                };
                (0..grid.cells()).map(square).collect()
            }
            Self::Given(plots) => plots.clone(),
        }
    }

    /// The things whose places are in each of them.
    fn of_each<'a, T>(&self, things: &'a [T], place_m: impl Fn(&T) -> DVec3) -> Vec<Vec<&'a T>> {
        match self {
            Self::Squares(grid) => {
                let mut inside: Vec<Vec<&'a T>> = vec![Vec::new(); grid.cells()];
                for thing in things {
                    if let Some(plot) = grid.cell_at(place_m(thing).truncate()) {
                        inside[plot].push(thing);
                    }
                }
                inside
            }
            Self::Given(plots) => {
                let inside = |plot: &Crop| -> Vec<&'a T> {
                    let is_inside = |thing: &T| plot.contains(place_m(thing).truncate());
                    things.iter().filter(|thing| is_inside(thing)).collect()
                };
                plots.iter().map(inside).collect()
            }
        }
    }

    /// The canopy of each.
    fn canopies(&self, maps: &CanopyMaps) -> Vec<Option<PlotCanopy>> {
        match self {
            Self::Squares(grid) => PlotCanopy::of_plots(maps, grid),
            Self::Given(plots) => {
                let of_plot = |plot: &Crop| {
                    PlotCanopy::of_part(maps, plot.bounds_m(), |place_m| plot.contains(place_m))
                };
                plots.iter().map(of_plot).collect()
            }
        }
    }
}

/// A plot is at least this wide, metres.
const LEAST_M: f64 = 0.01;

/// Refuses a plot that is smaller than that, and one that is not wholly in a region.
fn check_inside(plot: &Crop, number: usize, [low_m, high_m]: [DVec2; 2]) -> Result<(), Error> {
    let [from_m, to_m] = plot.bounds_m();
    let is_inside = (to_m - from_m).cmpge(DVec2::splat(LEAST_M)).all()
        && from_m.cmpge(low_m - SLACK_M).all()
        && to_m.cmple(high_m + SLACK_M).all();
    if is_inside {
        return Ok(());
    }
    let region = Crop::Rectangle { low_m, high_m };
    Err(Error::request(format!(
        "plot {number} = {plot}: must be 1 cm wide or more and lie wholly in the region {region}, \
         metres in world coordinates"
    )))
}

/// Measures of each plot, with its place, to which `origin_m` is added, its lying dead wood and its
/// canopy. `whole` says what counts.
pub(super) fn plots_csv(
    survey: &Survey,
    plots: &Plots,
    whole: &Plot,
    origin_m: DVec2,
) -> Result<String, Error> {
    let trees = plots.of_each(&survey.trees, |tree| tree.position_m);
    let deadwood = plots.of_each(&survey.deadwood, |piece| piece.position_m);
    let canopies = plots.canopies(&survey.maps);
    let inside = trees.into_iter().zip(deadwood).zip(canopies);
    let mut rows = Vec::with_capacity(inside.len());
    for ((shape, number), ((trees, pieces), canopy)) in plots.shapes().iter().zip(1..).zip(inside) {
        let plot = Plot {
            area_m2: shape.area_m2(),
            ..*whole
        };
        let lying = LyingDeadwood::of(pieces, &plot).map_err(Error::of_stage)?;
        let mut more = vec![format!("{:.4}", lying.all().volume_m3_ha)];
        more.extend(canopy_fields(canopy));
        rows.push(StandRow {
            key: key_fields(number, shape, origin_m),
            measures: StandMeasures::of(trees, &plot).map_err(Error::of_stage)?,
            more,
        });
    }
    Ok(stand_csv((&KEY_COLUMNS, &MORE_COLUMNS), &rows))
}

/// Which plot it is, in the order of [`KEY_COLUMNS`].
fn key_fields(number: usize, shape: &Crop, origin_m: DVec2) -> Vec<String> {
    let [low_m, high_m] = shape.bounds_m().map(|corner_m| corner_m + origin_m);
    // The sum turns -0 into 0.
    let text = |number: f64| format!("{}", (number * 1e6).round() / 1e6 + 0.0);
    let (middle_m, radius) = match *shape {
        Crop::Rectangle { .. } => ((low_m + high_m) / 2.0, String::new()),
        Crop::Circle { centre_m, radius_m } => (centre_m + origin_m, text(radius_m)),
    };
    let borders = [low_m.x, low_m.y, high_m.x, high_m.y];
    let mut fields = vec![
        number.to_string(),
        text(middle_m.x),
        text(middle_m.y),
        radius,
    ];
    fields.extend(borders.map(text));
    fields.push(text(shape.area_m2()));
    fields
}

/// A canopy in the order of [`MORE_COLUMNS`]; empty if there is none.
fn canopy_fields(canopy: Option<PlotCanopy>) -> Vec<String> {
    let Some(canopy) = canopy else {
        return vec![String::new(); MORE_COLUMNS.len() - 1];
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
