//! This crate lets water run through an endless chunked world: streams from springs to ponds, the
//! beds that they cut, and puddles.
//!
//! ```
//! use std::sync::Arc;
//! use nemoral_scene::glam::DVec2;
//! use nemoral_scene::{ChunkCoord, FlatSurface, Surface};
//! use nemoral_seed::Key;
//! use nemoral_water::{GroundWithoutWays, Water, WaterParams};
//!
//! let base = Arc::new(FlatSurface { height_m: 5.0, gradient: DVec2::ZERO });
//! let params = WaterParams { ponds: 0.02, ..WaterParams::default() };
//! let ways = Arc::new(GroundWithoutWays(Arc::clone(&base)));
//! let water = Water::new(params, 50.0, Key::world(7), base.clone(), ways)?;
//! let chunks = ChunkCoord::new(0, 0).square(2);
//! let near = chunks.map(|chunk| water.near(chunk, 10.0)).find(|near| !near.is_empty());
//! let near = near.expect("a plain is full of hollows");
//! let pond = near.ponds().next().expect("there are no streams on a plain");
//! let middle = pond.middle_m();
//! let bed = near.carve(middle, base.sample(middle));
//! assert!(near.edge_m(middle) < 0.0 && bed.height_m < pond.level_m());
//! assert!(pond.level_m() < 5.0);
//! # Ok::<(), nemoral_water::ParamError>(())
//! ```
//!
//! # The model
//! - The terrain is smoothed on a lattice of 8 m. From each node water flows to the steepest of its
//!   eight neighbours (O'Callaghan and Mark 1984, "The extraction of drainage networks from digital
//!   elevation data"), or, out of a hollow, over a low barrier to a lower node nearby (Lindsay and
//!   Creed 2005 call this breaching). So where it flows is a pure function of a node, and streams
//!   that meet go on as one.
//! - Cells of the plane have keyed springs. A stream ends in the first hollow that it cannot leave,
//!   where there is a pond. A chunk tests every cell within [`REACH_M`], so the order of visits
//!   does not matter.
//! - The level of a stream is the least height of the ground along it so far, less a freeboard, so
//!   water never runs uphill. Its width grows with the square root of the length of streams above
//!   it, as downstream hydraulic geometry has it with discharge (Leopold and Maddock 1953).
//! - [`ChunkWater::carve`] cuts the bed and its banks into the ground, and fills a rim onto it
//!   where it is lower than the water.
//! - A stream passes under [`GroundWithWays`]: its bed ends at their verges.
//!
//! All lengths are metres.

mod channel;
mod chunk_water;
mod course;
mod directions;
mod lattice;
mod network;
mod params;
mod pond;
mod puddle;
mod stream;
mod surface_mesh;
mod water;
mod ways;

/// A stream ends within this distance of its spring, east and north, metres.
pub const REACH_M: f64 = 360.0;

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;

pub use channel::CrossSection;
pub use chunk_water::{ChunkWater, puddle_surfaces};
pub use nemoral_scene::ParamError;
pub use params::WaterParams;
pub use pond::Pond;
pub use puddle::{Puddle, PuddleSite};
pub use surface_mesh::WaterKind;
pub use water::{SURFACE_REACH_M, Water};
pub use ways::{GroundWithWays, GroundWithoutWays};
