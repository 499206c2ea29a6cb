//! Whole worlds: what stands, lies and grows in them, and where. They are in one program, as each
//! keeps a processor busy for seconds but seldom two.
#![allow(clippy::print_stdout, reason = "what was measured, for --nocapture")]

mod balance;
mod cliffs;
mod climbers;
mod closed_vegetation;
mod common;
mod deadwood;
mod edge_trees;
mod export;
mod flight;
mod ground_shade;
mod imu;
mod inventory;
mod litter;
mod meadows;
mod scans;
mod seasons;
mod splits;
mod surface_roots;
mod walk;
mod water;
