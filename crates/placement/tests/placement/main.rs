//! Tests of samplers and of stands, in one program.

mod common;
mod cover;
mod poisson_disks;
mod properties;
mod stands;
mod uniformity;
