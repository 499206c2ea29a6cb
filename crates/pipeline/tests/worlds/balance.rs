//! Frames that are chosen for what they show: each by itself, as any run makes it, and for what was
//! asked.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::AtomicBool;

use nemoral_dataset::{Dataset, Manifest, MergeParams, OpenMode, merge, stats};
use nemoral_pipeline::config::{Config, ConfigLayers, Sequences};
use nemoral_pipeline::plan::Runner;
use nemoral_pipeline::world::trajectory::Surroundings;
use nemoral_pipeline::{
    Backend, ForestPlan, FrameSelection, GenerateParams, Recorder, SequenceFrames, generate,
};
use nemoral_realism::{grown, store};
use nemoral_scene::Semantic;
use nemoral_scene::glam::DVec3;

use crate::common::Notes;

/// A small forest with rocks here and there and without logs.
const SMALL: [&str; 17] = [
    "frames=10",
    "placement.trees=30",
    "placement.rocks_min=3",
    "placement.rocks_max=6",
    "trails.grass_max=4",
    "undergrowth.cover=0.1",
    "chunks.visible_radius_m=40",
    "chunks.undergrowth_radius_m=10",
    "camera.width_px=64",
    "camera.height_px=36",
    "camera.edge_samples=1",
    "lidar.pulses=400",
    "robot.spacing_m=9",
    "robot.wander={}",
    "balance.candidates=8",
    "balance.pilot=128",
    "balance.targets.rocks=0.06",
];

fn layers(more: &[&str]) -> ConfigLayers {
    ConfigLayers {
        preset: Some("demo".to_owned()),
        file: None,
        settings: SMALL.iter().chain(more).map(|s| (*s).to_owned()).collect(),
    }
}

fn load(more: &[&str]) -> Config {
    layers(more).load().unwrap_or_else(|e| panic!("{e}"))
}

fn make(out: &Path, config: &Config, shard: Option<(u64, u64)>, mode: OpenMode) -> Vec<String> {
    let all = SequenceFrames::new(FrameSelection::first(config.frames), 1);
    let params = GenerateParams {
        sequences: Sequences::of(config).expect("valid"),
        frames: shard.map_or(all.clone(), |(i, n)| all.shard(i, n)),
        out: out.to_owned(),
        mode,
        is_shard: shard.is_some(),
        threads: 2,
        backend: Backend::Cpu,
        cache: grown(),
    };
    let notes = Notes::default();
    generate(&params, &notes, &AtomicBool::new(false)).unwrap_or_else(|e| panic!("{e}"));
    notes.0.into_inner().expect("no panic")
}

/// All ten frames in one run.
static WHOLE: LazyLock<(tempfile::TempDir, Vec<String>)> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a folder");
    let notes = make(
        &folder.path().join("out"),
        &load(&[]),
        None,
        OpenMode::Fresh,
    );
    (folder, notes)
});

fn whole() -> PathBuf {
    WHOLE.0.path().join("out")
}

fn manifest(out: &Path) -> Manifest {
    Dataset::open(out).expect("a data set").manifest().clone()
}

fn files(folder: &Path, root: &Path, found: &mut BTreeMap<PathBuf, Vec<u8>>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files(&path, root, found);
        } else {
            let name = path.strip_prefix(root).expect("below").to_owned();
            found.insert(name, fs::read(&path).expect("a file"));
        }
    }
}

