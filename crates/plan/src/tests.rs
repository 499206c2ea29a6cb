//! The guarantees of the engine, tested on toy stages.

use std::sync::{Arc, Condvar, Mutex, mpsc};
use std::time::Duration;

use crate::*;

/// A coordinate of the toy plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum At {
    Everywhere,
    Cell(Cell),
}

/// A cell of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Cell(i32, i32);

impl Cell {
    fn offset(self, dx: i32, dy: i32) -> Self {
        Self(self.0 + dx, self.1 + dy)
    }
}

impl AnyCoordinate for At {
    const GLOBAL: Self = Self::Everywhere;

    fn hash(self, hasher: &mut Hasher) {
        if let Self::Cell(Cell(x, y)) = self {
            hasher.write_i64(i64::from(x));
            hasher.write_i64(i64::from(y));
        }
    }
}

impl Coordinate<Toy> for Cell {
    fn erase(self) -> At {
        At::Cell(self)
    }

    fn restore(at: At) -> Option<Self> {
        if let At::Cell(cell) = at {
            Some(cell)
        } else {
            None
        }
    }
}

#[derive(Clone, Debug, PartialEq, thiserror::Error)]
enum Error {
    #[error("no such height")]
    NoHeight,
    #[error("stage {0} at {1:?}: no such height")]
    NoHeightAt(&'static str, At),
    #[error("stage {0} at {1:?} panicked")]
    Panicked(&'static str, At),
}

impl StageError<At> for Error {
    fn in_stage(self, stage: &'static str, at: At) -> Self {
        match self {
            Self::NoHeight => Self::NoHeightAt(stage, at),
            other => other,
        }
    }

    fn panicked(stage: &'static str, at: At) -> Self {
        Self::Panicked(stage, at)
    }
}

/// The context is a seed.
enum Toy {}

impl PlanTypes for Toy {
    type At = At;
    type Context = u64;
    type Error = Error;

    fn hash_context(seed: &u64, hasher: &mut Hasher) {
        hasher.write_u64(*seed);
    }
}

struct Scale(f64);

impl Stage<Toy> for Scale {
    type At = ();
    type Inputs = ();
    type Output = f64;
    const ID: &'static str = "scale";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        hasher.write_f64(self.0);
    }

    fn run(&self, (): (), _: u64, (): ()) -> Result<f64, Error> {
        Ok(self.0)
    }
}

struct Height;

impl Stage<Toy> for Height {
    type At = Cell;
    type Inputs = (GlobalEdge<f64>,);
    type Output = f64;
    const ID: &'static str = "height";
    const VERSION: u32 = 1;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(&self, at: Cell, seed: u64, (scale,): (Arc<f64>,)) -> Result<f64, Error> {
        if at == Cell(99, 99) {
            return Err(Error::NoHeight);
        }
        let mixed = (i64::from(at.0) * 7919 + i64::from(at.1) * 104_729).unsigned_abs() * seed;
        Ok(*scale * (mixed % 1000) as f64)
    }
}

/// Sums a 3 x 3 neighbourhood: needs nodes at other cells.
struct Smooth {
    width: f64,
}

impl Stage<Toy> for Smooth {
    type At = Cell;
    type Inputs = (Node<Cell, f64>, DynamicEdge<Cell, f64>);
    type Output = f64;
    const ID: &'static str = "smooth";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        hasher.write_f64(self.width);
    }

    fn run(
        &self,
        at: Cell,
        _: u64,
        (own, any): (Arc<f64>, Demand<'_, Toy, Cell, f64>),
    ) -> Result<f64, Error> {
        let mut sum = *own * self.width;
        for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
            sum += *any.at(at.offset(dx, dy))?;
        }
        Ok(sum)
    }
}

fn plan(scale: f64, width: f64) -> (Plan<Toy>, Node<Cell, f64>, Node<Cell, f64>) {
    let mut plan = Plan::new(7);
    let scale = plan.add(Scale(scale), ());
    let height = plan.add(Height, (scale.global(),));
    let smooth = plan.add(Smooth { width }, (height, height.anywhere()));
    (plan, height, smooth)
}

fn square(n: i32) -> Vec<Cell> {
    (0..n * n)
        .map(|i| Cell(i % n - n / 2, i / n - n / 2))
        .collect()
}

