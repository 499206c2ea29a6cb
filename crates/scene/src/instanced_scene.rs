//! The port to renderers that draw shapes instead of casting rays at them.

use std::sync::Arc;

use glam::Vec3;

use crate::Instance;

/// Instances that are made and dropped together, such as those of one chunk.
pub trait InstanceGroup: Send + Sync {
    /// The instances in order of their numbers.
    fn instances(&self) -> Box<dyn ExactSizeIterator<Item = &Instance> + '_>;
}

/// A group, and the position of its frame's origin in the scene, metres.
pub type PlacedGroup = (Vec3, Arc<dyn InstanceGroup>);

/// A scene that lists the shapes that it consists of, so that a rasteriser draws what rays are cast
/// at.
///
/// An instance whose linear map is singular or not finite is never hit by a ray, and must not be
/// drawn.
pub trait InstancedScene: Sync {
    /// The groups of the scene in order of their numbers.
    fn placed_groups(&self) -> Vec<PlacedGroup>;
}