#[track_caller]
fn assert_same_files(a: &Path, b: &Path) {
    let (mut of_a, mut of_b) = (BTreeMap::new(), BTreeMap::new());
    files(a, a, &mut of_a);
    files(b, b, &mut of_b);
    assert_eq!(
        of_a.keys().collect::<Vec<_>>(),
        of_b.keys().collect::<Vec<_>>()
    );
    for (name, bytes) in of_a {
        assert!(bytes == of_b[&name], "{} differs", name.display());
    }
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_frame_alone_is_that_of_a_whole_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("seven");
    let config = load(&[]);
    let params = GenerateParams {
        sequences: Sequences::of(&config).expect("valid"),
        frames: SequenceFrames::new(std::iter::once(7..8).collect(), 1),
        out: out.clone(),
        mode: OpenMode::Fresh,
        is_shard: false,
        threads: 1,
        backend: Backend::Cpu,
        cache: grown(),
    };
    generate(&params, &Notes::default(), &AtomicBool::new(false)).expect("made");
    let (mut alone, mut all) = (BTreeMap::new(), BTreeMap::new());
    files(&out.join("sequences"), &out, &mut alone);
    files(&whole().join("sequences"), &whole(), &mut all);
    let of_seven = |name: &&PathBuf| name.to_string_lossy().contains("000007");
    assert_eq!(alone.keys().filter(of_seven).count(), 8);
    for name in alone.keys().filter(of_seven) {
        assert!(alone[name] == all[name], "{} differs", name.display());
    }
    // The record of the frame, and the poses of all frames.
    let [seven, ten] = [manifest(&out), manifest(&whole())];
    assert_eq!(seven.frames[0], ten.frames[7]);
    assert_eq!(seven.tracks[0].balance, ten.tracks[0].balance);
    let poses = Path::new("sequences/00/poses.txt");
    assert_eq!(alone[poses], all[poses]);
}

#[test]
fn shards_are_merged_to_the_bytes_of_one_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = load(&[]);
    let parts: Vec<PathBuf> = (0..3)
        .map(|i| {
            let out = folder.path().join(format!("part{i}"));
            make(&out, &config, Some((i, 3)), OpenMode::Fresh);
            out
        })
        .collect();
    let parts: Vec<&Path> = parts.iter().map(PathBuf::as_path).collect();
    let merged = folder.path().join("merged");
    merge(&parts, &merged, MergeParams::default()).expect("merged");
    assert_same_files(&merged, &whole());
    // A run that continues after a part ends with the same bytes.
    let resumed = folder.path().join("part1");
    make(&resumed, &config, None, OpenMode::Resume);
    assert_same_files(&resumed, &whole());
}

#[test]
fn frames_in_memory_are_those_on_disk() {
    let sequence = layers(&[]).sequences().expect("valid").get(0).expect("one");
    let recorder = Recorder::new(sequence, Backend::Cpu, grown(), 1).expect("a recorder");
    let dataset = Dataset::open(&whole()).expect("a data set");
    for frame in [7, 2] {
        let recorded = recorder.frame(frame).expect("a frame");
        let stored = dataset.read_frame(frame as usize).expect("a frame");
        assert!(recorded.images[0].rgb.pixels() == stored.cameras[0].rgb.pixels());
        let record = &dataset.manifest().frames[frame as usize];
        let pose = recorded.pose.world_from_body().to_rows();
        assert_eq!(pose, record.world_from_body);
    }
}

#[test]
fn what_was_asked_for_is_shown_more_often() {
    let made = manifest(&whole());
    let balance = made.tracks[0].balance.as_ref().expect("balance");
    assert_eq!((balance.candidates, balance.cap), (8, 4.0));
    assert!((100..=128).contains(&balance.pilot_poses));
    let [rocks] = &balance.targets[..] else {
        panic!("{balance:?}")
    };
    assert_eq!((rocks.name.as_str(), rocks.goal), ("rocks", 0.06));
    assert!(rocks.before > 0.002 && rocks.before < 0.03, "{rocks:?}");
    assert!(rocks.expected > 2.0 * rocks.before, "{rocks:?}");
    let stats = stats(&whole()).expect("statistics");
    let [shown] = &stats.balance[..] else {
        panic!("{stats}")
    };
    assert_eq!(shown.name, "rocks");
    assert!((shown.before - rocks.before).abs() < 1e-12, "{shown:?}");
    assert!(shown.after > 2.0 * shown.before, "{shown:?}");
    let table = stats.to_string();
    assert!(
        table.contains("balance") && table.contains("rocks"),
        "{table}"
    );
    // The pixels of the pictures say it too: rocks of all distances are class 7.
    let pixels = stats
        .classes
        .iter()
        .find(|c| c.name == "Rocks")
        .expect("a class")
        .pixels;
    let share = pixels as f64 / stats.pixels() as f64;
    assert!(share > 2.0 * rocks.before, "{share} {rocks:?}");
}

