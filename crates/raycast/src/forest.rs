//! A frame's scene.

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{Hit, Ray, RayCaster};

use crate::brute::BruteForce;
use crate::group::Group;

/// A frame's scene: groups placed by their offsets, and a small tree over their roots, the only
/// thing that is made anew for a frame.
#[derive(Clone, Debug)]
pub struct Forest {
    linear: BruteForce,
}

impl Forest {
    /// Places groups: each with the offset, in metres, of its frame in the scene.
    #[must_use]
    pub fn new(groups: Vec<(Vec3, Arc<Group>)>) -> Self {
        Self {
            linear: BruteForce::new(groups),
        }
    }
}

impl RayCaster for Forest {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        self.linear.closest_hit(ray)
    }
}
