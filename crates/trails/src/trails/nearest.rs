//! The trail that is nearest to a place.

use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::ChunkCoord;

use crate::{TrailPath, Trails};

/// The greatest distance within which a trail is searched, metres.
const SEARCHED_M: f64 = 5000.0;
/// No chunk that is searched or makes a trail there is as many chunks away.
const SEARCHED_CHUNKS: i32 = 10_000;
/// How much farther than its nearest place the chunk of a passage may be, metres.
const BESIDE_M: f64 = 2.0;

impl Trails {
    /// The trail nearest to a point within `radius_m` of it, and the arc length of the closest
    /// point of its middle. Chunks are searched ring by ring until a trail is found; a radius above
    /// 5 km counts as that.
    #[must_use]
    pub fn nearest(&self, world_m: DVec2, radius_m: f64) -> Option<(Arc<TrailPath>, f64)> {
        self.nearest_where(world_m, radius_m, |_| true)
    }

    /// As [`nearest`](Self::nearest), of the trails that are `wanted`.
    #[must_use]
    pub fn nearest_where(
        &self,
        world_m: DVec2,
        radius_m: f64,
        wanted: impl Fn(&TrailPath) -> bool,
    ) -> Option<(Arc<TrailPath>, f64)> {
        let size = self.chunk_size_m;
        // Rings of chunks have coordinates, and what is not a number has no trail.
        let farthest_m = f64::from(i32::MAX - SEARCHED_CHUNKS) * size;
        let has_chunks = world_m.abs().cmple(DVec2::splat(farthest_m)).all();
        if !has_chunks || radius_m.is_nan() {
            return None;
        }
        let radius_m = radius_m.min(SEARCHED_M);
        let centre = ChunkCoord::containing(world_m, size);
        let rings = (radius_m / size).ceil().max(0.0) as i32;
        let (bound_m, _) = (0..=rings).find_map(|i| {
            let near = ring(centre, i).filter(|c| c.distance_m(world_m, size) <= radius_m);
            self.nearest_in(near, (world_m, radius_m), &wanted)
        })?;
        // In the next rings there may be nearer ones, and of equally near ones the first counts.
        let reach_m = radius_m.min(bound_m + BESIDE_M);
        let near = ChunkCoord::within(world_m, reach_m, size).into_iter();
        let best = self.nearest_in(near, (world_m, radius_m), &wanted);
        best.map(|(_, found)| found)
    }

    /// The nearest of the trails that are `wanted` by their passages through chunks, its distance
    /// and the arc length of its closest point; of equally near ones, that which is found first.
    fn nearest_in(
        &self,
        chunks: impl Iterator<Item = ChunkCoord>,
        (world_m, radius_m): (DVec2, f64),
        wanted: &impl Fn(&TrailPath) -> bool,
    ) -> Option<(f64, (Arc<TrailPath>, f64))> {
        let mut best = (radius_m, None);
        for chunk in chunks {
            for path in self.in_chunk(chunk).into_iter().filter(|p| wanted(p)) {
                for (_, _, knots) in path.transits().filter(|t| t.1 == chunk) {
                    let square = |i: usize| path.knots()[i].position.distance_squared(world_m);
                    // The knot after a transit's last is on its border.
                    let end = (knots.end + 1).min(path.knots().len());
                    let knot = (knots.start..end).min_by(|&a, &b| square(a).total_cmp(&square(b)));
                    let foot = knot.map(|knot| path.foot(world_m, knot));
                    let closer = |d: f64| d < best.0 || (d == best.0 && best.1.is_none());
                    if let Some(foot) = foot.filter(|f| closer(f.distance)) {
                        best = (foot.distance, Some((Arc::clone(&path), foot.arc)));
                    }
                }
            }
        }
        let (distance_m, found) = best;
        found.map(|found| (distance_m, found))
    }
}

/// The chunks that are this many chunks away from one, diagonally too, in order of (x, y).
fn ring(centre: ChunkCoord, rings: i32) -> impl Iterator<Item = ChunkCoord> {
    (-rings..=rings).flat_map(move |x| {
        // Whole columns at both sides, and the ends of those between.
        let step = if x.abs() == rings {
            1
        } else {
            2 * rings as usize
        };
        (-rings..=rings)
            .step_by(step)
            .map(move |y| centre.offset(x, y))
    })
}
