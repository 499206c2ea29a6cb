//! A layer that can be placed.

use std::sync::Arc;

use nemoral_scene::ChunkCoord;
use nemoral_seed::{Domain, Draw, Key};

use super::blocks::Blocks;
use super::gap_part::{GapPart, together};
use super::open_land::EdgeProfile;
use super::patches::{PatchMap, Patches};
use super::rows::Rows;
use crate::sampler::bridson::{SamplePoint, fill, halo};
use crate::sampler::sizes::DiskSizes;
use crate::sampler::square::Square;

const THINNING: Domain = Domain::new("placement.thinning");

/// Patterns whose halo is wider than this, in chunk edges, are found for blocks of chunks.
const WIDE_HALO: f64 = 0.5;

/// The patches around a chunk that matter to a layer.
#[derive(Clone, Copy, Default)]
pub(crate) struct LayerPatches<'a> {
    pub(crate) gaps: Option<&'a PatchMap>,
    pub(crate) clusters: Option<&'a PatchMap>,
}

/// A layer, or a part of one, that can be placed: its sampler and the share that is kept.
#[derive(Clone, Debug)]
pub(crate) struct CalibratedLayer {
    /// The number of the layer.
    pub(crate) number: usize,
    pub(crate) part: GapPart,
    pub(crate) sizes: DiskSizes,
    pub(crate) pattern: Pattern,
    pub(crate) blocks: Arc<Blocks>,
    pub(crate) chunk_size_m: f64,
    /// The largest occupancy radius, in chunk edges.
    pub(crate) max_radius: f64,
    /// Per variety: the share of the pattern that is kept where the relative density is 1, as it is
    /// outside of gaps and inside of clusters.
    pub(crate) keep: Vec<f64>,
    pub(crate) in_gaps: f64,
    pub(crate) clusters: Option<Patches>,
    pub(crate) at_edges: Option<EdgeProfile>,
}

/// The pattern of places where a layer's plants could stand.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Pattern {
    /// A sample by Bridson's algorithm, with its number of rounds.
    Fill(u32),
    Rows(Rows),
}

impl CalibratedLayer {
    /// The pattern in the square of half width `need` around a chunk's centre, before thinning; of
    /// one for clusters or the inside of gaps, all that they have of it, and some more.
    pub(crate) fn points_around(
        &self,
        key: Key,
        chunk: ChunkCoord,
        need: f64,
        patches: &LayerPatches<'_>,
    ) -> Vec<SamplePoint<Key>> {
        let whole = Square::around_tile(need);
        let Pattern::Fill(rounds) = self.pattern else {
            return self.pattern_in(key, chunk, whole);
        };
        let halo = halo(&self.sizes, rounds);
        // Where it is narrow, blocks would be computed for chunks that nobody asks for.
        if halo > WIDE_HALO {
            let make = |chunk, need| self.pattern_in(key, chunk, Square::around_tile(need));
            return self.blocks.points_around(key, chunk, need, &make);
        }
        if let Some(squares) = self.squares(need, patches) {
            // Patches are dense, and most of the plane is not in one.
            let cost = |square: Square| {
                let edge = 2.0 * (square.half_width + halo);
                edge * edge
            };
            if squares.iter().copied().map(cost).sum::<f64>() < cost(whole) {
                let points = (squares.into_iter()).flat_map(|s| self.pattern_in(key, chunk, s));
                let mut points: Vec<_> = points.filter(|p| whole.contains(p.p)).collect();
                points.sort_unstable_by_key(|point| point.key);
                points.dedup_by_key(|point| point.key);
                return points;
            }
        }
        self.pattern_in(key, chunk, whole)
    }

    /// Squares that cover what is asked of the pattern; `None` for all of the plane.
    fn squares(&self, need: f64, patches: &LayerPatches<'_>) -> Option<Vec<Square>> {
        let gaps = patches.gaps.filter(|_| self.part == GapPart::Inside);
        match (gaps, patches.clusters) {
            (None, None) => None,
            (Some(only), None) | (None, Some(only)) => Some(only.squares(need).collect()),
            (Some(gaps), Some(clusters)) => {
                let clusters: Vec<Square> = clusters.squares(need).collect();
                let clustered = |gap: Square| gap.bounding_intersections(&clusters);
                Some(gaps.squares(need).filter_map(clustered).collect())
            }
        }
    }

