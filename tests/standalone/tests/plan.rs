//! Use of `nemoral-plan` alone: distances of random walks, each computed once.

use std::sync::Arc;

use nemoral_plan::{
    AnyCoordinate, Coordinate, Demand, DynamicEdge, GlobalEdge, GraphFormat, Hasher, Plan,
    PlanTypes, Runner, Stage, StageError, Store,
};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum At {
    All,
    Walk(u32),
}

impl AnyCoordinate for At {
    const GLOBAL: Self = Self::All;

    fn hash(self, hasher: &mut Hasher) {
        if let Self::Walk(walk) = self {
            hasher.write_u64(u64::from(walk));
        }
    }
}

/// The number of a walk.
#[derive(Clone, Copy)]
struct Walk(u32);

impl Coordinate<Walks> for Walk {
    fn erase(self) -> At {
        At::Walk(self.0)
    }

    fn restore(at: At) -> Option<Self> {
        match at {
            At::Walk(walk) => Some(Self(walk)),
            At::All => None,
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
enum Lost {
    Walker(u32),
    Panicked,
}

impl StageError<At> for Lost {
    fn panicked(_: &'static str, _: At) -> Self {
        Self::Panicked
    }
}

/// Plans whose context is a seed.
enum Walks {}

impl PlanTypes for Walks {
    type At = At;
    type Context = u64;
    type Error = Lost;

    fn hash_context(seed: &u64, hasher: &mut Hasher) {
        hasher.write_u64(*seed);
    }
}

/// Number of steps of a walk.
struct Steps(u32);

impl Stage<Walks> for Steps {
    type At = ();
    type Inputs = ();
    type Output = u32;
    const ID: &'static str = "steps";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        hasher.write_u64(u64::from(self.0));
    }

    fn run(&self, (): (), _: u64, (): ()) -> Result<u32, Lost> {
        Ok(self.0)
    }
}

/// End of a walk.
struct End;

impl Stage<Walks> for End {
    type At = Walk;
    type Inputs = (GlobalEdge<u32>,);
    type Output = i64;
    const ID: &'static str = "end";
    const VERSION: u32 = 1;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(&self, Walk(walk): Walk, seed: u64, (steps,): (Arc<u32>,)) -> Result<i64, Lost> {
        if walk == 13 {
            return Err(Lost::Walker(walk));
        }
        let mut state = seed ^ u64::from(walk);
        let step = |_| {
            state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(1);
            if state >> 63 == 0 { 1 } else { -1 }
        };
        Ok((0..*steps).map(step).sum())
    }
}

/// The mean square distance of the walks up to this one.
struct Spread;

impl Stage<Walks> for Spread {
    type At = Walk;
    type Inputs = (DynamicEdge<Walk, i64>,);
    type Output = f64;
    const ID: &'static str = "spread";
    const VERSION: u32 = 1;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(
        &self,
        Walk(walk): Walk,
        _: u64,
        (end,): (Demand<'_, Walks, Walk, i64>,),
    ) -> Result<f64, Lost> {
        let walks: Vec<Walk> = (0..=walk).map(Walk).collect();
        let ends = end.all(&walks)?;
        let squares: i64 = ends.iter().map(|end| **end * **end).sum();
        Ok(squares as f64 / f64::from(walk + 1))
    }
}

#[test]
fn a_plan_of_numbers() -> Result<(), Lost> {
    let wired = |steps| {
        let mut plan = Plan::new(7_u64);
        let steps = plan.add(Steps(steps), ());
        let end = plan.add(End, (steps.global(),));
        let spread = plan.add(Spread, (end.anywhere(),));
        (plan, spread)
    };
    let (plan, spread) = wired(100);
    let store = Store::unlimited();
    let runner = Runner::new(&plan, &store, 4);
    let value = *runner.get(spread, Walk(9))?;
    assert!(value >= 0.0 && value <= 10_000.0, "{value}");
    // These are ten ends, the number of steps and the spread; one more walk adds only new nodes.
    assert_eq!(store.computed(), 12);
    runner.get(spread, Walk(10))?;
    assert_eq!(store.computed(), 14);
    assert_eq!(runner.get(spread, Walk(13)), Err(Lost::Walker(13)));

    // A store that keeps only one value computes everything again, with the same result.
    let forgetful = Store::with_capacity(1);
    let again = Runner::new(&plan, &forgetful, 1).get(spread, Walk(9))?;
    assert_eq!(*again, value);
    // The key of a node depends on parameters of its inputs.
    let (other, of_other) = wired(101);
    assert_ne!(plan.key(spread, Walk(9)), other.key(of_other, Walk(9)));
    assert!(plan.draw(GraphFormat::Mermaid).contains("spread"));
    Ok(())
}
