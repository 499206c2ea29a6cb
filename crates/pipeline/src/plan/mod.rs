//! Typed plans: stages wired into a graph whose edges are typed handles.
//!
//! [`Plan::add`] takes the handles of nodes that exist already, so a plan is acyclic by
//! construction; there are no names in the wiring. A node is computed at a [`Coordinate`]: the world
//! plan has none, the chunk plan has a chunk, the frame plan a frame's number. An edge reaches a
//! node at the same coordinate, a world node ([`Node::of_world`]), or any chunk's
//! ([`Node::anywhere`]), at coordinates the stage asks for while it runs.
//!
//! Every node has a key before anything runs: the hash of its stage's id, version and parameters,
//! the world's seed, the keys of the nodes it reads, and its coordinate. Stages are pure, so equal
//! keys mean equal values: the key serves the [`Store`], resuming and provenance alike.

mod cache;
mod drawing;
mod edge;
mod encode;
mod fingerprint;
mod store;

use std::any::Any;
use std::marker::PhantomData;
use std::sync::Arc;

pub use cache::{Cache, Kept};
pub use drawing::GraphFormat;
pub use edge::{AnyChunk, Demand, Edge, Inputs, OfWorld};
pub use encode::{Encode, Encoder, KeyEncoder};
pub use fingerprint::{Fingerprint, Hasher};
pub use store::Store;

use nemoral_scene::ChunkCoord;

use crate::Error;

/// Where a node is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum At {
    /// Once for the world.
    World,
    /// For a chunk.
    Chunk(ChunkCoord),
    /// For a frame.
    Frame(u64),
}

/// The coordinate type of a plan: `()` for the world, [`ChunkCoord`], or a frame's `u64`.
pub trait Coordinate: Copy + Send + Sync + 'static {
    /// The coordinate, erased.
    fn at(self) -> At;

    /// The coordinate back; `None` for another plan's.
    fn from_at(at: At) -> Option<Self>;
}

impl Coordinate for () {
    fn at(self) -> At {
        At::World
    }

    fn from_at(at: At) -> Option<Self> {
        matches!(at, At::World).then_some(())
    }
}

impl Coordinate for ChunkCoord {
    fn at(self) -> At {
        At::Chunk(self)
    }

    fn from_at(at: At) -> Option<Self> {
        if let At::Chunk(c) = at { Some(c) } else { None }
    }
}

impl Coordinate for u64 {
    fn at(self) -> At {
        At::Frame(self)
    }

    fn from_at(at: At) -> Option<Self> {
        if let At::Frame(i) = at { Some(i) } else { None }
    }
}

/// One step of a plan: a pure function of its parameters, the world's key, a coordinate and its
/// inputs.
pub trait Stage: Send + Sync + 'static {
    /// Where it is computed.
    type At: Coordinate;
    /// What it reads: a tuple of edges.
    type Inputs: Inputs<Self::At>;
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
    /// Whatever the stage's crate says; the plan adds the stage and the coordinate.
    fn run(
        &self,
        at: Self::At,
        world: nemoral_seed::Key,
        inputs: <Self::Inputs as Inputs<Self::At>>::Values<'_>,
    ) -> Result<Self::Output, Error>;

    /// How a [`Cache`] keeps the output from run to run; not at all, but for what is dear to make.
    fn kept() -> Option<Kept<Self::Output>> {
        None
    }
}

/// A handle to a node that makes a `T` at a `C`.
pub struct Node<C, T> {
    index: usize,
    marker: PhantomData<fn(C) -> T>,
}

impl<C, T> Clone for Node<C, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<C, T> Copy for Node<C, T> {}

impl<C, T> std::fmt::Debug for Node<C, T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Node({})", self.index)
    }
}

impl<T> Node<(), T> {
    /// The edge from any plan to this world node.
    #[must_use]
    pub fn of_world(self) -> OfWorld<T> {
        OfWorld(self)
    }
}

impl<T> Node<ChunkCoord, T> {
    /// The edge to this node at chunks that the stage names while it runs.
    #[must_use]
    pub fn anywhere(self) -> AnyChunk<T> {
        AnyChunk(self)
    }
}

type Value = Arc<dyn Any + Send + Sync>;

