//! Tests of trajectories, in one program.

mod flight_lines;
mod navigation;
