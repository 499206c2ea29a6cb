//! A survey as files.

use std::collections::BTreeMap;
use std::path::Path;

use nemoral_export::{RasterMap, RasterValues, check_folder, to_geotiff};
use nemoral_files::{Folder, InnerPath};
use nemoral_mensuration::{
    Plot, StandMeasures, crowns_geojson, profile_csv, stand_csv, visible_crowns,
};
use nemoral_scene::TreeRecord;
use nemoral_scene::glam::{DVec2, DVec3};
use serde_json::json;

use super::{Survey, SurveyParams};
use crate::export::Rectangle;
use crate::{Error, Recorder};

/// How the trees of an inventory are counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InventoryParams {
    /// What is surveyed.
    pub survey: SurveyParams,
    /// The callipering limit of measures per hectare: thinner trees do not count, metres.
    pub min_dbh_m: f64,
    /// Side of the square plots that the rectangle is cut into, metres, if it is.
    pub plot_m: Option<f64>,
}

impl Default for InventoryParams {
    /// Trees of 7 cm and more count, as in most of Europe's inventories, and there are no plots.
    fn default() -> Self {
        Self {
            survey: SurveyParams::default(),
            min_dbh_m: 0.07,
            plot_m: None,
        }
    }
}

impl Recorder {
    /// Surveys a rectangle of the world and writes what a forest inventory of it would find into a
    /// folder, which must be new or empty:
    ///
    /// - `trees.csv`: the trees whose feet are in it, as in a data set;
    /// - `stand.csv`: measures per hectare, of all trees and of each species; `plots.csv`: those of
    ///   each plot, if there are any;
    /// - `profile.csv`: leaf and wood area by height;
    /// - `dtm.tif`, `dsm.tif`, `chm.tif`: heights of the ground and the surface, and of the surface
    ///   above the ground; `crowns.tif`: whose crown is highest, by `image_id`;
    /// - `crowns.geojson`: the same crowns as polygons with what is known of their trees;
    /// - `inventory.json`: what was surveyed and how. It appears last.
    ///
    /// Maps, polygons and plots are in the coordinates of the site's files, if the forest has a
    /// site; those of `trees.csv` are the world's.
    ///
    /// # Errors
    /// As [`Recorder::survey`]; if the folder has something in it, a plot is not a whole part of
    /// the rectangle's sides, or a file cannot be written.
    pub fn write_inventory(
        &self,
        [low_m, high_m]: [DVec2; 2],
        params: &InventoryParams,
        folder: &Path,
    ) -> Result<Survey, Error> {
        check_folder(folder).map_err(|e| Error::request(e.to_string()))?;
        let plots = params.plot_m.map(|side_m| plots(low_m, high_m, side_m));
        let plots = plots.transpose()?;
        let extent_m = high_m - low_m;
        let whole = Plot {
            area_m2: extent_m.x * extent_m.y,
            min_dbh_m: params.min_dbh_m,
        };
        // A wrong limit is told before anything grows.
        Rectangle::new(low_m, high_m)?;
        measures(&[], &whole)?;
        let survey = self.survey(low_m, high_m, &params.survey)?;
        let site = &self.sequence().config.site;
        let origin_m = DVec3::new(site.origin_x_m, site.origin_y_m, site.terrain.origin_z_m);
        let epsg = None;
        let out = Out {
            folder: Folder::new(folder),
            origin_m,
            epsg,
        };
        out.folder.create_root()?;
        out.put("trees.csv", nemoral_dataset::trees_csv(&survey.trees)?)?;
        let stand = by_species(&survey.trees, &whole)?;
        out.put("stand.csv", stand_csv(&["species"], &stand))?;
        if let Some(plots) = &plots {
            let rows = of_plots(&survey.trees, plots, params.min_dbh_m, origin_m.truncate())?;
            let keys = ["west_m", "south_m", "east_m", "north_m"];
            out.put("plots.csv", stand_csv(&keys, &rows))?;
        }
        out.put("profile.csv", profile_csv(&survey.profile))?;
        out.maps(&survey)?;
        let crowns = visible_crowns(&survey.maps);
        let crowns = crowns_geojson(&crowns, &survey.trees, origin_m.truncate(), epsg);
        out.put("crowns.geojson", crowns)?;
        let about = json!({
            "generator": concat!("nemoral ", env!("CARGO_PKG_VERSION")),
            "seed": self.sequence().config.seed,
            "region_m": [low_m.x, low_m.y, high_m.x, high_m.y],
            "origin_m": origin_m.to_array(),
            "epsg": epsg,
            "cell_m": params.survey.cell_m,
            "rays_a_side": params.survey.rays_a_side,
            "layer_m": params.survey.layer_m,
            "min_dbh_m": params.min_dbh_m,
            "plot_m": params.plot_m,
            "canopy_cover": survey.maps.cover,
            "leaf_area_index": survey.profile.leaf_area_index(),
        });
        let about = serde_json::to_string_pretty(&about).expect("numbers and text");
        out.put("inventory.json", format!("{about}\n"))?;
        Ok(survey)
    }
}

