//! This crate is an engine for pure computations that depend on each other: stages are wired into a
//! graph, every value has a key before anything runs, and each value is computed once.
//!
//! - A [`Stage`] is a pure function of its parameters, a coordinate, and what it reads.
//!   [`Plan::add`] wires it: it takes the handles of nodes that exist already, so a plan is acyclic
//!   by construction, and handles have types, so an edge that does not fit does not compile.
//! - A node is computed at a [`Coordinate`]: a day, a tile, a number, or `()` for the whole plan.
//!   An edge reaches a node at the same coordinate ([`Node`] itself), one that is computed once
//!   ([`Node::global`]), or one at coordinates that the stage asks for while it runs
//!   ([`Node::anywhere`]).
//! - A node's key is the hash of its stage's id, version and parameters, of the plan's context, of
//!   the keys of what it reads, and of its coordinate. Equal keys mean equal values, so a key
//!   serves the [`Store`], a [`Cache`] on disk, resuming, and provenance alike. Parameters are
//!   written into keys by [`Encode`], an encoding that is spelled out rather than derived.
//! - A [`Runner`] computes what is asked for and no more. One thread computes a value while others
//!   that want it turn to what else they want, and wait for it at last; a [`Store`] that forgets
//!   values changes the work, never a result.
//! - [`Plan::draw`] and [`Plan::explain`] show a plan.
//!
//! The user defines the coordinates and the error of stages ([`PlanTypes`]). The README has a whole
//! program.
//!
//! # Non-goals
//! Plans that change while they run, values that are not worth a hash and an `Arc` (nodes should
//! take microseconds at least), and distribution over machines.

mod cache;
mod drawing;
mod edge;
mod encode;
mod fingerprint;
mod node;
mod plan;
mod stage;
mod store;
#[cfg(test)]
mod tests;
mod types;
mod wanted;

pub use cache::{Cache, Kept};
pub use drawing::GraphFormat;
pub use edge::{Anywhere, Demand, Edge, Global, Inputs};
pub use encode::{Encode, Encoder, KeyEncoder};
pub use fingerprint::{Fingerprint, Hasher};
pub use node::Node;
pub use plan::{Plan, Runner};
pub use stage::{Stage, Values};
pub use store::Store;
pub use types::{AnyCoordinate, Coordinate, PlanTypes, StageError};
pub use wanted::Wanted;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