    /// The pattern in a square, computed anew; that of rows in one around the chunk's centre.
    pub(crate) fn pattern_in(
        &self,
        key: Key,
        chunk: ChunkCoord,
        square: Square,
    ) -> Vec<SamplePoint<Key>> {
        let (sizes, size_m) = (&self.sizes, self.chunk_size_m);
        match self.pattern {
            Pattern::Fill(rounds) => fill(sizes, rounds, key, chunk.into(), square),
            Pattern::Rows(rows) => rows.plant(sizes, key, chunk, size_m, square.half_width),
        }
    }

    /// Its clusters, if it has any.
    pub(crate) fn clusters(&self, key: Key, chunk: ChunkCoord, need: f64) -> Option<PatchMap> {
        let clusters = self.clusters.as_ref()?;
        Some(clusters.around(key, chunk, self.chunk_size_m, need))
    }

    /// Whether its density in gaps differs.
    pub(crate) fn minds_gaps(&self) -> bool {
        self.in_gaps != 1.0
    }

    /// Its density at a distance from the edge of a wood, if that matters to it.
    pub(crate) fn at_edge(&self, depth_m: impl FnOnce() -> f64) -> f64 {
        (self.at_edges.as_ref()).map_or(1.0, |profile| profile.at(depth_m()))
    }

    /// The thinning, which is keyed by the point and depends on nothing but the patches that the
    /// point is in, and on its density at the edge of a wood.
    pub(crate) fn keeps(
        &self,
        point: &SamplePoint<Key>,
        patches: &LayerPatches<'_>,
        at_edge: f64,
    ) -> bool {
        if patches.clusters.is_some_and(|c| !c.contain(point.p)) {
            return false;
        }
        let in_gap = self.minds_gaps() && patches.gaps.is_some_and(|g| g.contain(point.p));
        match self.part {
            GapPart::Inside if !in_gap => return false,
            GapPart::Outside if in_gap => return false,
            _ => (),
        }
        let factor = if in_gap { self.in_gaps } else { 1.0 };
        self.keeps_share(point, together(factor, at_edge))
    }

    /// The thinning where the relative density is `factor`.
    pub(crate) fn keeps_share(&self, point: &SamplePoint<Key>, factor: f64) -> bool {
        let mut rng = point.key.domain(THINNING).rng();
        rng.chance(factor * self.keep[usize::from(point.variety)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::variety::DiskKind;

    #[test]
    fn patches_have_the_pattern_that_is_there_without_them() {
        let variety = DiskKind {
            weight: 1.0,
            radius_m: (0.05, 0.1),
        };
        let patches = |share, low, high| Patches {
            share,
            radius_m: (low, high),
        };
        let gaps = patches(0.1, 4.0, 9.0);
        let clusters = patches(0.08, 2.0, 5.0);
        for (part, clusters) in [
            (GapPart::Both, Some(clusters)),
            (GapPart::Inside, None),
            (GapPart::Inside, Some(clusters)),
        ] {
            let layer = CalibratedLayer {
                number: 0,
                part,
                sizes: DiskSizes::new(&[variety], vec![0.006], 50.0, 1.0),
                pattern: Pattern::Fill(1),
                blocks: Arc::default(),
                chunk_size_m: 50.0,
                max_radius: 0.002,
                keep: vec![0.5],
                in_gaps: 2.0,
                clusters,
                at_edges: None,
            };
            let (key, need) = (Key::world(8), 0.55);
            let (mut found, mut of_plane, mut wanted) = (0, 0, 0);
            for (x, y) in [(0, 0), (-7, 3), (40, -1), (1_000_000, -1_000_000)] {
                let chunk = ChunkCoord::new(x, y);
                let clusters = layer.clusters(key, chunk, need);
                let gaps = gaps.around(key.item(1), chunk, 50.0, need);
                let patches = LayerPatches {
                    gaps: Some(&gaps),
                    clusters: clusters.as_ref(),
                };
                let kept = |mut points: Vec<SamplePoint<Key>>| {
                    points.retain(|p| layer.keeps(p, &patches, 1.0));
                    points.sort_unstable_by_key(|p| p.key);
                    let bits = points.iter().map(|p| (p.key, p.p, p.radius));
                    bits.collect::<Vec<_>>()
                };
                let whole = layer.points_around(key, chunk, need, &LayerPatches::default());
                let of_patches = layer.points_around(key, chunk, need, &patches);
                found += of_patches.len();
                of_plane += whole.len();
                let of_patches = kept(of_patches);
                wanted += of_patches.len();
                assert!(of_patches == kept(whole), "{part:?} {chunk}");
            }
            // Most of the plane is not looked at.
            assert!(
                3 * found < 2 * of_plane && wanted > 20,
                "{part:?}: {wanted} of {found} of {of_plane}"
            );
        }
    }
}
