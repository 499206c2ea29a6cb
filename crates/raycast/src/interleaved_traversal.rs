//! Traversal of a shape by single rays, a few of them interleaved.
//!
//! Each step of a ray waits for the one before it: for a node to be fetched, and for the decision
//! which of its children is nearest. Steps of other rays fill that time, so the rays that leave a
//! packet are traversed in turns (as lookups are in Kocberber et al. 2015, "Asynchronous memory
//! access chaining").

use crate::blas::Blocks;
use crate::group::InstanceRef;
use crate::nearest_hits::NearestHits;
use crate::node::Slabs;
use crate::ray_mask::{MAX_RAYS, RayMask, pop_ray};
use crate::ray_soa::LocalRaySoa;
use crate::simd::Isa;
use crate::traversal::{Stack, step};

/// How many rays are interleaved.
const INTERLEAVED: usize = 3;

/// Rays of a packet, each with a node or block below which it searches on its own.
#[derive(Debug)]
pub(crate) struct InterleavedTraversal {
    waiting: Vec<(u32, usize)>,
    stacks: [Stack; INTERLEAVED],
}

impl InterleavedTraversal {
    pub(crate) fn new() -> Self {
        Self {
            waiting: Vec::new(),
            stacks: [const { Stack::new() }; INTERLEAVED],
        }
    }

    /// Queues rays to search below a node or block.
    #[inline(always)]
    pub(crate) fn push(&mut self, at: u32, mut rays: RayMask) {
        while rays != 0 {
            self.waiting.push((at, pop_ray(&mut rays)));
        }
    }

    /// Lets all queued rays search. With `ANY`, rays stop at their first hit.
    #[inline(always)]
    pub(crate) fn run<I: Isa, const ANY: bool>(
        &mut self,
        isa: I,
        instance: &InstanceRef<'_>,
        lanes: &LocalRaySoa,
        hits: &mut NearestHits,
    ) {
        let nodes = instance.blas.nodes();
        let mut waiting = self.waiting.drain(..);
        let mut active = [None; INTERLEAVED];
        let mut busy = true;
        while busy {
            busy = false;
            for (turn, stack) in active.iter_mut().zip(&mut self.stacks) {
                let Some((at, i)) = turn.take().or_else(|| waiting.next()) else {
                    continue;
                };
                busy = true;
                let i = i & (MAX_RAYS - 1);
                let (ray, lanes) = (&lanes.ray(i), &lanes.lane(i));
                let blocks = Blocks::<ANY> {
                    blas: instance.blas,
                    ray,
                    lanes,
                    source: instance.source,
                };
                let nearest = hits.of_mut(i);
                // The same ray may have found something below another node.
                if ANY && nearest.found().is_some() {
                    stack.clear();
                    continue;
                }
                let slabs = Slabs::new(isa, lanes, nearest);
                let place = (nodes, at);
                match step::<I, _, _, ANY>(isa, place, &slabs, &blocks, nearest, (stack, 0)) {
                    Some(at) => {
                        instance.blas.prefetch(isa, at);
                        *turn = Some((at, i));
                    }
                    None => hits.update_reach::<ANY>(i),
                }
            }
        }
    }
}
