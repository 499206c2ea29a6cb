//! Edges: what a stage may read.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use nemoral_scene::ChunkCoord;

use super::{Coordinate, Node, Runner};
use crate::Error;

/// One thing that a stage at a `C` reads.
pub trait Edge<C>: Copy + Send + Sync + 'static {
    /// What the stage is given.
    type Value<'a>;

    /// The nodes it leads to.
    fn nodes(self) -> Vec<usize>;

    /// Gets it.
    ///
    /// # Errors
    /// The error of the node it leads to.
    fn fetch<'a>(self, at: C, runner: &Runner<'a>) -> Result<Self::Value<'a>, Error>;
}

/// The node at the same coordinate.
impl<C: Coordinate, T: Send + Sync + 'static> Edge<C> for Node<C, T> {
    type Value<'a> = Arc<T>;

    fn nodes(self) -> Vec<usize> {
        vec![self.index]
    }

    fn fetch<'a>(self, at: C, runner: &Runner<'a>) -> Result<Arc<T>, Error> {
        runner.get(self, at)
    }
}

/// A world node, from any plan.
pub struct OfWorld<T>(pub(super) Node<(), T>);

/// A chunk node, at coordinates that the stage chooses while it runs.
pub struct AnyChunk<T>(pub(super) Node<ChunkCoord, T>);

macro_rules! handle {
    ($name:ident) => {
        impl<T> Clone for $name<T> {
            fn clone(&self) -> Self {
                *self
            }
        }

        impl<T> Copy for $name<T> {}

        impl<T> std::fmt::Debug for $name<T> {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(f, "{}({})", stringify!($name), self.0.index)
            }
        }
    };
}

handle!(OfWorld);
handle!(AnyChunk);

impl<C: Coordinate, T: Send + Sync + 'static> Edge<C> for OfWorld<T> {
    type Value<'a> = Arc<T>;

    fn nodes(self) -> Vec<usize> {
        vec![self.0.index]
    }

    fn fetch<'a>(self, _at: C, runner: &Runner<'a>) -> Result<Arc<T>, Error> {
        runner.get(self.0, ())
    }
}

impl<C: Coordinate, T: Send + Sync + 'static> Edge<C> for AnyChunk<T> {
    type Value<'a> = Demand<'a, T>;

    fn nodes(self) -> Vec<usize> {
        vec![self.0.index]
    }

    fn fetch<'a>(self, _at: C, runner: &Runner<'a>) -> Result<Demand<'a, T>, Error> {
        Ok(Demand::new(*runner, self.0))
    }
}

/// Several chunk nodes of one type, at coordinates that the stage chooses while it runs.
impl<C: Coordinate, T: Send + Sync + 'static, const N: usize> Edge<C> for [AnyChunk<T>; N] {
    type Value<'a> = [Demand<'a, T>; N];

    fn nodes(self) -> Vec<usize> {
        self.iter().map(|edge| edge.0.index).collect()
    }

    fn fetch<'a>(self, _at: C, runner: &Runner<'a>) -> Result<[Demand<'a, T>; N], Error> {
        Ok(self.map(|edge| Demand::new(*runner, edge.0)))
    }
}

/// A chunk node that can be asked for at any coordinate.
#[derive(Debug)]
pub struct Demand<'a, T> {
    runner: Runner<'a>,
    node: Node<ChunkCoord, T>,
}

impl<T> Clone for Demand<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Demand<'_, T> {}

impl<'a, T> Demand<'a, T> {
    pub(super) fn new(runner: Runner<'a>, node: Node<ChunkCoord, T>) -> Self {
        Self { runner, node }
    }
}

/// Where a worker leaves what it made.
type Slot<T> = Mutex<Option<Result<Arc<T>, Error>>>;

impl<T: Send + Sync + 'static> Demand<'_, T> {
    /// The node's value at a chunk.
    ///
    /// # Errors
    /// The error of a stage.
    pub fn at(&self, chunk: ChunkCoord) -> Result<Arc<T>, Error> {
        self.runner.get(self.node, chunk)
    }

    /// The node's values at many chunks, in their order, computed by the runner's threads.
    ///
    /// # Errors
    /// The error of the first chunk, in their order, that has one.
    pub fn all(&self, chunks: &[ChunkCoord]) -> Result<Vec<Arc<T>>, Error> {
        let workers = self.runner.threads.min(chunks.len());
        if workers <= 1 {
            return chunks.iter().map(|&c| self.at(c)).collect();
        }
        // Ordinary threads, not the rayon pool: a node may wait for another thread's node here.
        let next = AtomicUsize::new(0);
        let slots: Vec<Slot<T>> = chunks.iter().map(|_| Mutex::new(None)).collect();
        std::thread::scope(|scope| {
            for _ in 0..workers {
                scope.spawn(|| {
                    while let Some(i) =
                        Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&i| i < chunks.len())
                    {
                        *slots[i].lock().expect("a slot has one writer") = Some(self.at(chunks[i]));
                    }
                });
            }
        });
        slots
            .into_iter()
            .map(|slot| {
                let value = slot.into_inner().expect("a slot has one writer");
                value.expect("every slot was filled")
            })
            .collect()
    }
}

/// A tuple of edges.
pub trait Inputs<C>: Copy + Send + Sync + 'static {
    /// The tuple of their values.
    type Values<'a>;

    /// The nodes they lead to.
    fn nodes(self) -> Vec<usize>;

    /// Gets all of them.
    ///
    /// # Errors
    /// The first edge's error.
    fn fetch<'a>(self, at: C, runner: &Runner<'a>) -> Result<Self::Values<'a>, Error>;
}

impl<C> Inputs<C> for () {
    type Values<'a> = ();

    fn nodes(self) -> Vec<usize> {
        Vec::new()
    }

    fn fetch<'a>(self, _at: C, _runner: &Runner<'a>) -> Result<(), Error> {
        Ok(())
    }
}

macro_rules! tuples {
    ($($edge:ident)*) => {
        impl<At: Coordinate, $($edge: Edge<At>),*> Inputs<At> for ($($edge,)*) {
            type Values<'a> = ($($edge::Value<'a>,)*);

            fn nodes(self) -> Vec<usize> {
                #[allow(non_snake_case, reason = "a macro's variables are named after its types")]
                let ($($edge,)*) = self;
                [$($edge.nodes()),*].concat()
            }

            fn fetch<'a>(self, at: At, runner: &Runner<'a>) -> Result<Self::Values<'a>, Error> {
                #[allow(non_snake_case, reason = "a macro's variables are named after its types")]
                let ($($edge,)*) = self;
                Ok(($($edge.fetch(at, runner)?,)*))
            }
        }
    };
}

tuples!(A);
tuples!(A B);
tuples!(A B C);
tuples!(A B C D);
tuples!(A B C D E);
tuples!(A B C D E F);
tuples!(A B C D E F G);
tuples!(A B C D E F G H);
