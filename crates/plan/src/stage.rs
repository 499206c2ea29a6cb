//! Stages, and how they become nodes of a plan.

use std::any::{TypeId, type_name};
use std::sync::Arc;

use crate::edge::Inputs;
use crate::node::{Node, Value};
use crate::plan::{Entry, ErasedNode, Plan, Runner};
use crate::{Cache, CacheCodec, Coordinate, Fingerprint, Hasher, PlanTypes};

/// The values that a stage runs on: one for each of its inputs, in their order.
pub type Values<'a, P, S> = <<S as Stage<P>>::Inputs as Inputs<P, <S as Stage<P>>::At>>::Values<'a>;

/// One step of a plan: a pure function of its parameters, the plan's context, a coordinate and its
/// inputs.
pub trait Stage<P: PlanTypes>: Send + Sync + 'static {
    /// The type of its coordinates.
    type At: Coordinate<P>;
    /// Its inputs, a tuple of edges.
    type Inputs: Inputs<P, Self::At>;
    /// The type of its output.
    type Output: Send + Sync + 'static;
    /// Its name in graphs, logs and keys. Each type of stage needs one of its own, as equal keys
    /// mean equal values; it is never used for wiring.
    const ID: &'static str;
    /// A number that is raised whenever equal inputs give a different output.
    const VERSION: u32;

    /// Writes every parameter that the output depends on.
    fn fingerprint(&self, hasher: &mut Hasher);

    /// Makes the output.
    ///
    /// # Errors
    /// The stage's own error; the plan adds the stage's id and the coordinate.
    fn run(
        &self,
        at: Self::At,
        context: P::Context,
        inputs: Values<'_, P, Self>,
    ) -> Result<Self::Output, P::Error>;

    /// The context that it runs in and that its key depends on: the plan's by default. A stage that
    /// depends on less than all of it may give another one, so that plans of different contexts
    /// share its values.
    fn context(&self, plan: &P::Context) -> P::Context {
        plan.clone()
    }

    /// How a [`Cache`](crate::Cache) stores the output between runs. By default it does not; this
    /// is meant for outputs that are expensive to compute.
    fn cache_codec() -> Option<CacheCodec<Self::Output>> {
        None
    }
}

struct Wired<P: PlanTypes, S: Stage<P>> {
    stage: S,
    edges: S::Inputs,
    inputs: Vec<usize>,
}

impl<P: PlanTypes, S: Stage<P>> ErasedNode<P> for Wired<P, S> {
    fn id(&self) -> &'static str {
        S::ID
    }

    fn stage_type(&self) -> (TypeId, &'static str) {
        (TypeId::of::<S>(), type_name::<S>())
    }

    fn inputs(&self) -> &[usize] {
        &self.inputs
    }

    fn run(&self, at: P::At, runner: &Runner<'_, P>) -> Result<Value, P::Error> {
        let at = S::At::restore(at).expect("handles carry their plan's coordinate type");
        let values = self.edges.fetch(at, runner)?;
        let context = self.stage.context(&runner.plan.context);
        let output = self.stage.run(at, context, values)?;
        Ok(Arc::new(output))
    }

    fn is_kept(&self) -> bool {
        S::cache_codec().is_some()
    }

    fn keep(&self, value: &Value, cache: &Cache, key: Fingerprint) {
        let output = value.downcast_ref::<S::Output>();
        let output = output.expect("a node's value is of its stage's type");
        if let Some(CacheCodec { write, .. }) = S::cache_codec() {
            cache.put(key, |out| write(output, out));
        }
    }

    fn value_of(&self, bytes: &[u8]) -> Option<Value> {
        let output = (S::cache_codec()?.from_bytes)(bytes)?;
        Some(Arc::new(output))
    }
}

impl<P: PlanTypes> Plan<P> {
    /// Adds a stage that reads `edges`, all of which exist already.
    ///
    /// # Panics
    /// If a stage of another type has the same key: the two would share their values.
    pub fn add<S: Stage<P>>(&mut self, stage: S, edges: S::Inputs) -> Node<S::At, S::Output> {
        let inputs = edges.nodes();
        let mut hasher = Hasher::new(S::ID);
        hasher.write_u64(u64::from(S::VERSION));
        P::hash_context(&stage.context(&self.context), &mut hasher);
        stage.fingerprint(&mut hasher);
        for &input in &inputs {
            hasher.write_bytes(&self.entries[input].base.0);
        }
        let base = hasher.finish();
        for same in self.entries.iter().filter(|entry| entry.base == base) {
            let (other, name) = same.node.stage_type();
            assert!(
                other == TypeId::of::<S>(),
                "stages {name} and {} have the same key: give each an `ID` of its own, not {:?}",
                type_name::<S>(),
                S::ID,
            );
        }
        let index = self.entries.len();
        self.entries.push(Entry {
            node: Box::new(Wired {
                stage,
                edges,
                inputs,
            }),
            base,
        });
        Node::new(index)
    }
}
