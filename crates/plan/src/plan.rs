//! Stages, nodes, the graph that they make, and what runs it.

use std::any::Any;
use std::fmt;
use std::marker::PhantomData;
use std::sync::Arc;

use crate::edge::{Anywhere, Demand, Global, Inputs};
use crate::{AnyCoordinate, Coordinate, Fingerprint, Hasher, Kept, PlanTypes, StageError, Store};

/// One step of a plan: a pure function of its parameters, the plan's context, a coordinate and its
/// inputs.
pub trait Stage<P: PlanTypes>: Send + Sync + 'static {
    /// Where it is computed.
    type At: Coordinate<P>;
    /// What it reads: a tuple of edges.
    type Inputs: Inputs<P, Self::At>;
    /// What it makes.
    type Output: Send + Sync + 'static;
    /// For graphs, logs and keys; never for wiring.
    const ID: &'static str;
    /// Raised whenever the same inputs give another output.
    const VERSION: u32;

    /// Writes every parameter that the output depends on.
    fn fingerprint(&self, hasher: &mut Hasher);

    /// Makes the output.
    ///
    /// # Errors
    /// Whatever the stage says; the plan adds its id and the coordinate.
    fn run(
        &self,
        at: Self::At,
        context: P::Context,
        inputs: <Self::Inputs as Inputs<P, Self::At>>::Values<'_>,
    ) -> Result<Self::Output, P::Error>;

    /// How a [`Cache`](crate::Cache) keeps the output from run to run; not at all, but for what is
    /// dear to make.
    fn kept() -> Option<Kept<Self::Output>> {
        None
    }
}

/// A handle to a node that makes a `T` at a `C`.
pub struct Node<C, T> {
    pub(crate) index: usize,
    marker: PhantomData<fn(C) -> T>,
}

impl<C, T> Clone for Node<C, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<C, T> Copy for Node<C, T> {}

impl<C, T> fmt::Debug for Node<C, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Node({})", self.index)
    }
}

impl<T> Node<(), T> {
    /// The edge from a stage at any coordinate to this node, which is computed once.
    #[must_use]
    pub fn global(self) -> Global<T> {
        Global(self)
    }
}

impl<C, T> Node<C, T> {
    /// The edge to this node at coordinates that the stage names while it runs.
    #[must_use]
    pub fn anywhere(self) -> Anywhere<C, T> {
        Anywhere(self)
    }
}

pub(crate) type Value = Arc<dyn Any + Send + Sync>;

/// A node with its types erased; the erasure is private and guarded by [`Node`]'s types.
pub(crate) trait Erased<P: PlanTypes>: Send + Sync {
    fn id(&self) -> &'static str;
    fn inputs(&self) -> &[usize];
    fn run(&self, at: P::At, runner: &Runner<'_, P>) -> Result<Value, P::Error>;
    /// Does a cache keep its values?
    fn is_kept(&self) -> bool;
    /// Of a value, if it is kept.
    fn bytes_of(&self, value: &Value) -> Option<Vec<u8>>;
    fn value_of(&self, bytes: &[u8]) -> Option<Value>;
}

struct Wired<P: PlanTypes, S: Stage<P>> {
    stage: S,
    edges: S::Inputs,
    inputs: Vec<usize>,
}

impl<P: PlanTypes, S: Stage<P>> Erased<P> for Wired<P, S> {
    fn id(&self) -> &'static str {
        S::ID
    }

    fn inputs(&self) -> &[usize] {
        &self.inputs
    }

    fn run(&self, at: P::At, runner: &Runner<'_, P>) -> Result<Value, P::Error> {
        let at = S::At::restore(at).expect("handles carry their plan's coordinate type");
        let values = self.edges.fetch(at, runner)?;
        let output = self.stage.run(at, runner.plan.context.clone(), values)?;
        Ok(Arc::new(output))
    }

    fn is_kept(&self) -> bool {
        S::kept().is_some()
    }

    fn bytes_of(&self, value: &Value) -> Option<Vec<u8>> {
        let output = value.downcast_ref::<S::Output>();
        let output = output.expect("a node's value is of its stage's type");
        Some((S::kept()?.to_bytes)(output))
    }

    fn value_of(&self, bytes: &[u8]) -> Option<Value> {
        let output = (S::kept()?.from_bytes)(bytes)?;
        Some(Arc::new(output))
    }
}

pub(crate) struct Entry<P> {
    pub(crate) node: Box<dyn Erased<P>>,
    /// Hash of everything but the coordinate.
    pub(crate) base: Fingerprint,
}

/// Stages wired by typed handles.
pub struct Plan<P: PlanTypes> {
    context: P::Context,
    pub(crate) entries: Vec<Entry<P>>,
}

