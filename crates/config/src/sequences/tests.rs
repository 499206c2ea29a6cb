use std::collections::BTreeSet;

use super::*;
use crate::ConfigLayers;

/// The sequences of a file.
fn of(text: &str) -> Result<Sequences, Error> {
    Sequences::new(None, vec![Source::parse("c.toml", false, text.to_owned())?])
}

fn all(text: &str) -> Vec<SequenceConfig> {
    let sequences = of(text).expect("fine");
    (0..sequences.len())
        .map(|k| sequences.get(k).expect("fine"))
        .collect()
}

fn refused(text: &str) -> String {
    of(text).expect_err(text).to_string()
}

const VARIED: &str = r#"
sequences = 32
seed = 5
placement.trees = 50

[splits]
train = 0.5
val = 0.25
test = 0.25
by = "preset"

[vary]
preset = { beech = 3, spruce = 1 }
"lidar.device" = ["mid70", "vlp16"]
weather.visibility_m = [300, 20000]
"output_of_nothing" = 3

[[vary.group.season]]
weight = 3
"floor_litter" = 1
"#;

/// The same without what is wrong in it.
fn varied() -> String {
    let sound = VARIED.replace("\"output_of_nothing\" = 3\n", "");
    let season = "[[vary.group.season]]\nweight = 3\n\"undergrowth.cover\" = 0.1\n\
        \"sky.overcast\" = [0.0, 0.5]\n\n[[vary.group.season]]\n\"undergrowth.cover\" = 0.7\n\
        \"lidar.spinning\" = {}\n";
    let from = sound.find("[[vary").expect("a group");
    sound[..from].to_owned() + season
}

#[test]
fn a_request_without_sequences_is_one_sequence_as_it_stands() {
    let sequences = of("seed = 11\nplacement.trees = 50").expect("fine");
    assert_eq!(sequences.len(), 1);
    let only = sequences.get(0).expect("fine");
    assert_eq!((only.config.seed, only.config.assets.seed), (11, 0));
    assert_eq!((only.split, only.drawn.len()), (None, 0));
    assert_eq!(sequences.to_toml().expect("fine"), only.config.to_toml());
    let none = sequences.get(1).expect_err("only one").to_string();
    assert!(none.contains("sequence 1: must be 0 to 0"), "{none}");
}

#[test]
fn worlds_differ_and_plants_are_shared_within_a_split_alone() {
    let text = "sequences = 40\nseed = 11\nsplits.train = 0.5\nsplits.test = 0.5";
    let sequences = all(text);
    let seeds: BTreeSet<u64> = sequences.iter().map(|s| s.config.seed).collect();
    assert_eq!(seeds.len(), 40);
    assert_eq!(sequences[0].config.seed, 11);
    let plants_of = |split| -> BTreeSet<u64> {
        let of_split = sequences.iter().filter(|s| s.split == Some(split));
        of_split.map(|s| s.config.assets.seed).collect()
    };
    let [train, val, test] = Split::ALL.map(plants_of);
    assert_eq!((train.len(), val.len(), test.len()), (1, 0, 1));
    assert!(train.is_disjoint(&test) && !train.contains(&0));
    // Plants of one's own choice.
    let own = all("sequences = 3\nassets.seed = 4");
    assert!(own.iter().all(|s| s.config.assets.seed == 4));
}