#[test]
fn eight_threads_and_a_store_of_one_give_what_one_thread_gives() {
    let (plan, _, smooth) = plan(1.0, 2.0);
    let cells = square(12);
    let reference: Vec<f64> = {
        let store = Store::unlimited();
        let runner = Runner::new(&plan, &store, 1);
        cells
            .iter()
            .map(|&c| *runner.get(smooth, c).expect("runs"))
            .collect()
    };
    for capacity in [1, 7, usize::MAX] {
        let store = Store::with_capacity(capacity);
        let runner = Runner::new(&plan, &store, 8);
        let values = runner.demand(smooth).all(&cells).expect("runs");
        assert_eq!(values.iter().map(|v| **v).collect::<Vec<_>>(), reference);
        // The one global value comes on top.
        assert!(store.len() <= capacity.saturating_add(1));
        // The same in reverse order.
        let mut backwards = cells.clone();
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
    store.retain(|id, at| id != "height" || at == At::Cell(Cell(0, 0)));
    assert_eq!(store.count("height"), 1);
    runner.demand(smooth).all(&square(6)).expect("kept");
    assert_eq!(store.computed(), 36 + 60 + 1);
}

/// The first cell's value is computed only once that of the second is.
struct Patient {
    second_is_done: Arc<(Mutex<bool>, Condvar)>,
    first_has_begun: mpsc::Sender<()>,
}

impl Stage<Toy> for Patient {
    type At = Cell;
    type Inputs = ();
    type Output = Vec<i32>;
    const ID: &'static str = "patient";
    const VERSION: u32 = 1;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(&self, at: Cell, _: u64, (): ()) -> Result<Vec<i32>, Error> {
        let (done, changed) = &*self.second_is_done;
        let mut done = done.lock().expect("no panic");
        if at.0 == 0 {
            self.first_has_begun.send(()).expect("a listener");
            let wait = Duration::from_secs(20);
            let waited = changed.wait_timeout_while(done, wait, |done| !*done);
            if waited.expect("no panic").1.timed_out() {
                return Err(Error::NoHeight);
            }
        } else {
            *done = true;
            changed.notify_all();
        }
        Ok(vec![at.0])
    }
}

#[test]
fn what_another_thread_computes_is_waited_for_at_last() {
    type Ask = fn(&Demand<'_, Toy, Cell, Vec<i32>>, [Cell; 2]) -> Result<Vec<i32>, Error>;
    let joined: Ask = |demand, cells| demand.joined(cells);
    let all: Ask = |demand, cells| Ok(demand.all(&cells)?.iter().map(|list| list[0]).collect());
    for ask in [joined, all] {
        let (first_has_begun, begun) = mpsc::channel();
        let mut plan: Plan<Toy> = Plan::new(1);
        let patient = Patient {
            second_is_done: Arc::default(),
            first_has_begun,
        };
        let node = plan.add(patient, ());
        let store = Store::unlimited();
        let runner = Runner::new(&plan, &store, 1);
        std::thread::scope(|scope| {
            let first = scope.spawn(|| runner.get(node, Cell(0, 0)));
            begun.recv().expect("the first begins");
            let both = ask(&runner.demand(node), [Cell(0, 0), Cell(1, 0)]);
            assert_eq!(both, Ok(vec![0, 1]));
            assert_eq!(first.join().expect("no panic"), Ok(Arc::new(vec![0])));
        });
    }
}

#[test]
fn demands_of_several_nodes_are_computed_together() {
    let (plan, height, smooth) = plan(1.0, 2.0);
    for threads in [1, 3, 50, usize::MAX] {
        let store = Store::unlimited();
        let runner = Runner::new(&plan, &store, threads);
        let (smooth, height) = (runner.demand(smooth), runner.demand(height));
        let far = [Cell(40, 40)];
        let batch = smooth.batch(&square(3)).and(height.batch(&far));
        batch.compute().expect("runs");
        // 9 smooth, 9 + 4 * 3 heights and a far one, one scale.
        assert_eq!(store.computed(), 9 + 21 + 1 + 1);
        smooth.batch(&[]).compute().expect("nothing");
        // The first in their order.
        let bad = height
            .batch(&[Cell(99, 99)])
            .and(smooth.batch(&[Cell(98, 99)]));
        let error = bad.and(height.batch(&far)).compute().expect_err("fails");
        assert_eq!(error, Error::NoHeightAt("height", At::Cell(Cell(99, 99))));
    }
}

#[test]
fn a_plan_that_follows_another_keeps_what_both_have() {
    let (first, _, smooth) = plan(1.0, 2.0);
    let (second, _, other) = plan(1.0, 3.0);
    let store = Store::unlimited();
    let before = Runner::new(&first, &store, 1).demand(smooth);
    before.all(&square(4)).expect("runs");
    let after = Runner::new(&second, &store, 1);
    after.get(other, Cell(0, 0)).expect("runs");
    let heights = store.count("height");
    store.retain_plan(&second);
    assert_eq!((store.count("smooth"), store.count("height")), (1, heights));
    assert!(store.contains(second.key(other, Cell(0, 0))));
    assert_eq!(store.count("scale"), 1);
}

#[test]
fn a_store_adopts_the_values_of_a_stage() {
    let (plan, height, _) = plan(1.0, 2.0);
    let (theirs, ours) = (Store::unlimited(), Store::unlimited());
    let value = Runner::new(&plan, &theirs, 1).get(height, Cell(0, 0));
    ours.adopt(&theirs, "scale");
    ours.adopt(&ours, "scale");
    assert_eq!((ours.count("scale"), ours.count("height")), (1, 0));
    let again = Runner::new(&plan, &ours, 1).get(height, Cell(0, 0));
    assert_eq!(again, value);
    assert_eq!(ours.computed(), 1);
}

#[test]
fn keys_change_with_what_a_value_depends_on_and_with_nothing_else() {
    let at = Cell(3, -4);
    let (a, a_height, a_smooth) = plan(1.0, 2.0);
    let (b, b_height, b_smooth) = plan(1.0, 3.0);
    assert_eq!(a.key(a_height, at), b.key(b_height, at));
    assert_ne!(a.key(a_smooth, at), b.key(b_smooth, at));
    let (c, c_height, c_smooth) = plan(1.5, 2.0);
    assert_ne!(a.key(a_height, at), c.key(c_height, at));
    assert_ne!(a.key(a_smooth, at), c.key(c_smooth, at));
    assert_ne!(a.key(a_height, at), a.key(a_height, at.offset(1, 0)));
    let mut other = Plan::new(8);
    let scale = other.add(Scale(1.0), ());
    let height = other.add(Height, (scale.global(),));
    assert_ne!(a.key(a_height, at), other.key(height, at));
}

/// Has the id of [`Scale`], but another meaning.
struct Negated(f64);

impl Stage<Toy> for Negated {
    type At = ();
    type Inputs = ();
    type Output = f64;
    const ID: &'static str = "scale";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        hasher.write_f64(self.0);
    }

    fn run(&self, (): (), _: u64, (): ()) -> Result<f64, Error> {
        Ok(-self.0)
    }
}

#[test]
fn stages_of_one_type_may_be_equal() {
    let mut plan: Plan<Toy> = Plan::new(1);
    let scales = [2.0, 2.0, 3.0].map(|scale| plan.add(Scale(scale), ()));
    let store = Store::unlimited();
    let runner = Runner::new(&plan, &store, 1);
    assert_eq!(
        scales.map(|node| *runner.get(node, ()).expect("runs")),
        [2.0, 2.0, 3.0]
    );
    assert_eq!(store.computed(), 2);
}

#[test]
#[should_panic(expected = "have the same key: give each an `ID` of its own, not \"scale\"")]
fn stages_of_two_types_must_not_share_a_key() {
    let mut plan: Plan<Toy> = Plan::new(1);
    plan.add(Scale(2.0), ());
    plan.add(Negated(2.0), ());
}

#[test]
fn an_error_names_its_stage_and_coordinate_and_is_not_kept() {
    let (plan, height, smooth) = plan(1.0, 2.0);
    let store = Store::unlimited();
    let runner = Runner::new(&plan, &store, 4);
    let error = runner
        .demand(smooth)
        .all(&[Cell(98, 99)])
        .expect_err("fails");
    assert_eq!(
        error.to_string(),
        "stage height at Cell(Cell(99, 99)): no such height"
    );
    assert!(!store.contains(plan.key(height, Cell(99, 99))));
    assert!(runner.get(height, Cell(98, 99)).is_ok());
}

struct Bomb;

impl Stage<Toy> for Bomb {
    type At = ();
    type Inputs = ();
    type Output = ();
    const ID: &'static str = "bomb";
    const VERSION: u32 = 1;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(&self, (): (), _: u64, (): ()) -> Result<(), Error> {
        std::thread::sleep(std::time::Duration::from_millis(50));
        panic!("on purpose")
    }
}

#[test]
fn a_panicking_stage_does_not_leave_others_waiting() {
    let mut plan: Plan<Toy> = Plan::new(1);
    let bomb = plan.add(Bomb, ());
    let store = Store::unlimited();
    let runner = Runner::new(&plan, &store, 1);
    std::thread::scope(|scope| {
        let first = scope.spawn(|| runner.get(bomb, ()));
        std::thread::sleep(std::time::Duration::from_millis(10));
        // Either it waited for the first thread and gets its error, or it came later and panics
        // itself.
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
