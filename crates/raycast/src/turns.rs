//! Rays that go on alone in a shape, a few in turn.
//!
//! Each step of a ray waits for the one before: for a node, for which of its children is the nearest. Steps of
//! another ray fill that time, so the rays that a packet lets go are walked by turns (as lookups are in Kocberber et
//! al. 2015, "Asynchronous memory access chaining").

use crate::blas::Blocks;
use crate::group::Door;
use crate::lanes::Lanes;
use crate::node::Slabs;
use crate::packet::{Findings, MOST, Set, next};
use crate::simd::Isa;
use crate::stack::{Stack, step};

/// How many rays take turns.
const IN_TURN: usize = 3;

/// Rays of a packet, each at a node or block below which it looks on its own.
#[derive(Debug)]
pub(crate) struct Turns {
    waiting: Vec<(u32, usize)>,
    stacks: [Stack; IN_TURN],
}

impl Turns {
    pub(crate) fn new() -> Self {
        Self {
            waiting: Vec::new(),
            stacks: [const { Stack::new() }; IN_TURN],
        }
    }

    /// Lets rays look below a node or block, later.
    #[inline(always)]
    pub(crate) fn push(&mut self, at: u32, mut rays: Set) {
        while rays != 0 {
            self.waiting.push((at, next(&mut rays)));
        }
    }

    /// Lets all that wait look. With `ANY`, rays stop at their first hit.
    #[inline(always)]
    pub(crate) fn walk<I: Isa, const ANY: bool>(
        &mut self,
        isa: I,
        door: &Door<'_>,
        lanes: &Lanes,
        findings: &mut Findings,
    ) {
        let nodes = door.blas.nodes();
        let mut waiting = self.waiting.drain(..);
        let mut going = [None; IN_TURN];
        let mut busy = true;
        while busy {
            busy = false;
            for (turn, stack) in going.iter_mut().zip(&mut self.stacks) {
                let Some((at, i)) = turn.take().or_else(|| waiting.next()) else {
                    continue;
                };
                busy = true;
                let i = i & (MOST - 1);
                let (ray, lanes) = (&lanes.ray(i), &lanes.lane(i));
                let blocks = Blocks::<ANY> {
                    blas: door.blas,
                    ray,
                    lanes,
                    source: door.source,
                };
                let nearest = findings.of_mut(i);
                // Another turn of the same ray may have found something.
                if ANY && nearest.found().is_some() {
                    stack.clear();
                    continue;
                }
                let slabs = Slabs::new(isa, lanes, nearest);
                let place = (nodes, at);
                match step::<I, _, _, ANY>(isa, place, &slabs, &blocks, nearest, (stack, 0)) {
                    Some(at) => {
                        door.blas.fetch(isa, at);
                        *turn = Some((at, i));
                    }
                    None => findings.note::<ANY>(i),
                }
            }
        }
    }
}
