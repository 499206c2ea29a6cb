//! This crate casts rays at forests of instanced, alpha-masked shapes.

mod blas;
mod brute;
mod exact;
mod forest;
mod group;
mod nearest;
mod surface;

pub use blas::Blas;
pub use brute::BruteForce;
pub use forest::Forest;
pub use group::Group;
