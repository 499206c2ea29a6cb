//! This crate casts rays at forests of instanced, alpha-masked shapes.

mod blas;
mod block;
mod brute;
mod exact;
mod forest;
mod group;
mod hull;
mod nearest;
mod node;
mod order;
mod simd;
mod stack;
mod surface;
mod tree;

pub use blas::Blas;
pub use brute::BruteForce;
pub use forest::Forest;
pub use group::Group;
