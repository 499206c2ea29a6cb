//! Requests: layered, checked, with errors that point at the line.

mod devices;
mod load;
mod pages;
mod presets;
mod ranges;
mod schema;
mod sections;
mod stands;
mod validate;

pub(crate) use devices::LIGHT_M_PER_NS;
pub use load::{ConfigError, ConfigErrors, Layers, Place};
pub use pages::{annotated_toml, json_schema, reference_page};
pub use presets::Preset;
pub use schema::{Allowed, KeySpec, SectionSpec};
pub use sections::*;
pub(crate) use validate::sensor_name;