#[test]
fn what_different_splits_would_share_is_refused() {
    const HALVES: &str = "sequences = 8\nsplits.train = 0.5\nsplits.test = 0.5\n";
    let fails = |text: &str, parts: &[&str]| {
        let message = refused(&format!("{HALVES}{text}"));
        for part in parts {
            assert!(message.contains(part), "{text}: {message}");
        }
    };
    let of_seed = [
        "assets.seed = 4",
        "(train)",
        "(test)",
        "must be 0,",
        "c.toml:4",
    ];
    fails("assets.seed = 4", &of_seed);
    fails(
        "[vary]\nassets.seed = [4, 5]",
        &["assets.seed = ", "c.toml:5"],
    );
    let group = "[[vary.group.a]]\nassets.seed = 4\n[[vary.group.a]]\nplacement.trees = 90";
    fails(group, &["assets.seed = 4", "c.toml:4"]);
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name).display().to_string();
    let write = |name: &str, text: &str| {
        let path = file(name);
        nemoral_files::write(path.as_ref(), text.as_bytes()).expect("a writable folder");
        path
    };
    let map = "x_m,y_m\n0,0\n5,3\n";
    let stems = [("a.csv", map), ("b.csv", "x_m,y_m\n0,0\n5,4\n")];
    let stems = stems.map(|(name, map)| write(name, map));
    // A copy, and another path to the same file, are the same trees.
    let again = [write("copy.csv", map), file("./a.csv")];
    let of_stems = format!("site.stems.path = {:?}", stems[0]);
    let parts = [
        "site.stems.path = \"",
        "trees in common",
        "must be \"\"",
        "c.toml:4",
    ];
    fails(&of_stems, &parts);
    fails(
        &format!("[vary]\nsite.stems.path = {stems:?}"),
        &["site.stems.path", "c.toml:5"],
    );
    for path in again {
        let both = [&stems[0], &path];
        fails(
            &format!("[vary]\nsite.stems.path = {both:?}"),
            &["trees in common"],
        );
    }
    let trails = write("trails.csv", "trail,x_m,y_m\na,0,0\na,90,5\n");
    let of_trails = format!("site.trails.path = {trails:?}");
    fails(&of_trails, &["site.trails.path", "trails in common"]);
    // All of them at once.
    fails(
        &format!("assets.seed = 4\n{of_stems}"),
        &["assets.seed", "site.stems.path"],
    );

    // What has no seed or no file in common, and what no two splits have.
    let seeds_of =
        |text: &str| -> BTreeSet<u64> { all(text).iter().map(|s| s.config.assets.seed).collect() };
    assert_eq!(seeds_of(&format!("{HALVES}assets.seed = 0")).len(), 2);
    let wide = format!("{HALVES}[vary]\nassets.seed = [1, 1000000000]");
    assert_eq!(seeds_of(&wide).len(), 8);
    // A seed in some worlds alone leaves the others that of their split.
    let all_train = format!("sequences = 8\nsplits.train = 1\n{group}");
    assert_eq!(seeds_of(&all_train).len(), 2);
    assert_eq!(all(&format!("sequences = 3\n{of_stems}")).len(), 3);
    let one_each = HALVES.replace("= 8", "= 2");
    let split = all(&one_each);
    assert_ne!(split[0].split, split[1].split);
    assert_eq!(
        all(&format!("{one_each}[vary]\nsite.stems.path = {stems:?}")).len(),
        2
    );
    let layers = ConfigLayers {
        preset: None,
        file: None,
        settings: [
            "sequences=8",
            "splits.train=0.5",
            "splits.test=0.5",
            "assets.seed=4",
        ]
        .map(str::to_owned)
        .into(),
    };
    let refused = layers.sequences().expect_err("a fixed seed").to_string();
    assert!(refused.contains("--set assets.seed=4"), "{refused}");
    let over = [layers.settings.clone(), vec!["assets.seed=0".to_owned()]].concat();
    let over = ConfigLayers {
        settings: over,
        ..layers
    };
    assert!(over.sequences().is_ok());
}

#[test]
fn words_are_drawn_by_weight_and_groups_together() {
    let sequences = all(&varied());
    let beech = sequences
        .iter()
        .filter(|s| s.drawn["preset"].as_str() == Some("beech"));
    assert_eq!(beech.clone().count(), 24, "3 of 4");
    for s in beech {
        assert!(s.config.assets.beech > 0.0 && s.config.placement.trees == 50.0);
    }
    let with = |device: &str| {
        sequences
            .iter()
            .filter(|s| s.config.lidar.device == device)
            .count()
    };
    assert_eq!((with("mid70"), with("vlp16")), (16, 16));
    let (mut few, mut many) = (0, 0);
    for s in &sequences {
        let overcast = s.drawn.get("sky.overcast").and_then(Value::as_float);
        match s.config.undergrowth.cover {
            0.1 => {
                few += 1;
                assert!(overcast.is_some_and(|o| (0.0..=0.5).contains(&o)));
            }
            0.7 => {
                many += 1;
                assert_eq!(overcast, None, "the other alternative does not draw it");
            }
            other => panic!("{other}"),
        }
    }
    assert_eq!((few, many), (24, 8));
}

