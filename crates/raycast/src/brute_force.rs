//! The oracle, which tests every primitive of every instance, one after the other.

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{Hit, Ray, RayCaster};

use crate::group::Group;
use crate::hit::ResolvedHit;
use crate::intersection::LocalRay;
use crate::nearest::{Nearest, PrimitiveHit, PrimitiveRef, Rank};

/// A caster without any acceleration, which tests every primitive: the oracle of
/// [`RayScene`](crate::RayScene).
///
/// Both decide hits by the same f64 arithmetic, so their results are equal to the bit, within the
/// limit of coordinates that is documented there.
#[derive(Clone, Debug)]
pub struct BruteForce {
    groups: Vec<(Vec3, Arc<Group>)>,
}

impl BruteForce {
    /// Places groups, as [`RayScene::new`](crate::RayScene::new) does.
    #[must_use]
    pub fn new(groups: Vec<(Vec3, Arc<Group>)>) -> Self {
        Self { groups }
    }
}

impl RayCaster for BruteForce {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let mut nearest = Nearest::of(ray);
        for (g, (offset, group)) in self.groups.iter().enumerate() {
            let in_group = LocalRay::in_group(ray, *offset);
            for (i, (instance, blas)) in group.instances().iter().enumerate() {
                let Some(pose) = group.pose(i) else { continue };
                let local = pose.local(&in_group);
                for primitive in 0..blas.primitive_count() as u32 {
                    if let Some(intersection) = blas.intersect(primitive, &local) {
                        let rank = Rank {
                            object: instance.object,
                            group: g as u32,
                            instance: i as u32,
                            primitive,
                        };
                        nearest.offer(PrimitiveHit {
                            rank,
                            intersection,
                            primitive: PrimitiveRef::NONE,
                        });
                    }
                }
            }
        }
        Hit::of(&self.groups, &nearest)
    }
}
