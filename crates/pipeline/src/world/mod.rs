//! The content of a world, made from a config: its ground and plants, and the robot's sensors.

pub mod assets;
pub mod balance;
pub(crate) mod built_ways;
pub mod cameras;
pub mod chunk_geometry;
pub(crate) mod climbers;
pub(crate) mod closed_vegetation;
pub(crate) mod deadwood;
pub mod flora;
pub mod ground;
pub(crate) mod ground_mesh;
pub(crate) mod ground_recipe;
pub mod lidars;
pub(crate) mod low_plants;
pub(crate) mod models;
pub(crate) mod object_sites;
pub mod patch;
pub(crate) mod placement;
pub(crate) mod puddles;
pub(crate) mod recipe;
pub(crate) mod stream_stones;
pub(crate) mod thrown;
pub mod trajectory;
pub(crate) mod trajectory_recipe;
pub mod uncovered;
pub mod water;
