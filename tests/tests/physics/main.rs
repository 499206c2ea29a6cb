//! Light, lenses and laser pulses obey physics: closed forms, path-traced light, and what
//! foresters measure in scans.

#![allow(clippy::print_stdout, reason = "what was measured, for --nocapture")]

mod ambient_occlusion;
mod crowns;
mod dbh;
mod foliage;
mod leaf_area;
mod lens;
mod light;
mod ranging;
