//! The scene that rays are cast at.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{
    Hit, InstanceGroup, InstancePlace, InstancedScene, MaterialLibrary, PlacedGroup, Prototype,
    Ray, RayCaster, SurfaceHit,
};
use rayon::prelude::*;

use crate::blas::Blas;
use crate::group::Group;
use crate::hit::ResolvedHit;
use crate::hit_record::HitRecord;
use crate::intersection::LocalRay;
use crate::nearest::Nearest;
use crate::node::LaneRay;
use crate::quantization_grid::QuantizationGrid;
use crate::ray_bundle::{self, RayBundle};
use crate::ray_sort::{by_direction, by_origin};
use crate::simd::{Isa, Kernel, Level};
use crate::tlas::Tlas;
use crate::traversal::{LeafVisitor, Stack, traverse};

/// A scene that rays are cast at: groups placed by their offsets, and a small tree over them, the
/// only one that is made anew for a frame.
///
/// The results are those of [`BruteForce`](crate::BruteForce), to the bit, if no coordinate of a
/// placed shape or of a ray's origin is beyond ±1e9 m ([`Prototype::FARTHEST_M`]), far from where
/// squares of lengths are beyond f32.
#[derive(Clone, Debug)]
pub struct RayScene {
    tlas: Tlas,
    level: Level,
}

impl RayScene {
    /// Places groups: each with the offset, in metres, of its frame in the scene. Their order gives
    /// their numbers, which decide ties in distance between hits of one object.
    #[must_use]
    pub fn new(groups: Vec<(Vec3, Arc<Group>)>) -> Self {
        Self {
            tlas: Tlas::build(groups),
            level: Level::detect(),
        }
    }

    /// A scene of one shape as it is, in metres, without an object id. The shape must be valid
    /// against `materials` (see [`Prototype::new`]).
    #[must_use]
    pub fn of_shape(prototype: Arc<Prototype>, materials: &MaterialLibrary) -> Self {
        let blas = Arc::new(Blas::build(prototype, materials));
        let group = Group::build(vec![(InstancePlace::at(Vec3::ZERO), blas)]);
        Self::new(vec![(Vec3::ZERO, Arc::new(group))])
    }

    /// The same scene, but cast at without special instructions of the processor: slower, with
    /// results equal to the bit.
    #[must_use]
    pub fn portable(mut self) -> Self {
        self.level = Level::Portable;
        self
    }

    /// The groups and their offsets, in order of their numbers.
    #[must_use]
    pub fn groups(&self) -> &[(Vec3, Arc<Group>)] {
        &self.tlas.groups
    }

    /// Which primitive of which instance a ray hits first.
    #[must_use]
    pub fn closest_record(&self, ray: &Ray) -> Option<HitRecord> {
        let nearest = self.cast::<false>(ray);
        HitRecord::of(&self.tlas.groups, &nearest)
    }

    /// The same for each ray, as fast as [`closest_surfaces`](RayCaster::closest_surfaces).
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn closest_records(&self, rays: &[Ray], records: &mut [Option<HitRecord>]) {
        self.resolve(rays, records);
    }

    /// Hands over the first hit of each ray with the ray's number, on the calling thread and in an
    /// order of its own: for who has many batches, one for each thread, and keeps hits in a form of
    /// their own.
    pub fn for_each_closest_record(
        &self,
        rays: &[Ray],
        mut take: impl FnMut(usize, Option<HitRecord>),
    ) {
        self.cast_all(rays, &by_direction(rays), &mut |_, ray, nearest| {
            take(ray as usize, HitRecord::of(&self.tlas.groups, nearest));
        });
    }

