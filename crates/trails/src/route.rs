//! The chunks that a trail goes through.

use glam::DVec2;
use nemoral_scene::ChunkCoord;
use nemoral_seed::{Domain, Draw, Key};

use crate::TrailParams;
use crate::trail_id::TrailId;

const ROUTE: Domain = Domain::new("trails.route");
const FORKS: Domain = Domain::new("trails.forks");

/// The least and the most chunks that a branch goes through.
const BRANCH_CHUNKS: [u32; 2] = [2, 6];

/// A compass direction: 0 east, 1 north, 2 west, 3 south.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CompassDirection(u8);

impl CompassDirection {
    pub(crate) fn step(self) -> (i32, i32) {
        [(1, 0), (0, 1), (-1, 0), (0, -1)][usize::from(self.0)]
    }

    pub(crate) fn vector(self) -> DVec2 {
        let (x, y) = self.step();
        DVec2::new(f64::from(x), f64::from(y))
    }

    /// One quarter turn to the left.
    pub(crate) fn left(self) -> Self {
        Self((self.0 + 1) % 4)
    }

    fn right(self) -> Self {
        Self((self.0 + 3) % 4)
    }
}

/// A chunk on the route of a trail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    pub(crate) chunk: ChunkCoord,
    /// The direction in which the chunk is left, or would be.
    pub(crate) exit: CompassDirection,
}

/// Decides where trails are born and where they turn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Router {
    key: Key,
    forks: Key,
    spawn_probability: f64,
    forward_probability: f64,
    max_length: u32,
    fork_probability: f64,
}

impl Router {
    pub(crate) fn new(params: &TrailParams, key: Key) -> Self {
        Self {
            key: key.domain(ROUTE),
            forks: key.domain(FORKS),
            spawn_probability: params.spawn_probability,
            forward_probability: params.forward_probability,
            max_length: params.max_length_chunks,
            fork_probability: params.fork_probability,
        }
    }

    /// The route of the trail that is born in a chunk, if there is one.
    ///
    /// The first chunk is left in a uniform direction, every further one by the opposite border
    /// with the forward probability, else by the left or the right one. The number of chunks is
    /// uniform from half the longest.
    pub(crate) fn walk(&self, birth: ChunkCoord) -> Option<Walk> {
        let mut rng = self.key.chunk(birth).rng();
        if !rng.chance(self.spawn_probability) {
            return None;
        }
        let exit = CompassDirection(rng.below(4) as u8);
        let left = rng.between(self.max_length.div_ceil(2), self.max_length);
        Some(Walk {
            forward_probability: self.forward_probability,
            rng,
            left,
            next: Step { chunk: birth, exit },
        })
    }

    /// The branch that leaves a trail of these steps at the beginning of one of them, through one
    /// of the two other borders of that step's chunk, if there is one.
    pub(crate) fn branch(&self, birth: ChunkCoord, steps: &[Step], at: usize) -> Option<Walk> {
        // There is none where the trail begins, and none where it ends.
        if at == 0 || at + 1 >= steps.len() {
            return None;
        }
        let mut rng = self.forks.chunk(birth).item(at as u64).rng();
        if !rng.chance(self.fork_probability) {
            return None;
        }
        let entered = steps[at - 1].exit;
        let others = [entered, entered.left(), entered.right()];
        let mut others = others.into_iter().filter(|&e| e != steps[at].exit);
        let exit = others.nth(rng.below(2) as usize)?;
        let left = rng.between(BRANCH_CHUNKS[0], BRANCH_CHUNKS[1]);
        let chunk = steps[at].chunk;
        Some(Walk {
            forward_probability: self.forward_probability,
            rng,
            left,
            next: Step { chunk, exit },
        })
    }