/// Where files go, and what is added to places of the world on maps.
struct Out {
    folder: Folder,
    origin_m: DVec3,
    epsg: Option<u16>,
}

impl Out {
    fn put(&self, name: &str, content: impl AsRef<[u8]>) -> Result<(), Error> {
        let name = InnerPath::new(name).expect("a plain name");
        Ok(self.folder.put(&name, content.as_ref())?)
    }

    fn maps(&self, survey: &Survey) -> Result<(), Error> {
        let maps = &survey.maps;
        let high = |heights: &[f64]| -> Vec<f32> {
            let of_site = heights.iter().map(|h| (h + self.origin_m.z) as f32);
            of_site.collect()
        };
        let above: Vec<f32> = maps.heights_m().map(|h| h as f32).collect();
        let ids = maps.tops.iter().map(|top| top.to_image_id()).collect();
        for (name, values) in [
            ("dtm.tif", RasterValues::Real(high(&maps.ground_m))),
            ("dsm.tif", RasterValues::Real(high(&maps.surface_m))),
            ("chm.tif", RasterValues::Real(above)),
            ("crowns.tif", RasterValues::Id(ids)),
        ] {
            self.map(survey, name, values)?;
        }
        Ok(())
    }

    fn map(&self, survey: &Survey, name: &str, values: RasterValues) -> Result<(), Error> {
        let grid = &survey.maps.grid;
        let height_m = grid.rows as f64 * grid.cell_m;
        let map = RasterMap {
            north_west_m: grid.south_west_m + self.origin_m.truncate() + DVec2::new(0.0, height_m),
            cell_m: grid.cell_m,
            columns: grid.columns,
            rows: grid.rows,
            values: from_north(values, grid.columns),
            epsg: self.epsg,
        };
        self.put(name, to_geotiff(&map).map_err(Error::of_stage)?)
    }
}

/// Rows from north to south, of rows from south to north.
fn from_north(values: RasterValues, columns: usize) -> RasterValues {
    fn turned<T: Copy>(values: &[T], columns: usize) -> Vec<T> {
        values.chunks(columns).rev().flatten().copied().collect()
    }
    match values {
        RasterValues::Real(values) => RasterValues::Real(turned(&values, columns)),
        RasterValues::Id(values) => RasterValues::Id(turned(&values, columns)),
    }
}

type Rows = Vec<(Vec<String>, StandMeasures)>;

fn measures(trees: &[&TreeRecord], plot: &Plot) -> Result<StandMeasures, Error> {
    let measured = StandMeasures::of(trees.iter().copied(), plot);
    measured.map_err(|e| Error::request(e.to_string()))
}

/// Measures of all trees, and of each species in the order of names.
fn by_species(trees: &[TreeRecord], plot: &Plot) -> Result<Rows, Error> {
    let mut species: BTreeMap<&str, Vec<&TreeRecord>> = BTreeMap::new();
    for tree in trees {
        species.entry(&tree.species).or_default().push(tree);
    }
    let all: Vec<&TreeRecord> = trees.iter().collect();
    let mut rows = vec![(vec!["all".to_owned()], measures(&all, plot)?)];
    for (name, trees) in species {
        rows.push((vec![name.to_owned()], measures(&trees, plot)?));
    }
    Ok(rows)
}

/// South-west and north-east corners of the plots of a rectangle, from south to north, each row
/// from west to east.
fn plots(low_m: DVec2, high_m: DVec2, side_m: f64) -> Result<Vec<[DVec2; 2]>, Error> {
    let grid = nemoral_mensuration::MapGrid::of(low_m, high_m, side_m);
    let grid = grid.map_err(|e| Error::request(format!("plots: {e}")))?;
    let corner = |column: usize, row: usize| {
        grid.south_west_m + DVec2::new(column as f64, row as f64) * side_m
    };
    let row = |row| (0..grid.columns).map(move |column| (column, row));
    let all = (0..grid.rows).flat_map(row);
    Ok(all
        .map(|(column, row)| [corner(column, row), corner(column + 1, row + 1)])
        .collect())
}

fn of_plots(
    trees: &[TreeRecord],
    plots: &[[DVec2; 2]],
    min_dbh_m: f64,
    origin_m: DVec2,
) -> Result<Rows, Error> {
    let row = |&[low_m, high_m]: &[DVec2; 2]| {
        let is_inside = |tree: &&TreeRecord| {
            let foot_m = tree.position_m.truncate();
            foot_m.cmpge(low_m).all() && foot_m.cmplt(high_m).all()
        };
        let inside: Vec<&TreeRecord> = trees.iter().filter(is_inside).collect();
        let extent_m = high_m - low_m;
        let plot = Plot {
            area_m2: extent_m.x * extent_m.y,
            min_dbh_m,
        };
        let corners = [low_m + origin_m, high_m + origin_m];
        let key = corners.iter().flat_map(|c| c.to_array());
        Ok((
            key.map(|m| m.to_string()).collect(),
            measures(&inside, &plot)?,
        ))
    };
    plots.iter().map(row).collect()
}
