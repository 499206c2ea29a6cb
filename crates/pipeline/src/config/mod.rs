//! Requests, which are made of layers and checked, with errors that point at the line.

mod balance_targets;
mod camera_model;
mod choices;
mod devices;
mod dotted_keys;
mod errors;
mod file_paths;
mod ground_problems;
mod imu_model;
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
mod site_files;
mod site_inputs;
mod sky_image;
mod source;
mod species_shares;
mod stands;
mod validate;
mod vary;
pub(crate) mod way_model;

pub(crate) use balance_targets::{BalanceTarget, Counts};
pub(crate) use choices::VARIED_SURFACES;
pub use choices::{
    ExposureMode, FlightFollow, LaconteSensor, Look, MeteringMode, MirrorKind, ModelKind,
    OntologyName, PathFormat, RangeNoiseModel, ReturnMode, SpinningHead, TerrainNoise, ToneChoice,
    VignettingModel, WhiteBalanceMode,
};
pub(crate) use devices::LIGHT_M_PER_NS;
pub(crate) use dotted_keys::{is_model, most_bytes};
pub use errors::{ConfigError, ConfigErrors, ErrorLocation};
pub(crate) use file_paths::SEQUENCE_UP;
pub use input_path::InputPath;
pub use key_reference::{annotated_toml, json_schema, reference_page};
pub(crate) use lidar_model::refused_at;
pub(crate) use light_model::sky_params;
pub use load::ConfigLayers;
pub(crate) use model_problems::{LONGEST_LOG_M, SLACK};
pub(crate) use path_model::forward;
pub(crate) use placement_problems::OBJECTS_OF_A_CHUNK_MAX;
pub use presets::Preset;
pub(crate) use quotations::cut;
pub use schema::{AllowedValues, KeySpec, SectionSpec};
pub use sections::*;
pub(crate) use sensors::sensor_name;
pub use sequences::{SequenceConfig, Sequences};
pub use site_files::SiteFiles;
pub(crate) use site_inputs::{extent_m, height_map, lines_m, posts, stems_of};
pub(crate) use sky_image::sky_image;
