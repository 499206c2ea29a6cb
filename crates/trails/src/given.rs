//! Trails along given lines.

use glam::DVec2;
use nemoral_scene::ChunkCoord;

use crate::curve::Cubic;
use crate::layout::Course;
use crate::path::STEP_M;
use crate::trail_id::TrailId;

/// Vertices nearer to the one before are left out, as those of a recorded track that stands still.
const NEAREST_M: f64 = 1.0;

/// A trail along a line: a smooth curve through its vertices, whose direction at each is that from
/// the vertex before to the one after (Catmull and Rom). `None` for a line shorter than a metre.
pub(crate) fn course(line_m: &[DVec2], number: u32, chunk_size_m: f64) -> Option<Course> {
    let mut vertices: Vec<DVec2> = Vec::with_capacity(line_m.len());
    for &vertex in line_m {
        if vertices
            .last()
            .is_none_or(|last| last.distance(vertex) >= NEAREST_M)
        {
            vertices.push(vertex);
        }
    }
    let last = vertices.len().checked_sub(1).filter(|&last| last > 0)?;
    let direction = |i: usize| {
        let chord = vertices[(i + 1).min(last)] - vertices[i.saturating_sub(1)];
        // A line may turn back on itself.
        chord.try_normalize().unwrap_or(DVec2::X)
    };
    let (mut points, mut start) = (Vec::new(), 0.0);
    for i in 0..last {
        let ends = [vertices[i], vertices[i + 1]];
        let cubic = Cubic::between(ends, [direction(i), direction(i + 1)], f64::INFINITY);
        let (walked, length) = cubic.walk(STEP_M);
        let n = walked.len() as f64;
        for (k, (position, tangent)) in walked.into_iter().enumerate() {
            points.push((position, tangent, start + length * k as f64 / n));
        }
        start += length;
    }
    points.push((vertices[last], direction(last), start));
    let chunk_of = |p: DVec2| ChunkCoord::containing(p, chunk_size_m);
    let mut transits: Vec<(ChunkCoord, usize)> = Vec::new();
    for (i, (position, ..)) in points.iter().enumerate() {
        let chunk = chunk_of(*position);
        if transits.last().is_none_or(|(before, _)| *before != chunk) {
            transits.push((chunk, i));
        }
    }
    let birth = chunk_of(vertices[0]);
    Some(Course {
        id: TrailId { birth, number },
        points,
        transits,
    })
}
