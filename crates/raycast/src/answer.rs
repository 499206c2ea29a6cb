//! From the nearest primitive to what a sensor asks of it.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use nemoral_scene::{Hit, SurfaceHit};

use crate::group::Group;
use crate::nearest::{Found, Nearest};
use crate::surface;

/// What is to be known of a hit.
pub(crate) trait Answer: Copy + Send + Sync {
    /// It, if anything is hit.
    fn of(groups: &[(Vec3, Arc<Group>)], nearest: &Nearest) -> Option<Self>;
}

impl Answer for Hit {
    fn of(groups: &[(Vec3, Arc<Group>)], nearest: &Nearest) -> Option<Self> {
        let found = nearest.found()?;
        let group = &groups[found.rank.group as usize].1;
        let number = found.rank.instance as usize;
        let (instance, blas) = &group.instances()[number];
        surface::hit(blas, instance, group.pose(number)?, found, nearest.t())
    }
}

impl Answer for SurfaceHit {
    fn of(groups: &[(Vec3, Arc<Group>)], nearest: &Nearest) -> Option<Self> {
        let Found { rank, place, .. } = nearest.found()?;
        let door = (groups[rank.group as usize].1).door(rank.group, place.entry);
        let (shape, material) = door.blas.shape_at(rank.primitive, place)?;
        let [u, v] = shape.edges();
        let normal = door.pose.normal_to_group(u.cross(v)).try_normalize();
        Some(Self {
            distance_m: nearest.t(),
            geometric_normal: normal.unwrap_or(DVec3::Z).as_vec3(),
            material,
            object: rank.object,
        })
    }
}
