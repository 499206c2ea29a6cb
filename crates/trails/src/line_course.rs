//! The courses of trails along given lines.

use std::collections::BTreeMap;

use glam::DVec2;
use nemoral_scene::ChunkCoord;

use crate::curve::{Cubic, PIECES};
use crate::layout::Course;
use crate::path::STEP_M;
use crate::trail_id::TrailId;

/// Vertices nearer than this to the one before are left out, metres, as those of a recorded track
/// that stands still, and so are those nearer to the line's end.
const NEAREST_M: f64 = 1.0;

/// Lines whose ends are at most this far apart go on as each other, metres.
const MEET_M: f64 = 1.0;

/// A line that is longer than this and ends where it starts is a loop, metres.
const LOOP_M: f64 = 10.0;

/// The places between two points at which it is looked which chunk they are in.
const GLANCES: u32 = 16;

/// A trail along a line: a smooth curve through its vertices, whose direction at each is that from
/// the vertex before to the one after (Catmull and Rom), in equal steps of about a metre. `None`
/// for a line shorter than a metre.
pub(crate) fn course(line_m: &[DVec2], number: u32, chunk_size_m: f64) -> Option<Course> {
    let vertices = apart(line_m)?;
    let last = vertices.len() - 1;
    let direction = |i: usize| {
        let chord = vertices[(i + 1).min(last)] - vertices[i.saturating_sub(1)];
        // A line may turn back on itself.
        chord.try_normalize().unwrap_or(DVec2::X)
    };
    let cubic = |i: usize| {
        let ends = [vertices[i], vertices[i + 1]];
        Cubic::between(ends, [direction(i), direction(i + 1)], f64::INFINITY)
    };
    // The arc lengths at which the pieces end. Steps are those of the whole line, whatever the
    // distances of its vertices are.
    let mut length = 0.0;
    let ends: Vec<f64> = (0..last)
        .map(|i| {
            length += cubic(i).arcs()[PIECES];
            length
        })
        .collect();
    let steps = (length / STEP_M).round().max(1.0) as usize;
    let step = length / steps as f64;
    let mut points = Vec::with_capacity(steps + 1);
    let mut start = 0.0;
    for (i, &end) in ends.iter().enumerate() {
        let first = points.len();
        let arcs = (first..steps).map(|k| k as f64 * step);
        let here: Vec<f64> = arcs.take_while(|&arc| arc < end).collect();
        let cubic = cubic(i);
        let table = cubic.arcs();
        let places = cubic.at_arcs(&table, here.iter().map(|arc| arc - start));
        points.extend(places.zip(&here).map(|((p, t), &arc)| (p, t, arc)));
        start = end;
    }
    points.push((vertices[last], direction(last), length));
    Some(Course {
        id: TrailId {
            birth: ChunkCoord::containing(vertices[0], chunk_size_m),
            number,
        },
        transits: transits(&points, chunk_size_m),
        points,
        free: [true; 2],
    })
}

/// The vertices of a line that are far enough apart, its first and its last among them, so that
/// lines that meet do so here, too. `None` if these two are all and too near to each other.
fn apart(line_m: &[DVec2]) -> Option<Vec<DVec2>> {
    let (&start, &end) = (line_m.first()?, line_m.last()?);
    let is_near = |a: DVec2, b: DVec2| a.distance(b) < NEAREST_M;
    let mut vertices = vec![start];
    for &vertex in line_m {
        if !is_near(vertices[vertices.len() - 1], vertex) {
            vertices.push(vertex);
        }
    }
    while vertices.len() > 1 && is_near(vertices[vertices.len() - 1], end) {
        vertices.pop();
    }
    if is_near(vertices[vertices.len() - 1], end) {
        return None;
    }
    vertices.push(end);
    Some(vertices)
}

/// The chunks that a curve goes through, in order, each with the number of its first point; where
/// it touches one between two points only, that of the second one.
fn transits(points: &[(DVec2, DVec2, f64)], chunk_size_m: f64) -> Vec<(ChunkCoord, usize)> {
    let chunk_of = |p: DVec2| ChunkCoord::containing(p, chunk_size_m);
    let mut transits = vec![(chunk_of(points[0].0), 0)];
    let mut enter = |chunk: ChunkCoord, point: usize| {
        if transits.last().is_none_or(|(before, _)| *before != chunk) {
            transits.push((chunk, point));
        }
    };
    for (i, pair) in points.windows(2).enumerate() {
        let [(a, t, from), (b, u, to)] = [pair[0], pair[1]];
        let step = to - from;
        // The curve is in the hull of these four.
        let (handle_a, handle_b) = (a + t * (step / 3.0), b - u * (step / 3.0));
        let low = a.min(b).min(handle_a).min(handle_b);
        let high = a.max(b).max(handle_a).max(handle_b);
        if chunk_of(low) != chunk_of(high) {
            let curve = Cubic {
                ends: [a, b],
                slopes: [t * step, u * step],
            };
            for k in 1..GLANCES {
                let [p, ..] = curve.at(f64::from(k) / f64::from(GLANCES));
                enter(chunk_of(p), i + 1);
            }
        }
        enter(chunk_of(b), i + 1);
    }
    transits
}

