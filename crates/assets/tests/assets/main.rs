//! Tests of grown trees, plants, litter, logs and their textures, in one program.

mod budgets;
mod climbers;
mod common;
mod communities;
mod deadwood;
mod edge_trees;
mod litter;
mod measured;
mod properties;
mod seasons;
mod seedlings;
mod species;
mod structure;
mod textures;
mod trees;
