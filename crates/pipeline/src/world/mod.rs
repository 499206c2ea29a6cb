//! What stands in a world: the values of the plan's world and chunk nodes, made from a config.

pub mod assets;
pub mod ground;
pub(crate) mod recipe;
