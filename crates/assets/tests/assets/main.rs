//! Tests of grown trees, plants, litter, logs and their textures, in one program.

mod budgets;
mod climbers;
mod common;
mod communities;
mod deadwood;
mod default_library;
mod edge_trees;
mod litter;
mod material_properties;
mod measured;
mod plant_properties;
mod properties;
mod seasons;
mod seedlings;
mod species;
mod structure;
mod textures;
mod trees;
