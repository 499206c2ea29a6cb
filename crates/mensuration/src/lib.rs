//! This crate measures a virtual forest as an inventory would measure a real one, without its
//! errors of instruments and models: what programs for plots, airborne and terrestrial scans should
//! find.
//!
//! - [`StandMeasures`]: trees, basal area, diameters, heights and volume per hectare.
//! - [`LyingDeadwood`]: logs and their volume per hectare, by stage of decay.
//! - [`CanopyMaps`]: ground, surface and height of the canopy on a grid, its cover, and whose crown
//!   is the top, by vertical rays.
//! - [`PlotCanopy`]: cover and heights of the canopy in plots of any shape.
//! - [`visible_crowns`]: those crowns as polygons.
//! - [`AreaProfile`]: leaf and wood area by height above the ground.
//! - [`stand_csv`], [`deadwood_stand_csv`], [`profile_csv`], [`crowns_geojson`] and
//!   [`stems_geojson`]: all of that as text.
//!
//! ```
//! use nemoral_mensuration::{Plot, StandMeasures};
//! # use nemoral_scene::{ChunkCoord, ObjectId, TreeRecord, glam::DVec3};
//! # let tree = |item: u16, dbh_m: f64, height_m: f64| TreeRecord {
//! #     object: ObjectId::new(ChunkCoord::new(0, 0), item).unwrap(),
//! #     species: "beech".to_owned(),
//! #     position_m: DVec3::ZERO,
//! #     dbh_m,
//! #     height_m,
//! #     crown_base_m: 10.0,
//! #     crown_radius_m: 3.0,
//! #     leaf_area_m2: 300.0,
//! #     stem_volume_m3: 1.2,
//! #     wood_volume_m3: Some(1.4),
//! #     merchantable_volume_m3: Some(1.25),
//! #     lean_rad: 0.0,
//! #     age_class: "mature".to_owned(),
//! #     alive: true,
//! #     field_id: String::new(),
//! # };
//! let trees = [tree(1, 0.3, 22.0), tree(2, 0.4, 26.0)];
//! let plot = Plot { area_m2: 100.0, min_dbh_m: 0.07, min_deadwood_diameter_m: 0.1 };
//! let stand = StandMeasures::of(&trees, &plot)?;
//! assert_eq!(stand.trees_per_ha, 200.0);
//! assert!((stand.basal_area_m2_ha - 19.635).abs() < 1e-3);
//! // A hundredth of a hectare has one of the 100 thickest trees per hectare.
//! assert_eq!(stand.dominant_height_m, Some(26.0));
//! # Ok::<(), nemoral_scene::ParamError>(())
//! ```
//!
//! World axes are x east, y north, z up; lengths are metres.

mod area_profile;
mod canopy_maps;
mod lying_deadwood;
mod map_grid;
mod plot_canopy;
mod stand;
mod tables;
mod visible_crowns;

pub use area_profile::{AreaProfile, ShapeAreas};
pub use canopy_maps::{CanopyCell, CanopyMaps, CanopyScene, CellRays};
pub use lying_deadwood::{DeadwoodMeasures, LyingDeadwood};
pub use map_grid::MapGrid;
pub use plot_canopy::PlotCanopy;
pub use stand::{Plot, StandMeasures};
pub use tables::{
    MapFrame, StandRow, crowns_geojson, deadwood_stand_csv, profile_csv, stand_csv, stems_geojson,
};
pub use visible_crowns::{CrownPolygon, VisibleCrown, visible_crowns};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