/// The renderer, which knows nothing of the choice, sees the shares by which frames were chosen.
#[test]
fn pictures_show_the_shares_of_their_choice() {
    let config = load(&[
        "balance.targets.trunks=0.1",
        "balance.targets.near_obstacles=0.05",
    ]);
    let forest = ForestPlan::new(&config).expect("a plan");
    let store = store();
    let runner = Runner::new(forest.plan(), &store, 2);
    let choice = forest.balance_choice.expect("balance is on");
    let lens = config.camera.intrinsics().expect("a lens");
    let body_from_camera = config.camera.body_from_camera();
    let solid = [
        Semantic::Stem,
        Semantic::Limb,
        Semantic::RootFlare,
        Semantic::Stump,
        Semantic::Snag,
        Semantic::Rock,
        Semantic::Stone,
    ];
    for frame in 0..4 {
        let chosen = runner.get(choice, frame).expect("a choice");
        let images = runner.get(forest.images, frame).expect("pictures");
        let truth = &images[0].truth;
        // near_obstacles, rocks, trunks: in order of names.
        let mut counts = [0_u32; 3];
        for (i, semantic) in truth.semantic.pixels().iter().enumerate() {
            let (column, row) = (i % 64, i / 64);
            let direction = lens.direction(nemoral_scene::glam::DVec2::new(
                column as f64 + 0.5,
                row as f64 + 0.5,
            ));
            let depth_m = f64::from(truth.depth_m.pixels()[i]);
            let range_m = depth_m / direction.z;
            let at_m = body_from_camera.transform_point(direction * range_m);
            let near = range_m <= 3.0 && (0.1..=1.5).contains(&at_m.z);
            counts[0] += u32::from(near && solid.contains(semantic));
            counts[1] += u32::from(matches!(semantic, Semantic::Rock | Semantic::Stone));
            counts[2] += u32::from(matches!(
                semantic,
                Semantic::Stem
                    | Semantic::Limb
                    | Semantic::RootFlare
                    | Semantic::Stump
                    | Semantic::Snag
                    | Semantic::StemGrowth
            ));
        }
        for (t, count) in counts.into_iter().enumerate() {
            let share = f64::from(count) / (64.0 * 36.0);
            // Two grids of some 2,000 points over one picture differ by their spacing.
            let differ = (share - chosen.shares[t]).abs();
            assert!(
                differ < 0.012 + 0.1 * share,
                "frame {frame}, target {t}: {share} of pixels, {} of rays",
                chosen.shares[t]
            );
        }
    }
}

/// Litter in relief counts where it is asked for, and is chosen for as anything else.
#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn litter_is_chosen_for() {
    let config = load(&[
        "litter.cover=1",
        "litter.wood=4",
        "assets.individuals=1",
        "balance.targets.rocks=0",
        "balance.targets.fallen_twig=0.012",
    ]);
    let forest = ForestPlan::new(&config).expect("a plan");
    let store = store();
    let runner = Runner::new(forest.plan(), &store, 2);
    let pilot = forest.balance_pilot.expect("balance is on");
    let pilot = runner.get(pilot, ()).expect("a pilot");
    let twigs = &pilot.targets[0];
    assert!(twigs.before > 0.0005, "{twigs:?}");
    assert!(twigs.expected > 1.3 * twigs.before, "{twigs:?}");
    let choice = forest.balance_choice.expect("balance is on");
    let (mut of_rays, mut of_pixels) = (0.0, 0.0);
    for frame in 0..10 {
        of_rays += runner.get(choice, frame).expect("a choice").shares[0] / 10.0;
        let images = runner.get(forest.images, frame).expect("pictures");
        let pixels = images[0].truth.semantic.pixels();
        let twigs = pixels.iter().filter(|s| **s == Semantic::FallenTwig);
        of_pixels += twigs.count() as f64 / pixels.len() as f64 / 10.0;
    }
    println!(
        "twigs: {:.2} % before, {:.2} % expected, {:.2} % of rays, {:.2} % of pixels",
        100.0 * twigs.before,
        100.0 * twigs.expected,
        100.0 * of_rays,
        100.0 * of_pixels
    );
    // The renderer sees what the rays saw, but for pixels between the rays.
    let differ = (of_rays - of_pixels).abs();
    assert!(differ < 0.2 * of_rays + 0.001, "{of_rays} {of_pixels}");
    assert!(of_pixels > 1.2 * twigs.before, "{of_pixels} {twigs:?}");
    // What does not count litter does not look for it.
    let key = |settings: &[&str]| {
        let forest = ForestPlan::new(&load(settings)).expect("a plan");
        let choice = forest.balance_choice.expect("balance is on");
        forest.plan().key(choice, 3)
    };
    let radius = "chunks.litter_radius_m=5";
    let with = ["litter.cover=1", "balance.targets.rocks=0"];
    for (target, is_looked_for) in [("logs", false), ("stump", false), ("fallen_twig", true)] {
        let target = format!("balance.targets.{target}=0.1");
        let [near, far] = [
            key(&[with[0], with[1], &target, radius]),
            key(&[with[0], with[1], &target]),
        ];
        assert_eq!(near != far, is_looked_for, "{target}");
    }
}

