//! The instances of one chunk, ready for rays.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use nemoral_scene::{Bounds, Instance, InstanceGroup, InstancePlace, ObjectId};

use crate::blas::{Blas, Source};
use crate::bvh8::{self, BuildEffort};
use crate::intersection::LocalRay;
use crate::nearest::{Nearest, Rank};
use crate::node::{LaneRay, Node, bounds_of, extent};
use crate::quantization_grid::QuantizationGrid;
use crate::simd::Isa;
use crate::traversal::{LeafVisitor, Stack, traverse};

/// The instances of one chunk with their acceleration structure, in the chunk's own frame.
///
/// A group is built once, kept as long as its chunk, and placed in the scene of each frame by a
/// [`RayScene`](crate::RayScene).
#[derive(Debug)]
pub struct Group {
    instances: Vec<(Instance, Arc<Blas>)>,
    /// `None` where the linear map cannot be inverted; such an instance is flat and never hit.
    poses: Vec<Option<Pose>>,
    parts: Vec<InstancePart>,
    /// The boxes of the parts.
    pub(crate) boxes: Vec<Bounds>,
    pub(crate) nodes: Vec<Node>,
    /// `None` if there is nothing to hit.
    pub(crate) root: Option<u32>,
    pub(crate) bounds: Bounds,
}

/// The transform from the group's frame to an instance's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pose {
    pub(crate) position: DVec3,
    pub(crate) inverse: DMat3,
}

/// A part of an instance: a leaf of the group's tree.
///
/// Two lines of a processor's cache hold all that it takes to get to the shape.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct InstancePart {
    pose: Pose,
    blas: Arc<Blas>,
    object: ObjectId,
    instance: u32,
    /// The root of the part in the instance's [`Blas`].
    root: u32,
}

/// A reference to a part of an instance, with all that a ray needs to enter it.
pub(crate) struct InstanceRef<'a> {
    pub(crate) pose: &'a Pose,
    pub(crate) blas: &'a Blas,
    /// The root of the part in the shape's tree.
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

    /// The position is subtracted first, because the other order loses digits by cancellation at a
    /// hundred metres.
    #[inline(always)]
    pub(crate) fn local(&self, ray: &LocalRay) -> LocalRay {
        LocalRay {
            origin: self.inverse * (ray.origin - self.position),
            direction: self.inverse * ray.direction,
        }
    }

    /// A normal of the instance in the group's frame, not of unit length. It is transformed by the
    /// inverse transpose, which keeps the shape's side in mirrored instances too.
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
    /// Prepares instances of shapes. Their order gives their numbers, which decide ties in distance
    /// between hits of one object: the caller sorts.
    ///
    /// An instance whose linear map is singular or not finite is never hit.
    #[must_use]
    pub fn build(shapes: Vec<(InstancePlace, Arc<Blas>)>) -> Self {
        let instance = |(place, blas): (InstancePlace, Arc<Blas>)| {
            let instance = Instance::new(Arc::clone(blas.prototype()), place);
            (instance, blas)
        };
        let instances: Vec<(Instance, Arc<Blas>)> = shapes.into_iter().map(instance).collect();
        let poses: Vec<Option<Pose>> = instances.iter().map(|(i, _)| Pose::of(i)).collect();
        let mut parts = Vec::new();
        let mut boxes = Vec::new();
        for (i, ((instance, blas), pose)) in instances.iter().zip(&poses).enumerate() {
            let Some(pose) = pose else { continue };
            for part in blas.parts() {
                parts.push(InstancePart {
                    pose: *pose,
                    blas: Arc::clone(blas),
                    object: instance.object,
                    instance: i as u32,
                    root: part.root,
                });
                boxes.push(placed(&part.boxes, instance));
            }
        }
        let mut nodes = Vec::new();
        let root =
            (!boxes.is_empty()).then(|| bvh8::build(&boxes, 1, EFFORT, &mut nodes, |e| e[0]));
        let bounds = boxes.iter().fold(Bounds::EMPTY, |a, b| a.union(*b));
        Self {
            instances,
            poses,
            parts,
            boxes,
            nodes,
            root,
            bounds,
        }
    }

    /// The memory that the instances and their tree take, bytes, without the shapes that they
    /// share.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>()
            + size_of_val(self.instances.as_slice())
            + size_of_val(self.poses.as_slice())
            + size_of_val(self.parts.as_slice())
            + size_of_val(self.boxes.as_slice())
            + size_of_val(self.nodes.as_slice())
    }

    /// The instances in order of their numbers, each with its shape.
    #[must_use]
    pub fn instances(&self) -> &[(Instance, Arc<Blas>)] {
        &self.instances
    }

    pub(crate) fn pose(&self, instance: usize) -> Option<&Pose> {
        self.poses[instance].as_ref()
    }

    /// The box of everything that can be hit; `None` if there is nothing.
    #[must_use]
    pub fn bounds(&self) -> Option<Bounds> {
        self.root.map(|_| self.bounds)
    }

    /// Offers the hits of a ray with the group's instances to its search.
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
        let lanes = LaneRay::new(ray, extent(&self.bounds), &QuantizationGrid::IDENTITY);
        let parts = Parts::<ANY> {
            group: self,
            number,
            ray,
        };
        traverse::<I, _, _, ANY>(isa, (&self.nodes, root), &lanes, &parts, nearest, stack);
    }

    /// Offers the hits of a ray, given in the group's frame, with one part of an instance.
    #[inline(always)]
    pub(crate) fn enter<I: Isa, const ANY: bool>(
        &self,
        isa: I,
        number: u32,
        part: u32,
        ray: &LocalRay,
        nearest: &mut Nearest,
        stack: &mut Stack,
    ) {
        let instance = self.instance_ref(number, part);
        let local = instance.pose.local(ray);
        (instance.blas).cast::<I, ANY>(isa, instance.root, &local, instance.source, nearest, stack);
    }

    /// The part with a number in this group; `number` is the group's own.
    #[inline(always)]
    pub(crate) fn instance_ref(&self, number: u32, part_number: u32) -> InstanceRef<'_> {
        let part = &self.parts[part_number as usize];
        let rank = Rank {
            object: part.object,
            group: number,
            instance: part.instance,
            primitive: 0,
        };
        InstanceRef {
            pose: &part.pose,
            blas: &part.blas,
            root: part.root,
            source: Source {
                rank,
                part: part_number,
            },
        }
    }
}

/// A chunk's tree is traversed by every ray nearby, but must be built within milliseconds.
const EFFORT: BuildEffort = BuildEffort {
    passes: 1,
    share: 1.0,
};

/// The leaves of a group's tree: parts of instances.
struct Parts<'a, const ANY: bool> {
    group: &'a Group,
    number: u32,
    ray: &'a LocalRay,
}

impl<const ANY: bool> LeafVisitor for Parts<'_, ANY> {
    #[inline(always)]
    fn visit<I: Isa>(&self, isa: I, leaf: u32, nearest: &mut Nearest, stack: &mut Stack) {
        let Self { group, number, ray } = *self;
        group.enter::<I, ANY>(isa, number, leaf, ray, nearest, stack);
    }
}

/// The box in the group's frame around boxes of an instance.
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
