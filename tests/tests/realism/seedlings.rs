//! Seedlings of trees on the forest floor: their number, places and species, and that they change
//! nothing else.
#![allow(clippy::print_stdout, reason = "what was measured, for --nocapture")]

use std::f64::consts::TAU;
use std::sync::LazyLock;

use nemoral_pipeline::plan::Runner;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Instance, ObjectId, Semantic, Surface};
use nemoral_stand::StandLayer;
use nemoral_tests::{World, config};

/// A setting for one individual of each species, on which seedlings do not depend.
const FEW: &str = "assets.individuals=1";

const CHUNK_M: f64 = 50.0;

/// A mixed stand with many trails.
static OAKS: LazyLock<World> =
    LazyLock::new(|| World::without_cameras("oak-mixed", &[FEW, "trails.spawn_probability=0.1"]));

/// The chunks of a square with this side.
fn square(side: i32) -> impl Iterator<Item = ChunkCoord> {
    (0..side * side).map(move |i| ChunkCoord::new(i % side - side / 2, i / side - side / 2))
}

fn places(runner: &Runner<'_>, world: &World, at: ChunkCoord) -> Vec<DVec2> {
    let seedlings = runner.get(world.forest.seedlings, at).expect("seedlings");
    seedlings.iter().map(|p| p.position_m).collect()
}

/// Area of one kind of ground, and its seedlings.
#[derive(Clone, Copy, Debug, Default)]
struct Stratum {
    m2: f64,
    seedlings: f64,
}

impl Stratum {
    fn per_m2(self) -> f64 {
        self.seedlings / self.m2
    }
}

/// Ground in clusters and outside, each where less than a tenth of the sky is visible, and where
/// more than a sixth is.
#[derive(Debug, Default)]
struct Strata {
    inside: [Stratum; 2],
    outside: [Stratum; 2],
}

