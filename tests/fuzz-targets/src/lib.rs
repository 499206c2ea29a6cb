//! The functions that the fuzzers in `fuzz/` and, on stable Rust, the replay of their corpora
//! (`tests/corpus.rs`) call with their inputs: one function of bytes for each kind of file that may
//! come from others.
//!
//! A function may refuse its input in any way that returns. It must not panic, abort, hang, or ask
//! for a gigabyte. Some functions also assert that an accepted input can be written and read again,
//! or that nothing outside a data set's folder changes.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

mod base;
mod decoders;
mod edits;
mod folders;
mod requests;
mod scratch;
mod site;
mod state;

pub use base::{Files, files, shards, write_shard};

/// A function for inputs, with its name.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// The name of its binary in `fuzz/`, and of its corpus's folder.
    pub name: &'static str,
    /// Runs one input.
    pub run: fn(&[u8]),
}

macro_rules! targets {
    ($($module:ident::$name:ident)*) => {
        $(pub use $module::$name;)*

        /// All of them, by name.
        pub const TARGETS: &[Target] = &[
            $(Target { name: stringify!($name), run: $name },)*
        ];
    };
}

targets! {
    decoders::bin
    decoders::boxes
    decoders::calib
    requests::config
    decoders::deadwood
    decoders::exr
    site::geotiff
    site::gltf
    site::height_png
    decoders::imu
    decoders::instances
    decoders::label
    state::manifest
    folders::merge
    decoders::npy
    site::obj
    requests::pattern
    decoders::ply
    decoders::png
    decoders::poses
    requests::robot_poses
    requests::settings
    requests::sky
    requests::species
    state::state
    site::stem_map
    decoders::times
    site::trail_lines
    decoders::trees
}
