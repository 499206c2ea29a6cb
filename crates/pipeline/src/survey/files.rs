//! A survey as files.

use std::collections::BTreeMap;
use std::path::Path;

use nemoral_dataset::{deadwood_csv, trees_csv};
use nemoral_export::{RasterMap, RasterValues, check_folder, to_geotiff};
use nemoral_files::{Folder, InnerPath};
use nemoral_mensuration::{
    CanopyCell, LyingDeadwood, MapFrame, Plot, StandMeasures, StandRow, VisibleCrown,
    crowns_geojson, deadwood_stand_csv, profile_csv, stand_csv, stems_geojson, visible_crowns,
};
use nemoral_scene::TreeRecord;
use nemoral_scene::glam::DVec2;
use serde_json::json;

use super::plots::{InventoryPlots, Plots, plots_csv};
use super::{Survey, SurveyParams};
use crate::header::site_spec;
use crate::{Error, Recorder};

/// How the trees and the dead wood of an inventory are counted.
#[derive(Clone, Debug, PartialEq)]
pub struct InventoryParams {
    /// What is surveyed.
    pub survey: SurveyParams,
    /// The callipering limit of measures per hectare, 0 to 2 m: thinner trees do not count.
    pub min_dbh_m: f64,
    /// Logs that are thinner at their thick end do not count per hectare, 0 to 2 m.
    pub min_deadwood_diameter_m: f64,
    /// The plots that are measured by themselves, too.
    pub plots: InventoryPlots,
}

impl Default for InventoryParams {
    /// Trees of 7 cm and more count, as in Germany's national inventory, and logs of 10 cm and
    /// more, as there, too; there are no plots.
    fn default() -> Self {
        Self {
            survey: SurveyParams::default(),
            min_dbh_m: 0.07,
            min_deadwood_diameter_m: 0.1,
            plots: InventoryPlots::None,
        }
    }
}

impl InventoryParams {
    /// Checks the numbers for a rectangle, and gives the whole of it as a plot, and its plots.
    fn check(&self, low_m: DVec2, high_m: DVec2) -> Result<(Plot, Option<Plots>), Error> {
        let extent_m = high_m - low_m;
        let whole = Plot {
            area_m2: extent_m.x * extent_m.y,
            min_dbh_m: self.min_dbh_m,
            min_deadwood_diameter_m: self.min_deadwood_diameter_m,
        };
        whole.check().map_err(|e| Error::request(e.to_string()))?;
        Ok((whole, Plots::of(&self.plots, [low_m, high_m])?))
    }
}

impl Recorder {
    /// Surveys a rectangle of the world and writes what a forest inventory of it would find into a
    /// folder, which must be new or empty:
    ///
    /// - `trees.csv`, `deadwood.csv`: trees and dead wood of the rectangle, as in a data set;
    /// - `stand.csv`: measures per hectare, of all trees and of each species;
    ///   `deadwood_stand.csv`: those of lying dead wood, of all and of each stage of decay;
    ///   `plots.csv`: those of each plot, if there are any, with its dead wood and its canopy;
    /// - `profile.csv`: leaf and wood area by height;
    /// - `dtm.tif`, `dsm.tif`, `chm.tif`: heights of the ground, of the surface, and of the canopy
    ///   above the ground;
    /// - `crowns.tif`, `crowns.geojson`: whose crown is the top, as a map of numbers from 1 on and
    ///   as polygons with these numbers and what is known of their trees; `stems.geojson`: the
    ///   trees as points;
    /// - `inventory.json`: what was surveyed and how. It appears last.
    ///
    /// Maps, GeoJSON and plots are in the coordinates of the site's files, if the forest has a
    /// site; those of `trees.csv` and `deadwood.csv` are the world's.
    ///
    /// # Errors
    /// As [`Recorder::survey`]; if a parameter is out of its range, the folder has something in it,
    /// squares are not whole parts of the rectangle's sides, a given plot is not wholly in the
    /// rectangle, or a file cannot be written.
    pub fn write_inventory(
        &self,
        [low_m, high_m]: [DVec2; 2],
        params: &InventoryParams,
        folder: &Path,
    ) -> Result<Survey, Error> {
        self.rectangle(low_m, high_m)?;
        let (whole, plots) = params.check(low_m, high_m)?;
        let frame = self.map_frame()?;
        check_folder(folder).map_err(|e| Error::request(e.to_string()))?;
        let survey = self.survey(low_m, high_m, &params.survey)?;
        let crowns = visible_crowns(&survey.maps);
        let mut crowned = [&survey.trees[..], &survey.trees_outside].concat();
        crowned.sort_by_key(|tree| tree.object);
        let stand = stand_csv((&["species"], &[]), &by_species(&survey.trees, &whole)?);
        let lying = LyingDeadwood::of(&survey.deadwood, &whole).map_err(Error::of_stage)?;
        let mut files = vec![
            ("trees.csv", trees_csv(&survey.trees)?.into_bytes()),
            ("deadwood.csv", deadwood_csv(&survey.deadwood)?.into_bytes()),
            ("stand.csv", stand.into_bytes()),
            (
                "deadwood_stand.csv",
                deadwood_stand_csv(&lying).into_bytes(),
            ),
            ("profile.csv", profile_csv(&survey.profile).into_bytes()),
            (
                "crowns.geojson",
                crowns_geojson(&crowns, &crowned, &frame).into_bytes(),
            ),
            (
                "stems.geojson",
                stems_geojson(&survey.trees, &frame).into_bytes(),
            ),
        ];
        if let Some(plots) = &plots {
            let text = plots_csv(&survey, plots, &whole, frame.origin_m.truncate())?;
            files.push(("plots.csv", text.into_bytes()));
        }
        files.extend(maps(&survey, &crowns, &frame)?);
        let side_m = match params.plots {
            InventoryPlots::Squares { side_m } => Some(side_m),
            InventoryPlots::None | InventoryPlots::Given(_) => None,
        };
        let rounded = |number: f64| (number * 1e6).round() / 1e6;
        let about = json!({
            "generator": concat!("nemoral ", env!("CARGO_PKG_VERSION")),
            "seed": self.sequence().config.seed,
            "region_m": [low_m.x, low_m.y, high_m.x, high_m.y],
            "origin_m": frame.origin_m.to_array(),
            "epsg": frame.epsg,
            "has_measured_heights": !self.sequence().config.site.terrain.path.is_empty(),
            "cell_m": params.survey.cell_m,
            "rays_a_side": params.survey.rays_a_side,
            "layer_m": params.survey.layer_m,
            "min_dbh_m": params.min_dbh_m,
            "min_deadwood_diameter_m": params.min_deadwood_diameter_m,
            "plot_m": side_m,
            "plots": plots.map_or(0, |plots| plots.shapes().len()),
            "canopy_cover": rounded(survey.maps.cover()),
            "leaf_area_index_of_all_plants": rounded(survey.profile.leaf_area_index()),
            "lying_deadwood_m3_ha": rounded(lying.all().volume_m3_ha),
        });
        let about = serde_json::to_string_pretty(&about).expect("numbers and text");
        files.push(("inventory.json", format!("{about}\n").into_bytes()));
        // Nothing is written before all is made.
        let folder = Folder::new(folder);
        folder.create_root()?;
        for (name, bytes) in files {
            folder.put(&InnerPath::new(name).expect("a plain name"), &bytes)?;
        }
        Ok(survey)
    }