#[test]
fn chosen_places_are_near_the_path_clear_and_on_the_ground() {
    let config = load(&["balance.reach_m=6", "balance.turn_deg=40"]);
    let forest = ForestPlan::new(&config).expect("a plan");
    let store = store();
    let runner = Runner::new(forest.plan(), &store, 2);
    let trajectory = runner.get(forest.trajectory, ()).expect("a path");
    let sequence = Sequences::of(&config).expect("valid").get(0).expect("one");
    let recorder = Recorder::new(sequence, Backend::Cpu, grown(), 1).expect("a recorder");
    let choice = forest.balance_choice.expect("balance is on");
    let mut numbers = Vec::new();
    for frame in 0..10 {
        let chosen = runner.get(choice, frame).expect("a choice");
        let pose = runner.get(forest.pose, frame).expect("a pose");
        assert_eq!(pose.world_from_body(), chosen.world_from_body);
        let surroundings = Surroundings {
            ground: runner.demand(forest.ground),
            objects: runner.demand(forest.objects),
        };
        let on_path = trajectory.pose(frame, 0.0, surroundings).expect("a pose");
        let place_m = chosen.world_from_body.translation_m;
        let away_m = (place_m - on_path.translation_m).truncate().length();
        assert!(away_m <= 6.0 + 1e-9, "{away_m}");
        let ahead = |pose: &nemoral_scene::RigidTransform| {
            pose.transform_vector(DVec3::X).truncate().normalize()
        };
        let turned = ahead(&chosen.world_from_body).dot(ahead(&on_path));
        assert!(turned >= 40_f64.to_radians().cos() - 0.02, "{turned}");
        let place = place_m.truncate();
        let stood = recorder
            .pose_on_ground(place, chosen.pose_2d.1)
            .expect("ground");
        assert!(stood.translation_m.distance(place_m) < 1e-9);
        let around = nemoral_scene::glam::DVec2::splat(1.0);
        for disk in recorder
            .obstacles(place - around, place + around)
            .expect("objects")
        {
            let free_m = disk.position_m.distance(place) - disk.radius_m;
            assert!(free_m >= config.robot.clearance_m - 1e-9, "{free_m}");
        }
        numbers.extend(chosen.candidate);
    }
    numbers.sort_unstable();
    numbers.dedup();
    assert!(numbers.len() >= 4, "{numbers:?}");
}

