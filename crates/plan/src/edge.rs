//! Edges, which say what a stage may read.

use std::fmt;
use std::sync::Arc;

use crate::node::Node;
use crate::plan::Runner;
use crate::{Coordinate, DemandBatch, PlanTypes};

/// One input of a stage that is computed at coordinates of type `C`.
pub trait Edge<P: PlanTypes, C>: Copy + Send + Sync + 'static {
    /// What the stage is given.
    type Value<'a>;

    /// The nodes that it leads to.
    fn nodes(self) -> Vec<usize>;

    /// Gets the value.
    ///
    /// # Errors
    /// The error of the node that it leads to.
    fn fetch<'a>(self, at: C, runner: &Runner<'a, P>) -> Result<Self::Value<'a>, P::Error>;
}

/// The node at the same coordinate.
impl<P: PlanTypes, C: Coordinate<P>, T: Send + Sync + 'static> Edge<P, C> for Node<C, T> {
    type Value<'a> = Arc<T>;

    fn nodes(self) -> Vec<usize> {
        vec![self.index]
    }

    fn fetch<'a>(self, at: C, runner: &Runner<'a, P>) -> Result<Arc<T>, P::Error> {
        runner.get(self, at)
    }
}

/// A node that is computed once, read at any coordinate.
pub struct GlobalEdge<T>(pub(crate) Node<(), T>);

/// A node at coordinates that the stage chooses while it runs.
pub struct DynamicEdge<D, T>(pub(crate) Node<D, T>);

impl<T> Clone for GlobalEdge<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for GlobalEdge<T> {}

impl<T> fmt::Debug for GlobalEdge<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "GlobalEdge({})", self.0.index)
    }
}

impl<D, T> Clone for DynamicEdge<D, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<D, T> Copy for DynamicEdge<D, T> {}

impl<D, T> fmt::Debug for DynamicEdge<D, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "DynamicEdge({})", self.0.index)
    }
}

impl<P: PlanTypes, C: Coordinate<P>, T: Send + Sync + 'static> Edge<P, C> for GlobalEdge<T> {
    type Value<'a> = Arc<T>;

    fn nodes(self) -> Vec<usize> {
        vec![self.0.index]
    }

    fn fetch<'a>(self, _at: C, runner: &Runner<'a, P>) -> Result<Arc<T>, P::Error> {
        runner.get(self.0, ())
    }
}

impl<P, C, D, T> Edge<P, C> for DynamicEdge<D, T>
where
    P: PlanTypes,
    C: Coordinate<P>,
    D: Coordinate<P>,
    T: Send + Sync + 'static,
{
    type Value<'a> = Demand<'a, P, D, T>;

    fn nodes(self) -> Vec<usize> {
        vec![self.0.index]
    }

    fn fetch<'a>(self, _at: C, runner: &Runner<'a, P>) -> Result<Self::Value<'a>, P::Error> {
        Ok(Demand::new(*runner, self.0))
    }
}

/// Several nodes of one type, at coordinates that the stage chooses while it runs.
impl<P, C, D, T, const N: usize> Edge<P, C> for [DynamicEdge<D, T>; N]
where
    P: PlanTypes,
    C: Coordinate<P>,
    D: Coordinate<P>,
    T: Send + Sync + 'static,
{
    type Value<'a> = [Demand<'a, P, D, T>; N];

    fn nodes(self) -> Vec<usize> {
        self.iter().map(|edge| edge.0.index).collect()
    }

    fn fetch<'a>(self, _at: C, runner: &Runner<'a, P>) -> Result<Self::Value<'a>, P::Error> {
        Ok(self.map(|edge| Demand::new(*runner, edge.0)))
    }
}

/// A node that can be asked for at any of its coordinates.
pub struct Demand<'a, P: PlanTypes, D, T> {
    runner: Runner<'a, P>,
    node: Node<D, T>,
}

impl<P: PlanTypes, D, T> Clone for Demand<'_, P, D, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<P: PlanTypes, D, T> Copy for Demand<'_, P, D, T> {}

impl<P: PlanTypes, D, T> fmt::Debug for Demand<'_, P, D, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Demand({})", self.node.index)
    }
}

impl<'a, P: PlanTypes, D, T> Demand<'a, P, D, T> {
    pub(crate) fn new(runner: Runner<'a, P>, node: Node<D, T>) -> Self {
        Self { runner, node }
    }

