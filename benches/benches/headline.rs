//! The paper's headline measured again: a scan of 50,000 pulses at `medium`, with all fields and
//! noise, on one thread and on two. The cost is processor time, as wall-clock time also depends on
//! what else the machine does.
//!
//! `cargo bench -p nemoral-benches --bench headline -- [PULSES] [PRESET] [SCANS] [KEY=VALUE]…`
#![allow(clippy::print_stdout, reason = "a report for its user")]

use std::time::Instant;

use cpu_time::ProcessTime;
use nemoral_benches::{Grown, settings};
use nemoral_scene::LidarPoint;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words = std::env::args().skip(1).filter(|w| !w.starts_with("--"));
    let (mut set, words): (Vec<String>, Vec<String>) = words.partition(|w| w.contains('='));
    let mut words = words.into_iter();
    let pulses = words.next().map_or(Ok(50_000), |w| w.parse())?;
    let preset = words.next().unwrap_or_else(|| "medium".to_owned());
    let scans = words.next().map_or(Ok(60), |w| w.parse())?;
    set.push(format!("lidar.pulses={pulses}"));
    let grown = Grown::new(&settings(&preset, &set)?)?;
    let scan = grown.first_scan()?;
    println!("{preset}, {pulses} pulses, {scans} scans: milliseconds a scan");
    println!("points: {:016x}", hash(&scan()));
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()?;
        let mut wall = Vec::new();
        let mut processor = Vec::new();
        let mut points = 0;
        for _ in 0..scans {
            let (start, used) = (Instant::now(), ProcessTime::now());
            points = pool.install(&scan).len();
            wall.push(start.elapsed().as_secs_f64() * 1e3);
            processor.push(used.elapsed().as_secs_f64() * 1e3);
        }
        wall.sort_by(f64::total_cmp);
        processor.sort_by(f64::total_cmp);
        println!(
            "{threads} threads: wall {:.1} at best, {:.1} median; processor {:.1} at best, {:.1} \
             median; {points} points",
            wall[0],
            wall[scans / 2],
            processor[0],
            processor[scans / 2],
        );
    }
    Ok(())
}

/// A hash that tells the points of two programs apart (FNV-1a of the debug text of all fields,
/// which is exact to the bit).
fn hash(points: &[LidarPoint]) -> u64 {
    let text = format!("{points:?}");
    text.bytes().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}
