//! Data sets of several sequences.

use std::path::Path;

use nemoral_dataset::{
    CloudParams, Dataset, DatasetHeader, Error, FileRecord, MergeParams, OpenMode, Split,
    WorldTables, Writer, check, cloud, input_path, merge, stats,
};
use nemoral_scene::Intrinsics;
use nemoral_scene::{Ontology, TreeRecord};

use crate::common::{objects, opened, see, sequence, small, track, tree, trees};

/// The numbers of the sequences; their folders have two digits or more.
const NUMBERS: [u32; 3] = [0, 7, 100];

/// Three sequences with cameras of different sizes, the last of another split.
fn three() -> DatasetHeader {
    let mut header = small();
    header.sequences = NUMBERS.map(sequence).into();
    for (spec, width) in header.sequences.iter_mut().zip([32, 48, 40]) {
        spec.cameras[0].intrinsics = Intrinsics::from_fov(width, 24, 1.3).expect("valid");
        spec.seed = 7 + u64::from(spec.number);
        spec.split = Some(Split::Train);
        spec.config.to_mut()["seed"] = spec.seed.into();
        spec.config_toml = format!("seed = {}\n", spec.seed);
    }
    header.sequences[2].split = Some(Split::Test);
    header
}

/// Writes a frame of a sequence, whose content is that of sequence 0 of the small world.
fn write_frame(writer: &Writer, spec: usize, frame: usize) {
    let mut alone = writer.header().clone();
    alone.sequences = vec![alone.sequences[spec].clone()];
    let seen = see(&alone, frame);
    let mut data = seen.data(&alone);
    data.sequence = alone.sequences[0].number;
    writer.write_frame(&data).expect("frame");
}

/// The trees of a sequence, of which no other one has any.
fn trees_of_world(number: u32) -> Vec<TreeRecord> {
    let mut trees = trees();
    for tree in &mut trees {
        tree.height_m += f64::from(number) / 256.0;
    }
    trees
}

fn write_sequence(writer: &Writer, number: u32) -> Result<(), Error> {
    write_world(writer, number, number)
}

/// Writes a sequence with the trees of the world of another one, or of its own.
fn write_world(writer: &Writer, number: u32, trees_of: u32) -> Result<(), Error> {
    let (trees, objects) = (trees_of_world(trees_of), objects());
    let world = WorldTables {
        trees: &trees,
        objects: &objects,
        deadwood: &[],
    };
    let mut track = track(3);
    track.sequence = number;
    writer.write_sequence(&track, &world)
}

/// Writes frames, given by the position of their sequence and their index, and ends.
fn write(out: &Path, header: &DatasetHeader, frames: &[(usize, usize)]) {
    let writer = Writer::create(out, OpenMode::Fresh, header.clone()).expect("create");
    for &(spec, frame) in frames {
        write_frame(&writer, spec, frame);
    }
    let mut numbers: Vec<u32> = (frames.iter())
        .map(|f| header.sequences[f.0].number)
        .collect();
    numbers.dedup();
    for number in numbers {
        write_sequence(&writer, number).expect("sequence");
    }
    writer.finish().expect("finish");
}

fn all() -> Vec<(usize, usize)> {
    (0..3).flat_map(|s| (0..3).map(move |f| (s, f))).collect()
}

#[test]
fn each_sequence_has_sensors_a_world_and_files_of_its_own() {
    let dir = tempfile::tempdir().expect("a folder");
    let header = three();
    write(dir.path(), &header, &all());
    let dataset = Dataset::open(dir.path()).expect("open");
    assert_eq!(dataset.manifest().header, opened(&header));
    let widths: Vec<usize> = (0..9)
        .map(|i| dataset.read_frame(i).expect("frame").cameras[0].rgb.width())
        .collect();
    assert_eq!(widths, [32, 32, 32, 48, 48, 48, 40, 40, 40]);
    for number in NUMBERS {
        assert_eq!(
            dataset.trees(number).expect("trees"),
            trees_of_world(number)
        );
        let folder = dir.path().join(format!("sequences/{number:02}"));
        let config = std::fs::read_to_string(folder.join("config.toml")).expect("config");
        assert_eq!(config, format!("seed = {}\n", 7 + number));
        assert_eq!(dataset.sequence_config(number).expect("config"), config);
        assert!(dir.path().join(format!("poses/{number:02}.txt")).exists());
    }
    let report = check(dir.path()).expect("check");
    assert!(report.problems.is_empty(), "{report}");
    assert_eq!(report.agreement.failures(), Vec::<String>::new());
    let stats = stats(dir.path()).expect("stats");
    assert_eq!((stats.sequences, stats.frames), (3, 9));
    assert_eq!(stats.trees, 3 * trees().len());
    let yaml = std::fs::read_to_string(dir.path().join("ontology.yaml")).expect("yaml");
    assert!(yaml.ends_with("train: [0, 7]\n  valid: []\n  test: [100]\n"));
    let card = std::fs::read_to_string(dir.path().join("README.md")).expect("card");
    assert!(card.contains("3 sequences, each of a world of its own (train: 00 07; test: 100)"));
}

