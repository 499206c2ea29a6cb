//! Patterns that are found for blocks of chunks.

use std::convert::Infallible;
use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;
use quick_cache::sync::Cache;

use crate::sampler::bridson::SamplePoint;
use crate::sampler::square::Square;

/// How many chunks a block reaches in each direction from its middle one. A pattern is computed on
/// more of the plane than is asked for, which is shared by a block's chunks.
const REACH: i32 = 1;

/// How many blocks of a layer are kept.
const KEPT: usize = 64;

/// A layer, a block's middle chunk, and the bits of how much is needed around it.
type BlockKey = (Key, ChunkCoord, u64);

/// The patterns of a layer in blocks of chunks. They are pure functions, so neither evictions nor
/// the order of calls can change one.
#[derive(Debug)]
pub(crate) struct Blocks(Cache<BlockKey, Arc<[SamplePoint<Key>]>>);

impl Default for Blocks {
    fn default() -> Self {
        Self(Cache::new(KEPT))
    }
}

impl Blocks {
    /// The pattern in the square of half width `need` around a chunk's centre, of that of blocks,
    /// which `make` computes.
    pub(crate) fn points_around(
        &self,
        key: Key,
        chunk: ChunkCoord,
        need: f64,
        make: &dyn Fn(ChunkCoord, f64) -> Vec<SamplePoint<Key>>,
    ) -> Vec<SamplePoint<Key>> {
        let from_middle = [chunk.x, chunk.y].map(|at| at.rem_euclid(2 * REACH + 1) - REACH);
        let middle = chunk.offset(-from_middle[0], -from_middle[1]);
        let make = || Ok::<_, Infallible>(make(middle, need + f64::from(REACH)).into());
        let Ok(points) = self
            .0
            .get_or_insert_with(&(key, middle, need.to_bits()), make);
        // Positions are multiples of a power of two, so this is exact.
        let shift = DVec2::from(from_middle.map(f64::from));
        let moved = points.iter().map(|&point| SamplePoint {
            p: point.p - shift,
            ..point
        });
        let needed = Square::around_tile(need);
        moved.filter(|point| needed.contains(point.p)).collect()
    }
}

#[cfg(test)]
mod tests {
    use nemoral_seed::Domain;

    use super::*;
    use crate::sampler::bridson::fill;
    use crate::sampler::sizes::DiskSizes;
    use crate::variety::DiskKind;

    #[test]
    fn a_chunk_has_the_points_that_it_has_alone() {
        let variety = DiskKind {
            weight: 1.0,
            radius_m: (0.5, 2.0),
        };
        let sizes = DiskSizes::new(&[variety], vec![0.02], 50.0, 1.0);
        let key = Key::world(3).domain(Domain::new("placement.test"));
        let make =
            |chunk: ChunkCoord, need| fill(&sizes, 2, key, chunk.into(), Square::around_tile(need));
        let sorted = |mut points: Vec<SamplePoint<Key>>| {
            points.sort_unstable_by_key(|p| p.key);
            let bits = points.iter().map(|p| (p.key, p.p, p.radius));
            bits.collect::<Vec<_>>()
        };
        let blocks = Blocks::default();
        for (x, y) in [(0, 0), (-1, 1), (4, -5), (1_000_001, -1_000_000), (-9, 7)] {
            let chunk = ChunkCoord::new(x, y);
            let alone = sorted(make(chunk, 0.6));
            assert!(alone.len() > 100, "{}", alone.len());
            for _ in 0..2 {
                let of_block = blocks.points_around(key, chunk, 0.6, &make);
                assert_eq!(sorted(of_block), alone, "{chunk}");
            }
        }
        assert_eq!(blocks.0.len(), 5);
    }
}
