//! Uses the sampler alone: prints how dense Poisson disks of one radius are after each number of
//! rounds, and how fast they are computed.
//!
//! `cargo run --release -p nemoral-placement --example poisson_disks`

#![allow(clippy::print_stdout, reason = "a measurement prints")]

use std::time::Instant;

use glam::DVec2;
use nemoral_placement::{ParamError, PoissonDiskParams, PoissonDisks};
use nemoral_seed::Key;

/// Points per square of the least distance in a saturated sample.
const SATURATED: f64 = 0.6966;

fn main() -> Result<(), ParamError> {
    let edge_m = 400.0;
    for rounds in 1..=5 {
        let params = PoissonDiskParams {
            rounds,
            ..PoissonDiskParams::default()
        };
        let spacing_m = 2.0 * params.varieties[0].radius_m.0;
        let sampler = PoissonDisks::new(params, Key::world(1))?;
        let start = Instant::now();
        let disks = sampler.in_rect(DVec2::ZERO, DVec2::splat(edge_m));
        let seconds = start.elapsed().as_secs_f64();
        let density = disks.len() as f64 * (spacing_m / edge_m) * (spacing_m / edge_m);
        println!(
            "{rounds} rounds: {} disks, {:.3} of saturation, {:.0} disks a second",
            disks.len(),
            density / SATURATED,
            disks.len() as f64 / seconds
        );
    }
    Ok(())
}
