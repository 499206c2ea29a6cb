//! Packet traversal: up to 64 rays in one shape.
//!
//! Rays of a bundle that enter a shape traverse it together (as the streams of Barringer and
//! Akenine-Möller 2014, "Dynamic ray stream traversal"): a node or a block is fetched once for all
//! of them, values that do not depend on the ray are computed once, and the next node is chosen
//! once. Each ray is tested separately, eight boxes or primitives at a time, and only where it may
//! still find a nearer hit. Where few rays are left, they continue separately after the packet is
//! done ([`InterleavedTraversal`]).

use glam::Vec3;

use crate::blas::{Blas, Source};
use crate::block::Block;
use crate::group::InstanceRef;
use crate::interleaved_traversal::InterleavedTraversal;
use crate::intersection::Intersection;
use crate::nearest_hits::NearestHits;
use crate::node::{Boxes, LEAF, LaneRay, Node, Slabs};
use crate::quantized_node::QuantizedNode;
use crate::ray_mask::{MAX_RAYS, RayMask, pop_ray};
use crate::ray_soa::{LocalRaySoa, RaySoa};
use crate::simd::{F8, Isa, Keys, Rows};
use crate::traversal::MAX_LEVELS;

/// Up to this number of rays are faster when traversed separately.
const FEW: u32 = 2;

/// A node that has been opened, and which of its children are yet to be visited, by which rays.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Visit {
    /// Where the first ray enters the children.
    distances: F8,
    rays: [RayMask; 8],
    keys: Keys,
    node: u32,
    /// How many children are left.
    left: u32,
}

/// Rays in the frame of a shape.
#[derive(Debug)]
pub(crate) struct Packet {
    lanes: LocalRaySoa,
    visits: [Visit; MAX_LEVELS],
    single: InterleavedTraversal,
}

impl Packet {
    pub(crate) fn new() -> Self {
        Self {
            lanes: LocalRaySoa::NONE,
            visits: [Visit {
                distances: F8::splat(0.0),
                rays: [0; 8],
                keys: Keys::NONE,
                node: 0,
                left: 0,
            }; MAX_LEVELS],
            single: InterleavedTraversal::new(),
        }
    }