#[test]
fn worlds_that_two_splits_have_are_found() {
    let problems_of = |change: &dyn Fn(&mut DatasetHeader), number: u32| {
        let dir = tempfile::tempdir().expect("a folder");
        let mut header = three();
        change(&mut header);
        let writer = Writer::create(dir.path(), OpenMode::Fresh, header).expect("create");
        for (spec, frame) in all() {
            write_frame(&writer, spec, frame);
        }
        for of in NUMBERS {
            // The last sequence may have the trees of another one.
            let trees_of = if of == NUMBERS[2] { number } else { of };
            write_world(&writer, of, trees_of).expect("sequence");
        }
        writer.finish().expect("finish");
        let problems = check(dir.path()).expect("check").problems;
        problems
            .into_iter()
            .map(|p| (p.path, p.message))
            .collect::<Vec<_>>()
    };
    assert_eq!(problems_of(&|_| {}, 100), []);
    // Sequences of one split may share plants, and a seed of 0 is none.
    let plants = |seeds: [u64; 3]| {
        move |header: &mut DatasetHeader| {
            for (spec, seed) in header.sequences.iter_mut().zip(seeds) {
                spec.config.to_mut()["assets"]["seed"] = seed.into();
            }
        }
    };
    assert_eq!(problems_of(&plants([5, 5, 6]), 100), []);
    assert_eq!(problems_of(&plants([0, 0, 0]), 100), []);
    let found = problems_of(&plants([4, 5, 5]), 100);
    let told = "assets.seed = 5 of sequence 100 (test) is that of sequence 7 (train), too: it must \
        differ between splits";
    assert_eq!(found, [("dataset.json".to_owned(), told.to_owned())]);
    let same = |header: &mut DatasetHeader| header.sequences[2].seed = header.sequences[0].seed;
    let found = problems_of(&same, 100);
    assert!(
        found[0].1.starts_with("seed = 7 of sequence 100 (test)"),
        "{found:?}"
    );
    // Another name of the same stem map.
    let of_site = |header: &mut DatasetHeader| {
        for (spec, name) in header.sequences.iter_mut().zip(["a.csv", "b.csv", "c.csv"]) {
            let map: &[u8] = if name == "b.csv" {
                b"x_m,y_m\n"
            } else {
                b"x_m,y_m\n1,2\n"
            };
            let path = input_path(name, map);
            spec.config.to_mut()["site"] =
                serde_json::json!({ "stems": { "path": path.as_str() } });
            spec.inputs = vec![FileRecord::of(path.clone(), map)];
            header.input_files.insert(path, map.into());
        }
    };
    let found = problems_of(&of_site, 100);
    let [(_, message)] = &found[..] else {
        panic!("{found:?}");
    };
    assert!(message.starts_with("site.stems.path = "), "{message}");
    let found = problems_of(&|_| {}, 7);
    let [(path, message)] = &found[..] else {
        panic!("{found:?}");
    };
    let count = trees().len();
    assert_eq!(path, "sequences/100/trees.csv");
    let start = format!("{count} of {count} trees are in other splits, too: tree ");
    assert!(
        message.starts_with(&start) && message.contains("sequence 7 (train)"),
        "{message}"
    );
}

