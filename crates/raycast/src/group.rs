//! The instances of one chunk, ready for rays.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use nemoral_scene::{Bounds, Instance, InstanceGroup, ObjectId};

use crate::blas::{Blas, Source};
use crate::exact::LocalRay;
use crate::grid::Grid;
use crate::nearest::{Nearest, Rank};
use crate::node::{LaneRay, Node, bounds_of, extent};
use crate::simd::Isa;
use crate::stack::{Leaves, Stack, walk};
use crate::tree::{self, Effort};

/// The instances of one chunk with their acceleration structure, in the chunk's own frame: made
/// once a chunk, kept while the chunk is, placed in the scene of each frame by a
/// [`Forest`](crate::Forest).
#[derive(Debug)]
pub struct Group {
    instances: Vec<(Instance, Arc<Blas>)>,
    /// `None` where the linear map cannot be inverted: such an instance is flat and never hit.
    poses: Vec<Option<Pose>>,
    entries: Vec<Entry>,
    /// Of the entries.
    pub(crate) boxes: Vec<Bounds>,
    pub(crate) nodes: Vec<Node>,
    /// `None` if there is nothing to hit.
    pub(crate) root: Option<u32>,
    pub(crate) bounds: Bounds,
}

/// From the group's frame to an instance's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pose {
    pub(crate) position: DVec3,
    pub(crate) inverse: DMat3,
}

/// A part of an instance: a leaf of the group's tree.
#[derive(Clone, Copy, Debug)]
struct Entry {
    pose: Pose,
    object: ObjectId,
    instance: u32,
    /// In the instance's [`Blas`].
    root: u32,
}

/// What a ray needs to enter a part of an instance.
pub(crate) struct Door<'a> {
    pub(crate) pose: &'a Pose,
    pub(crate) blas: &'a Blas,
    /// In the shape.
    pub(crate) root: u32,
    pub(crate) source: Source,
}

impl Pose {
    fn of(instance: &Instance) -> Option<Self> {
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

    /// A normal of the instance in the group's frame, not of unit length: by the inverse transpose,
    /// which keeps the shape's side in mirrored instances too.
    pub(crate) fn normal_to_group(&self, normal: DVec3) -> DVec3 {
        self.inverse.transpose() * normal
    }
}

impl InstanceGroup for Group {
    fn instances(&self) -> Box<dyn ExactSizeIterator<Item = &Instance> + '_> {
        Box::new(self.instances.iter().map(|(instance, _)| instance))
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
        let poses: Vec<Option<Pose>> = instances.iter().map(|(i, _)| Pose::of(i)).collect();
        let mut entries = Vec::new();
        let mut boxes = Vec::new();
        for (i, ((instance, blas), pose)) in instances.iter().zip(&poses).enumerate() {
            let Some(pose) = pose else { continue };
            for part in blas.parts() {
                entries.push(Entry {
                    pose: *pose,
                    object: instance.object,
                    instance: i as u32,
                    root: part.root,
                });
                boxes.push(placed(&part.boxes, instance));
            }
        }
        let mut nodes = Vec::new();
        let root =
            (!boxes.is_empty()).then(|| tree::build(&boxes, 1, EFFORT, &mut nodes, |e| e[0]));
        let bounds = boxes.iter().fold(Bounds::EMPTY, |a, b| a.union(*b));
        Self {
            instances,
            poses,
            entries,
            boxes,
            nodes,
            root,
            bounds,
        }
    }

    /// The instances in order of their numbers.
    #[must_use]
    pub fn instances(&self) -> &[(Instance, Arc<Blas>)] {
        &self.instances
    }

    pub(crate) fn pose(&self, instance: usize) -> Option<&Pose> {
        self.poses[instance].as_ref()
    }

    /// The box of all that can be hit; `None` if there is nothing.
    pub(crate) fn bounds(&self) -> Option<Bounds> {
        self.root.map(|_| self.bounds)
    }

    /// Offers the group's hits.
    #[inline(always)]
    pub(crate) fn cast<I: Isa, const ANY: bool>(
        &self,
        isa: I,
        number: u32,
        ray: &LocalRay,
        nearest: &mut Nearest,
        stack: &mut Stack,
    ) {
        let Some(root) = self.root else { return };
        let lanes = LaneRay::new(ray, extent(&self.bounds), &Grid::NONE);
        let parts = Parts::<ANY> {
            group: self,
            number,
            ray,
        };
        walk::<I, _, _, ANY>(isa, (&self.nodes, root), &lanes, &parts, nearest, stack);
    }

    /// Offers the hits of an entry. The ray is in the group's frame.
    #[inline(always)]
    pub(crate) fn enter<I: Isa, const ANY: bool>(
        &self,
        isa: I,
        number: u32,
        entry: u32,
        ray: &LocalRay,
        nearest: &mut Nearest,
        stack: &mut Stack,
    ) {
        let door = self.door(number, entry);
        let local = door.pose.local(ray);
        (door.blas).cast::<I, ANY>(isa, door.root, &local, door.source, nearest, stack);
    }

    /// How to enter a part. `number` is the group's.
    #[inline(always)]
    pub(crate) fn door(&self, number: u32, entry_number: u32) -> Door<'_> {
        let entry = &self.entries[entry_number as usize];
        let (_, blas) = &self.instances[entry.instance as usize];
        let rank = Rank {
            object: entry.object,
            group: number,
            instance: entry.instance,
            primitive: 0,
        };
        Door {
            pose: &entry.pose,
            blas,
            root: entry.root,
            source: Source {
                rank,
                entry: entry_number,
            },
        }
    }
}

/// A chunk's tree is met by every ray nearby, and must be there within milliseconds.
const EFFORT: Effort = Effort {
    passes: 1,
    share: 1.0,
};

/// The parts of instances.
struct Parts<'a, const ANY: bool> {
    group: &'a Group,
    number: u32,
    ray: &'a LocalRay,
}

impl<const ANY: bool> Leaves for Parts<'_, ANY> {
    #[inline(always)]
    fn visit<I: Isa>(&self, isa: I, leaf: u32, nearest: &mut Nearest, stack: &mut Stack) {
        let Self { group, number, ray } = *self;
        group.enter::<I, ANY>(isa, number, leaf, ray, nearest, stack);
    }
}

/// The box, in the group's frame, of boxes of an instance.
fn placed(boxes: &[Bounds], instance: &Instance) -> Bounds {
    let linear = instance.linear.as_dmat3();
    let position = instance.position_m.as_dvec3();
    let size = DMat3::from_cols(
        linear.x_axis.abs(),
        linear.y_axis.abs(),
        linear.z_axis.abs(),
    );
    bounds_of(boxes.iter().flat_map(|b| {
        let (min, max) = (b.min.as_dvec3(), b.max.as_dvec3());
        let centre = linear * ((min + max) / 2.0) + position;
        let half = size * ((max - min) / 2.0);
        [centre - half, centre + half]
    }))
}
