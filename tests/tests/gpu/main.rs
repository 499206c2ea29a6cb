//! The GPU camera compared with the ray-cast camera. Each test needs a Vulkan or OpenGL driver, of
//! a GPU or in software.

#![allow(clippy::print_stdout, reason = "what was measured, for --nocapture")]

mod common;
mod memory;
mod passes;
mod pictures;
mod sheets;
mod truth;

#[path = "../../../crates/render/examples/species_map/avenue.rs"]
mod avenue;
