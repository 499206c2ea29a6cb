//! What a frame is recorded from: the robot's pose, the visible scene, and what pictures are
//! annotated from.

pub(crate) mod annotations;
pub mod pose;
pub mod scene;
