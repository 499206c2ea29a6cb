//! Sabotage that `check` must find.

use std::fs;
use std::path::Path;

use nemoral_dataset::{
    Agreement, CheckReport, ClassAgreement, Dataset, DepthFormat, JudgedAgreement, check,
};
use nemoral_scene::glam::DVec3;

use crate::common::{header, reseal, small, write};

const TREES: &str = "sequences/00/trees.csv";
const LABELS: &str = "sequences/00/labels/000001.label";
const SEMANTIC: &str = "sequences/00/semantic/000001.png";
const INSTANCE: &str = "sequences/00/instance/000001.png";
const PLY: &str = "sequences/00/points/000001.ply";

fn sound() -> (tempfile::TempDir, Dataset) {
    let dir = tempfile::tempdir().expect("a folder");
    let dataset = write(dir.path(), &header(), &[0, 1, 2, 3]);
    (dir, dataset)
}

fn report(dir: &Path) -> CheckReport {
    check(dir).expect("a data set")
}

/// The problems that name a file.
fn about<'a>(report: &'a CheckReport, path: &str) -> Vec<&'a str> {
    let of = report.problems.iter().filter(|p| p.path == path);
    of.map(|p| &*p.message).collect()
}

#[test]
fn a_sound_data_set_passes() {
    let (dir, _) = sound();
    let report = report(dir.path());
    println!("{report}");
    assert!(report.passed(), "{report}");
    let agreement = &report.agreement;
    assert!(agreement.overall().expect("points") >= 0.97);
    assert!(agreement.comparable_share() > 0.8 && agreement.comparable() > 10_000);
    assert!(
        agreement
            .classes
            .iter()
            .filter(|c| c.comparable >= 1000)
            .count()
            >= 5
    );
    for residual in [&agreement.same_frame, &agreement.next_frame] {
        assert!(residual.points() > 1000 && residual.median_m().expect("points").abs() < 0.005);
    }
}

#[test]
fn a_writer_is_at_work_while_its_header_is_there() {
    let (dir, _) = sound();
    let state = dir.path().join(".nemoral");
    fs::create_dir(&state).expect("a folder");
    // What NFS leaves of a lock that was removed while it was open.
    fs::write(state.join(".nfs000000000001"), "").expect("written");
    let found = report(dir.path());
    assert!(found.passed(), "{found}");
    fs::write(state.join("header.json"), "{}").expect("written");
    let found = report(dir.path());
    assert_eq!(about(&found, ".nemoral").len(), 1, "{found}");
    assert!(!found.passed());
}

#[test]
fn of_few_points_chance_is_forgiven() {
    let failures = |comparable, same| {
        let class = ClassAgreement {
            id: 1,
            name: "Terrain".to_owned(),
            points: comparable,
            comparable,
            same_class: same,
            near_same_class: comparable,
            same_instance: same,
            judged: JudgedAgreement {
                same,
                near: comparable,
            },
        };
        let agreement = Agreement {
            classes: vec![class],
            judged: true,
            ..Agreement::default()
        };
        agreement.failures().len()
    };
    assert_eq!((failures(20, 18), failures(20, 17)), (0, 1));
    assert_eq!((failures(200, 187), failures(200, 186)), (0, 1));
    assert_eq!((failures(1000, 970), failures(1000, 969)), (0, 1));
}

#[test]
fn missing_truncated_and_flipped_files_are_found() {
    let (dir, _) = sound();
    let at = |name: &str| dir.path().join(name);
    fs::remove_file(at(LABELS)).expect("remove");
    let bytes = fs::read(at(PLY)).expect("read");
    fs::write(at(PLY), &bytes[..bytes.len() - 5]).expect("write");
    let mut bytes = fs::read(at(INSTANCE)).expect("read");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(at(INSTANCE), bytes).expect("write");
    fs::write(at(TREES), "").expect("write");
    fs::write(at("sequences/00/semantic/000009.png"), "").expect("write");
    let report = report(dir.path());
    assert!(!report.passed());
    let first = |path| {
        about(&report, path)
            .first()
            .copied()
            .unwrap_or_default()
            .to_owned()
    };
    assert!(first(LABELS).contains("No such file"), "{report}");
    assert!(first(PLY).contains("bytes"), "{report}");
    assert!(first(INSTANCE).contains("checksum"), "{report}");
    assert!(first(TREES).contains("bytes"), "{report}");
    assert!(
        first("sequences/00/semantic/000009.png").contains("belongs to no frame"),
        "{report}"
    );
}

