//! This crate reads and checks requests for a forest: configs in layers (preset, file, settings).
//!
//! Each key is defined once ([`SECTIONS`]), with its default, what is allowed and where the default
//! comes from; the checks, the commented config, the JSON schema and the reference page come from
//! that. A request is refused with all of its errors, which point at the line.
//!
//! ```
//! use nemoral_config::ConfigLayers;
//!
//! let layers = ConfigLayers {
//!     preset: Some("beech".to_owned()),
//!     file: None,
//!     settings: vec!["placement.trees=40".to_owned(), "lidar.device=vlp16".to_owned()],
//! };
//! let config = layers.load()?;
//! assert_eq!((config.placement.trees, config.lidar.wavelength_nm), (40.0, 905));
//!
//! // Each error names the key, its value and what is allowed.
//! let layers = ConfigLayers { settings: vec!["terrain.octaves=99".to_owned()], ..layers };
//! let error = layers.load().expect_err("too many").to_string();
//! assert!(error.contains("terrain.octaves = 99: must be a whole number from 1 to 16"));
//! # Ok::<(), nemoral_config::Error>(())
//! ```
//!
//! - [`ConfigLayers`]: what a user asked for; [`Preset`]: the named requests; [`Config`]: the whole
//!   of a world, a robot and what is recorded.
//! - [`Sequences`]: the configs of a data set, each with what `[vary]` drew for it.
//! - [`InputFiles`]: the files that a config names, each read once, within the limit of its key.
//! - [`annotated_toml`], [`json_schema`], [`reference_page`]: the keys, for people and editors.
//! - [`SiteFiles`]: the config that a user's site suggests; [`SiteSpecies`]: which species it
//!   needs, and how large the trees of its stem map are.
//!
//! What a table means to a stage crate is said by methods of the table, such as
//! [`Lidar::scanner_params`].
//!
//! # Non-goals
//! Growing and recording anything (`nemoral-pipeline`).

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;

mod balance_targets;
mod camera_model;
mod choices;
mod config_errors;
mod devices;
mod dotted_keys;
mod error;
mod file_paths;
mod ground_problems;
mod grown_assets;
mod imu_model;
mod input_files;
mod input_path;
mod key_reference;
mod latin_hypercube;
mod lidar_errors;
mod lidar_model;
mod lidar_problems;
mod light_model;
mod load;
mod model_problems;
mod mount;
mod navigation_model;
mod path_model;
mod placement_problems;
mod presets;
mod quotations;
mod robot_problems;
mod schema;
mod sections;
mod sensor_problems;
mod sensors;
mod sequences;
mod site;
mod site_files;
mod site_inputs;
mod sky_image;
mod source;
mod species_shares;
mod stands;
mod validate;
mod vary;
mod way_model;

pub use balance_targets::{BalanceTarget, CountedSurfaces};
pub use choices::{
    ExposureMode, FlightFollow, LaconteSensor, Look, MeteringMode, MirrorKind, ModelKind,
    OntologyName, PathFormat, RangeNoiseModel, ReturnMode, SpinningHead, TerrainNoise, ToneChoice,
    VignettingModel, WhiteBalanceMode,
};
pub use config_errors::{ConfigError, ConfigErrors, ErrorLocation};
pub use error::Error;
pub use input_files::{InputFile, InputFiles};
pub use input_path::InputPath;
pub use key_reference::{annotated_toml, json_schema, reference_page};
pub use load::ConfigLayers;
pub use model_problems::LONGEST_LOG_M;
pub use presets::Preset;
pub use schema::{AllowedValues, KeySpec, SectionSpec};
pub use sections::*;
pub use sequences::{SequenceConfig, Sequences};
pub use site::{MeasuredStem, MeasuredStems, ModelStem, SiteSpecies};
pub use site_files::SiteFiles;