impl<P: PlanTypes> fmt::Debug for Plan<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list()
            .entries(self.entries.iter().map(|e| e.node.id()))
            .finish()
    }
}

impl<P: PlanTypes> Plan<P> {
    /// An empty plan.
    #[must_use]
    pub fn new(context: P::Context) -> Self {
        Self {
            context,
            entries: Vec::new(),
        }
    }

    /// Adds a stage that reads `edges`, all of which exist already.
    pub fn add<S: Stage<P>>(&mut self, stage: S, edges: S::Inputs) -> Node<S::At, S::Output> {
        let inputs = edges.nodes();
        let mut hasher = Hasher::new(S::ID);
        hasher.write_u64(u64::from(S::VERSION));
        P::hash_context(&self.context, &mut hasher);
        stage.fingerprint(&mut hasher);
        for &input in &inputs {
            hasher.write_bytes(&self.entries[input].base.0);
        }
        let base = hasher.finish();
        let index = self.entries.len();
        self.entries.push(Entry {
            node: Box::new(Wired {
                stage,
                edges,
                inputs,
            }),
            base,
        });
        Node {
            index,
            marker: PhantomData,
        }
    }

    /// The key of a node at a coordinate.
    #[must_use]
    pub fn key<C: Coordinate<P>, T>(&self, node: Node<C, T>, at: C) -> Fingerprint {
        self.key_of(node.index, at.erase())
    }

    /// Id and base key (everything but the coordinate) of every node: the provenance of what the
    /// plan makes.
    #[must_use]
    pub fn provenance(&self) -> Vec<(&'static str, Fingerprint)> {
        self.entries.iter().map(|e| (e.node.id(), e.base)).collect()
    }

    pub(crate) fn key_of(&self, index: usize, at: P::At) -> Fingerprint {
        let mut hasher = Hasher::new("at");
        hasher.write_bytes(&self.entries[index].base.0);
        at.hash(&mut hasher);
        hasher.finish()
    }
}

/// A plan with a store to keep what it computes, and a number of threads to compute with.
pub struct Runner<'a, P: PlanTypes> {
    plan: &'a Plan<P>,
    store: &'a Store<P>,
    threads: usize,
}

impl<P: PlanTypes> Clone for Runner<'_, P> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<P: PlanTypes> Copy for Runner<'_, P> {}

impl<P: PlanTypes> fmt::Debug for Runner<'_, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Runner")
            .field("plan", self.plan)
            .field("store", self.store)
            .field("threads", &self.threads)
            .finish()
    }
}

impl<'a, P: PlanTypes> Runner<'a, P> {
    /// A runner; `threads` is how many nodes [`Demand::all`] computes at once.
    #[must_use]
    pub fn new(plan: &'a Plan<P>, store: &'a Store<P>, threads: usize) -> Self {
        Self {
            plan,
            store,
            threads: threads.max(1),
        }
    }

    /// The plan.
    #[must_use]
    pub fn plan(&self) -> &'a Plan<P> {
        self.plan
    }

    /// How many nodes are computed at once.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// The store.
    #[must_use]
    pub fn store(&self) -> &'a Store<P> {
        self.store
    }

    /// The value of a node, from the store or computed now. If another thread is computing it, this
    /// one waits.
    ///
    /// Call it from ordinary threads, never from inside a job of a thread pool that stages use: a
    /// pool thread that waits may be the one that the computing node needs.
    ///
    /// # Errors
    /// The first error of a stage, with the stage and its coordinate.
    pub fn get<C: Coordinate<P>, T: Send + Sync + 'static>(
        &self,
        node: Node<C, T>,
        at: C,
    ) -> Result<Arc<T>, P::Error> {
        let value = self.value(node.index, at.erase())?;
        Ok(value
            .downcast::<T>()
            .expect("a node's handle carries its output type"))
    }

    /// What [`Anywhere`] gives a stage, outside of one.
    #[must_use]
    pub fn demand<C, T>(&self, node: Node<C, T>) -> Demand<'a, P, C, T> {
        Demand::new(*self, node)
    }

    fn value(&self, index: usize, at: P::At) -> Result<Value, P::Error> {
        let node = &self.plan.entries[index].node;
        let key = self.plan.key_of(index, at);
        let cache = self.store.cache().filter(|_| node.is_kept());
        self.store.get_or_compute(key, node.id(), at, || {
            let kept = cache.and_then(|cache| cache.get(key));
            if let Some(value) = kept.and_then(|bytes| node.value_of(&bytes)) {
                return Ok(value);
            }
            let value = node.run(at, self).map_err(|e| e.in_stage(node.id(), at))?;
            if let Some((cache, bytes)) = cache.zip(node.bytes_of(&value)) {
                cache.put(key, &bytes);
            }
            Ok(value)
        })
    }
}