    /// The node's values at many coordinates, to be computed together with others.
    #[must_use]
    pub fn batch(&self, places: &[D]) -> DemandBatch<'a, P>
    where
        D: Coordinate<P>,
    {
        let places = places.iter().map(|at| at.erase()).collect();
        DemandBatch::new(self.runner, self.node.index, places)
    }
}

impl<T> Node<(), T> {
    /// The edge from a stage at any coordinate to this node, which is computed once.
    #[must_use]
    pub fn global(self) -> GlobalEdge<T> {
        GlobalEdge(self)
    }
}

impl<C, T> Node<C, T> {
    /// The edge to this node at coordinates that the stage names while it runs.
    #[must_use]
    pub fn anywhere(self) -> DynamicEdge<C, T> {
        DynamicEdge(self)
    }
}

impl<'a, P: PlanTypes> Runner<'a, P> {
    /// What [`DynamicEdge`] gives a stage, for use outside of a stage.
    #[must_use]
    pub fn demand<C, T>(&self, node: Node<C, T>) -> Demand<'a, P, C, T> {
        Demand::new(*self, node)
    }
}

impl<P: PlanTypes, D: Coordinate<P>, T: Clone + Send + Sync + 'static> Demand<'_, P, D, Vec<T>> {
    /// The elements of the node's lists at many coordinates, in their order.
    ///
    /// # Errors
    /// The error of the first coordinate that has one.
    pub fn joined(&self, places: impl IntoIterator<Item = D>) -> Result<Vec<T>, P::Error> {
        let mut all = Vec::new();
        // What another thread computes is waited for at last.
        let places = places.into_iter().map(Coordinate::erase);
        let answers: Vec<_> = places
            .map(|at| self.runner.ask(self.node.index, at))
            .collect();
        for answer in answers {
            all.extend_from_slice(&self.node.typed(answer.wait()?));
        }
        Ok(all)
    }
}

impl<P: PlanTypes, D: Coordinate<P>, T: Send + Sync + 'static> Demand<'_, P, D, T> {
    /// The node's value at a coordinate.
    ///
    /// # Errors
    /// The error of a stage.
    pub fn at(&self, at: D) -> Result<Arc<T>, P::Error> {
        self.runner.get(self.node, at)
    }

    /// The node's values at many coordinates, in their order, computed by the runner's threads.
    ///
    /// # Errors
    /// The error of the first coordinate, in their order, that has one.
    pub fn all(&self, places: &[D]) -> Result<Vec<Arc<T>>, P::Error> {
        let values = self.batch(places).values().into_iter();
        values.map(|value| Ok(self.node.typed(value?))).collect()
    }
}

/// A tuple of edges.
pub trait Inputs<P: PlanTypes, C>: Copy + Send + Sync + 'static {
    /// The tuple of their values.
    type Values<'a>;

    /// The nodes that they lead to.
    fn nodes(self) -> Vec<usize>;

    /// Gets all of them.
    ///
    /// # Errors
    /// The first edge's error.
    fn fetch<'a>(self, at: C, runner: &Runner<'a, P>) -> Result<Self::Values<'a>, P::Error>;
}

impl<P: PlanTypes, C> Inputs<P, C> for () {
    type Values<'a> = ();

    fn nodes(self) -> Vec<usize> {
        Vec::new()
    }

    fn fetch<'a>(self, _at: C, _runner: &Runner<'a, P>) -> Result<(), P::Error> {
        Ok(())
    }
}

macro_rules! tuples {
    ($($edge:ident)*) => {
        impl<P, At, $($edge),*> Inputs<P, At> for ($($edge,)*)
        where
            P: PlanTypes,
            At: Coordinate<P>,
            $($edge: Edge<P, At>),*
        {
            type Values<'a> = ($($edge::Value<'a>,)*);

            fn nodes(self) -> Vec<usize> {
                #[allow(non_snake_case, reason = "a macro's variables are named after its types")]
                let ($($edge,)*) = self;
                [$($edge.nodes()),*].concat()
            }

            fn fetch<'a>(
                self,
                at: At,
                runner: &Runner<'a, P>,
            ) -> Result<Self::Values<'a>, P::Error> {
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
tuples!(A B C D E F G H I);
