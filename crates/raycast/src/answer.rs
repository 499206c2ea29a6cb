//! From the nearest primitive to what a sensor asks of it.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use nemoral_scene::{Hit, MaterialId, SurfaceHit};

use crate::group::Group;
use crate::nearest::Nearest;
use crate::surface;

/// What is to be known of a hit.
pub(crate) trait Answer: Copy + Send + Sync {
    /// It, if anything is hit.
    fn of(groups: &[(Vec3, Arc<Group>)], nearest: &Nearest) -> Option<Self>;
}

impl Answer for Hit {
    fn of(groups: &[(Vec3, Arc<Group>)], nearest: &Nearest) -> Option<Self> {
        let found = nearest.found()?;
        let (rank, m) = (found.rank, &found.meeting);
        let group = &groups[rank.group as usize].1;
        let (instance, blas) = &group.instances()[rank.instance as usize];
        let pose = group.pose(rank.instance as usize)?;
        let t = nearest.t();
        Some(surface::hit(blas, instance, pose, rank.primitive, t, m))
    }
}

/// From what casting has just looked at: the block holds the primitive's edges.
impl Answer for SurfaceHit {
    fn of(groups: &[(Vec3, Arc<Group>)], nearest: &Nearest) -> Option<Self> {
        let found = nearest.found()?;
        let place = found.place;
        let door = (groups[found.rank.group as usize].1).door(found.rank.group, place.entry);
        let (block, lane) = (door.blas.block(place.block)?, place.lane as usize);
        let [a, b, c] = block.points(lane);
        let normal = if block.is_triangle(lane) {
            (b - a).cross(c - a)
        } else {
            b.cross(c)
        };
        let normal = door.pose.normal_to_group(normal).try_normalize();
        let (_, material) = block.primitive(lane);
        Some(Self {
            distance_m: nearest.t(),
            geometric_normal: normal.unwrap_or(DVec3::Z).as_vec3(),
            material: MaterialId(material),
            object: found.rank.object,
        })
    }
}
