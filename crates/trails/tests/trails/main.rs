//! Tests of trails, in one program.

mod common;
mod continuity;
mod dressing;
mod ground;
mod paths;
mod ways;