#[test]
fn labels_one_pixel_off_at_least_double_the_disagreement() {
    let (dir, dataset) = sound();
    let before = report(dir.path());
    for k in 0..4 {
        let path = format!("sequences/00/semantic/{k:06}.png");
        let image = dataset.read_frame(k).expect("frame").cameras[0]
            .semantic
            .clone();
        let (w, h) = (image.width(), image.height());
        let shifted: Vec<u8> = (0..w * h)
            .map(|i| *image.at((i % w).saturating_sub(1), i / w))
            .collect();
        write_palette(&dir.path().join(&path), w, h, &shifted);
        reseal(dir.path(), &path);
    }
    let after = report(dir.path());
    for of in [Agreement::overall, Agreement::overall_near] {
        let wrong = |r: &CheckReport| 1.0 - of(&r.agreement).expect("points");
        println!("disagreement {:.4} -> {:.4}", wrong(&before), wrong(&after));
        assert!(wrong(&after) >= 2.0 * wrong(&before) && wrong(&after) > 0.002);
    }
    // The files themselves are valid, but pixels without depth have a class now.
    assert!(
        about(&after, SEMANTIC)
            .iter()
            .all(|m| m.contains("without depth")),
        "{after}"
    );
}

fn write_palette(path: &Path, width: usize, height: usize, ids: &[u8]) {
    let mut encoder = png::Encoder::new(
        fs::File::create(path).expect("create"),
        width as u32,
        height as u32,
    );
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_palette(vec![0; 24]);
    let mut writer = encoder.write_header().expect("header");
    writer.write_image_data(ids).expect("data");
}

/// Rewrites one line of a text file.
fn edit(dir: &Path, relative: &str, line: &str, change: impl Fn(&mut Vec<f64>)) {
    let path = dir.join(relative);
    let text = fs::read_to_string(&path).expect("read");
    let edit = |l: &str| {
        let mut values: Vec<f64> = l[line.len()..]
            .split_whitespace()
            .map(|w| w.parse().expect("a number"))
            .collect();
        change(&mut values);
        let words: Vec<String> = values.iter().map(f64::to_string).collect();
        format!("{line}{}", words.join(" "))
    };
    let lines: Vec<String> = text
        .lines()
        .map(|l| {
            if l.starts_with(line) {
                edit(l)
            } else {
                l.to_owned()
            }
        })
        .collect();
    fs::write(&path, lines.join("\n") + "\n").expect("write");
    reseal(dir, relative);
}

#[test]
fn a_mount_five_centimetres_off_moves_the_depth_residual() {
    let (dir, _) = sound();
    // The LiDAR is moved 5 cm forward, along the camera's axis.
    edit(dir.path(), "sequences/00/calib.txt", "Tr: ", |v| {
        v[11] += 0.05
    });
    let report = report(dir.path());
    let median = report.agreement.same_frame.median_m().expect("points");
    println!("median depth residual with Tr 5 cm off: {median:+.4} m\n{report}");
    assert!(median > 0.03 && !report.passed());
    assert!(
        about(&report, "sequences/00/calib.txt")[0].contains("0.05"),
        "{report}"
    );
    assert!(
        report
            .agreement
            .failures()
            .iter()
            .any(|f| f.contains("mounts"))
    );
}

#[test]
fn poses_five_centimetres_off_move_the_residual_to_the_next_frame() {
    let (dir, dataset) = sound();
    // A shift of every second pose by 5 cm would cancel out; a drift of 5 cm per frame does not.
    let poses = dataset.poses(0).expect("poses");
    let path = dir.path().join("sequences/00/poses.txt");
    let mut text = String::new();
    for (k, pose) in poses.iter().enumerate() {
        let mut pose = *pose;
        pose.translation_m += pose.rotation * DVec3::Z * 0.05 * k as f64;
        let rows = pose.to_rows();
        let words: Vec<String> = rows.as_flattened().iter().map(f64::to_string).collect();
        text += &(words.join(" ") + "\n");
    }
    fs::write(path, text).expect("write");
    reseal(dir.path(), "sequences/00/poses.txt");
    let report = report(dir.path());
    let copy = about(&report, "poses/00.txt");
    assert_eq!(copy, ["differs from sequences/00/poses.txt"]);
    let median = report.agreement.next_frame.median_m().expect("points");
    println!("median depth residual to the next frame with poses 5 cm off: {median:+.4} m");
    assert!(median.abs() > 0.03);
    assert!(
        report
            .agreement
            .same_frame
            .median_m()
            .expect("points")
            .abs()
            < 0.005
    );
    assert!(
        about(&report, "sequences/00/poses.txt")[0].contains("frame 1"),
        "{report}"
    );
    assert!(
        report
            .agreement
            .failures()
            .iter()
            .any(|f| f.contains("poses"))
    );
}

