//! The engine's promises, on toy stages.

use std::sync::atomic::{AtomicU64, Ordering};

use nemoral_seed::Key;

use super::*;

static RUNS: AtomicU64 = AtomicU64::new(0);

struct Scale(f64);

impl Stage for Scale {
    type At = ();
    type Inputs = ();
    type Output = f64;
    const ID: &'static str = "scale";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        hasher.write_f64(self.0);
    }

    fn run(&self, (): (), _: Key, (): ()) -> Result<f64, Error> {
        Ok(self.0)
    }
}

struct Height;

impl Stage for Height {
    type At = ChunkCoord;
    type Inputs = (OfWorld<f64>,);
    type Output = f64;
    const ID: &'static str = "height";
    const VERSION: u32 = 1;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(&self, at: ChunkCoord, world: Key, (scale,): (Arc<f64>,)) -> Result<f64, Error> {
        RUNS.fetch_add(1, Ordering::Relaxed);
        if at == ChunkCoord::new(99, 99) {
            return Err(Error::of_stage(std::io::Error::other("no such height")));
        }
        Ok(*scale * (world.chunk(at).to_u64() % 1000) as f64)
    }
}

/// Sums a 3 x 3 neighbourhood: needs nodes at other chunks.
struct Smooth {
    width: f64,
}

impl Stage for Smooth {
    type At = ChunkCoord;
    type Inputs = (Node<ChunkCoord, f64>, AnyChunk<f64>);
    type Output = f64;
    const ID: &'static str = "smooth";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        hasher.write_f64(self.width);
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (own, any): (Arc<f64>, Demand<'_, f64>),
    ) -> Result<f64, Error> {
        let mut sum = *own * self.width;
        for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
            sum += *any.at(at.offset(dx, dy))?;
        }
        Ok(sum)
    }
}

fn plan(scale: f64, width: f64) -> (Plan, Node<ChunkCoord, f64>, Node<ChunkCoord, f64>) {
    let mut plan = Plan::new(Key::world(7));
    let scale = plan.add(Scale(scale), ());
    let height = plan.add(Height, (scale.of_world(),));
    let smooth = plan.add(Smooth { width }, (height, height.anywhere()));
    (plan, height, smooth)
}

fn square(n: i32) -> Vec<ChunkCoord> {
    (0..n * n)
        .map(|i| ChunkCoord::new(i % n - n / 2, i / n - n / 2))
        .collect()
}

#[test]
fn eight_threads_and_a_store_of_one_give_what_one_thread_gives() {
    let (plan, _, smooth) = plan(1.0, 2.0);
    let chunks = square(12);
    let reference: Vec<f64> = {
        let store = Store::unlimited();
        let runner = Runner::new(&plan, &store, 1);
        chunks
            .iter()
            .map(|&c| *runner.get(smooth, c).expect("runs"))
            .collect()
    };
    for capacity in [1, 7, usize::MAX] {
        let store = Store::with_capacity(capacity);
        let runner = Runner::new(&plan, &store, 8);
        let values = runner.demand(smooth).all(&chunks).expect("runs");
        assert_eq!(values.iter().map(|v| **v).collect::<Vec<_>>(), reference);
        // And the one world value.
        assert!(store.len() <= capacity.saturating_add(1));
        // And backwards.
        let mut backwards = chunks.clone();
        backwards.reverse();
        let values = runner.demand(smooth).all(&backwards).expect("runs");
        assert_eq!(
            values.iter().rev().map(|v| **v).collect::<Vec<_>>(),
            reference
        );
    }
}

#[test]
fn a_value_is_computed_once_while_it_is_kept() {
    let (plan, _, smooth) = plan(1.0, 2.0);
    let store = Store::unlimited();
    let runner = Runner::new(&plan, &store, 8);
    runner.demand(smooth).all(&square(6)).expect("runs");
    // 36 smooth, 36 + 4 * 6 heights, one scale.
    assert_eq!(store.computed(), 36 + 60 + 1);
    assert_eq!((store.count("smooth"), store.count("height")), (36, 60));
    store.retain(|id, at| id != "height" || at == At::Chunk(ChunkCoord::new(0, 0)));
    assert_eq!(store.count("height"), 1);
    runner.demand(smooth).all(&square(6)).expect("kept");
    assert_eq!(store.computed(), 36 + 60 + 1);
}

#[test]
fn keys_change_with_what_a_value_depends_on_and_with_nothing_else() {
    let at = ChunkCoord::new(3, -4);
    let (a, a_height, a_smooth) = plan(1.0, 2.0);
    let (b, b_height, b_smooth) = plan(1.0, 3.0);
    assert_eq!(a.key(a_height, at), b.key(b_height, at));
    assert_ne!(a.key(a_smooth, at), b.key(b_smooth, at));
    let (c, c_height, c_smooth) = plan(1.5, 2.0);
    assert_ne!(a.key(a_height, at), c.key(c_height, at));
    assert_ne!(a.key(a_smooth, at), c.key(c_smooth, at));
    assert_ne!(a.key(a_height, at), a.key(a_height, at.offset(1, 0)));
    let mut other = Plan::new(Key::world(8));
    let scale = other.add(Scale(1.0), ());
    let height = other.add(Height, (scale.of_world(),));
    assert_ne!(a.key(a_height, at), other.key(height, at));
}

#[test]
fn an_error_names_its_stage_and_chunk_and_is_not_kept() {
    let (plan, height, smooth) = plan(1.0, 2.0);
    let store = Store::unlimited();
    let runner = Runner::new(&plan, &store, 4);
    let error = runner
        .demand(smooth)
        .all(&[ChunkCoord::new(98, 99)])
        .expect_err("fails");
    assert_eq!(
        error.to_string(),
        "stage height at chunk (99, 99): no such height"
    );
    assert!(!store.contains(plan.key(height, ChunkCoord::new(99, 99))));
    assert!(runner.get(height, ChunkCoord::new(98, 99)).is_ok());
}

struct Bomb;

impl Stage for Bomb {
    type At = ();
    type Inputs = ();
    type Output = ();
    const ID: &'static str = "bomb";
    const VERSION: u32 = 1;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(&self, (): (), _: Key, (): ()) -> Result<(), Error> {
        std::thread::sleep(std::time::Duration::from_millis(50));
        panic!("on purpose")
    }
}

#[test]
fn a_panicking_stage_does_not_leave_others_waiting() {
    let mut plan = Plan::new(Key::world(1));
    let bomb = plan.add(Bomb, ());
    let store = Store::unlimited();
    let runner = Runner::new(&plan, &store, 1);
    std::thread::scope(|scope| {
        let first = scope.spawn(|| runner.get(bomb, ()));
        std::thread::sleep(std::time::Duration::from_millis(10));
        // Either it waited for the first thread, and is told, or it came later and panics itself.
        let second = scope.spawn(|| runner.get(bomb, ()));
        assert!(first.join().is_err());
        assert!(second.join().map_or(true, |r| r.is_err()));
    });
}

#[test]
fn drawings_have_every_node_and_edge() {
    let (plan, ..) = plan(1.0, 2.0);
    let dot = plan.draw(GraphFormat::Dot);
    for line in ["n0 [label=\"scale\"]", "n0 -> n1;", "n1 -> n2;"] {
        assert!(dot.contains(line), "{dot}");
    }
    assert!(plan.draw(GraphFormat::Mermaid).contains("n1 --> n2"));
    assert_eq!(plan.explain(&Store::unlimited()).lines().count(), 3);
}
