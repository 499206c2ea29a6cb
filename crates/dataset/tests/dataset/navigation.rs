//! What a navigation system estimates of poses: kept beside the truth, merged, checked, and what
//! registers clouds.

use std::fs;
use std::path::Path;

use nemoral_dataset::{
    CloudParams, CloudPoint, CloudPoses, Dataset, DatasetHeader, Error, Manifest, MergeParams,
    OpenMode, WorldTables, Writer, check, merge,
};
use nemoral_scene::RigidTransform;
use nemoral_scene::glam::DVec3;

use crate::common::{cloud_points, objects, reseal, see, small, track, trees};

const FILE: &str = "sequences/00/poses_estimated.txt";
const FRAMES: usize = 3;

fn header() -> DatasetHeader {
    let mut header = small();
    header.sequences[0].has_estimated_poses = true;
    header
}

/// A pose with errors that differ from frame to frame.
fn estimated(frame: usize, (_, pose): (f64, RigidTransform)) -> RigidTransform {
    let off_m = DVec3::new(0.1, -0.2, 0.3) * (frame + 1) as f64;
    let turned = RigidTransform::from_xyz_rpy(off_m, 0.0, 0.0, 0.01 * frame as f64);
    RigidTransform {
        rotation: turned.rotation * pose.rotation,
        translation_m: pose.translation_m + off_m,
    }
}

fn write(
    out: &Path,
    header: &DatasetHeader,
    frames: &[usize],
    estimated: &[RigidTransform],
) -> Result<Manifest, Error> {
    let writer = Writer::create(out, OpenMode::Overwrite, header.clone())?;
    for &frame in frames {
        writer.write_frame(&see(header, frame).data(header))?;
    }
    let mut track = track(FRAMES);
    track.estimated = estimated.to_vec();
    let tables = WorldTables {
        trees: &trees(),
        objects: &objects(),
        ..WorldTables::default()
    };
    writer.write_sequence(&track, &tables)?;
    writer.finish()
}

fn estimates() -> Vec<RigidTransform> {
    let poses = track(FRAMES).poses;
    (poses.into_iter().enumerate())
        .map(|(frame, pose)| estimated(frame, pose))
        .collect()
}

fn points(dir: &Path, poses: CloudPoses) -> Result<Vec<CloudPoint>, Error> {
    let params = CloudParams {
        poses,
        ..CloudParams::default()
    };
    cloud_points(dir, params)
}

#[test]
fn estimates_come_back_and_register_clouds() -> Result<(), Error> {
    let dir = tempfile::tempdir().expect("a folder");
    write(dir.path(), &header(), &[0, 2], &estimates())?;
    let report = check(dir.path())?;
    assert!(report.passed(), "{report}");
    let found = Dataset::open(dir.path())?.estimated_world_from_body(0)?;
    let found = found.expect("a system");
    assert_eq!(found.len(), FRAMES);
    for (found, asked) in found.iter().zip(estimates()) {
        assert!(found.translation_m.distance(asked.translation_m) < 1e-9);
        assert!(found.rotation.angle_between(asked.rotation) < 1e-7);
    }
    let truth = points(dir.path(), CloudPoses::True)?;
    let moved = points(dir.path(), CloudPoses::Estimated)?;
    // Poses of another program are in the same form, with fewer digits.
    let text = fs::read_to_string(dir.path().join(FILE)).expect("a file");
    let few = |number: &str| format!("{:.3}", number.parse::<f64>().expect("a number"));
    let few = |line: &str| line.split(' ').map(few).collect::<Vec<_>>().join(" ");
    let lines: Vec<String> = text.lines().map(few).collect();
    let other = tempfile::tempdir().expect("a folder");
    let own = other.path().join("slam.txt");
    let write_own = |text: &str| fs::write(&own, text).expect("a writable folder");
    write_own(&lines.join("\n"));
    let by_own = points(dir.path(), CloudPoses::File(own.clone()))?;
    assert_eq!(moved.len(), by_own.len());
    for (a, b) in moved.iter().zip(&by_own) {
        let far_m = a.from_scanner_m.length();
        assert!(a.world_m.distance(b.world_m) < 2e-3 * (1.0 + far_m));
    }
    for (wrong, message) in [
        (
            lines[1..].join("\n"),
            "must have one for each of the sequence's",
        ),
        (
            text.replacen("0", "7", 1),
            "line 1: must be a rotation and a place",
        ),
        ("no numbers\n".to_owned(), "line 1"),
    ] {
        write_own(&wrong);
        let error = points(dir.path(), CloudPoses::File(own.clone())).expect_err("wrong poses");
        assert!(matches!(error, Error::Invalid { .. }), "{error}");
        assert!(error.to_string().contains(message), "{error}");
    }
    assert_eq!(truth.len(), moved.len());
    let poses = track(FRAMES).poses;
    for (truth, moved) in truth.iter().zip(&moved) {
        assert_eq!(truth.recorded, moved.recorded);
        let frame = truth.frame as usize;
        let in_body = poses[frame].1.inverse().transform_point(truth.world_m);
        let asked = estimates()[frame].transform_point(in_body);
        assert!(moved.world_m.distance(asked) < 1e-9);
    }
    Ok(())
}

