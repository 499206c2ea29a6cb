//! What grows and lies under the trees: its cover by layer, the volume of what lies, and how far
//! one sees stems. Each leaves its range when its cause is broken.

use nemoral_realism::ranges::{self, leaves};
use nemoral_realism::{LayerCover, StemVisibility, Survey, law_per_m};
use nemoral_tests::World;

/// The robot crosses the square that is surveyed.
const SETTINGS: [&str; 8] = [
    "robot.wander.amplitude_m=0",
    "robot.spacing_m=20",
    "frames=2",
    "chunks.visible_radius_m=65",
    "chunks.undergrowth_radius_m=60",
    "assets.individuals=2",
    "terrain.cell_m=1",
    "trails.enabled=false",
];

/// Side of the square, chunks.
const SIDE: i32 = 6;
const FRAMES: [u64; 2] = [0, 1];

struct Floor {
    cover: [f64; 5],
    /// How fast sight falls off, over the law of stems at random.
    sight: f64,
    /// How far it is from an exponential curve.
    off_the_curve: f64,
    deadwood_m3_ha: f64,
}

fn floor(preset: &str, settings: &[&str]) -> Floor {
    let world = World::without_cameras(preset, &[&SETTINGS, settings].concat());
    let runner = world.runner(2);
    let assets = runner.get(world.forest.assets, ()).expect("assets");
    let survey = Survey::of(&world, &runner, &assets, SIDE);
    let visibility = StemVisibility::of(&world, &runner, &assets, &survey.trees, &FRAMES);
    let law = law_per_m(&survey.trees, survey.square.1 * survey.square.1);
    Floor {
        cover: LayerCover::of(&world, &runner, &assets, &FRAMES).shares(),
        sight: visibility.falls_off_per_m() / law,
        off_the_curve: visibility.off_the_curve(),
        deadwood_m3_ha: survey.deadwood_m3_ha,
    }
}

#[test]
#[ignore = "a minute: .ci/full runs it"]
fn a_floor_that_is_swept_or_overgrown_is_noticed() {
    let preset = "oak-mixed";
    let sound = floor(preset, &[]);
    let swept = floor(
        preset,
        &[
            "undergrowth.cover=0",
            "undergrowth.sward.cover=0",
            "undergrowth.thickets.bramble=0",
            "undergrowth.thickets.bracken=0",
            "placement.shrubs=0",
            "placement.regeneration.seedlings=0",
            "deadwood.volume_m3_ha=1",
        ],
    );
    let overgrown = floor(
        preset,
        &[
            "undergrowth.thickets.bramble=1",
            "undergrowth.thickets.bracken=1",
            // Dry ground does not bear them otherwise.
            "undergrowth.ground.wetness=0",
            "undergrowth.ground.heat_load=0",
            "undergrowth.ground.soil=0",
            "deadwood.volume_m3_ha=20",
        ],
    );
    let of = |i: usize| {
        let range = ranges::layer_cover(preset)[i].expect("oaks have them");
        let broken = [
            ("nothing grows", swept.cover[i]),
            ("thickets everywhere", overgrown.cover[i]),
        ];
        (range, sound.cover[i], broken)
    };
    let (range, herbs, broken) = of(1);
    leaves("herbs", range, herbs, &broken[..1]);
    let (range, middle, broken) = of(3);
    leaves("0.5 to 1.5 m", range, middle, &broken);
    let asked = nemoral_tests::config(preset, &[]).deadwood.volume_m3_ha;
    let broken = [
        ("none lies", swept.deadwood_m3_ha / asked),
        ("too much lies", overgrown.deadwood_m3_ha / asked),
    ];
    let found = sound.deadwood_m3_ha / asked;
    let range = ranges::deadwood(asked).expect("enough is asked for");
    leaves("deadwood over what was asked for", range, found, &broken);
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_hall_that_is_overgrown_is_noticed() {
    let range = ranges::sight("beech");
    let hall = floor("beech", &[]);
    let thickets = [
        "undergrowth.thickets.bramble=1",
        "undergrowth.thickets.bracken=1",
    ];
    let overgrown = floor("beech", &thickets).sight;
    leaves("sight", range, hall.sight, &[("thickets", overgrown)]);
    assert!(hall.off_the_curve <= ranges::OFF_THE_CURVE.1);
}
