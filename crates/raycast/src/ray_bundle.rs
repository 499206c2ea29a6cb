//! Bundles of neighbouring rays, which search the trees above the instances together.
//!
//! Half of a ray's steps are through these trees, and rays that start near each other in about one
//! direction take the same ones. So a bundle takes these steps once, with bounds on its rays (as
//! Wald et al. 2007, "Ray tracing deformable scenes using dynamic bounding volume hierarchies", do
//! with frusta): it lists the parts of instances that any of its rays may hit, nearest first, and
//! no farther than its rays look. Each ray tests the list, eight boxes at a time, and the rays that
//! enter a part traverse it as a [`Packet`].

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::{DVec3, Vec3};
use nemoral_scene::{Bounds, Ray};

use crate::intersection::LocalRay;
use crate::nearest::Nearest;
use crate::nearest_hits::NearestHits;
use crate::node::{BOX_SLACK, Boxes, LEAF, LaneRay, Node, bounds_of, extent};
use crate::packet::{Packet, test};
use crate::quantization_grid::QuantizationGrid;
use crate::ray_mask::{MAX_RAYS, RayMask};
use crate::ray_soa::RaySoa;
use crate::simd::Isa;
use crate::tlas::Tlas;

/// The least number of rays in a bundle; fewer are not worth it.
const LEAST: usize = 4;

/// How far the directions of a bundle may differ from that of its first ray, per axis.
const SPREAD: f32 = 0.1;

/// How far the origins of a bundle may differ from that of its first ray, per axis, metres.
const DRIFT_M: f32 = 2.0;

/// How many of the first rays form a bundle; 1 if the first ray is to be cast alone.
pub(crate) fn leading(rays: &[Ray], order: &[u32]) -> usize {
    let first = &rays[order[0] as usize];
    // False for every NaN, which would spoil the bounds of the others: `max_element` may skip it.
    let near = |a: Vec3, b: Vec3, most: f32| (a - b).abs().cmple(Vec3::splat(most)).all();
    let alike = |&&i: &&u32| {
        let ray = &rays[i as usize];
        near(ray.direction, first.direction, SPREAD)
            && near(ray.origin, first.origin, DRIFT_M)
            && ray.t_min_m >= 0.0
    };
    let n = order.iter().take(MAX_RAYS).take_while(alike).count();
    if n < LEAST { 1 } else { n }
}

/// A part of an instance that rays of a bundle may hit.
#[derive(Clone, Copy, Debug, Default)]
struct Candidate {
    group: u32,
    part: u32,
}

/// Up to eight candidates.
#[derive(Debug)]
struct Candidates {
    /// Their boxes in the scene.
    node: Node,
    /// No ray hits these or later candidates nearer than this.
    near: f32,
    candidates: [Candidate; 8],
}

/// A node or leaf that is yet to be opened, ordered by distance: distance bits, group, node or
/// leaf. In place of the group, [`TOP`] stands for the tree over the groups.
///
/// It is one number because comparing three takes as many branches, which are often mispredicted.
type Waiting = Reverse<u128>;

#[inline(always)]
fn waiting(near: u32, group: u32, at: u32) -> Waiting {
    Reverse(u128::from(near) << 64 | u128::from(group) << 32 | u128::from(at))
}

const TOP: u32 = u32::MAX;

/// The search of a bundle, which is reused from one bundle to the next for its memory.
#[derive(Debug)]
pub(crate) struct RayBundle {
    origins: (DVec3, DVec3),
    directions: (Vec3, Vec3),
    t_max: f32,
    waiting: BinaryHeap<Waiting>,
    rays: RaySoa,
    /// The same rays, prepared for the scene's boxes.
    lanes: [LaneRay; MAX_RAYS],
    hits: NearestHits,
    packet: Packet,
}

impl RayBundle {
    pub(crate) fn new() -> Self {
        Self {
            origins: (DVec3::ZERO, DVec3::ZERO),
            directions: (Vec3::ZERO, Vec3::ZERO),
            t_max: 0.0,
            waiting: BinaryHeap::new(),
            rays: RaySoa::NONE,
            lanes: [LaneRay::NONE; MAX_RAYS],
            hits: NearestHits::new(),
            packet: Packet::new(),
        }
    }

