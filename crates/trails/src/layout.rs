//! The exact points at which a trail crosses the borders of its chunks.

use glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_seed::{Domain, Draw, Key};

use crate::curve::Cubic;
use crate::route::Step;
use crate::trail_id::TrailId;
use crate::turning::turning_loop;

const CROSSING: Domain = Domain::new("trails.crossing");
const END: Domain = Domain::new("trails.end");

/// The number of places on a border, of which a trail takes the one with the least climb.
const CANDIDATES: usize = 4;

/// The greatest angle of a trail to the border's normal where it crosses, radians.
const LEAN_RAD: f64 = 0.5;

/// A trail on the map.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    pub(crate) id: TrailId,
    /// At least two: position, unit direction, arc length from the start.
    pub(crate) points: Vec<(DVec2, DVec2, f64)>,
    /// Chunks in order, each with the number of its first point.
    pub(crate) transits: Vec<(ChunkCoord, usize)>,
    /// Whether it fades at its start and at its end, as it does unless another one goes on there.
    pub(crate) free: [bool; 2],
}

/// The crossings of a trail: points and directions, its ends included.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    id: TrailId,
    chunk_size_m: f64,
    steps: Vec<Step>,
    /// The crossings, one more than there are steps; `nodes[i]` is where `steps[i]` begins.
    nodes: Vec<Node>,
    /// The radius of the loops at its beginning and its end, metres.
    turning_m: [Option<f64>; 2],
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Node {
    pub(crate) position: DVec2,
    pub(crate) direction: DVec2,
}

impl Layout {
    /// Lays out a trail that goes through at least one chunk; from the second one on, its ends may
    /// be loops of the radius `turning_m`. A branch begins at a crossing of the trail that it
    /// leaves, in the same direction.
    ///
    /// Crossings and directions are drawn from keys of the trail, the border and the number of the
    /// step, so both sides of a border agree.
    pub(crate) fn new(
        key: Key,
        (id, steps): (TrailId, Vec<Step>),
        fork: Option<Node>,
        chunk_size_m: f64,
        turning_m: Option<f64>,
        base: &dyn Surface,
    ) -> Self {
        let last = steps.len() - 1;
        let turning_m = turning_m.filter(|_| last > 0);
        let end = |step: &Step, side: f64, index: u64| {
            let mut rng = id.key(key.domain(END)).item(index).rng();
            let jitter = DVec2::new(rng.range_f64(-0.1, 0.1), rng.range_f64(-0.1, 0.1));
            let offset = match turning_m {
                // The loop needs the other half of the chunk.
                Some(_) => jitter * 0.2,
                None => step.exit.vector() * (0.25 * side) + jitter,
            };
            step.chunk.centre_m(chunk_size_m) + offset * chunk_size_m
        };
        // A trail ends a quarter of a chunk past the middle of the last one, straight on.
        let entered = Step {
            exit: steps[last.saturating_sub(1)].exit,
            ..steps[last]
        };
        let first = fork.map_or_else(|| end(&steps[0], -1.0, 0), |node| node.position);
        let mut points = vec![first];
        for (i, step) in steps[..last].iter().enumerate() {
            let mut rng = border_key(id.key(key.domain(CROSSING)), step)
                .item(i as u64)
                .rng();
            let before = points[i];
            let height = base.height_m(before);
            let mut best = (f64::INFINITY, before);
            for _ in 0..CANDIDATES {
                let point = on_border(step, rng.range_f64(0.25, 0.75), chunk_size_m);
                let climb = (base.height_m(point) - height).abs() / point.distance(before);
                if climb < best.0 {
                    best = (climb, point);
                }
            }
            points.push(best.1);
        }
        points.push(end(&entered, 1.0, 1));

        let mut nodes = Vec::with_capacity(points.len());
        for (i, &position) in points.iter().enumerate() {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(points.len() - 1));
            let chord = points[b] - points[a];
            let inner = 0 < i && i < points.len() - 1;
            let direction = if let Some(node) = fork.filter(|_| i == 0) {
                node.direction
            } else if inner {
                // The border's normal, turned towards the direction between the neighbouring nodes,
                // with a small random angle.
                let normal = steps[i - 1].exit.vector();
                let mut rng = border_key(id.key(key.domain(CROSSING)), &steps[i - 1])
                    .item(i as u64 - 1)
                    .item(0)
                    .rng();
                let lean = libm::atan2(normal.perp_dot(chord), normal.dot(chord));
                let lean = (lean + rng.range_f64(-0.15, 0.15)).clamp(-LEAN_RAD, LEAN_RAD);
                let turn = DVec2::new(libm::cos(lean), libm::sin(lean));
                turn.rotate(normal)
            } else if turning_m.is_some() {
                let step = if i == 0 { &steps[0] } else { &entered };
                step.exit.vector()
            } else {
                chord / chord.length().max(f64::MIN_POSITIVE)
            };
            nodes.push(Node {
                position,
                direction,
            });
        }
        Self {
            id,
            chunk_size_m,
            steps,
            nodes,
            turning_m: [turning_m.filter(|_| fork.is_none()), turning_m],
        }
    }

    /// The crossing at the beginning of a step.
    pub(crate) fn node(&self, step: usize) -> Node {
        self.nodes[step]
    }

    /// Its steps.
    pub(crate) fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The trail with points about `step_m` apart.
    pub(crate) fn course(&self, step_m: f64) -> Course {
        let mut points = Vec::new();
        let mut transits = Vec::new();
        let mut start = 0.0;
        let turn = |end: usize, foot: DVec2, direction| {
            let turning = self.turning_m[end].into_iter();
            turning.flat_map(move |radius_m| turning_loop(foot, direction, radius_m, step_m))
        };
        let Node {
            position,
            direction,
        } = self.nodes[0];
        for point in turn(0, position, -direction) {
            start = point.2;
            points.push(point);
        }
        // The foot is the first point of the run, too.
        points.pop();
        for (step, pair) in self.steps.iter().zip(self.nodes.windows(2)) {
            let ends = [pair[0].position, pair[1].position];
            let directions = [pair[0].direction, pair[1].direction];
            // Handles this short stay in the chunk, and so does the curve.
            let cubic = Cubic::between(ends, directions, 0.48 * self.chunk_size_m);
            let first = if transits.is_empty() { 0 } else { points.len() };
            transits.push((step.chunk, first));
            let (walked, length) = cubic.walk(step_m);
            let n = walked.len() as f64;
            for (i, (p, t)) in walked.into_iter().enumerate() {
                points.push((p, t, start + length * i as f64 / n));
            }
            start += length;
        }
        let end = self.nodes[self.nodes.len() - 1];
        points.push((end.position, end.direction, start));
        for (position, direction, arc) in turn(1, end.position, end.direction).skip(1) {
            points.push((position, direction, start + arc));
        }
        Course {
            id: self.id,
            points,
            transits,
            free: [true; 2],
        }
    }
}

/// The key of the border by which a step leaves its chunk, whichever way it is crossed.
fn border_key(key: Key, step: &Step) -> Key {
    let (dx, dy) = step.exit.step();
    let owner = step.chunk.offset(dx.max(0), dy.max(0));
    key.chunk(owner).item(u64::from(dy != 0))
}

/// The world point at a share of the border by which a step leaves its chunk.
fn on_border(step: &Step, share: f64, chunk_size_m: f64) -> DVec2 {
    let (dx, dy) = step.exit.step();
    let owner = step.chunk.offset(dx.max(0), dy.max(0));
    let along = if dx == 0 { DVec2::X } else { DVec2::Y };
    owner.origin_m(chunk_size_m) + along * (share * chunk_size_m)
}