    /// All trails and branches that go through each chunk of a block, in order.
    pub(crate) fn through(&self, block: Block) -> Vec<Vec<TrailId>> {
        let branch = if self.fork_probability > 0.0 {
            BRANCH_CHUNKS[1] as i32 - 1
        } else {
            0
        };
        let reach = self.max_length as i32 - 1 + branch;
        let mut ids = vec![Vec::new(); (Block::SIDE * Block::SIDE) as usize];
        let mut add = |id: TrailId, steps: &[Step]| {
            for step in steps {
                let here = block.index(step.chunk).map(|i| &mut ids[i]);
                // Trails may come back.
                if let Some(here) = here.filter(|here| here.last() != Some(&id)) {
                    here.push(id);
                }
            }
        };
        for dx in -reach..Block::SIDE + reach {
            for dy in -reach..Block::SIDE + reach {
                if Block::beyond(dx) + Block::beyond(dy) > reach {
                    continue;
                }
                let birth = block.first().offset(dx, dy);
                let Some(walk) = self.walk(birth) else {
                    continue;
                };
                let steps: Vec<Step> = walk.collect();
                add(TrailId { birth, number: 0 }, &steps);
                for at in 0..steps.len() {
                    if block.borders_to(steps[at].chunk) < BRANCH_CHUNKS[1] as i32
                        && let Some(walk) = self.branch(birth, &steps, at)
                    {
                        add(TrailId::branch(birth, at), &walk.collect::<Vec<_>>());
                    }
                }
            }
        }
        ids
    }
}

/// A square of chunks, for which trails are looked for at once: those of neighbouring chunks are
/// born in almost the same places.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Block {
    x: i32,
    y: i32,
}

impl Block {
    const SIDE: i32 = 8;

    /// The block of a chunk.
    pub(crate) fn of(chunk: ChunkCoord) -> Self {
        Self {
            x: chunk.x.div_euclid(Self::SIDE),
            y: chunk.y.div_euclid(Self::SIDE),
        }
    }

    /// Its chunk of the least coordinates.
    fn first(self) -> ChunkCoord {
        ChunkCoord::new(self.x * Self::SIDE, self.y * Self::SIDE)
    }

    /// The number of a chunk in this block, if it is in it.
    pub(crate) fn index(self, chunk: ChunkCoord) -> Option<usize> {
        let (dx, dy) = (
            chunk.x.rem_euclid(Self::SIDE),
            chunk.y.rem_euclid(Self::SIDE),
        );
        (Self::of(chunk) == self).then_some((Self::SIDE * dy + dx) as usize)
    }

    /// How many chunks a coordinate from the first chunk on is outside.
    fn beyond(offset: i32) -> i32 {
        (-offset).max(offset - (Self::SIDE - 1)).max(0)
    }

    /// The least number of borders between a chunk and one of these.
    fn borders_to(self, chunk: ChunkCoord) -> i32 {
        let first = self.first();
        Self::beyond(chunk.x - first.x) + Self::beyond(chunk.y - first.y)
    }
}

/// The steps of a trail, one by one.
#[derive(Clone, Debug)]
pub(crate) struct Walk {
    forward_probability: f64,
    rng: nemoral_seed::PhiloxRng,
    left: u32,
    next: Step,
}

impl Iterator for Walk {
    type Item = Step;

