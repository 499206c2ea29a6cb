//! A frame's scene.

use std::sync::Arc;

use glam::{Mat3, Vec3};
use nemoral_scene::{
    Hit, Instance, InstanceGroup, MaterialLibrary, ObjectId, PlacedGroup, Prototype, Ray,
    RayCaster, SurfaceHit,
};
use rayon::prelude::*;

use crate::answer::Answer;
use crate::blas::Blas;
use crate::bundle::{self, Bundle};
use crate::exact::LocalRay;
use crate::grid::Grid;
use crate::group::Group;
use crate::nearest::Nearest;
use crate::node::{LaneRay, Node, bounds_of, extent};
use crate::order::{by_direction, by_place};
use crate::simd::{Isa, Kernel, Level};
use crate::stack::{Leaves, Stack, walk};
use crate::tree::{self, Effort};

/// A frame's scene: groups placed by their offsets, and a small tree over their roots, the only
/// thing that is made anew for a frame.
///
/// The answers are those of [`BruteForce`](crate::BruteForce), to the bit.
#[derive(Clone, Debug)]
pub struct Forest {
    pub(crate) groups: Vec<(Vec3, Arc<Group>)>,
    pub(crate) nodes: Vec<Node>,
    /// `None` if there is nothing to hit.
    pub(crate) root: Option<u32>,
    pub(crate) extent: f32,
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
        let root = (!boxes.is_empty()).then(|| tree::build(&boxes, 1, EFFORT, &mut nodes, leaf));
        Self {
            groups,
            nodes,
            root,
            extent: boxes.iter().map(extent).fold(0.0, f32::max),
            level: Level::detect(),
        }
    }

    /// One shape as it is, in a scene of its own: metres, without an object id. It must be valid against
    /// `materials` (see [`Prototype::new`]).
    #[must_use]
    pub fn of_shape(prototype: Arc<Prototype>, materials: &MaterialLibrary) -> Self {
        let blas = Arc::new(Blas::build(Arc::clone(&prototype), materials));
        let instance = Instance {
            prototype,
            position_m: Vec3::ZERO,
            linear: Mat3::IDENTITY,
            object: ObjectId::NONE,
            variation: 0.0,
        };
        let group = Group::build(vec![(instance, blas)]);
        Self::new(vec![(Vec3::ZERO, Arc::new(group))])
    }

    /// The same scene, cast at without special instructions of the processor: slower, and equal to
    /// the bit.
    #[must_use]
    pub fn portable(mut self) -> Self {
        self.level = Level::Portable;
        self
    }

    /// The groups and their offsets, in order of their numbers.
    #[must_use]
    pub fn groups(&self) -> &[(Vec3, Arc<Group>)] {
        &self.groups
    }

    /// What is to be known of the nearest hits of rays.
    fn answer<A: Answer>(&self, rays: &[Ray], hits: &mut [Option<A>]) {
        assert_eq!(rays.len(), hits.len(), "one hit for each ray");
        if rays.len() >= 2 * ENOUGH {
            let parts = rays.par_chunks(ENOUGH).zip(hits.par_chunks_mut(ENOUGH));
            parts.for_each(|(rays, hits)| self.answer(rays, hits));
            return;
        }
        let order = by_direction(rays);
        if rays.len() < 2 * PIECE || rayon::current_num_threads() == 1 {
            self.cast_all(rays, &order, &mut |_, ray, nearest| {
                hits[ray as usize] = A::of(&self.groups, nearest);
            });
            return;
        }
        let mut found = vec![None; rays.len()];
        let pieces = order.par_chunks(PIECE).zip(found.par_chunks_mut(PIECE));
        pieces.for_each(|(order, found)| {
            self.cast_all(rays, order, &mut |at, _, nearest| {
                found[at] = A::of(&self.groups, nearest);
            });
        });
        let mut place = vec![0; rays.len()];
        for (at, &i) in order.iter().enumerate() {
            place[i as usize] = at as u32;
        }
        let hits = hits.par_iter_mut().with_min_len(PIECE);
        hits.zip(&place)
            .for_each(|(hit, &at)| *hit = found[at as usize]);
    }

    /// Casts rays in an order in which neighbours look alike.
    fn cast_all(&self, rays: &[Ray], order: &[u32], take: Take<'_>) {
        let forest = self;
        self.level.run(Batch {
            forest,
            rays,
            order,
            take,
        });
    }

    /// The nearest hit (with `ANY`: any hit) of a ray.
    fn cast<const ANY: bool>(&self, ray: &Ray, stack: &mut Stack) -> Nearest {
        let forest = self;
        self.level.run(Cast::<ANY> { forest, ray, stack })
    }

    /// The same, inlined.
    #[inline(always)]
    fn find<I: Isa, const ANY: bool>(&self, isa: I, ray: &Ray, stack: &mut Stack) -> Nearest {
        let mut nearest = Nearest::of(ray);
        if let Some(root) = self.root {
            let lanes = LaneRay::new(&in_group(ray, Vec3::ZERO), self.extent, &Grid::NONE);
            let groups = Groups::<ANY> { forest: self, ray };
            walk::<I, _, _, ANY>(
                isa,
                (&self.nodes, root),
                &lanes,
                &groups,
                &mut nearest,
                stack,
            );
        }
        nearest
    }
}

