//! The program from a user's view: what it writes, what it refuses, and what it leaves behind.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

mod breakdown;
mod common;
mod export;
mod formats;
mod hostile;
mod progress;
mod questions;
mod recording;
mod refusals;
mod sequences;
mod terminal;
