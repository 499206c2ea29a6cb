//! Tests of casters, in one program.

mod common;
mod fuzzed_scenes;
mod parry_agreement;
mod properties;
mod shapes;
mod watertight;