#[test]
fn a_data_set_without_estimates_says_so() -> Result<(), Error> {
    let dir = tempfile::tempdir().expect("a folder");
    write(dir.path(), &header(), &[0], &estimates())?;
    // What was there is cleared away.
    write(dir.path(), &small(), &[0], &[])?;
    assert!(!dir.path().join(FILE).exists());
    assert!(check(dir.path())?.passed());
    let dataset = Dataset::open(dir.path())?;
    assert!(dataset.estimated_poses(0)?.is_none());
    assert!(dataset.estimated_world_from_body(0)?.is_none());
    let error = points(dir.path(), CloudPoses::Estimated)
        .expect_err("there are none")
        .to_string();
    assert!(error.contains("navigation.enabled"), "{error}");
    Ok(())
}

#[test]
fn parts_have_the_same_estimates_and_so_has_the_whole() -> Result<(), Error> {
    let dir = tempfile::tempdir().expect("a folder");
    let [a, b, c, both] = ["a", "b", "c", "both"].map(|name| dir.path().join(name));
    write(&a, &header(), &[0, 1], &estimates())?;
    write(&b, &header(), &[2], &estimates())?;
    merge(&[&a, &b], &both, MergeParams::default())?;
    let read = |out: &Path| fs::read(out.join(FILE)).expect("a file");
    assert_eq!(read(&both), read(&a));
    assert!(check(&both)?.passed());
    // Other estimates are another data set.
    let truth: Vec<_> = track(FRAMES).poses.iter().map(|(_, pose)| *pose).collect();
    write(&c, &header(), &[2], &truth)?;
    let error = merge(&[&a, &c], &dir.path().join("never"), MergeParams::default());
    let error = error.expect_err("they differ").to_string();
    assert!(error.contains("track of sequence 0"), "{error}");
    Ok(())
}

#[test]
fn files_that_are_no_poses_of_the_frames_are_refused() -> Result<(), Error> {
    let dir = tempfile::tempdir().expect("a folder");
    write(dir.path(), &header(), &[0, 1, 2], &estimates())?;
    let path = dir.path().join(FILE);
    let text = fs::read_to_string(&path).expect("text");
    let end = text.trim_end().rfind('\n').expect("lines") + 1;
    let first = text.split(' ').next().expect("a number");
    let zeros = "0 0 0 0 0 0 0 0 0 0 0 0\n";
    for (hostile, told) in [
        (
            text[..end].to_owned(),
            "has 2 lines: must have one for each of the sequence's 3 frames",
        ),
        (text.replacen(first, "NaN", 1), "line 1: must be a rotation"),
        (
            format!("{}{zeros}", &text[..end]),
            "line 3: must be a rotation",
        ),
        (text.replacen(first, "-1", 1), "line 1: must be a rotation"),
    ] {
        fs::write(&path, hostile).expect("another file");
        reseal(dir.path(), FILE);
        let report = check(dir.path())?.to_string();
        assert!(report.contains(told), "{report}");
        let error = points(dir.path(), CloudPoses::Estimated)
            .expect_err("no poses")
            .to_string();
        assert!(
            error.contains("poses_estimated.txt") && error.contains(told),
            "{error}"
        );
    }
    Ok(())
}

#[test]
fn what_the_header_does_not_say_is_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    for (header, estimated) in [(small(), estimates()), (header(), vec![])] {
        let error = write(dir.path(), &header, &[0], &estimated).expect_err("contradiction");
        assert!(error.to_string().contains("track.estimated"), "{error}");
    }
}
