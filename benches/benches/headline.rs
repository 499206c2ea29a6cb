//! The paper's headline redone: a scan of 50,000 pulses at `medium`, all fields and noise included, on
//! one thread and on two. Processor time is what the scan costs; the wall's clock also tells of what
//! else the machine does.
//!
//! `cargo bench -p nemoral-benches --bench headline -- [PULSES] [PRESET] [SCANS]`
#![allow(clippy::print_stdout, reason = "a report for its user")]

use std::time::Instant;

use cpu_time::ProcessTime;
use nemoral_benches::{Grown, config};
use nemoral_seed::Key;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1).filter(|w| !w.starts_with("--"));
    let pulses = words.next().map_or(Ok(50_000), |w| w.parse())?;
    let preset = words.next().unwrap_or_else(|| "medium".to_owned());
    let scans = words.next().map_or(Ok(60), |w| w.parse())?;
    let grown = Grown::new(&config(&preset, pulses)?)?;
    let runner = grown.runner();
    let forest = &grown.forest;
    let pose = runner.get(forest.pose, 0)?;
    let scene = runner.get(forest.scene, 0)?;
    let rigs = runner.get(forest.lidars, ())?;
    let assets = runner.get(forest.assets, ())?;
    let (rig, track) = (&rigs[0], pose.track.relative_to(scene.origin_m));
    println!("{preset}, {pulses} pulses, {scans} scans: milliseconds a scan");
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()?;
        let mut wall = Vec::new();
        let mut processor = Vec::new();
        let mut points = 0;
        for _ in 0..scans {
            let (start, used) = (Instant::now(), ProcessTime::now());
            let scan = pool.install(|| {
                rig.scanner.scan(
                    rig.scanner.first_pulse_at(pose.time_s),
                    &scene.forest,
                    &assets.library.materials,
                    &|offset_s| track.at(offset_s) * rig.body_from_lidar,
                    &rig.noise,
                    Key::world(1),
                )
            });
            wall.push(start.elapsed().as_secs_f64() * 1e3);
            processor.push(used.elapsed().as_secs_f64() * 1e3);
            points = scan.len();
        }
        wall.sort_by(f64::total_cmp);
        processor.sort_by(f64::total_cmp);
        println!(
            "{threads} threads: wall {:.1} at best, {:.1} median; processor {:.1} at best, {:.1} median; {points} points",
            wall[0],
            wall[scans / 2],
            processor[0],
            processor[scans / 2],
        );
    }
    Ok(())
}
