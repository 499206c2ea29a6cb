//! A frame's scene.

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{Hit, Ray, RayCaster};

use crate::exact::LocalRay;
use crate::group::Group;
use crate::nearest::Nearest;
use crate::node::{LaneRay, Node, bounds_of, extent};
use crate::simd::{Isa, Kernel, Level};
use crate::stack::{Stack, walk};
use crate::{surface, tree};

/// A frame's scene: groups placed by their offsets, and a small tree over their roots, the only
/// thing that is made anew for a frame.
///
/// The answers are those of [`BruteForce`](crate::BruteForce), to the bit.
#[derive(Clone, Debug)]
pub struct Forest {
    groups: Vec<(Vec3, Arc<Group>)>,
    nodes: Vec<Node>,
    /// `None` if there is nothing to hit.
    root: Option<u32>,
    extent: f32,
    level: Level,
}

impl Forest {
    /// Places groups: each with the offset, in metres, of its frame in the scene. Their order gives
    /// their numbers, which decide ties in distance between hits of one object.
    #[must_use]
    pub fn new(groups: Vec<(Vec3, Arc<Group>)>) -> Self {
        let mut numbers = Vec::new();
        let mut boxes = Vec::new();
        for (i, (offset, group)) in groups.iter().enumerate() {
            if let Some(b) = group.bounds() {
                let at = |p: Vec3| p.as_dvec3() + offset.as_dvec3();
                numbers.push(i as u32);
                boxes.push(bounds_of([at(b.min), at(b.max)]));
            }
        }
        let mut nodes = Vec::new();
        let leaf = |b: &[u32]| numbers[b[0] as usize];
        let root = (!boxes.is_empty()).then(|| tree::build(&boxes, 1, &mut nodes, leaf));
        Self {
            groups,
            nodes,
            root,
            extent: boxes.iter().map(extent).fold(0.0, f32::max),
            level: Level::detect(),
        }
    }

    /// The same scene, cast at without special instructions of the processor: slower, and equal to
    /// the bit.
    #[must_use]
    pub fn portable(mut self) -> Self {
        self.level = Level::Portable;
        self
    }

    /// The nearest hit (with `ANY`: any hit) of a ray.
    #[inline(always)]
    fn cast<I: Isa, const ANY: bool>(&self, isa: I, ray: &Ray, stack: &mut Stack) -> Nearest {
        let mut nearest = Nearest::of(ray);
        let Some(root) = self.root else {
            return nearest;
        };
        let in_scene = in_group(ray, Vec3::ZERO);
        let lanes = LaneRay::new(&in_scene, self.extent);
        walk::<I, ANY>(
            isa,
            &self.nodes,
            root,
            &lanes,
            &mut nearest,
            stack,
            |leaf, nearest, stack| {
                let (offset, group) = &self.groups[leaf as usize];
                group.cast::<I, ANY>(isa, leaf, &in_group(ray, *offset), nearest, stack);
            },
        );
        nearest
    }
}

/// The ray in the frame of a group. An f64 holds the difference of two f32 of like size exactly, so
/// neighbouring groups see one ray.
#[inline(always)]
pub(crate) fn in_group(ray: &Ray, offset: Vec3) -> LocalRay {
    LocalRay {
        origin: ray.origin.as_dvec3() - offset.as_dvec3(),
        direction: ray.direction.as_dvec3(),
    }
}

/// The whole hit, once the nearest primitive is known.
pub(crate) fn describe(groups: &[(Vec3, Arc<Group>)], ray: &Ray, nearest: &Nearest) -> Option<Hit> {
    let rank = nearest.rank()?;
    let (offset, group) = &groups[rank.group as usize];
    let (instance, blas) = &group.instances()[rank.instance as usize];
    let pose = group.pose(rank.instance as usize)?;
    let m = blas.meet(rank.primitive, &pose.local(&in_group(ray, *offset)))?;
    Some(surface::hit(
        blas,
        instance,
        pose,
        rank.primitive,
        nearest.t(),
        &m,
    ))
}

/// One ray.
struct Single<'a, const ANY: bool>(&'a Forest, &'a Ray);

impl<const ANY: bool> Kernel for Single<'_, ANY> {
    type Output = Nearest;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Nearest {
        self.0.cast::<I, ANY>(isa, self.1, &mut Stack::new())
    }
}

impl RayCaster for Forest {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let nearest = self.level.run(Single::<false>(self, ray));
        describe(&self.groups, ray, &nearest)
    }

    fn is_occluded(&self, ray: &Ray) -> bool {
        let nearest = self.level.run(Single::<true>(self, ray));
        nearest.rank().is_some()
    }
}
