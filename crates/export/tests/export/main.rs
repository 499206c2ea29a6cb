//! What is written, read again by small readers of the tests' own.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

mod common;
mod geotiff;
mod glb;
mod gltf;
mod height_map;
mod sdf;
mod usd;
