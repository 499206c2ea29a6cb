//! What a camera's truth maps say of one place.

use glam::Vec3;
use nemoral_scene::{ObjectId, Semantic};

/// The truth at an image position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelTruth {
    /// The fine semantic; [`Semantic::Sky`] where nothing was hit.
    pub semantic: Semantic,
    /// The object that the surface belongs to.
    pub object: ObjectId,
    /// Planar depth: z in the optical frame, metres; 0 where nothing was hit.
    pub depth_m: f32,
    /// Unit normal of the flat primitive in the optical frame, towards the camera; zero where
    /// nothing was hit.
    pub normal: Vec3,
}