impl Strata {
    fn of(world: &World, side: i32) -> Self {
        let runner = world.runner(2);
        let placement = runner.get(world.forest.placement, ()).expect("placement");
        let mut strata = Self::default();
        for at in square(side) {
            let openness = runner
                .get(world.forest.sky_view_factor, at)
                .expect("openness");
            let ground = runner.get(world.forest.ground, at).expect("ground");
            let clusters = placement
                .clusters(at, StandLayer::Saplings.index())
                .expect("clusters");
            let mut count = |p: DVec2, m2: f64, seedlings: f64| {
                let part = if clusters.contain(p) {
                    &mut strata.inside
                } else {
                    &mut strata.outside
                };
                let stratum = match openness.at(p.extend(ground.height_m(p) + 0.3)) {
                    sky if sky < 0.10 => &mut part[0],
                    sky if sky > 0.17 => &mut part[1],
                    _ => return,
                };
                stratum.m2 += m2;
                stratum.seedlings += seedlings;
            };
            for i in 0..2500 {
                let cell = DVec2::new(f64::from(i % 50), f64::from(i / 50));
                count(at.origin_m(CHUNK_M) + cell + 0.5, 1.0, 0.0);
            }
            for p in places(&runner, world, at) {
                count(p, 0.0, 1.0);
            }
        }
        strata
    }
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn they_come_up_in_clusters_and_in_light() {
    let world = World::without_cameras("spruce", &[FEW, "trails.enabled=false"]);
    let strata = Strata::of(&world, 6);
    println!("spruce, in shade and in light: {strata:?}");
    let asked = world.config.placement.regeneration.seedlings;
    let [shade, light] = strata.inside;
    // There are many patches of both kinds of ground.
    assert!(shade.m2 > 500.0 && light.m2 > 1500.0);
    assert!(light.per_m2() > 2.0 * shade.per_m2());
    assert!((0.4 * asked..asked).contains(&light.per_m2()));
    assert!(shade.per_m2() < 0.3 * asked && shade.seedlings > 50.0);
    for (inside, outside) in strata.inside.into_iter().zip(strata.outside) {
        assert!(outside.per_m2() < 0.12 * inside.per_m2());
        assert!(outside.seedlings > 0.0, "some stray");
    }
}

#[test]
#[ignore = "a minute: .ci/full runs it"]
fn none_is_on_a_trail_and_none_is_in_a_row() {
    let world = &*OAKS;
    let runner = world.runner(2);
    let (mut beside, mut all) = (0, 0);
    let mut waves = [DVec2::ZERO; 2];
    for at in square(4) {
        let ground = runner.get(world.forest.ground, at).expect("ground");
        for p in places(&runner, world, at) {
            let edge_m = ground.trail_edge_m(p);
            assert!(edge_m > 0.35, "{p}: {edge_m} m from a trail");
            beside += u32::from(edge_m < 1.5);
            all += 1;
            // Seedlings are placed on a grid with cells of 0.7 m.
            for (wave, x) in waves.iter_mut().zip(p.to_array()) {
                *wave += DVec2::from_angle(TAU * x / 0.7);
            }
        }
    }
    println!("{all} seedlings, {beside} of them within 1.5 m of a trail");
    assert!(beside > 30, "the trails do pass by: {beside}");
    for wave in waves {
        let order = wave.length() / f64::from(all);
        // It is 0.4 for the undergrowth's grid, and 1 for a grid without jitter.
        assert!(order < 0.1, "{order}");
    }
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_chunk_does_not_know_its_neighbours() {
    let at = ChunkCoord::new(1, -1);
    let world = || World::without_cameras("beech", &[FEW]);
    let (alone, among) = (world(), world());
    let first = places(&alone.runner(1), &alone, at);
    let runner = among.runner(2);
    let all: Vec<DVec2> = square(5).flat_map(|c| places(&runner, &among, c)).collect();
    let chunk = |p: &&DVec2| ChunkCoord::containing(**p, CHUNK_M) == at;
    let last: Vec<DVec2> = all.iter().filter(chunk).copied().collect();
    assert!(first.len() > 100 && first == last);
    // Chunk borders are not visible either: as many seedlings as elsewhere are within a metre of
    // one.
    let border_m = |x: f64| {
        let within = x.rem_euclid(CHUNK_M);
        within.min(CHUNK_M - within)
    };
    let near = all
        .iter()
        .filter(|p| border_m(p.x) < 1.0 || border_m(p.y) < 1.0);
    let (near, area) = (near.count() as f64, 1.0 - (48.0 * 48.0) / 2500.0);
    let expected = area * all.len() as f64;
    // The count scatters more than that of random points, as there are clusters.
    assert!((near / expected - 1.0).abs() < 0.25, "{near} of {expected}");
}

#[test]
fn a_plantation_has_none() {
    let of = |preset| config(preset, &[]).placement.regeneration.seedlings;
    assert_eq!(of("eucalyptus-plantation"), 0.0);
    assert!(of("montado") < of("medium") && of("medium") < of("oak-mixed"));
}

/// The low plants of a chunk: seedlings, and all others.
fn low(world: &World, at: ChunkCoord) -> (Vec<Instance>, Vec<Instance>) {
    let low = world
        .runner(2)
        .get(world.forest.undergrowth_geometry, at)
        .expect("plants");
    let group = low.0.as_ref().expect("something grows");
    let all = group
        .instances()
        .iter()
        .map(|(instance, _)| instance.clone());
    all.partition(|i| i.prototype.name().contains("_seedling."))
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn they_are_the_stands_own_and_stand_on_its_ground() {
    let world = &*OAKS;
    let assets = world
        .runner(2)
        .get(world.forest.assets, ())
        .expect("assets");
    let (mut oaks, mut all) = (0, 0);
    for at in square(3) {
        let ground = world
            .runner(1)
            .get(world.forest.ground, at)
            .expect("ground");
        for seedling in low(world, at).0 {
            let (shape, scale) = (&seedling.prototype, seedling.linear.z_axis.z);
            all += 1;
            oaks += u32::from(shape.name().starts_with("english_oak"));
            assert_eq!(seedling.object, ObjectId::NONE);
            let local = seedling.position_m.truncate().as_dvec2();
            let height_m = ground.height_m(at.origin_m(CHUNK_M) + local);
            assert!((f64::from(seedling.position_m.z) - height_m).abs() < 1e-3);
            let top_m = scale * shape.bounds().max.z;
            assert!((0.05..0.3).contains(&top_m), "{} is {top_m}", shape.name());
            for card in shape.cards() {
                let semantic = assets.library.materials.get(card.material).semantic;
                assert_eq!(semantic, Semantic::Seedling);
                let lowest = card.corners().map(|c| c.z).into_iter().fold(1.0, f32::min);
                assert!(scale * lowest >= 0.04, "{}", shape.name());
            }
        }
    }
    let share = f64::from(oaks) / f64::from(all);
    println!("{all} seedlings, {share:.2} of them oaks");
    assert!(
        all > 1000 && (share - 0.65).abs() < 0.05,
        "{share} of {all}"
    );
}

#[test]
#[ignore = "a minute: .ci/full runs it"]
fn other_plants_do_not_move_for_them_and_their_cards_are_few() {
    let at = ChunkCoord::new(0, 0);
    let with = low(&World::without_cameras("medium", &[FEW]), at);
    let without = World::without_cameras("medium", &[FEW, "placement.regeneration.seedlings=0"]);
    let library = without.runner(2).get(without.forest.library, ());
    let library = library.expect("a library");
    let mut materials = library.materials.materials().iter();
    assert!(materials.all(|m| m.semantic != Semantic::Seedling));
    let without = low(&without, at);
    assert!(without.0.is_empty() && !with.0.is_empty());
    let text = |i: &Instance| {
        let place = (i.position_m, i.linear, i.variation, i.object);
        format!("{} {place:?}", i.prototype.name())
    };
    let texts = |plants: &[Instance]| plants.iter().map(text).collect::<Vec<_>>();
    assert!(texts(&with.1) == texts(&without.1));
    let cards =
        |plants: &[Instance]| -> usize { plants.iter().map(|i| i.prototype.cards().len()).sum() };
    let (new, old) = (cards(&with.0), cards(&with.1));
    println!(
        "medium: {} seedlings of {new} cards among {} plants of {old} cards",
        with.0.len(),
        with.1.len()
    );
    assert!(new < old / 30, "{new} cards, {old} without them");
}
