//! The content of a frame: the robot's pose, the visible scene, and the data for annotations.

pub(crate) mod annotations;
pub mod pose;
pub mod recording_context;
pub mod scene;
pub(crate) mod seen_area;
pub(crate) mod visible_reach;
