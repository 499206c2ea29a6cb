//! Requests: layered, checked, with errors that point at the line.

mod load;
mod pages;
mod presets;
mod schema;
mod sections;
mod validate;

pub use load::{ConfigError, ConfigErrors, Layers, Place};
pub use pages::{annotated_toml, json_schema, reference_page};
pub use presets::Preset;
pub use schema::{Allowed, KeySpec, SectionSpec};
pub use sections::*;
