//! What a world is made of, from a config: its ground and plants, and the robot's sensors.

pub mod assets;
pub mod cameras;
pub mod ground;
pub mod lidars;
pub(crate) mod recipe;