    /// The memory that the scene takes, bytes: groups, shapes with their prototypes, and masks,
    /// each once. Textures are not included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        // By address: what is shared counts once.
        let (mut groups, mut known) = (BTreeSet::new(), BTreeSet::new());
        let mut bytes = size_of::<Self>()
            + size_of_val(self.tlas.groups.as_slice())
            + size_of_val(self.tlas.nodes.as_slice());
        for (_, group) in &self.tlas.groups {
            if !groups.insert(Arc::as_ptr(group)) {
                continue;
            }
            bytes += group.memory_bytes();
            for (_, blas) in group.instances() {
                if !known.insert(Arc::as_ptr(blas).cast::<()>()) {
                    continue;
                }
                bytes += blas.memory_bytes();
                if known.insert(Arc::as_ptr(blas.prototype()).cast()) {
                    bytes += blas.prototype().memory_bytes();
                }
                for mask in blas.masks() {
                    if known.insert(Arc::as_ptr(mask).cast()) {
                        bytes += mask.memory_bytes();
                    }
                }
            }
        }
        bytes
    }

    /// Describes the nearest hits of rays.
    fn resolve<A: ResolvedHit>(&self, rays: &[Ray], hits: &mut [Option<A>]) {
        assert_eq!(rays.len(), hits.len(), "one hit for each ray");
        if rays.len() >= 2 * ORDER_RAYS {
            let parts = rays
                .par_chunks(ORDER_RAYS)
                .zip(hits.par_chunks_mut(ORDER_RAYS));
            parts.for_each(|(rays, hits)| self.resolve(rays, hits));
            return;
        }
        let order = by_direction(rays);
        if rays.len() < 2 * TASK_RAYS || rayon::current_num_threads() == 1 {
            self.cast_all(rays, &order, &mut |_, ray, nearest| {
                hits[ray as usize] = A::of(&self.tlas.groups, nearest);
            });
            return;
        }
        let mut found = vec![None; rays.len()];
        let pieces = order
            .par_chunks(TASK_RAYS)
            .zip(found.par_chunks_mut(TASK_RAYS));
        pieces.for_each(|(order, found)| {
            self.cast_all(rays, order, &mut |at, _, nearest| {
                found[at] = A::of(&self.tlas.groups, nearest);
            });
        });
        let mut place = vec![0; rays.len()];
        for (at, &i) in order.iter().enumerate() {
            place[i as usize] = at as u32;
        }
        let hits = hits.par_iter_mut().with_min_len(TASK_RAYS);
        hits.zip(&place)
            .for_each(|(hit, &at)| *hit = found[at as usize]);
    }

    /// Casts rays in an order in which neighbours are similar.
    fn cast_all(&self, rays: &[Ray], order: &[u32], take: HitSink<'_>) {
        self.level.run(Batch {
            tlas: &self.tlas,
            rays,
            order,
            take,
        });
    }

    /// The nearest hit (with `ANY`: any hit) of a ray.
    fn cast<const ANY: bool>(&self, ray: &Ray) -> Nearest {
        thread_local! {
            /// Kept from ray to ray: to clear a new one takes longer than a twentieth of a ray.
            static STACK: RefCell<Stack> = const { RefCell::new(Stack::new()) };
        }
        let tlas = &self.tlas;
        STACK.with_borrow_mut(|stack| {
            stack.clear();
            self.level.run(Cast::<ANY> { tlas, ray, stack })
        })
    }
}

/// The nearest hit (with `ANY`: any hit) of a ray.
#[inline(always)]
fn find<I: Isa, const ANY: bool>(isa: I, tlas: &Tlas, ray: &Ray, stack: &mut Stack) -> Nearest {
    let mut nearest = Nearest::of(ray);
    // Boxes cannot be told apart with what is no number. Such rays are never in bundles.
    let is_ray = ray.origin.is_finite() && ray.direction.is_finite() && ray.t_min_m <= ray.t_max_m;
    if let (Some(root), true) = (tlas.root, is_ray) {
        let in_scene = LocalRay::in_group(ray, Vec3::ZERO);
        let lanes = LaneRay::new(&in_scene, tlas.extent, &QuantizationGrid::IDENTITY);
        let groups = Groups::<ANY> { tlas, ray };
        traverse::<I, _, _, ANY>(
            isa,
            (&tlas.nodes, root),
            &lanes,
            &groups,
            &mut nearest,
            stack,
        );
    }
    nearest
}

struct Cast<'a, const ANY: bool> {
    tlas: &'a Tlas,
    ray: &'a Ray,
    stack: &'a mut Stack,
}

impl<const ANY: bool> Kernel for Cast<'_, ANY> {
    type Output = Nearest;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Nearest {
        find::<I, ANY>(isa, self.tlas, self.ray, self.stack)
    }
}

/// The leaves of the tree over the groups: the groups themselves.
struct Groups<'a, const ANY: bool> {
    tlas: &'a Tlas,
    ray: &'a Ray,
}

