//! Requests: layered, checked, with errors that point at the line.

mod devices;
mod input_path;
mod load;
mod pages;
mod presets;
mod ranges;
mod schema;
mod sections;
mod stands;
mod validate;
mod words;

pub(crate) use devices::LIGHT_M_PER_NS;
pub use input_path::InputPath;
pub(crate) use load::most_bytes;
pub use load::{ConfigError, ConfigErrors, Layers, Place};
pub use pages::{annotated_toml, json_schema, reference_page};
pub use presets::Preset;
pub use schema::{Allowed, KeySpec, SectionSpec};
pub use sections::*;
pub(crate) use validate::sensor_name;
