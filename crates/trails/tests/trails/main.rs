//! Tests of trails, in one program.

mod common;
mod continuity;
mod dressing;
mod dressing_amounts;
mod forks;
mod ground;
mod joins;
mod paths;
mod sections;
mod ways;
