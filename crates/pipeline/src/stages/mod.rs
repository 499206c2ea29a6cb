//! Stage adapters: each wraps one call of a stage crate for the plan.

pub mod annotations;
pub mod assets;
pub mod balance;
pub mod deadwood;
pub mod frame;
pub mod ground;
pub mod ground_occlusion;
pub mod litter;
pub mod object_geometry;
pub mod placement;
pub mod scene_objects;
pub mod sensors;
pub mod sky_view_factor;
pub mod trajectory;
pub mod undergrowth;
pub mod undergrowth_geometry;
