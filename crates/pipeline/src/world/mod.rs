//! The content of a world, made from a config: its ground and plants, and the robot's sensors.

pub mod assets;
pub mod balance;
pub(crate) mod banks;
pub mod cameras;
pub mod chunk_geometry;
pub mod chunk_ground;
pub(crate) mod climbers;
pub(crate) mod closed_vegetation;
pub(crate) mod communities;
pub(crate) mod conditions;
pub(crate) mod culverts;
pub(crate) mod deadwood;
pub(crate) mod edge_trees;
pub mod flora;
pub mod ground;
pub(crate) mod ground_mesh;
pub(crate) mod ground_recipe;
pub(crate) mod library_recipe;
pub mod lidars;
pub mod litter;
pub(crate) mod low_plants;
pub(crate) mod meadows;
pub(crate) mod models;
pub(crate) mod object_reach;
pub(crate) mod object_sites;
pub(crate) mod outcrops;
pub mod patch;
pub(crate) mod placement;
pub(crate) mod plot;
pub(crate) mod puddles;
pub(crate) mod sky_params;
pub(crate) mod snow;
pub(crate) mod stream_stones;
pub(crate) mod surface_roots;
pub(crate) mod terrain_with_trails;
pub mod trajectory;
pub(crate) mod trajectory_recipe;
pub mod uncovered;
pub mod water;
pub(crate) mod ways;
pub(crate) mod windthrow;

/// The name of the sensor whose table is at `path`: its last part.
pub(crate) fn sensor_name(path: &str) -> &str {
    path.rsplit_once('.').map_or(path, |(_, name)| name)
}