/// A node with its types erased; the erasure is private and guarded by [`Node`]'s types.
trait Erased: Send + Sync {
    fn id(&self) -> &'static str;
    fn inputs(&self) -> &[usize];
    fn run(&self, at: At, runner: &Runner<'_>) -> Result<Value, Error>;
    /// Does a [`Cache`] keep its values?
    fn is_kept(&self) -> bool;
    /// Of a value, if it is kept.
    fn bytes_of(&self, value: &Value) -> Option<Vec<u8>>;
    fn value_of(&self, bytes: &[u8]) -> Option<Value>;
}

struct Wired<S: Stage> {
    stage: S,
    edges: S::Inputs,
    inputs: Vec<usize>,
}

impl<S: Stage> Erased for Wired<S> {
    fn id(&self) -> &'static str {
        S::ID
    }

    fn inputs(&self) -> &[usize] {
        &self.inputs
    }

    fn run(&self, at: At, runner: &Runner<'_>) -> Result<Value, Error> {
        let at = S::At::from_at(at).expect("handles carry their plan's coordinate type");
        let values = self.edges.fetch(at, runner)?;
        let output = self.stage.run(at, runner.plan.world, values)?;
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

struct Entry {
    node: Box<dyn Erased>,
    /// Hash of everything but the coordinate.
    base: Fingerprint,
}

/// The graphs of a world: stages wired by typed handles.
pub struct Plan {
    world: nemoral_seed::Key,
    entries: Vec<Entry>,
}

impl std::fmt::Debug for Plan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_list()
            .entries(self.entries.iter().map(|e| e.node.id()))
            .finish()
    }
}

impl Plan {
    /// An empty plan for a world.
    #[must_use]
    pub fn new(world: nemoral_seed::Key) -> Self {
        Self {
            world,
            entries: Vec::new(),
        }
    }

    /// Adds a stage that reads `edges`, all of which exist already.
    pub fn add<S: Stage>(&mut self, stage: S, edges: S::Inputs) -> Node<S::At, S::Output> {
        let inputs = edges.nodes();
        let mut hasher = Hasher::new(S::ID);
        hasher.write_u64(u64::from(S::VERSION));
        hasher.write_bytes(&self.world.to_bytes());
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
    pub fn key<C: Coordinate, T>(&self, node: Node<C, T>, at: C) -> Fingerprint {
        self.key_of(node.index, at.at())
    }

    /// Id and base key (everything but the coordinate) of every node: a data set's provenance.
    #[must_use]
    pub fn provenance(&self) -> Vec<(&'static str, Fingerprint)> {
        self.entries.iter().map(|e| (e.node.id(), e.base)).collect()
    }

    fn key_of(&self, index: usize, at: At) -> Fingerprint {
        let mut hasher = Hasher::new("at");
        hasher.write_bytes(&self.entries[index].base.0);
        match at {
            At::World => {}
            At::Chunk(c) => {
                hasher.write_i64(i64::from(c.x));
                hasher.write_i64(i64::from(c.y));
            }
            At::Frame(i) => hasher.write_u64(i),
        }
        hasher.finish()
    }
}

/// A plan with a store to keep what it computes, and a number of threads to compute with.
#[derive(Clone, Copy, Debug)]
pub struct Runner<'a> {
    plan: &'a Plan,
    store: &'a Store,
    threads: usize,
}

impl<'a> Runner<'a> {
    /// A runner; `threads` is how many nodes [`Demand::all`] computes at once.
    #[must_use]
    pub fn new(plan: &'a Plan, store: &'a Store, threads: usize) -> Self {
        Self {
            plan,
            store,
            threads: threads.max(1),
        }
    }

    /// The plan.
    #[must_use]
    pub fn plan(&self) -> &'a Plan {
        self.plan
    }

    /// How many nodes are computed at once.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// The store.
    #[must_use]
    pub fn store(&self) -> &'a Store {
        self.store
    }

    /// The value of a node, from the store or computed now. If another thread is computing it, this
    /// one waits.
    ///
    /// Call it from ordinary threads, never from inside a rayon job: a pool thread that waits may be
    /// the one that the computing node needs.
    ///
    /// # Errors
    /// The first error of a stage, with the stage and its coordinate.
    pub fn get<C: Coordinate, T: Send + Sync + 'static>(
        &self,
        node: Node<C, T>,
        at: C,
    ) -> Result<Arc<T>, Error> {
        let value = self.value(node.index, at.at())?;
        Ok(value
            .downcast::<T>()
            .expect("a node's handle carries its output type"))
    }

    /// [`AnyChunk`]'s value outside of a stage.
    #[must_use]
    pub fn demand<T>(&self, node: Node<ChunkCoord, T>) -> Demand<'a, T> {
        Demand::new(*self, node)
    }

    fn value(&self, index: usize, at: At) -> Result<Value, Error> {
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

#[cfg(test)]
mod tests;
