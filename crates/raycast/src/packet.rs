//! Up to 64 rays in one shape.
//!
//! Rays of a bundle that enter a shape walk it together (as the streams of Barringer and
//! Akenine-Möller 2014, "Dynamic ray stream traversal"): a node or a block is fetched once for all of
//! them, what does not depend on the ray is computed once, and where to go next is decided once. Each
//! ray is tested on its own, eight boxes or primitives at a time, and only where it may still find
//! something nearer. Where few are left they go on alone, when the packet is through ([`Turns`]).

use glam::Vec3;
use nemoral_scene::Ray;

use crate::blas::{Blas, Source};
use crate::block::Block;
use crate::exact::Meeting;
use crate::grid::GridNode;
use crate::group::Door;
use crate::lanes::{Lanes, Rays};
use crate::nearest::Nearest;
use crate::node::{Boxes, LEAF, LaneRay, Node, Slabs};
use crate::simd::{F8, Isa, Keys, Rows};
use crate::stack::LEVELS;
use crate::turns::Turns;

/// The most rays in a packet.
pub(crate) const MOST: usize = 64;

/// So few rays are quicker on their own.
const FEW: u32 = 2;

/// Rays by number: bit `i` for ray `i`.
pub(crate) type Set = u64;

/// The numbers of a set, lowest first.
#[inline(always)]
pub(crate) fn next(set: &mut Set) -> usize {
    let i = set.trailing_zeros() as usize & (MOST - 1);
    *set &= set.wrapping_sub(1);
    i
}

/// What rays found, and how far they still look.
#[derive(Debug)]
pub(crate) struct Findings {
    nearest: [Nearest; MOST],
    /// The distance to beat, of each.
    t: [F8; MOST / 8],
}

impl Findings {
    pub(crate) fn new() -> Self {
        Self {
            nearest: [Nearest::none(); MOST],
            t: [F8::splat(0.0); MOST / 8],
        }
    }

    #[inline(always)]
    pub(crate) fn start(&mut self, i: usize, ray: &Ray) {
        self.nearest[i] = Nearest::of(ray);
        self.note::<false>(i);
    }

    #[inline(always)]
    pub(crate) fn of(&self, i: usize) -> &Nearest {
        &self.nearest[i & (MOST - 1)]
    }

    #[inline(always)]
    pub(crate) fn of_mut(&mut self, i: usize) -> &mut Nearest {
        &mut self.nearest[i & (MOST - 1)]
    }

    /// After a change. With `ANY`, a ray that has found something looks no farther.
    #[inline(always)]
    pub(crate) fn note<const ANY: bool>(&mut self, i: usize) {
        let nearest = &self.nearest[i];
        self.t[(i / 8) & 7].0[i & 7] = if ANY && nearest.found().is_some() {
            f32::NEG_INFINITY
        } else {
            nearest.t()
        };
    }

    /// The rays that still look as far as `t` or farther.
    #[inline(always)]
    pub(crate) fn beyond<I: Isa>(&self, isa: I, t: f32) -> Set {
        let t = isa.splat(t);
        let mut set = 0;
        for (k, far) in self.t.iter().enumerate() {
            set |= u64::from(isa.signs(isa.le(t, isa.load(far)))) << (8 * k);
        }
        set
    }
}

/// A node on the way, and which of its children are yet to be visited, by which rays.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Visit {
    /// Where the first ray enters the children.
    distances: F8,
    rays: [Set; 8],
    keys: Keys,
    node: u32,
    /// Children left.
    left: u32,
}

/// Rays in the frame of a shape.
#[derive(Debug)]
pub(crate) struct Packet {
    lanes: Lanes,
    visits: [Visit; LEVELS],
    turns: Turns,
}

impl Packet {
    pub(crate) fn new() -> Self {
        Self {
            lanes: Lanes::NONE,
            visits: [Visit {
                distances: F8::splat(0.0),
                rays: [0; 8],
                keys: Keys::NONE,
                node: 0,
                left: 0,
            }; LEVELS],
            turns: Turns::new(),
        }
    }