#[test]
fn wrong_ids_are_found() {
    let (dir, _) = sound();
    let at = |name: &str| dir.path().join(name);
    // An instance that is in no table.
    let mut ids = image::open(at(INSTANCE)).expect("image").into_rgb8();
    ids.put_pixel(160, 200, image::Rgb([9, 9, 9]));
    ids.save(at(INSTANCE)).expect("save");
    reseal(dir.path(), INSTANCE);
    // A label that differs from its point's class.
    let mut labels = fs::read(at(LABELS)).expect("read");
    labels[2] ^= 1;
    fs::write(at(LABELS), labels).expect("write");
    reseal(dir.path(), LABELS);
    // One table lacks a tree.
    let trees = fs::read_to_string(at(TREES)).expect("read");
    let fewer: Vec<&str> = trees.lines().take(2).collect();
    fs::write(at(TREES), fewer.join("\n") + "\n").expect("write");
    reseal(dir.path(), TREES);
    let report = report(dir.path());
    let expected = ["1 pixels have an id that instances.csv lacks (the first: 592137)"];
    assert_eq!(about(&report, INSTANCE), expected, "{report}");
    assert!(
        about(&report, LABELS)[0].contains("differs from"),
        "{report}"
    );
    assert!(
        about(&report, TREES)[0].contains("1 trees here, 2 in instances.csv"),
        "{report}"
    );
    assert_eq!(report.problems.len(), 3, "{report}");
}

#[test]
fn what_is_no_depth_is_found() {
    const DEPTH: &str = "sequences/00/depth/000001.npy";
    let dir = tempfile::tempdir().expect("a folder");
    let mut header = small();
    header.sequences[0].depth_format = DepthFormat::Npy;
    write(dir.path(), &header, &[0, 1]);
    let path = dir.path().join(DEPTH);
    let sound = fs::read(&path).expect("read");
    let with = |z: f32| {
        let mut bytes = sound.clone();
        // The second pixel of the last row.
        let at = bytes.len() - 4 * (header.sequences[0].cameras[0].intrinsics.width as usize - 1);
        bytes[at..at + 4].copy_from_slice(&z.to_le_bytes());
        fs::write(&path, bytes).expect("write");
        reseal(dir.path(), DEPTH);
        report(dir.path())
    };
    for z in [f32::NAN, -3.5] {
        let report = with(z);
        let row = header.sequences[0].cameras[0].intrinsics.height - 1;
        let told = format!("000001.npy: depth = {z} m in column 1, row {row}: must be 0 or more");
        let problems = about(&report, "sequences/00 frame 000001");
        let [problem] = &problems[..] else {
            panic!("{report}");
        };
        assert!(problem.ends_with(&told), "{problem}");
    }
    // What is farther than a format holds is infinitely far.
    let far = with(f32::INFINITY);
    assert!(about(&far, "sequences/00 frame 000001").is_empty(), "{far}");
}

#[test]
fn points_of_things_that_do_not_exist_are_found() {
    let (dir, _) = sound();
    let path = dir.path().join("sequences/00/instances.csv");
    let text = fs::read_to_string(&path).expect("read");
    let kept: Vec<&str> = text.lines().filter(|l| !l.contains("rock")).collect();
    fs::write(&path, kept.join("\n") + "\n").expect("write");
    reseal(dir.path(), "sequences/00/instances.csv");
    let report = report(dir.path());
    assert!(
        about(&report, PLY)[0].contains("true id that instances.csv lacks"),
        "{report}"
    );
    assert!(
        about(&report, INSTANCE)[0].contains("id that instances.csv lacks"),
        "{report}"
    );
}