    /// Where the world lies on maps.
    fn map_frame(&self) -> Result<MapFrame, Error> {
        let sequence = self.sequence();
        let site = site_spec(&sequence.config, &sequence.inputs)?;
        Ok(site.map_or_else(MapFrame::default, |site| MapFrame {
            origin_m: site.origin_m.into(),
            epsg: site.epsg,
        }))
    }
}

/// The maps as files.
fn maps(
    survey: &Survey,
    crowns: &[VisibleCrown],
    frame: &MapFrame,
) -> Result<Vec<(&'static str, Vec<u8>)>, Error> {
    let grid = &survey.maps.grid;
    let real = |of: &dyn Fn(&CanopyCell) -> f64| {
        let value = |number: usize| of(&survey.maps.cells[number]) as f32;
        RasterValues::Real(grid.from_north(value))
    };
    let number_of = |number: usize| {
        let top = survey.maps.cells[number].top;
        let at = crowns.binary_search_by_key(&top, |crown| crown.object);
        at.map_or(0, |at| at as u32 + 1)
    };
    let zero_m = frame.origin_m.z;
    let north_west_m = grid.south_west_m + DVec2::new(0.0, grid.rows as f64 * grid.cell_m);
    let file = |(name, values)| {
        let map = RasterMap {
            north_west_m: north_west_m + frame.origin_m.truncate(),
            cell_m: grid.cell_m,
            columns: grid.columns,
            rows: grid.rows,
            values,
            epsg: frame.epsg,
        };
        Ok((name, to_geotiff(&map).map_err(Error::of_stage)?))
    };
    let all = [
        ("dtm.tif", real(&|cell| cell.ground_m + zero_m)),
        ("dsm.tif", real(&|cell| cell.surface_m + zero_m)),
        ("chm.tif", real(&|cell| cell.height_m)),
        ("crowns.tif", RasterValues::Id(grid.from_north(number_of))),
    ];
    all.into_iter().map(file).collect()
}

/// Measures of all trees, and of each species in the order of names.
fn by_species(trees: &[TreeRecord], plot: &Plot) -> Result<Vec<StandRow>, Error> {
    let mut species: BTreeMap<&str, Vec<&TreeRecord>> = BTreeMap::new();
    for tree in trees {
        species.entry(&tree.species).or_default().push(tree);
    }
    let parts = std::iter::once(("all", trees.iter().collect())).chain(species);
    parts
        .map(|(name, trees): (&str, Vec<&TreeRecord>)| {
            Ok(StandRow {
                key: vec![name.to_owned()],
                measures: StandMeasures::of(trees, plot).map_err(Error::of_stage)?,
                more: Vec::new(),
            })
        })
        .collect()
}
