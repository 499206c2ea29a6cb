//! The oracle: every primitive of every instance, one after the other.

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{Hit, PlacedGroup, Ray, RayCaster};

use crate::answer::Answer;
use crate::forest::{in_group, placed};
use crate::group::Group;
use crate::nearest::{Found, Nearest, Place, Rank};

/// What a [`Forest`](crate::Forest) must answer, without any acceleration: a loop over everything.
///
/// Both decide hits by the same f64 arithmetic, so their answers are equal to the bit.
#[derive(Clone, Debug)]
pub struct BruteForce {
    groups: Vec<(Vec3, Arc<Group>)>,
}

impl BruteForce {
    /// Takes what [`Forest::new`](crate::Forest::new) takes.
    #[must_use]
    pub fn new(groups: Vec<(Vec3, Arc<Group>)>) -> Self {
        Self { groups }
    }
}

impl RayCaster for BruteForce {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let mut nearest = Nearest::of(ray);
        for (g, (offset, group)) in self.groups.iter().enumerate() {
            let in_group = in_group(ray, *offset);
            for (i, (instance, blas)) in group.instances().iter().enumerate() {
                let Some(pose) = group.pose(i) else { continue };
                let local = pose.local(&in_group);
                for primitive in 0..blas.primitive_count() as u32 {
                    if let Some(m) = blas.meet(primitive, &local) {
                        let rank = Rank {
                            object: instance.object,
                            group: g as u32,
                            instance: i as u32,
                            primitive,
                        };
                        nearest.offer(Found {
                            rank,
                            meeting: m,
                            place: Place::NONE,
                        });
                    }
                }
            }
        }
        Hit::of(&self.groups, &nearest)
    }

    fn placed_groups(&self) -> Option<Vec<PlacedGroup>> {
        Some(placed(&self.groups))
    }
}
