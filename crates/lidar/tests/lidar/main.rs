//! Tests of scanners, in one program.

mod beams;
mod carrier;
mod common;
mod devices;
mod echoes;
mod intensity;
mod mirror;
mod motorised;
mod patterns;
mod properties;
mod pulse_errors;
mod scan_mirror;
mod walls;
mod weather;