    /// The nearest hit of ray `i` of the last bundle.
    pub(crate) fn nearest(&self, i: usize) -> &Nearest {
        self.hits.of(i)
    }

    /// Starts the search of other rays.
    #[inline(always)]
    fn aim(&mut self, tlas: &Tlas, rays: &[Ray], order: &[u32]) {
        self.waiting.clear();
        let bundled = || order.iter().map(|&i| &rays[i as usize]);
        let origins = Bounds::of_points(bundled().map(|r| r.origin));
        let directions = Bounds::of_points(bundled().map(|r| r.direction));
        self.origins = (origins.min.as_dvec3(), origins.max.as_dvec3());
        self.directions = (directions.min, directions.max);
        self.t_max = bundled().fold(0.0, |t, r| r.t_max_m.max(t));
        for (i, ray) in bundled().enumerate() {
            self.rays.put(i, ray);
            self.lanes[i] = LaneRay::new(
                &LocalRay::in_group(ray, Vec3::ZERO),
                tlas.extent,
                &QuantizationGrid::IDENTITY,
            );
            self.hits.start(i, ray);
        }
        if let Some(root) = tlas.root {
            self.waiting.push(waiting(0, TOP, root));
        }
    }

    /// Finds the nearest hit of each ray; with `ANY`, any hit.
    #[inline(always)]
    pub(crate) fn cast<I: Isa, const ANY: bool>(
        &mut self,
        isa: I,
        tlas: &Tlas,
        rays: &[Ray],
        order: &[u32],
    ) {
        self.aim(tlas, rays, order);
        let all = RayMask::MAX >> (MAX_RAYS - order.len());
        while let Some(listed) = self.next_candidates(isa, tlas) {
            let looking = all & self.hits.beyond(isa, listed.near);
            if looking == 0 {
                break;
            }
            let entered = test(isa, &listed.node, |i| self.lanes[i], looking, &self.hits);
            let columns = isa.columns(&entered.rows);
            let distances = isa.store(entered.near);
            for (k, candidate) in listed.candidates.iter().enumerate() {
                let entering = columns[k] & self.hits.beyond(isa, distances.0[k]);
                if entering != 0 {
                    self.enter::<I, ANY>(isa, tlas, candidate, entering);
                }
            }
        }
    }

    /// Casts rays at a part of an instance.
    #[inline(always)]
    fn enter<I: Isa, const ANY: bool>(
        &mut self,
        isa: I,
        tlas: &Tlas,
        candidate: &Candidate,
        entering: RayMask,
    ) {
        let (offset, group) = &tlas.groups[candidate.group as usize];
        let instance = group.instance_ref(candidate.group, candidate.part);
        (self.packet).cast::<I, ANY>(
            isa,
            (*offset, &instance),
            (&self.rays, entering),
            &mut self.hits,
        );
    }

    /// The next up to eight candidates; `None` if there are no more.
    #[inline(always)]
    fn next_candidates<I: Isa>(&mut self, isa: I, tlas: &Tlas) -> Option<Candidates> {
        let mut children = Vec::with_capacity(8);
        let mut candidates = [Candidate::default(); 8];
        let mut first = 0;
        while children.len() < 8 {
            let Some(Reverse(next)) = self.waiting.pop() else {
                break;
            };
            let [near, group, at] = [64, 32, 0].map(|shift| (next >> shift) as u32);
            if group == TOP {
                if at & LEAF == 0 {
                    let node = &tlas.nodes[at as usize];
                    self.open(isa, node, TOP, Vec3::ZERO, tlas.extent);
                } else if let Some(root) = tlas.groups[(at & !LEAF) as usize].1.root {
                    self.waiting.push(waiting(near, at & !LEAF, root));
                }
                continue;
            }
            let (offset, placed) = &tlas.groups[group as usize];
            if at & LEAF == 0 {
                let node = &placed.nodes[at as usize];
                self.open(isa, node, group, *offset, extent(&placed.bounds));
                continue;
            }
            let part = at & !LEAF;
            if children.is_empty() {
                first = near;
            }
            let b = &placed.boxes[part as usize];
            let in_scene = [b.min, b.max].map(|p| p.as_dvec3() + offset.as_dvec3());
            candidates[children.len()] = Candidate { group, part };
            children.push((bounds_of(in_scene), 0));
        }
        (!children.is_empty()).then(|| Candidates {
            node: Node::new(&children),
            near: f32::from_bits(first),
            candidates,
        })
    }