    /// Offers the hits in a part of an instance, in a group at `offset`, to rays of the scene. With
    /// `ANY`, rays stop at their first hit.
    #[inline(always)]
    pub(crate) fn cast<I: Isa, const ANY: bool>(
        &mut self,
        isa: I,
        (offset, instance): (Vec3, &InstanceRef<'_>),
        (scene, rays): (&RaySoa, RayMask),
        hits: &mut NearestHits,
    ) {
        let blas = instance.blas;
        let space = (blas.extent(), blas.grid());
        (self.lanes).place((scene, rays), (offset, instance.pose), space);
        let mut len = 0;
        let mut next_step = Some((instance.root, rays));
        while let Some((at, rays)) = next_step {
            if rays.count_ones() <= FEW {
                self.single.push(at, rays);
            } else if at & LEAF == 0 {
                if let Some((child, rays)) = self.open(isa, blas, at, rays, hits, &mut len) {
                    next_step = Some((child, rays));
                    continue;
                }
            } else {
                self.intersect_block::<I, ANY>(isa, instance, at & !LEAF, rays, hits);
            }
            next_step = self.take(isa, blas.nodes(), &mut len, hits);
        }
        (self.single).run::<I, ANY>(isa, instance, &self.lanes, hits);
    }

    /// Tests a node's boxes. Returns the nearest child that any ray passes through, with its rays,
    /// and pushes the others on the stack.
    #[inline(always)]
    fn open<I: Isa>(
        &mut self,
        isa: I,
        blas: &Blas,
        at: u32,
        rays: RayMask,
        hits: &NearestHits,
        len: &mut usize,
    ) -> Option<(u32, RayMask)> {
        let node = &blas.nodes()[at as usize];
        let NodeHits { near, any, rows } =
            test(isa, &node.wide(isa), |i| self.lanes.lane(i), rays, hits);
        if any == 0 {
            return None;
        }
        let mut left = any;
        while left != 0 {
            let child = node.child(left.trailing_zeros() as usize);
            left &= left - 1;
            blas.prefetch(isa, child);
        }
        let visit = &mut self.visits[*len];
        visit.rays = isa.columns(&rows);
        visit.keys = isa.all_keys(near);
        visit.distances = isa.store(near);
        let lane = isa.first(&visit.keys);
        visit.keys.remove(lane);
        visit.node = at;
        visit.left = any.count_ones() - 1;
        *len += usize::from(visit.left > 0);
        Some((node.child(lane), visit.rays[lane & 7]))
    }

    /// Takes the nearest child that is left, with the rays that still search that far.
    #[inline(always)]
    fn take<I: Isa>(
        &mut self,
        isa: I,
        nodes: &[QuantizedNode],
        len: &mut usize,
        hits: &NearestHits,
    ) -> Option<(u32, RayMask)> {
        while *len > 0 {
            let visit = &mut self.visits[*len - 1];
            let lane = isa.first(&visit.keys);
            visit.keys.remove(lane);
            visit.left -= 1;
            *len -= usize::from(visit.left == 0);
            let rays = visit.rays[lane & 7] & hits.beyond(isa, visit.distances.0[lane & 7]);
            if rays != 0 {
                return Some((nodes[visit.node as usize].child(lane), rays));
            }
        }
        None
    }

    /// Intersects rays with the primitives of a block.
    #[inline(always)]
    fn intersect_block<I: Isa, const ANY: bool>(
        &self,
        isa: I,
        instance: &InstanceRef<'_>,
        number: u32,
        mut rays: RayMask,
        hits: &mut NearestHits,
    ) {
        let Some(block) = instance.blas.block(number) else {
            return;
        };
        let sides = block.edges(isa);
        // All tests come first, then all intersections, then all hits, so that a mispredicted
        // branch of one ray does not delay the others.
        let mut proposed = [(0_u8, 0_u8); MAX_RAYS];
        let mut len = 0;
        while rays != 0 {
            let i = pop_ray(&mut rays);
            let lanes = sides.candidates(isa, &self.lanes.lane(i), &hits.nearest[i]);
            proposed[len & (MAX_RAYS - 1)] = (i as u8, lanes as u8);
            len += usize::from(lanes != 0);
        }
        let mut opaque = [(0_u8, 0_u8, Intersection::NONE); 8];
        let mut many = 0;
        for &(i, lanes) in &proposed[..len] {
            let mut lanes = lanes;
            let ray = self.lanes.ray(i.into());
            while lanes != 0 {
                let lane = lanes.trailing_zeros();
                lanes &= lanes - 1;
                let (intersection, counts) =
                    instance.blas.intersect_lane(block, lane as usize, &ray);
                opaque[many & 7] = (i, lane as u8, intersection);
                many += usize::from(counts);
                if many == 8 {
                    take::<ANY>(&opaque, (block, number), instance.source, hits);
                    many = 0;
                }
            }
        }
        take::<ANY>(&opaque[..many], (block, number), instance.source, hits);
    }
}

/// Offers opaque points of a block to the searches, each given by its ray, lane and intersection.
#[inline(always)]
fn take<const ANY: bool>(
    opaque: &[(u8, u8, Intersection)],
    (block, number): (&Block, u32),
    source: Source,
    hits: &mut NearestHits,
) {
    for &(i, lane, intersection) in opaque {
        let i = usize::from(i) & (MAX_RAYS - 1);
        hits.nearest[i].offer(source.hit(block, (number, lane.into()), intersection));
        hits.update_reach::<ANY>(i);
    }
}

/// The boxes of a node that rays pass through.
pub(crate) struct NodeHits<I: Isa> {
    /// Where the first ray enters each; infinity where none does.
    pub(crate) near: I::V,
    /// The lanes that any ray passes through.
    any: u32,
    /// The lanes that each ray passes through.
    pub(crate) rows: Rows,
}

/// Tests eight boxes against rays.
#[inline(always)]
pub(crate) fn test<I: Isa>(
    isa: I,
    node: &Node,
    lane: impl Fn(usize) -> LaneRay,
    mut rays: RayMask,
    hits: &NearestHits,
) -> NodeHits<I> {
    let mut rows = Rows::NONE;
    let mut any = 0;
    let mut near = isa.splat(f32::INFINITY);
    while rays != 0 {
        let i = pop_ray(&mut rays);
        let nearest = hits.of(i);
        let (distances, hit) = node.test(isa, &Slabs::new(isa, &lane(i), nearest), nearest);
        let signs = isa.signs(hit);
        rows.0[i] = signs as u8;
        any |= signs;
        near = isa.min(isa.only(distances, hit), near);
    }
    NodeHits { near, any, rows }
}