    fn next(&mut self) -> Option<Step> {
        self.left = self.left.checked_sub(1)?;
        let step = self.next;
        let (dx, dy) = step.exit.step();
        let exit = if self.rng.chance(self.forward_probability) {
            step.exit
        } else if self.rng.chance(0.5) {
            step.exit.left()
        } else {
            step.exit.right()
        };
        let chunk = step.chunk.offset(dx, dy);
        self.next = Step { chunk, exit };
        Some(step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    fn router(spawn: f64, forward: f64, length: u32, seed: u64) -> Router {
        let params = TrailParams {
            spawn_probability: spawn,
            forward_probability: forward,
            max_length_chunks: length,
            ..TrailParams::default()
        };
        Router::new(&params, Key::world(seed))
    }

    fn square(n: i32) -> impl Iterator<Item = ChunkCoord> {
        (-n..n).flat_map(move |x| (-n..n).map(move |y| ChunkCoord::new(x, y)))
    }

    #[test]
    fn births_come_with_the_spawn_probability() {
        for p in [0.0, 0.02, 0.3, 1.0] {
            let router = router(p, 0.7, 40, 3);
            let n = 10_000.0;
            let births = square(50).filter(|&c| router.walk(c).is_some()).count() as f64;
            let sigma = f64::sqrt(n * p * (1.0 - p));
            assert!(
                (births - n * p).abs() <= 3.0 * sigma,
                "{births} of {n} at {p}"
            );
        }
    }

    #[test]
    fn trails_go_forward_with_the_forward_probability() {
        for p in [0.0, 0.35, 0.9, 1.0] {
            let router = router(1.0, p, 40, 4);
            let (mut forward, mut left, mut all) = (0.0, 0.0, 0.0);
            for birth in square(11) {
                let steps: Vec<_> = router.walk(birth).expect("always").collect();
                for pair in steps.windows(2) {
                    all += 1.0;
                    forward += f64::from(u8::from(pair[0].exit == pair[1].exit));
                    left += f64::from(u8::from(pair[0].exit.left() == pair[1].exit));
                }
            }
            assert!(all > 1e4);
            let sigma = |p: f64| 3.0 * f64::sqrt(all * p * (1.0 - p));
            assert!(
                (forward - all * p).abs() <= sigma(p),
                "{forward} of {all} at {p}"
            );
            let q = (1.0 - p) / 2.0;
            assert!((left - all * q).abs() <= sigma(q), "{left} of {all} at {q}");
        }
    }

    #[test]
    fn branches_come_with_their_probability_and_leave_by_another_border() {
        let params = TrailParams {
            spawn_probability: 1.0,
            fork_probability: 0.2,
            ..TrailParams::default()
        };
        let router = Router::new(&params, Key::world(4));
        let (mut forks, mut places) = (0.0, 0.0);
        for birth in square(8) {
            let steps: Vec<_> = router.walk(birth).expect("always").collect();
            places += steps.len() as f64 - 2.0;
            for at in 0..steps.len() {
                let Some(walk) = router.branch(birth, &steps, at) else {
                    continue;
                };
                let branch: Vec<_> = walk.collect();
                assert!((2..=6).contains(&branch.len()));
                assert_eq!(branch[0].chunk, steps[at].chunk);
                let back = steps[at - 1].exit.left().left();
                assert!(branch[0].exit != steps[at].exit && branch[0].exit != back);
                forks += 1.0;
            }
        }
        let sigma = f64::sqrt(places * 0.2 * 0.8);
        assert!(
            (forks - 0.2 * places).abs() < 3.0 * sigma,
            "{forks} of {places}"
        );
    }

    #[test]
    fn steps_go_to_the_neighbour_and_lengths_are_in_range() {
        let router = router(1.0, 0.5, 9, 5);
        let mut lengths = HashSet::new();
        for birth in square(10) {
            let steps: Vec<_> = router.walk(birth).expect("always").collect();
            assert_eq!(steps[0].chunk, birth);
            for pair in steps.windows(2) {
                let (dx, dy) = pair[0].exit.step();
                assert_eq!(pair[1].chunk, pair[0].chunk.offset(dx, dy));
            }
            lengths.insert(steps.len());
        }
        assert_eq!(lengths, HashSet::from([5, 6, 7, 8, 9]));
    }

    #[test]
    fn trails_through_a_chunk_are_the_brute_force_answer() {
        let params = TrailParams {
            spawn_probability: 0.6,
            forward_probability: 0.6,
            max_length_chunks: 7,
            fork_probability: 0.3,
            ..TrailParams::default()
        };
        let router = Router::new(&params, Key::world(6));
        for chunk in [
            ChunkCoord::new(0, 0),
            ChunkCoord::new(-1, 7),
            ChunkCoord::new(1_000_000, -1_000_000),
        ] {
            let mut expected = Vec::new();
            for birth in square(15).map(|c| chunk.offset(c.x, c.y)) {
                let steps: Vec<_> = router.walk(birth).into_iter().flatten().collect();
                if steps.iter().any(|s| s.chunk == chunk) {
                    expected.push(TrailId { birth, number: 0 });
                }
                for at in 0..steps.len() {
                    let branch = router.branch(birth, &steps, at);
                    if branch.into_iter().flatten().any(|s| s.chunk == chunk) {
                        expected.push(TrailId::branch(birth, at));
                    }
                }
            }
            expected.sort_unstable();
            let branches = expected.iter().filter(|id| id.is_branch()).count();
            assert!(branches > 0 && branches < expected.len());
            let block = Block::of(chunk);
            let index = block.index(chunk).expect("its own block");
            assert_eq!(router.through(block)[index], expected);
        }
    }

    #[test]
    fn value_stability() {
        let steps: Vec<_> = router(1.0, 0.5, 6, 7)
            .walk(ChunkCoord::new(-3, 5))
            .expect("always")
            .map(|s| (s.chunk.x, s.chunk.y))
            .collect();
        assert_eq!(steps, VALUES);
    }
    const VALUES: [(i32, i32); 6] = [(-3, 5), (-2, 5), (-2, 6), (-2, 7), (-2, 8), (-1, 8)];
}
