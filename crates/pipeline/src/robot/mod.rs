//! The robot: where it goes, and how its body lies on the ground.

mod body;
mod file;
mod guide;
mod stations;
mod wander;

pub use body::{Body, PoseTrack};
pub use file::read_poses;
pub use guide::{Guide, GuideStage, Heading, Land};
pub use wander::{Obstacle, Wander};