impl<const ANY: bool> LeafVisitor for Groups<'_, ANY> {
    #[inline(always)]
    fn visit<I: Isa>(&self, isa: I, leaf: u32, nearest: &mut Nearest, stack: &mut Stack) {
        let (offset, group) = &self.tlas.groups[leaf as usize];
        group.cast::<I, ANY>(
            isa,
            leaf,
            &LocalRay::in_group(self.ray, *offset),
            nearest,
            stack,
        );
    }
}

impl RayCaster for RayScene {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let nearest = self.cast::<false>(ray);
        Hit::of(&self.tlas.groups, &nearest)
    }

    fn closest_surface(&self, ray: &Ray) -> Option<SurfaceHit> {
        let nearest = self.cast::<false>(ray);
        SurfaceHit::of(&self.tlas.groups, &nearest)
    }

    fn is_occluded(&self, ray: &Ray) -> bool {
        let nearest = self.cast::<true>(ray);
        nearest.found().is_some()
    }

    /// Casts in an order of its own, on the calling thread.
    ///
    /// # Panics
    /// If the slices differ in length.
    fn are_occluded(&self, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "one result for each ray");
        let order = by_origin(rays);
        self.level.run(OcclusionBatch {
            tlas: &self.tlas,
            rays,
            order: &order,
            occluded,
        });
    }

    /// Casts in an order of its own, on all threads of the current rayon pool. Larger batches are
    /// faster per ray, so give a whole scan in one call.
    ///
    /// # Panics
    /// If the slices differ in length.
    fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.resolve(rays, hits);
    }

    /// As [`closest_hits`](Self::closest_hits).
    fn closest_surfaces(&self, rays: &[Ray], surfaces: &mut [Option<SurfaceHit>]) {
        self.resolve(rays, surfaces);
    }
}

impl InstancedScene for RayScene {
    fn placed_groups(&self) -> Vec<PlacedGroup> {
        let place = |(offset, group): &(Vec3, Arc<Group>)| {
            (*offset, Arc::clone(group) as Arc<dyn InstanceGroup>)
        };
        self.tlas.groups.iter().map(place).collect()
    }
}

/// The most rays that are sorted together. That is enough for rays to find similar neighbours, and
/// larger batches are sorted in parts so that threads need not wait for one sort.
const ORDER_RAYS: usize = 48 << 10;

/// The rays of a batch that one task casts.
const TASK_RAYS: usize = 1024;

/// Receives the nearest hit of a ray, with its place in the order of casting and its number.
type HitSink<'a> = &'a mut dyn FnMut(usize, u32, &Nearest);

/// Finds the nearest hits of rays, in an order in which neighbours are similar.
struct Batch<'a> {
    tlas: &'a Tlas,
    rays: &'a [Ray],
    order: &'a [u32],
    take: HitSink<'a>,
}

impl Kernel for Batch<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) {
        let Self {
            tlas,
            rays,
            order,
            take,
        } = self;
        let mut stack = Stack::new();
        let mut bundle = RayBundle::new();
        let mut done = 0;
        while done < order.len() {
            let alike = &order[done..done + ray_bundle::leading(rays, &order[done..])];
            if let [i] = *alike {
                let nearest = find::<I, false>(isa, tlas, &rays[i as usize], &mut stack);
                take(done, i, &nearest);
            } else {
                bundle.cast::<I, false>(isa, tlas, rays, alike);
                // This is a separate loop, so that the cache misses of several shapes overlap.
                for (k, &i) in alike.iter().enumerate() {
                    take(done + k, i, bundle.nearest(k));
                }
            }
            done += alike.len();
        }
    }
}

/// Finds whether rays hit anything, in an order in which neighbours start near each other.
struct OcclusionBatch<'a> {
    tlas: &'a Tlas,
    rays: &'a [Ray],
    order: &'a [u32],
    occluded: &'a mut [bool],
}

impl Kernel for OcclusionBatch<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) {
        let Self {
            tlas,
            rays,
            mut order,
            occluded,
        } = self;
        let mut stack = Stack::new();
        let mut bundle = RayBundle::new();
        while !order.is_empty() {
            let (alike, others) = order.split_at(ray_bundle::leading(rays, order));
            if let [i] = *alike {
                let nearest = find::<I, true>(isa, tlas, &rays[i as usize], &mut stack);
                occluded[i as usize] = nearest.found().is_some();
            } else {
                bundle.cast::<I, true>(isa, tlas, rays, alike);
                for (k, &i) in alike.iter().enumerate() {
                    occluded[i as usize] = bundle.nearest(k).found().is_some();
                }
            }
            order = others;
        }
    }
}