#[test]
fn splits_hold_in_each_stratum_and_stay_when_sequences_are_added() {
    let sequences = all(&varied());
    for preset in ["beech", "spruce"] {
        let of_preset = |split| {
            let is = |s: &&SequenceConfig| s.drawn["preset"].as_str() == Some(preset);
            sequences
                .iter()
                .filter(is)
                .filter(|s| s.split == Some(split))
                .count()
        };
        let [train, val, test] = Split::ALL.map(of_preset);
        let all = train + val + test;
        assert!(
            train.abs_diff(all / 2) <= 1 && val.abs_diff(all / 4) <= 1,
            "{train} {val} {test}"
        );
    }
    let more = all(&varied().replace("sequences = 32", "sequences = 50"));
    for (before, after) in sequences.iter().zip(&more) {
        assert_eq!((before.split, &before.config), (after.split, &after.config));
    }
}

#[test]
fn a_sequence_and_the_whole_request_can_be_made_again_from_their_toml() {
    let sequences = of(&varied()).expect("fine");
    let again = of(&sequences.to_toml().expect("fine")).expect("it is read back");
    for k in 0..sequences.len() {
        let (a, b) = (sequences.get(k).expect("fine"), again.get(k).expect("fine"));
        assert_eq!(
            (&a.config, a.split, &a.drawn),
            (&b.config, b.split, &b.drawn)
        );
        let alone = Config::from_toml(&a.config.to_toml()).expect("a config");
        assert_eq!(alone, a.config);
    }
    // An argument names the preset, and a setting overrides a draw.
    let layers = ConfigLayers {
        preset: Some("oak-mixed".to_owned()),
        file: None,
        settings: vec![
            "sequences=2".to_owned(),
            "vary.preset=[\"beech\", \"spruce\"]".to_owned(),
            "vary.placement.trees=[60, 140]".to_owned(),
            "placement.trees=33".to_owned(),
        ],
    };
    let sequences = layers.sequences().expect("fine");
    let again = of(&sequences.to_toml().expect("fine")).expect("it is read back");
    for k in 0..2 {
        let sequence = sequences.get(k).expect("fine");
        assert!(sequence.config.assets.english_oak > 0.0);
        assert_eq!(sequence.config.placement.trees, 33.0);
        assert_eq!(again.get(k).expect("fine").config, sequence.config);
    }
}

#[test]
#[expect(clippy::disallowed_methods, reason = "tests write files directly")]
fn a_file_is_read_once_for_all_sequences() {
    let folder = tempfile::tempdir().expect("a folder");
    let species = folder.path().join("own.toml");
    let text = nemoral_assets::Species::built_in_toml("beech").expect("there is a beech");
    std::fs::write(&species, text).expect("a writable folder");
    let sequences = of(&format!(
        "sequences = 2\n[assets]\nown_species = {species:?}\nown_share = 1"
    ));
    let sequences = sequences.expect("fine");
    std::fs::write(&species, "changed meanwhile").expect("a writable folder");
    for k in 0..2 {
        let SequenceConfig { config, inputs, .. } = sequences.get(k).expect("it is known");
        let file = inputs.get(&config.assets.own_species).expect("it is named");
        assert_eq!(file.text().expect("text"), text);
    }
}