/// A frame's choice depends on its world, its number, and what is asked for.
#[test]
fn other_frames_do_not_count() {
    let key = |more: &[&str]| {
        let forest = ForestPlan::new(&load(more)).expect("a plan");
        forest.plan().key(forest.balance_choice.expect("on"), 7)
    };
    let first = key(&[]);
    for same in [
        "frames=1000",
        "sky.overcast=0.7",
        "camera.exposure_bias_ev=1",
        "camera.sky=true",
    ] {
        assert_eq!(key(&[same]), first, "{same}");
    }
    for other in [
        "seed=8",
        "balance.targets.rocks=0.05",
        "balance.pilot=256",
        "placement.trees=31",
        "camera.mount_z_m=0.6",
        "robot.spacing_m=8",
    ] {
        assert_ne!(key(&[other]), first, "{other}");
    }
    // Without targets there are no such nodes, and keys are what they would be without the table.
    let drive = load(&["balance.targets.rocks=0"]);
    let forest = ForestPlan::new(&drive).expect("a plan");
    assert!(forest.balance_choice.is_none() && forest.balance_pilot.is_none());
    let other = ForestPlan::new(&load(&["balance.targets.rocks=0", "balance.reach_m=3"]));
    let other = other.expect("a plan");
    assert_eq!(
        forest.plan().key(forest.scans, 1),
        other.plan().key(other.scans, 1)
    );
}

#[test]
fn what_is_out_of_reach_is_noted() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = load(&["frames=1", "balance.targets.logs=0.03"]);
    let notes = make(&folder.path().join("out"), &config, None, OpenMode::Fresh);
    let note = notes.iter().find(|n| n.starts_with("balance:"));
    let note = note.unwrap_or_else(|| panic!("{notes:?}"));
    assert!(note.contains("views shows logs"), "{note}");
    let card = fs::read_to_string(folder.path().join("out/README.md")).expect("a card");
    assert!(card.contains("more of them show logs, rocks"), "{card}");
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_robot_with_a_lidar_alone_looks_by_its_pulses() {
    let config = load(&["camera.enabled=false", "balance.targets.rocks=0.02"]);
    let forest = ForestPlan::new(&config).expect("a plan");
    let store = store();
    let runner = Runner::new(forest.plan(), &store, 2);
    let pilot = forest.balance_pilot.expect("balance is on");
    let pilot = runner.get(pilot, ()).expect("a pilot");
    let rocks = &pilot.targets[0];
    assert!(
        rocks.before > 0.0 && rocks.expected > rocks.before,
        "{pilot:?}"
    );
}

#[test]
fn impossible_balances_are_refused() {
    for (settings, expected) in [
        (
            &["balance.targets.roks=0.1"][..],
            "balance.targets.roks: there is no such thing, class of \"paper\" or semantic; did \
             you mean `rocks`? there are logs, near_obstacles, rocks, wrapped_trunks, ",
        ),
        (&["balance.targets.sky=0.1"], "there is no such thing"),
        (&["balance.targets.fuel=0.1"], "class of \"paper\""),
        (
            &["balance.targets.rocks=1.5"],
            "balance.targets.rocks = 1.5: must be a number from 0 to 1",
        ),
        (
            &["balance.targets.rocks=\"many\""],
            "balance.targets.rocks = \"many\": must be a number",
        ),
        (
            &["balance.candidates=1"],
            "must be a whole number from 2 to 64",
        ),
        (
            &["balance.reach=3"],
            "balance.reach: no such key; did you mean `reach_m`?",
        ),
        (
            &["robot.stations={}"],
            "[robot.stations] asks for stations in a grid: must be a path to choose beside",
        ),
        (
            &["camera.flow=true"],
            "camera.flow = true: must be false with [balance.targets]",
        ),
    ] {
        let error = layers(settings).load().expect_err("is refused").to_string();
        assert!(error.contains(expected), "{error}");
    }
    let mut many: Vec<String> = Semantic::ALL[1..18]
        .iter()
        .map(|s| format!("balance.targets.{}=0.01", s.name()))
        .collect();
    let refused = |more: &[String]| {
        let more: Vec<&str> = more.iter().map(String::as_str).collect();
        layers(&more).load().err().map(|e| e.to_string())
    };
    let error = refused(&many).expect("is refused");
    assert!(
        error.contains("balance.targets: 18 of them; must be at most 16"),
        "{error}"
    );
    many.truncate(15);
    assert_eq!(refused(&many), None);
    // Draws of a target are draws like others.
    let drawn = load(&["vary.\"balance.targets.logs\"=[0.01, 0.02]"]);
    assert!((0.01..=0.02).contains(&drawn.balance.targets["logs"]));
}