#[test]
fn shards_merge_to_the_bytes_of_one_run_wherever_they_are_cut() {
    let dir = tempfile::tempdir().expect("a folder");
    let (header, frames) = (three(), all());
    write(&dir.path().join("whole"), &header, &frames);
    let mut config_of_parts = header.clone();
    for cut in [1, 3, 4, 8] {
        let parts = [
            dir.path().join(format!("a{cut}")),
            dir.path().join(format!("b{cut}")),
        ];
        write(&parts[0], &header, &frames[..cut]);
        write(&parts[1], &header, &frames[cut..]);
        let out = dir.path().join(format!("m{cut}"));
        let parts = [&*parts[1], &*parts[0]];
        merge(&parts, &out, MergeParams::default()).expect("merge");
        assert!(tree(&out) == tree(&dir.path().join("whole")), "{cut}");
    }
    // Whole sequences may be missing, too.
    let part = dir.path().join("a4");
    let none = merge(&[&part], &dir.path().join("none"), MergeParams::default());
    let none = none.expect_err("incomplete").to_string();
    assert!(
        none.contains("sequence 100: no part has any of its frames"),
        "{none}"
    );
    // Parts with other configs are of another data set.
    config_of_parts.sequences[1].config.to_mut()["seed"] = 1.into();
    let other = dir.path().join("other");
    write(&other, &config_of_parts, &frames[4..]);
    let differs = merge(
        &[&part, &other],
        &dir.path().join("none"),
        MergeParams::default(),
    );
    let differs = differs.expect_err("another config").to_string();
    assert!(differs.contains("sequences.1.config.seed"), "{differs}");
    assert!(!dir.path().join("none").exists());
}

#[test]
fn a_data_set_may_get_further_sequences_and_loses_none() {
    let dir = tempfile::tempdir().expect("a folder");
    let (header, frames) = (three(), all());
    write(&dir.path().join("whole"), &header, &frames);
    let mut fewer = header.clone();
    fewer.sequences.truncate(2);
    let out = dir.path().join("out");
    write(&out, &fewer, &frames[..6]);
    let writer = Writer::create(&out, OpenMode::Resume, header.clone()).expect("resume");
    assert_eq!(writer.frames().len(), 6);
    for frame in 0..3 {
        write_frame(&writer, 2, frame);
    }
    for number in NUMBERS {
        write_sequence(&writer, number).expect("sequence");
    }
    writer.finish().expect("finish");
    assert!(tree(&out) == tree(&dir.path().join("whole")));
    let lost = Writer::create(&out, OpenMode::Resume, fewer).expect_err("one fewer");
    assert!(lost.to_string().contains("sequences"), "{lost}");
    // An overwritten data set leaves nothing of the sequences that the new one lacks.
    let mut one = header;
    one.sequences.truncate(1);
    let writer = Writer::create(&out, OpenMode::Overwrite, one).expect("overwrite");
    write_frame(&writer, 0, 0);
    write_sequence(&writer, 0).expect("sequence");
    writer.finish().expect("finish");
    assert!(!out.join("sequences/07").exists() && !out.join("sequences/100").exists());
    assert!(!out.join("poses/07.txt").exists());
}

#[test]
fn what_sequences_lack_is_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    let writer = Writer::create(dir.path(), OpenMode::Fresh, three()).expect("create");
    write_frame(&writer, 1, 0);
    let unknown = write_sequence(&writer, 3).expect_err("there is no sequence 3");
    assert!(unknown.to_string().contains("sequence"), "{unknown}");
    write_sequence(&writer, 7).expect("sequence");
    let twice = write_sequence(&writer, 7).expect_err("twice");
    assert!(twice.to_string().contains("once"), "{twice}");
    write_frame(&writer, 0, 0);
    let without = writer.finish().expect_err("sequence 0 has no track");
    assert!(
        without.to_string().contains("sequence with a track"),
        "{without}"
    );
    let out = dir.path().join("set");
    let mut header = three();
    header.ontology = Ontology::paper();
    write(&out, &header, &[(0, 0), (1, 0)]);
    let one_of = |sequence| {
        let params = CloudParams {
            sequence,
            ..CloudParams::default()
        };
        cloud(&out, &dir.path().join("cloud.ply"), params)
    };
    for none in [None, Some(3), Some(100)] {
        let e = one_of(none).expect_err("which one?").to_string();
        assert!(e.contains("one of 0, 7"), "{e}");
    }
    assert!(one_of(Some(7)).expect("cloud") > 1000);
}
