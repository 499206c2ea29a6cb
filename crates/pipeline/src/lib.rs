//! Wires the stages.
pub mod config;
mod error;
pub mod plan;
pub use error::Error;
