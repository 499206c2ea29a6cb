//! This crate wires the nemoral stages into typed plans that grow a forest and record it.
//!
//! ```no_run
//! use nemoral_pipeline::config::Preset;
//! use nemoral_pipeline::plan::{Runner, Store};
//! use nemoral_pipeline::ForestPlan;
//!
//! let config = Preset::by_name("demo").expect("there is a demo").config();
//! let forest = ForestPlan::new(&config)?;
//! let store = Store::unlimited();
//! let runner = Runner::new(forest.plan(), &store, 2);
//! // Any node, at any coordinate, in any order: what it gives never depends on what ran before.
//! let scans = runner.get(forest.scans, 41)?;
//! let pictures = runner.get(forest.images, 41)?;
//! println!("{} points, {} pixels", scans[0].len(), pictures[0].rgb.pixels().len());
//! # Ok::<(), nemoral_pipeline::Error>(())
//! ```
//!
//! - [`config`]: requests in layers (preset, file, settings), which are `nemoral-config`.
//! - [`plan`]: the engine, `nemoral-plan`, at the coordinates of a forest.
//! - [`stages`]: thin adapters from the stage crates to the plan.
//! - [`world`]: the content of a world, made from a config.
//! - [`recording`]: the content of a frame, from which it is recorded.
//! - [`ForestPlan`]: all of it wired, on one page.
//! - [`InputFiles`]: the files that a config names, each read once.
//! - [`Recorder`]: single frames in memory, along the path or anywhere else.
//! - [`Recorder::export_scene`], [`tree_scene`]: what `nemoral-export` writes for other programs.
//! - [`check`], [`generate`], [`preview`]: check a request, and make data sets and pictures from
//!   it.
//! - [`merge`]: the shards of a data set in one, and in the other formats that it asks for.
//!
//! The chunk manager of the paper (section IV-A) is [`ChunkManager`]: the eviction policy of the
//! plan's store. A forest is endless, and only its part near the robot is kept.

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;

mod backend;
mod check;
mod chunks;
mod coordinate;
mod error;
mod estimate;
mod export;
mod forest;
mod formats;
mod frames;
#[cfg(feature = "fuzz")]
#[doc(hidden)]
pub mod fuzz;
mod generate;
mod header;
mod imu;
mod pictures;
pub mod plan;
mod pool;
mod prefetch;
mod preflight;
mod preview;
mod recorder;
pub mod recording;
mod scene_anywhere;
mod sequence_tables;
pub mod stages;
mod survey;
pub mod world;
mod worlds;

pub use backend::{Backend, BackendChoice, Renderer};
pub use check::check;
pub use chunks::{ChunkManager, ChunkState};
pub use error::Error;
pub use estimate::{Estimate, estimate};
pub use export::{ExportArea, tree_scene};
pub use forest::ForestPlan;
pub use formats::merge;
pub use frames::{FrameSelection, SequenceFrames};
pub use generate::{FrameWritten, GenerateParams, Observer, RunTimings, generate};
pub use header::header;
pub use imu::MeasuredMotion;
pub use nemoral_config as config;
pub use nemoral_config::{InputFile, InputFiles};
pub use pictures::{
    picture_of_classes, picture_of_depth, picture_of_instances, picture_of_normals, picture_of_scan,
};
pub use pool::use_thread_pool;
pub use preview::{preview, write_png};
pub use recorder::{BodyState, InventoryItem, RecordedFrame, Recorder};
pub use survey::{InventoryParams, InventoryPlots, Survey, SurveyParams};