#[test]
fn what_cannot_be_drawn_is_named() {
    let has = |text: &str, parts: &[&str]| {
        let message = refused(text);
        for part in parts {
            assert!(message.contains(part), "{text}: {message}");
        }
    };
    has(VARIED, &["output_of_nothing", "c.toml:16"]);
    has(
        "[vary]\npreset = [\"beach\"]",
        &["c.toml:2", "must be [a, b, …]", "\"beech\""],
    );
    has("[vary]\npreset = { beech = 0 }", &["weights above 0"]);
    has("[vary]\nseed = [1, 2]", &["drawn from it"]);
    has(
        "[vary]\noutput.ply = [true, false]",
        &["the same in all sequences"],
    );
    has("[vary]\nsequences = [1, 2]", &["the same in all sequences"]);
    has(
        "preset = \"beech\"\n[vary]\npreset = [\"spruce\"]",
        &["is set beside it"],
    );
    let twice = "[vary]\nplacement.trees = [1, 2]\n[[vary.group.a]]\nplacement.trees = 5";
    has(twice, &["too; keep one"]);
    has("[vary.group]\na = 3", &["must be a list of tables"]);
    has(
        "[[vary.group.a]]\nweight = -1",
        &["alternative 0: weight = -1"],
    );
    has(
        "[[vary.group.a]]\nplacement.trees = \"x\"",
        &["alternative 0: placement.trees", "[least"],
    );
    has(
        "[[vary.group.a]]\noutput.ply = true",
        &["the same in all sequences"],
    );
    has(
        "[[vary.group.a]]\nplacement.tree = 3",
        &["there is no key placement.tree"],
    );
    has(
        "splits.train = 0.5",
        &["train + val + test = 0.5: must be 1", "c.toml:1"],
    );
    let by = "splits.train = 1\nsplits.by = \"preset\"\n[vary]\nplacement.trees = [1, 2]";
    has(by, &["splits.by = \"preset\"", "there are: none"]);
    // What is impossible together is found in the sequence that it was drawn for.
    let some = "sequences = 8\n[vary]\nchunks.visible_radius_m = [100, 600]";
    // Of some seeds the first sequence is fine, and of all seeds one has too wide a view.
    let sequences = (0..20).find_map(|seed| of(&format!("seed = {seed}\n{some}")).ok());
    let sequences = sequences.expect("the first is fine");
    let found = (0..8)
        .find_map(|k| sequences.get(k).err())
        .expect("one has too wide a view");
    assert!(found.to_string().starts_with("sequence "), "{found}");
    assert!(found.to_string().contains("c.toml:4"), "{found}");
}

#[test]
fn what_sets_cameras_apart_is_drawn_and_inherited() {
    let worlds = all("sequences = 4\nseed = 3\n\
        [vary]\n\
        \"camera.white_balance.kelvin\" = [3000, 9000]\n\
        \"camera.metering\" = [\"centre\", \"sky\"]\n\
        \"camera.processing.jpeg_quality\" = [60, 95]\n\
        [camera.soiling]\nspecks = 20\n\
        [cameras.right]\nmount_y_m = -0.12\n\
        [cameras.clean.soiling]\nspecks = 0\n");
    let mut kelvins = BTreeSet::new();
    for world in &worlds {
        let (first, others) = (&world.config.camera, &world.config.cameras);
        for camera in others.values() {
            assert_eq!(camera.white_balance, first.white_balance);
            assert_eq!(camera.metering, first.metering);
            assert_eq!(camera.processing, first.processing);
        }
        assert_eq!(
            (first.soiling.specks, others["right"].soiling.specks),
            (20, 20)
        );
        assert_eq!(others["clean"].soiling.specks, 0);
        assert!((60..=95).contains(&first.processing.jpeg_quality));
        kelvins.insert(first.white_balance.kelvin.to_bits());
        // A sequence's config makes the same camera again.
        let again = Config::from_toml(&world.config.to_toml()).expect("a config");
        assert_eq!(again.camera, *first);
    }
    assert_eq!(kelvins.len(), 4);
    let bad = |text: &str| Config::from_toml(text).expect_err(text).to_string();
    let text = bad("[camera.vignetting]\nmodel = \"polynomial\"\na2 = -1.5\n");
    assert!(
        text.contains("camera.vignetting") && text.contains("from 0 to 2"),
        "{text}"
    );
    // Between 0.775 and 1 in pictures with the principal point in the middle.
    let polynomial = "model = \"polynomial\"\na2 = -0.9\na4 = 0.9\n";
    for (cx_px, is_sound) in [(640, true), (256, false)] {
        let text = format!(
            "[camera]\nwidth_px = 1280\nheight_px = 720\n[camera.calibration]\nfx_px = 700\n\
             cx_px = {cx_px}\n[camera.vignetting]\n{polynomial}"
        );
        assert_eq!(Config::from_toml(&text).is_ok(), is_sound, "{cx_px}");
    }
    let text = bad("[camera.white_balance]\nkelvin = 100\n");
    assert!(text.contains("from 2500 to 12000"), "{text}");
}
