//! The graph of wired stages, and the runner that computes it.

use std::any::TypeId;
use std::fmt;
use std::sync::Arc;

use crate::node::{Node, Value};
use crate::store::Answer;
use crate::{AnyCoordinate, Cache, Coordinate, Fingerprint, Hasher, PlanTypes, StageError, Store};

/// A node with its types erased; the erasure is private and guarded by [`Node`]'s types.
pub(crate) trait ErasedNode<P: PlanTypes>: Send + Sync {
    fn id(&self) -> &'static str;
    /// The type of its stage and its name.
    fn stage_type(&self) -> (TypeId, &'static str);
    fn inputs(&self) -> &[usize];
    fn run(&self, at: P::At, runner: &Runner<'_, P>) -> Result<Value, P::Error>;
    /// Whether its values are stored in a cache.
    fn is_kept(&self) -> bool;
    /// Stores a value in a cache, if its values are.
    fn keep(&self, value: &Value, cache: &Cache, key: Fingerprint);
    fn value_of(&self, bytes: &[u8]) -> Option<Value>;
}

pub(crate) struct Entry<P> {
    pub(crate) node: Box<dyn ErasedNode<P>>,
    /// Hash of everything but the coordinate.
    pub(crate) base: Fingerprint,
}

/// Stages wired by typed handles.
pub struct Plan<P: PlanTypes> {
    pub(crate) context: P::Context,
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

    /// Whether a stage has this key at a coordinate.
    pub(crate) fn has(&self, key: Fingerprint, id: &'static str, at: P::At) -> bool {
        let of_stage = (0..self.entries.len()).filter(|&i| self.entries[i].node.id() == id);
        of_stage.into_iter().any(|i| self.key_of(i, at) == key)
    }

    pub(crate) fn key_of(&self, index: usize, at: P::At) -> Fingerprint {
        let mut hasher = Hasher::new("at");
        hasher.write_bytes(&self.entries[index].base.0);
        at.hash(&mut hasher);
        hasher.finish()
    }
}

/// A plan with a store that keeps what is computed, and a number of threads.
pub struct Runner<'a, P: PlanTypes> {
    pub(crate) plan: &'a Plan<P>,
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
    /// A runner whose [`Demand::all`](crate::Demand::all) computes on so many threads. If they are
    /// several it has one in addition, as one or the other waits.
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

    /// How many threads compute nodes; see [`new`](Self::new).
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
        Ok(node.typed(self.ask(node.index, at.erase()).wait()?))
    }

    /// Computes the value of a node, unless it is known or another thread computes it.
    pub(crate) fn ask(&self, index: usize, at: P::At) -> Answer<P::Error> {
        let node = &self.plan.entries[index].node;
        let key = self.plan.key_of(index, at);
        let cache = self.store.cache().filter(|_| node.is_kept());
        self.store.get_or_compute(key, node.id(), at, || {
            let kept = cache.and_then(|cache| cache.get(key));
            if let Some(value) = kept.and_then(|bytes| node.value_of(&bytes)) {
                return Ok(value);
            }
            let value = node.run(at, self).map_err(|e| e.in_stage(node.id(), at))?;
            if let Some(cache) = cache {
                node.keep(&value, cache, key);
            }
            Ok(value)
        })
    }
}