/// Which ends of lines are free, by the two ends and the length of each: those near which no other
/// line ends, and no long one its own other end.
pub(crate) fn free_ends(lines: &[([DVec2; 2], f64)]) -> Vec<[bool; 2]> {
    let cell = |p: DVec2| {
        let cell = (p / MEET_M).floor();
        [cell.x as i64, cell.y as i64]
    };
    let mut in_cell: BTreeMap<[i64; 2], Vec<(usize, usize)>> = BTreeMap::new();
    for (i, (ends, _)) in lines.iter().enumerate() {
        for (k, end) in ends.iter().enumerate() {
            in_cell.entry(cell(*end)).or_default().push((i, k));
        }
    }
    let is_free = |i: usize, k: usize| {
        let (ends, length_m) = lines[i];
        let [x, y] = cell(ends[k]);
        let goes_on = |&(j, other): &(usize, usize)| {
            let is_another = j != i || (other != k && length_m > LOOP_M);
            is_another && lines[j].0[other].distance(ends[k]) <= MEET_M
        };
        !(x - 1..=x + 1).any(|x| {
            let column = (y - 1..=y + 1).filter_map(|y| in_cell.get(&[x, y]));
            column.flatten().any(goes_on)
        })
    };
    (0..lines.len())
        .map(|i| [is_free(i, 0), is_free(i, 1)])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_as_long_whatever_the_distances_of_vertices() {
        for apart_m in [1.0, 1.45, 1.55, 2.4, 40.0] {
            let vertex = |i: u32| DVec2::new(f64::from(i) * apart_m, 3.0);
            let line: Vec<_> = (0..=100).map(vertex).collect();
            let course = course(&line, 1, 50.0).expect("a line");
            let length_m = 100.0 * apart_m;
            assert_eq!(course.points.len(), length_m.round() as usize + 1);
            for pair in course.points.windows(2) {
                let (chord, step) = (pair[0].0.distance(pair[1].0), pair[1].2 - pair[0].2);
                assert!((0.99..1.01).contains(&step), "{step} at {apart_m}");
                assert!((chord - step).abs() < 1e-6, "{chord} {step}");
            }
            let end = course.points[course.points.len() - 1];
            assert_eq!(end.0, line[100]);
            assert!((end.2 - length_m).abs() < 1e-6);
        }
    }

    #[test]
    fn a_line_ends_at_its_last_vertex_however_near_others_are() {
        let line = |places: &[[f64; 2]]| {
            let vertices: Vec<DVec2> = places.iter().copied().map(DVec2::from_array).collect();
            course(&vertices, 1, 50.0)
        };
        let ends = |places: &[[f64; 2]]| {
            let course = line(places).expect("a line");
            let [first, last] = [0, course.points.len() - 1].map(|i| course.points[i]);
            ([first.0, last.0], last.2)
        };
        // Two lines that meet, each with a vertex shortly before.
        let middle = DVec2::new(49.95, 0.0);
        let both = [
            ends(&[[0.0, 0.0], [49.0, 0.0], [49.95, 0.0]]),
            ends(&[[100.0, 0.0], [50.9, 0.0], [49.95, 0.0]]),
        ];
        assert_eq!(both[0].0, [DVec2::ZERO, middle]);
        assert_eq!(both[1].0, [DVec2::new(100.0, 0.0), middle]);
        assert!((both[0].1 - 49.95).abs() < 1e-6 && (both[1].1 - 50.05).abs() < 1e-6);
        assert_eq!(free_ends(&both), [[true, false]; 2]);
        // A track at walking speed.
        let walked: Vec<[f64; 2]> = (0..60).map(|i| [0.0, 0.9 * f64::from(i)]).collect();
        let ([start, end], length_m) = ends(&walked);
        assert_eq!([start, end].map(|p| p.to_array()), [walked[0], walked[59]]);
        assert!((length_m - 53.1).abs() < 1e-6, "{length_m}");
        // Where vertices are far enough apart, all are kept.
        let far = [[0.0, 0.0], [5.0, 0.0], [5.0, 1.0], [9.0, 1.0]].map(DVec2::from_array);
        assert_eq!(apart(&far), Some(far.to_vec()));
        // There and back within a metre.
        assert!(line(&[[0.0, 0.0], [0.9, 0.0], [1.2, 0.0], [0.8, 0.0]]).is_none());
        assert!(line(&[[0.0, 0.0], [0.9, 0.0]]).is_none() && line(&[]).is_none());
    }

    #[test]
    fn chunks_that_a_line_touches_between_two_points_are_known() {
        // It cuts the corner of chunk (0, 1) by `cut_m` on both sides.
        for cut_m in [0.15, 0.3, 0.5] {
            for shift in 0..10 {
                let start = -20.3 - 0.1 * f64::from(shift);
                let line = [start, 70.0].map(|x| DVec2::new(x, x + cut_m));
                let course = course(&line, 1, 50.0).expect("a line");
                let chunks: Vec<_> = course.transits.iter().map(|t| [t.0.x, t.0.y]).collect();
                let expected = [[-1, -1], [-1, 0], [0, 0], [0, 1], [1, 1]];
                assert_eq!(chunks, expected, "{cut_m} {start}");
                assert!(course.transits.is_sorted_by_key(|t| t.1));
                assert!(course.transits.iter().all(|t| t.1 < course.points.len()));
            }
        }
    }

    #[test]
    fn ends_are_free_unless_a_line_goes_on_there() {
        let at = DVec2::new;
        let lines = [
            ([at(0.0, 0.0), at(100.0, 0.0)], 100.0),
            ([at(100.6, 0.6), at(200.0, 0.0)], 101.0),
            // A loop, a line that only looks like one, and one that ends beside another.
            ([at(-50.0, 0.0), at(-50.5, 0.5)], 60.0),
            ([at(-90.0, 0.0), at(-90.9, 0.0)], 1.2),
            ([at(0.0, 1.2), at(0.0, 90.0)], 88.8),
        ];
        let free = free_ends(&lines);
        let expected = [
            [true, false],
            [false, true],
            [false, false],
            [true, true],
            [true, true],
        ];
        assert_eq!(free, expected);
    }
}