/// A frame's own tree is small.
const EFFORT: Effort = Effort {
    passes: 1,
    share: 1.0,
};

struct Cast<'a, const ANY: bool> {
    forest: &'a Forest,
    ray: &'a Ray,
    stack: &'a mut Stack,
}

impl<const ANY: bool> Kernel for Cast<'_, ANY> {
    type Output = Nearest;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Nearest {
        self.forest.find::<I, ANY>(isa, self.ray, self.stack)
    }
}

/// The groups of the scene.
struct Groups<'a, const ANY: bool> {
    forest: &'a Forest,
    ray: &'a Ray,
}

impl<const ANY: bool> Leaves for Groups<'_, ANY> {
    #[inline(always)]
    fn visit<I: Isa>(&self, isa: I, leaf: u32, nearest: &mut Nearest, stack: &mut Stack) {
        let (offset, group) = &self.forest.groups[leaf as usize];
        group.cast::<I, ANY>(isa, leaf, &in_group(self.ray, *offset), nearest, stack);
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

impl RayCaster for Forest {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let nearest = self.cast::<false>(ray, &mut Stack::new());
        Hit::of(&self.groups, &nearest)
    }

    fn is_occluded(&self, ray: &Ray) -> bool {
        let nearest = self.cast::<true>(ray, &mut Stack::new());
        nearest.found().is_some()
    }

    /// Casts in an order of its own, on the calling thread.
    ///
    /// # Panics
    /// If the slices differ in length.
    fn are_occluded(&self, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "one answer for each ray");
        let order = by_place(rays);
        let forest = self;
        self.level.run(Shadows {
            forest,
            rays,
            order: &order,
            occluded,
        });
    }

    /// Casts in an order of its own, on all threads of the current rayon pool: give a whole scan a
    /// call, the larger the quicker.
    ///
    /// # Panics
    /// If the slices differ in length.
    fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.answer(rays, hits);
    }

    /// As [`closest_hits`](Self::closest_hits).
    fn closest_surfaces(&self, rays: &[Ray], surfaces: &mut [Option<SurfaceHit>]) {
        self.answer(rays, surfaces);
    }

    fn placed_groups(&self) -> Option<Vec<PlacedGroup>> {
        Some(placed(&self.groups))
    }
}

/// So many rays have neighbours enough. More are cast in several orders: threads that sort one are not waited for.
const ENOUGH: usize = 48 << 10;

/// Rays of a batch that one thread casts.
const PIECE: usize = 1024;

/// What is done with the nearest hit of a ray, given its place in the order of casting and its number.
type Take<'a> = &'a mut dyn FnMut(usize, u32, &Nearest);

/// Groups as renderers want them.
pub(crate) fn placed(groups: &[(Vec3, Arc<Group>)]) -> Vec<PlacedGroup> {
    groups
        .iter()
        .map(|(offset, group)| (*offset, Arc::clone(group) as Arc<dyn InstanceGroup>))
        .collect()
}

/// The nearest hits of rays, in an order in which neighbours look alike.
struct Batch<'a> {
    forest: &'a Forest,
    rays: &'a [Ray],
    order: &'a [u32],
    take: Take<'a>,
}

impl Kernel for Batch<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) {
        let Self {
            forest,
            rays,
            order,
            take,
        } = self;
        let mut stack = Stack::new();
        let mut bundle = Bundle::new();
        let mut done = 0;
        while done < order.len() {
            let alike = &order[done..done + bundle::leading(rays, &order[done..])];
            if let [i] = *alike {
                let nearest = forest.find::<I, false>(isa, &rays[i as usize], &mut stack);
                take(done, i, &nearest);
            } else {
                bundle.cast::<I, false>(isa, forest, rays, alike);
                // On their own, so that waiting for one shape is waiting for all.
                for (k, &i) in alike.iter().enumerate() {
                    take(done + k, i, bundle.nearest(k));
                }
            }
            done += alike.len();
        }
    }
}

/// Whether rays hit anything, in an order in which neighbours start near each other.
struct Shadows<'a> {
    forest: &'a Forest,
    rays: &'a [Ray],
    order: &'a [u32],
    occluded: &'a mut [bool],
}

impl Kernel for Shadows<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) {
        let Self {
            forest,
            rays,
            mut order,
            occluded,
        } = self;
        let mut stack = Stack::new();
        let mut bundle = Bundle::new();
        while !order.is_empty() {
            let (alike, others) = order.split_at(bundle::leading(rays, order));
            if let [i] = *alike {
                let nearest = forest.find::<I, true>(isa, &rays[i as usize], &mut stack);
                occluded[i as usize] = nearest.found().is_some();
            } else {
                bundle.cast::<I, true>(isa, forest, rays, alike);
                for (k, &i) in alike.iter().enumerate() {
                    occluded[i as usize] = bundle.nearest(k).found().is_some();
                }
            }
            order = others;
        }
    }
}
