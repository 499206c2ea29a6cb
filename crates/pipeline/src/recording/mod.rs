//! The content of a frame: the robot's pose, the visible scene, and the data for annotations.

pub(crate) mod annotations;
pub mod moment;
pub mod pose;
pub mod scene;
pub(crate) mod seen_area;
pub(crate) mod visible_reach;
