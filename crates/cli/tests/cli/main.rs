//! The program as a user meets it: what it writes, what it refuses, what it leaves behind.

mod breakdown;
mod common;
mod hostile;
mod questions;
mod recording;
mod refusals;
