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
mod scan_mirror;
