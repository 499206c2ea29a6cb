//! This crate runs forest trails through an endless chunked world and carves them into its ground.
//!
//! ```
//! use std::sync::Arc;
//! use nemoral_scene::{ChunkCoord, FlatSurface, Surface};
//! use nemoral_seed::Key;
//! use nemoral_trails::{TrailParams, Trails};
//!
//! let base = Arc::new(FlatSurface { height_m: 5.0, gradient: [0.2, 0.0].into() });
//! let params = TrailParams { spawn_probability: 0.05, ..TrailParams::default() };
//! let trails = Trails::new(params, 50.0, Key::world(7), base)?;
//! let (trail, s_m) = trails.nearest([0.0, 0.0].into(), 500.0).expect("about two trails a chunk");
//! let middle = trail.position_m(s_m);
//! let ground = trails.ground_near(ChunkCoord::containing(middle, 50.0), 10.0);
//! assert!(ground.edge_m(middle) < -0.3);
//! assert!(ground.sample(middle).height_m.is_finite());
//! # Ok::<(), nemoral_trails::ParamError>(())
//! ```
//!
//! # The model
//! Nunes, Ferreira and Peixoto (section IV-C) start trails in chunks with a probability, continue
//! them to the opposite border with another, lay a strip of a given width and section over the
//! ground, and place grass along its middle and small rocks on it. (Grass on the verges is our
//! addition.) They name the carving of the ground as future work. In this crate:
//! - A trail is born in a chunk and goes on for up to 40 chunks. A chunk finds its trails by
//!   testing every chunk within that reach for a trail that is born there and passes by, so the
//!   order of visits does not matter.
//! - Trails along given lines ([`Trails::along`]) are carved and dressed as those are.
//! - Trails cross borders at keyed places and directions, and run along cubic curves between.
//! - Trails fork ([`TrailParams::fork_probability`]): a branch leaves its trail at a crossing, in
//!   its direction, and goes on by another border. Branches are found as trails are.
//! - [`TrailGround`] carves them: the formation is the ground along the trail, smoothed and limited
//!   in grade as far as that moves no more earth than allowed; there are cut and fill slopes of
//!   given ratios, crossfall, crown, wheel ruts, and a ridge between these.
//! - Grass, stones, roots, steps, beds of stones and culverts dress them ([`DressingKind`]).
//! - A trail's material varies from trail to trail and along each ([`TrailSurfaceKind`]): the
//!   paper's segmentation failed on trails that looked different from its one texture.
//!
//! - A world has several kinds of way ([`WayKind`]): a trail's key draws which one it is. Those
//!   that are one piece of earthwork join at grade; a trodden path fades into the road that it
//!   meets.
//!
//! All lengths are metres; offsets are positive to the left of a trail's direction.

mod bends;
mod curve;
mod dressing;
mod dressing_placement;
mod earthwork;
mod earthwork_layer;
mod grading;
mod ground;
mod index;
mod layout;
mod line_course;
mod params;
mod path;
mod place;
mod route;
mod section;
mod surface_kinds;
mod trail_id;
mod trails;
mod turning;
mod value_noise;
mod way;
mod zone;

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;

pub use dressing::{DressingKind, TrailDressing};
pub use ground::TrailGround;
pub use nemoral_scene::ParamError;
pub use nemoral_scene::TrailSurfaceKind;
pub use params::{CrossSection, Ditch, Ruts, TrailParams};
pub use path::TrailPath;
pub use place::TrailPlace;
pub use trail_id::TrailId;
pub use trails::{TrailEdges, Trails};
pub use way::WayKind;
pub use zone::TrailZone;
