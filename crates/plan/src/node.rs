//! Handles to the nodes of a plan, and the values that nodes have.

use std::any::Any;
use std::fmt;
use std::marker::PhantomData;
use std::sync::Arc;

/// A node's value with its type erased.
pub(crate) type Value = Arc<dyn Any + Send + Sync>;

/// A handle to a node that makes a `T` at a `C`.
pub struct Node<C, T> {
    pub(crate) index: usize,
    marker: PhantomData<fn(C) -> T>,
}

impl<C, T> Node<C, T> {
    /// The handle to the entry of a plan; `C` and `T` must be that entry's.
    pub(crate) fn new(index: usize) -> Self {
        Self {
            index,
            marker: PhantomData,
        }
    }

    /// A value of this node.
    pub(crate) fn typed(self, value: Value) -> Arc<T>
    where
        T: Send + Sync + 'static,
    {
        (value.downcast()).expect("a node's handle carries its output type")
    }
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
