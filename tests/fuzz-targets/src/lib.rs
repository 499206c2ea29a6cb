//! This crate is what is done with an input by the fuzzers in `fuzz/`, and again on stable Rust by
//! the replay of their corpora (`tests/tests/fuzz_corpus.rs`): one function of bytes for each kind
//! of file that a stranger may have made.
//!
//! A function may refuse its input in any way that returns. It must not panic, abort, hang, or ask
//! for a gigabyte. Some hold more against what they are given: that what is accepted can be written
//! and read again, and that nothing outside a data set's folder is touched.

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
mod state;

pub use base::{Files, files, shards, write_shard};

/// What is done with an input.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// The name of its binary in `fuzz/`, and of its corpus's folder.
    pub name: &'static str,
    /// Takes one input.
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
    decoders::exr
    decoders::instances
    decoders::label
    state::manifest
    folders::merge
    decoders::npy
    requests::pattern
    decoders::ply
    decoders::png
    decoders::poses
    requests::robot_poses
    requests::settings
    requests::sky
    requests::species
    state::state
    decoders::times
    decoders::trees
}
