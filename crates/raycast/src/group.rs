//! The instances of one chunk, ready for rays.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use nemoral_scene::Instance;

use crate::blas::Blas;
use crate::exact::LocalRay;

/// The instances of one chunk with their acceleration structure, in the chunk's own frame: made
/// once a chunk, kept while the chunk is, placed in the scene of each frame by a [`Forest`](crate::Forest).
#[derive(Debug)]
pub struct Group {
    instances: Vec<(Instance, Arc<Blas>)>,
    /// `None` where the linear map cannot be inverted: such an instance is flat and never hit.
    poses: Vec<Option<Pose>>,
}

/// From the group's frame to an instance's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pose {
    pub(crate) position: DVec3,
    pub(crate) inverse: DMat3,
}

impl Pose {
    pub(crate) fn of(instance: &Instance) -> Option<Self> {
        let linear = instance.linear.as_dmat3();
        let inverse = linear.inverse();
        let sound =
            linear.determinant() != 0.0 && inverse.is_finite() && instance.position_m.is_finite();
        sound.then(|| Self {
            position: instance.position_m.as_dvec3(),
            inverse,
        })
    }

    /// The position is subtracted first: the other order cancels at a hundred metres.
    #[inline(always)]
    pub(crate) fn local(&self, ray: &LocalRay) -> LocalRay {
        LocalRay {
            origin: self.inverse * (ray.origin - self.position),
            direction: self.inverse * ray.direction,
        }
    }
}

impl Group {
    /// Prepares instances. Their order gives their numbers, which decide ties in distance between
    /// hits of one object: the caller sorts. An instance is cast at with the [`Blas`] beside it,
    /// which is that of its prototype.
    ///
    /// An instance whose linear map is singular or not finite is never hit.
    #[must_use]
    pub fn build(instances: Vec<(Instance, Arc<Blas>)>) -> Self {
        let poses = instances.iter().map(|(i, _)| Pose::of(i)).collect();
        Self { instances, poses }
    }

    /// The instances in order of their numbers.
    #[must_use]
    pub fn instances(&self) -> &[(Instance, Arc<Blas>)] {
        &self.instances
    }

    pub(crate) fn pose(&self, instance: usize) -> Option<&Pose> {
        self.poses[instance].as_ref()
    }
}
