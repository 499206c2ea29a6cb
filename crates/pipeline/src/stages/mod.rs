//! Stage adapters: each wraps one call of a stage crate for the plan.

pub mod assets;
pub mod chunk;
pub mod frame;
pub mod ground;
pub mod guide;
mod looks;
pub mod openness;
pub mod placement;
pub mod seedlings;
pub mod sensors;
pub(crate) mod sky_image;
pub mod things;
pub mod truth;
pub mod undergrowth;