    /// Queues the children of a node that any ray may hit.
    #[inline(always)]
    fn open<I: Isa>(&mut self, isa: I, node: &Node, group: u32, offset: Vec3, extent: f32) {
        let beam = Beam::new(self.origins, self.directions, offset, extent);
        let (distances, hit) = beam.test(isa, node, self.t_max);
        let mut left = isa.signs(hit);
        let distances = isa.store(distances);
        while left != 0 {
            let lane = left.trailing_zeros() as usize & 7;
            left &= left - 1;
            let near = distances.0[lane].to_bits();
            self.waiting.push(waiting(near, group, node.child(lane)));
        }
    }
}

/// Bounds on the distances at which the rays of a bundle pass the planes of boxes.
struct Beam {
    axes: [Axis; 3],
}

/// The distances of one axis: `plane · scale + shift`. Where the sign of the direction is known,
/// rays enter by one plane and leave by the other; where it is not, they may enter by both and need
/// not leave.
#[derive(Clone, Copy)]
struct Axis {
    /// The side of a box by which rays enter: 1 if they run towards smaller coordinates.
    near: usize,
    enter: [f32; 2],
    leave: [f32; 2],
    /// The distance to the other plane, where rays may enter by it.
    enter_far: [f32; 2],
}

/// Larger than any distance, and finite.
const FAR: f32 = 3e38;

impl Beam {
    fn new(origins: (DVec3, DVec3), directions: (Vec3, Vec3), offset: Vec3, extent: f32) -> Self {
        let (min, max) = (origins.0 - offset.as_dvec3(), origins.1 - offset.as_dvec3());
        let (min, max) = (min.as_vec3(), max.as_vec3());
        let reach = min.abs().max(max.abs()).max_element() + extent;
        // The margin is twice that of a ray, because the bounds themselves are rounded.
        let pad = 2.0 * BOX_SLACK * f32::EPSILON * reach;
        let axis = |k: usize| {
            let (low, high) = (min[k] - pad, max[k] + pad);
            let (slow, fast) = (directions.0[k], directions.1[k]);
            let line = |origin: f32, direction: f32| {
                let scale = 1.0 / direction;
                [scale, -origin * scale]
            };
            let (none, always) = ([0.0, -FAR], [0.0, FAR]);
            if slow > TINY {
                Axis {
                    near: 0,
                    enter: line(high, fast),
                    leave: line(low, slow),
                    enter_far: none,
                }
            } else if fast < -TINY {
                Axis {
                    near: 1,
                    enter: line(low, slow),
                    leave: line(high, fast),
                    enter_far: none,
                }
            } else {
                Axis {
                    near: 0,
                    enter: line(high, fast.max(TINY)),
                    leave: always,
                    enter_far: line(low, slow.min(-TINY)),
                }
            }
        };
        Self {
            axes: [axis(0), axis(1), axis(2)],
        }
    }

    /// The least distances at which rays may enter the boxes of a node, and the mask of the boxes
    /// that they may pass through.
    #[inline(always)]
    fn test<I: Isa>(&self, isa: I, node: &Node, t_max: f32) -> (I::V, I::V) {
        let mut first = isa.splat(0.0);
        let mut last = isa.splat(t_max.min(FAR));
        for (k, axis) in self.axes.iter().enumerate() {
            let (near, far) = (
                node.plane(isa, k, axis.near),
                node.plane(isa, k, axis.near ^ 1),
            );
            // Where a lane is empty, the NaN is replaced by the other operand.
            let enter_far = line(isa, far, axis.enter_far);
            first = isa.max(enter_far, isa.max(line(isa, near, axis.enter), first));
            last = isa.min(line(isa, far, axis.leave), last);
        }
        (first, isa.le(first, last))
    }
}

#[inline(always)]
fn line<I: Isa>(isa: I, plane: I::V, [scale, shift]: [f32; 2]) -> I::V {
    isa.mul_add(plane, isa.splat(scale), isa.splat(shift))
}

/// Directions below this have no certain sign.
const TINY: f32 = 1e-6;
