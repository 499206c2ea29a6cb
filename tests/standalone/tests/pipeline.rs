//! Use of `nemoral-pipeline` alone: one node of a plan, and a user's stage, without files.

use std::sync::Arc;

use nemoral_pipeline::config::{Config, ConfigLayers};
use nemoral_pipeline::plan::{ForestTypes, Hasher, Node, Plan, Runner, Stage, Store};
use nemoral_pipeline::{Error, ForestPlan};
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_seed::Key;

fn config(settings: &[&str]) -> Result<Config, Error> {
    let layers = ConfigLayers {
        preset: Some("demo".to_owned()),
        file: None,
        settings: settings.iter().map(|&s| s.to_owned()).collect(),
    };
    Ok(layers.load()?)
}

#[test]
fn the_ground_needs_no_forest() -> Result<(), Error> {
    let forest = ForestPlan::new(&config(&["terrain.max_height_m=9"])?)?;
    let store = Store::unlimited();
    let runner = Runner::new(forest.plan(), &store, 2);
    let chunk = ChunkCoord::new(1000, -1000);
    let ground = runner.get(forest.ground, chunk)?;
    let height_m = ground.height_m(chunk.centre_m(50.0));
    assert!((-2.0..11.0).contains(&height_m), "{height_m} m");
    // Two nodes were computed: this one and the world's model.
    assert_eq!(store.len(), 2);
    Ok(())
}

#[test]
fn a_frame_is_recorded_in_memory() -> Result<(), Error> {
    let settings = [
        "chunks.visible_radius_m=20",
        "chunks.undergrowth_radius_m=10",
    ];
    let forest = ForestPlan::new(&config(&settings)?)?;
    let store = Store::unlimited();
    let runner = Runner::new(forest.plan(), &store, 2);
    let points = &runner.get(forest.scans, 1)?[0];
    let pixels = runner.get(forest.images, 1)?[0].rgb.pixels().len();
    assert_eq!(pixels, 160 * 96);
    assert!(
        (100..=3000).contains(&points.len()),
        "{} points",
        points.len()
    );
    assert!(points.iter().all(|p| p.range_m > 0.4 && p.range_m < 260.0));
    Ok(())
}

#[test]
fn a_wrong_request_is_explained() {
    let error = config(&["terrain.octaves=99"]).expect_err("too many");
    assert!(error.is_request());
    let message = error.to_string();
    assert!(message.contains("terrain.octaves = 99"), "{message}");
    assert!(message.contains("from 1 to 16"), "{message}");
}

/// A stage for the number of deer in a chunk.
struct Deer {
    per_chunk: u64,
}

impl Stage<ForestTypes> for Deer {
    type At = ChunkCoord;
    type Inputs = ();
    type Output = u64;
    const ID: &'static str = "deer";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        hasher.write_bytes(&self.per_chunk.to_le_bytes());
    }

    fn run(&self, at: ChunkCoord, world: Key, (): ()) -> Result<u64, Error> {
        Ok(world.chunk(at).to_u64() % (2 * self.per_chunk))
    }
}

/// A stage for the number of wolves in a chunk, which depends on its deer.
struct Wolves;

impl Stage<ForestTypes> for Wolves {
    type At = ChunkCoord;
    type Inputs = (Node<ChunkCoord, u64>,);
    type Output = u64;
    const ID: &'static str = "wolves";
    const VERSION: u32 = 1;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(&self, _: ChunkCoord, _: Key, (deer,): (Arc<u64>,)) -> Result<u64, Error> {
        Ok(*deer / 10)
    }
}

#[test]
fn stages_of_ones_own() -> Result<(), Error> {
    let wired = |per_chunk| {
        let mut plan = Plan::new(Key::world(7));
        let deer = plan.add(Deer { per_chunk }, ());
        let wolves = plan.add(Wolves, (deer,));
        (plan, deer, wolves)
    };
    let (plan, deer, wolves) = wired(50);
    let store = Store::unlimited();
    let runner = Runner::new(&plan, &store, 2);
    let chunk = ChunkCoord::new(-4, 4);
    assert_eq!(*runner.get(wolves, chunk)?, *runner.get(deer, chunk)? / 10);
    // The key of a node depends on parameters of its inputs.
    let (other, _, of_other) = wired(51);
    assert_ne!(plan.key(wolves, chunk), other.key(of_other, chunk));
    Ok(())
}
