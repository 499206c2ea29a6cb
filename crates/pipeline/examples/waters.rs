//! Prints where the waters of a preset's world are:
//! `cargo run --example waters -- stream-valley 7`.
#![allow(clippy::print_stdout, reason = "an example")]

use nemoral_pipeline::ForestPlan;
use nemoral_pipeline::config::Preset;
use nemoral_pipeline::plan::{Runner, Store};
use nemoral_scene::ChunkCoord;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "default".to_owned());
    let mut config = Preset::by_name(&name).ok_or("no such preset")?.config();
    if let Some(seed) = arguments.next() {
        config.seed = seed.parse()?;
    }
    let forest = ForestPlan::new(&config)?;
    let store = Store::unlimited();
    let runner = Runner::new(forest.plan(), &store, 2);
    let (mut puddles, mut streams_m, mut ponds) = (0, 0.0, 0);
    for at in ChunkCoord::new(0, 0).square(6) {
        let ground = runner.get(forest.ground, at)?;
        for puddle in ground.puddles().filter(|p| ground.owns(p.middle_m())) {
            puddles += 1;
            if puddles % 12 == 1 {
                println!("puddle at {:.1}", puddle.middle_m());
            }
        }
        let Some(water) = ground.water() else {
            continue;
        };
        for pond in water.ponds().filter(|p| ground.owns(p.middle_m())) {
            ponds += 1;
            let middle = pond.middle_m();
            println!(
                "pond at {middle:.1}, up to {:.1} m wide",
                2.0 * pond.widest_m()
            );
        }
        for run in water.sections() {
            let (first, last) = (run[0], run[run.len() - 1]);
            let length = run
                .windows(2)
                .map(|w| w[0].middle_m.distance(w[1].middle_m));
            streams_m += length.sum::<f64>();
            println!(
                "stream at {:.1} towards {:.2}, {:.1} m wide, falls {:.2} m",
                first.middle_m,
                first.along,
                2.0 * first.half_m,
                first.level_m - last.level_m
            );
        }
    }
    println!("{puddles} puddles, {ponds} ponds and {streams_m:.0} m of streams in 42 ha");
    Ok(())
}
