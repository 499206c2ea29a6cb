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
//! program; here is one without these definitions.
//!
//! ```
//! use std::f64::consts::TAU;
//! use std::sync::Arc;
//!
//! use nemoral_plan::{GlobalEdge, Hasher, Plan, Runner, Stage, Store};
//! # use nemoral_plan::{AnyCoordinate, Coordinate, PlanTypes, StageError};
//! #
//! # #[derive(Clone, Copy, Debug, PartialEq, Eq)]
//! # enum At {
//! #     Always,
//! #     Day(u32),
//! # }
//! # impl AnyCoordinate for At {
//! #     const GLOBAL: Self = Self::Always;
//! #     fn hash(self, hasher: &mut Hasher) {
//! #         if let Self::Day(day) = self {
//! #             hasher.write_u64(u64::from(day));
//! #         }
//! #     }
//! # }
//! # #[derive(Clone, Copy)]
//! # struct Day(u32);
//! # impl Coordinate<Almanac> for Day {
//! #     fn erase(self) -> At {
//! #         At::Day(self.0)
//! #     }
//! #     fn restore(at: At) -> Option<Self> {
//! #         if let At::Day(day) = at { Some(Self(day)) } else { None }
//! #     }
//! # }
//! # #[derive(Clone, Debug)]
//! # struct Error;
//! # impl StageError<At> for Error {
//! #     fn panicked(_: &'static str, _: At) -> Self {
//! #         Self
//! #     }
//! # }
//! # enum Almanac {}
//! # impl PlanTypes for Almanac {
//! #     type At = At;
//! #     type Context = ();
//! #     type Error = Error;
//! #     fn hash_context((): &(), _: &mut Hasher) {}
//! # }
//!
//! /// The tilt of the earth's axis, radians, from degrees: once for the whole plan.
//! struct Tilt(f64);
//!
//! impl Stage<Almanac> for Tilt {
//!     type At = ();
//!     type Inputs = ();
//!     type Output = f64;
//!     const ID: &'static str = "tilt";
//!     const VERSION: u32 = 1;
//!     fn fingerprint(&self, hasher: &mut Hasher) {
//!         hasher.write_f64(self.0);
//!     }
//!     fn run(&self, (): (), (): (), (): ()) -> Result<f64, Error> {
//!         Ok(self.0.to_radians())
//!     }
//! }
//!
//! /// The sun's declination on a day of the year, radians.
//! struct Declination;
//!
//! impl Stage<Almanac> for Declination {
//!     type At = Day;
//!     type Inputs = (GlobalEdge<f64>,);
//!     type Output = f64;
//!     const ID: &'static str = "declination";
//!     const VERSION: u32 = 1;
//!     fn fingerprint(&self, _: &mut Hasher) {}
//!     fn run(&self, Day(day): Day, (): (), (tilt,): (Arc<f64>,)) -> Result<f64, Error> {
//!         Ok(*tilt * (TAU * (f64::from(day) - 81.0) / 365.0).sin())
//!     }
//! }
//!
//! let mut plan = Plan::new(());
//! let tilt = plan.add(Tilt(23.44), ());
//! let declination = plan.add(Declination, (tilt.global(),));
//!
//! let store = Store::unlimited();
//! let runner = Runner::new(&plan, &store, 2);
//! assert!(*runner.get(declination, Day(172))? > 0.4);
//! assert!(*runner.get(declination, Day(355))? < -0.4);
//! // The tilt was computed once.
//! assert_eq!(store.computed(), 3);
//! # Ok::<(), Error>(())
//! ```
//!
//! # Non-goals
//! Plans that change while they run, values that are not worth a hash and an `Arc` (nodes should
//! take microseconds at least), and distribution over machines.

mod batch;
mod cache;
mod edge;
mod encode;
mod fingerprint;
mod graph;
mod node;
mod plan;
mod stage;
mod store;
#[cfg(test)]
mod tests;
mod types;

pub use batch::DemandBatch;
pub use cache::{Cache, CacheCodec};
pub use edge::{Demand, DynamicEdge, Edge, GlobalEdge, Inputs};
pub use encode::{Encode, Encoder, KeyEncoder};
pub use fingerprint::{Fingerprint, Hasher};
pub use graph::GraphFormat;
pub use node::Node;
pub use plan::{Plan, Runner};
pub use stage::{Stage, Values};
pub use store::Store;
pub use types::{AnyCoordinate, Coordinate, PlanTypes, StageError};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