    /// Offers the hits behind a door, in a group at `offset`, to rays of the scene. With `ANY`, rays
    /// stop at their first hit.
    #[inline(always)]
    pub(crate) fn cast<I: Isa, const ANY: bool>(
        &mut self,
        isa: I,
        (offset, door): (Vec3, &Door<'_>),
        (scene, rays): (&Rays, Set),
        findings: &mut Findings,
    ) {
        let blas = door.blas;
        let space = (blas.extent(), blas.grid());
        (self.lanes).place((scene, rays), (offset, door.pose), space);
        let mut len = 0;
        let mut next_step = Some((door.root, rays));
        while let Some((at, rays)) = next_step {
            if rays.count_ones() <= FEW {
                self.turns.push(at, rays);
            } else if at & LEAF == 0 {
                if let Some((child, rays)) = self.open(isa, blas, at, rays, findings, &mut len) {
                    next_step = Some((child, rays));
                    continue;
                }
            } else {
                self.meet::<I, ANY>(isa, door, at & !LEAF, rays, findings);
            }
            next_step = self.take(isa, blas.nodes(), &mut len, findings);
        }
        (self.turns).walk::<I, ANY>(isa, door, &self.lanes, findings);
    }

    /// Tests a node's boxes. Returns the nearest child that any ray meets, with its rays; the others
    /// wait.
    #[inline(always)]
    fn open<I: Isa>(
        &mut self,
        isa: I,
        blas: &Blas,
        at: u32,
        rays: Set,
        findings: &Findings,
        len: &mut usize,
    ) -> Option<(u32, Set)> {
        let node = &blas.nodes()[at as usize];
        let Met { near, any, rows } =
            test(isa, &node.wide(isa), |i| self.lanes.lane(i), rays, findings);
        if any == 0 {
            return None;
        }
        let mut met = any;
        while met != 0 {
            let child = node.child(met.trailing_zeros() as usize);
            met &= met - 1;
            blas.fetch(isa, child);
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

    /// The nearest child left, and the rays that look so far.
    #[inline(always)]
    fn take<I: Isa>(
        &mut self,
        isa: I,
        nodes: &[GridNode],
        len: &mut usize,
        findings: &Findings,
    ) -> Option<(u32, Set)> {
        while *len > 0 {
            let visit = &mut self.visits[*len - 1];
            let lane = isa.first(&visit.keys);
            visit.keys.remove(lane);
            visit.left -= 1;
            *len -= usize::from(visit.left == 0);
            let rays = visit.rays[lane & 7] & findings.beyond(isa, visit.distances.0[lane & 7]);
            if rays != 0 {
                return Some((nodes[visit.node as usize].child(lane), rays));
            }
        }
        None
    }

    /// Tests the primitives of a block.
    #[inline(always)]
    fn meet<I: Isa, const ANY: bool>(
        &self,
        isa: I,
        door: &Door<'_>,
        number: u32,
        mut rays: Set,
        findings: &mut Findings,
    ) {
        let Some(block) = door.blas.block(number) else {
            return;
        };
        let sides = block.sides(isa);
        // All tests, then all meetings, then all hits: what a processor guesses wrong of one keeps no other
        // waiting.
        let mut proposed = [(0_u8, 0_u8); MOST];
        let mut len = 0;
        while rays != 0 {
            let i = next(&mut rays);
            let lanes = sides.candidates(isa, &self.lanes.lane(i), &findings.nearest[i]);
            proposed[len & (MOST - 1)] = (i as u8, lanes as u8);
            len += usize::from(lanes != 0);
        }
        let mut met = [(0_u8, 0_u8, Meeting::NONE); 8];
        let mut many = 0;
        for &(i, lanes) in &proposed[..len] {
            let mut lanes = lanes;
            let ray = self.lanes.ray(i.into());
            while lanes != 0 {
                let lane = lanes.trailing_zeros();
                lanes &= lanes - 1;
                let (meeting, counts) = door.blas.meeting(block, lane as usize, &ray);
                met[many & 7] = (i, lane as u8, meeting);
                many += usize::from(counts);
                if many == 8 {
                    take::<ANY>(&met, (block, number), door.source, findings);
                    many = 0;
                }
            }
        }
        take::<ANY>(&met[..many], (block, number), door.source, findings);
    }
}

/// Offers opaque points of a block: ray, lane, where.
#[inline(always)]
fn take<const ANY: bool>(
    met: &[(u8, u8, Meeting)],
    (block, number): (&Block, u32),
    source: Source,
    findings: &mut Findings,
) {
    for &(i, lane, meeting) in met {
        let i = usize::from(i) & (MOST - 1);
        findings.nearest[i].offer(source.found(block, (number, lane.into()), meeting));
        findings.note::<ANY>(i);
    }
}

/// The boxes of a node that rays meet.
pub(crate) struct Met<I: Isa> {
    /// Where the first ray enters each; infinity where none does.
    pub(crate) near: I::V,
    /// The lanes that any ray meets.
    any: u32,
    /// The lanes that each ray meets.
    pub(crate) rows: Rows,
}

/// Tests eight boxes against rays.
#[inline(always)]
pub(crate) fn test<I: Isa>(
    isa: I,
    node: &Node,
    lane: impl Fn(usize) -> LaneRay,
    mut rays: Set,
    findings: &Findings,
) -> Met<I> {
    let mut rows = Rows::NONE;
    let mut any = 0;
    let mut near = isa.splat(f32::INFINITY);
    while rays != 0 {
        let i = next(&mut rays);
        let nearest = findings.of(i);
        let (distances, hit) = node.test(isa, &Slabs::new(isa, &lane(i), nearest), nearest);
        let signs = isa.signs(hit);
        rows.0[i] = signs as u8;
        any |= signs;
        near = isa.min(isa.only(distances, hit), near);
    }
    Met { near, any, rows }
}
