//! The cost of each preset: its assets grown and baked, and read from the cache's files; a new
//! chunk; a scan and a draft picture of frame 0; the instances in view there, and the memory of
//! what rays are cast at, textures not counted. Seconds and milliseconds are wall-clock time on two
//! threads, the best of three but for growing, which is done once.
//!
//! `cargo bench -p nemoral-benches --bench presets -- [PRESET]...`
#![allow(clippy::print_stdout, reason = "a report for its user")]

use std::sync::Arc;
use std::time::Instant;

use nemoral_benches::{Grown, settings};
use nemoral_pipeline::ForestPlan;
use nemoral_pipeline::config::Preset;
use nemoral_pipeline::plan::{Cache, ForestCoordinate, Runner, Store};
use nemoral_raycast::RayScene;
use nemoral_scene::ChunkCoord;

/// Prefix of the nodes that belong to one chunk, all of which are computed anew.
const OF_CHUNK: &str = "chunk.";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(2)
        .build_global()?;
    let named: Vec<String> = std::env::args()
        .skip(1)
        .filter(|w| !w.starts_with("--"))
        .collect();
    println!(
        "| preset | assets, s | from the cache | a chunk, ms | scan of 50,000, ms | draft, s | in \
         view | MB |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let all = Preset::ALL.iter().map(|p| p.name);
    let wanted = all.filter(|p| named.is_empty() || named.iter().any(|n| n == p));
    for preset in wanted {
        let asked = ["lidar.pulses=50000", "camera.edge_samples=1"].map(str::to_owned);
        let config = settings(preset, &asked)?;
        let folder = tempfile::tempdir()?;
        let assets = || -> Result<f64, Box<dyn std::error::Error>> {
            let cache = Arc::new(Cache::open(folder.path())?);
            let store = Store::unlimited().with_cache(Some(cache));
            let forest = ForestPlan::new(&config)?;
            let start = Instant::now();
            Runner::new(forest.plan(), &store, 2).get(forest.assets, ())?;
            Ok(start.elapsed().as_secs_f64())
        };
        let grown_s = assets()?;
        let mut cached_s = f64::INFINITY;
        for _ in 0..3 {
            cached_s = cached_s.min(assets()?);
        }

        let grown = Grown::new(&config)?;
        let forest = &grown.forest;
        let best = |of: &dyn Fn()| {
            let time = |_| {
                let start = Instant::now();
                of();
                start.elapsed().as_secs_f64()
            };
            (0..3).map(time).fold(f64::INFINITY, f64::min)
        };
        // A chunk that the robot drives through. Its neighbours are already computed, as during a
        // drive.
        let at = ChunkCoord::new(0, 0);
        let of_this = |stage: &str, place| {
            stage.starts_with(OF_CHUNK) && place == ForestCoordinate::Chunk(at)
        };
        let chunk_s = best(&|| {
            grown.store.retain(|stage, place| !of_this(stage, place));
            let runner = grown.runner();
            runner
                .get(forest.object_geometry, at)
                .expect("grown before");
            runner
                .get(forest.undergrowth_geometry, at)
                .expect("grown before");
            runner
                .get(forest.litter_geometry, at)
                .expect("grown before");
        });
        let scan = grown.first_scan()?;
        let scan_s = best(&|| drop(scan()));
        let draft_s = best(&|| {
            grown.store.retain(|stage, _| stage != "frame.images");
            let images = grown.runner().get(forest.images, 0);
            images.expect("taken before");
        });
        let groups = &grown.runner().get(forest.scene, 0)?.groups;
        let in_view: usize = groups.iter().map(|(_, g)| g.instances().len()).sum();
        let bytes = RayScene::new(groups.clone()).memory_bytes();
        println!(
            "| `{preset}` | {grown_s:.1} | {cached_s:.2} | {:.0} | {:.1} | {draft_s:.2} | \
             {in_view} | {:.0} |",
            1e3 * chunk_s,
            1e3 * scan_s,
            bytes as f64 / 1e6
        );
    }
    Ok(())
}
