//! What data sets keep of an inertial measurement unit: it comes back, is the same in all parts, is
//! checked against the poses, and is refused where the header does not have it.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use nemoral_dataset::{
    Dataset, DatasetHeader, Error, EurocFiles, ImuSpec, Manifest, MergeParams, OpenMode,
    WorldTables, Writer, check, merge,
};
use nemoral_scene::RigidTransform;
use nemoral_scene::glam::DVec3;

use crate::common::{START, objects, see, small, track, trees};

const RATE_HZ: f64 = 50.0;
const FRAMES: usize = 3;
const FILES: [&str; 3] = [
    "imu0/data.csv",
    "imu0/sensor.yaml",
    "state_groundtruth_estimate0/data.csv",
];

fn spec() -> ImuSpec {
    ImuSpec {
        body_from_imu: RigidTransform::from_xyz_rpy(DVec3::new(-0.1, 0.0, 0.4), 0.0, 0.0, 0.5),
        rate_hz: RATE_HZ,
        angular_rate_noise_rad_s: 0.001,
        specific_force_noise_m_s2: 0.02,
    }
}

fn header() -> DatasetHeader {
    let mut header = small();
    header.sequences[0].imu = Some(spec());
    header
}

/// The true pose at a time, as [`track`] has it at the frames.
fn pose(time_s: f64) -> RigidTransform {
    let k = time_s / 0.5;
    let at = START + DVec3::new(0.3 * k, 0.05 * k, 0.0);
    RigidTransform::from_xyz_rpy(at, 0.01 * k, 0.0, 0.02 * k) * spec().body_from_imu
}

/// The files of a unit whose truth is wrong by `off_m` upwards.
fn texts(off_m: f64) -> EurocFiles {
    let mut texts = EurocFiles {
        samples: "#timestamp [ns]\n".to_owned(),
        sensor: "rate_hz: 50.0\n".to_owned(),
        states: "#timestamp\n".to_owned(),
    };
    for i in 0..=50 {
        let (time_ns, time_s) = (20_000_000 * i, 0.02 * i as f64);
        let RigidTransform {
            rotation,
            translation_m,
        } = pose(time_s);
        let [x, y, z] = (translation_m + DVec3::Z * off_m).to_array();
        let q = rotation;
        let _ = writeln!(texts.samples, "{time_ns},0.01,0.02,{time_s},0,0,9.8");
        let _ = writeln!(
            texts.states,
            "{time_ns},{x},{y},{z},{},{},{},{},0.6,0.1,0,0,0,0,0,0,0.05",
            q.w, q.x, q.y, q.z
        );
    }
    texts
}

fn write(
    out: &Path,
    header: DatasetHeader,
    frames: &[usize],
    imu: Option<EurocFiles>,
) -> Result<Manifest, Error> {
    let writer = Writer::create(out, OpenMode::Overwrite, header.clone())?;
    for &frame in frames {
        writer.write_frame(&see(&header, frame).data(&header))?;
    }
    let mut track = track(FRAMES);
    track.imu = imu;
    let tables = WorldTables {
        trees: &trees(),
        objects: &objects(),
        ..WorldTables::default()
    };
    writer.write_sequence(&track, &tables)?;
    writer.finish()
}

fn place(out: &Path, file: &str) -> std::path::PathBuf {
    out.join("sequences/00").join(file)
}

#[test]
fn readings_come_back() -> Result<(), Error> {
    let dir = tempfile::tempdir().expect("a folder");
    write(dir.path(), header(), &[0, 2], Some(texts(0.0)))?;
    let dataset = Dataset::open(dir.path())?;
    assert_eq!(dataset.manifest().header.sequences[0].imu, Some(spec()));
    let readings = dataset.imu(0)?;
    assert_eq!(readings.len(), 51);
    let last = readings[50];
    assert_eq!(last.time_ns, 1_000_000_000);
    assert_eq!(last.angular_rate_rad_s, DVec3::new(0.01, 0.02, 1.0));
    assert_eq!(last.accelerometer_bias_m_s2, DVec3::Z * 0.05);
    let asked = pose(1.0);
    assert_eq!(last.world_from_imu.translation_m, asked.translation_m);
    assert!(last.world_from_imu.rotation.angle_between(asked.rotation) < 1e-7);
    assert_eq!(
        fs::read_to_string(place(dir.path(), FILES[0])).expect("text"),
        texts(0.0).samples
    );
    let report = check(dir.path())?;
    assert!(report.passed(), "{report}");

    // One without a unit has none of this, and what was there is cleared away with its folders.
    write(dir.path(), small(), &[0], None)?;
    assert!(Dataset::open(dir.path())?.imu(0)?.is_empty());
    assert!(!place(dir.path(), "imu0").exists());
    assert!(!place(dir.path(), "state_groundtruth_estimate0").exists());
    assert!(check(dir.path())?.passed());
    Ok(())
}

#[test]
fn parts_have_the_same_readings_and_so_has_the_whole() -> Result<(), Error> {
    let dir = tempfile::tempdir().expect("a folder");
    let [a, b, c, both] = ["a", "b", "c", "both"].map(|name| dir.path().join(name));
    write(&a, header(), &[0, 1], Some(texts(0.0)))?;
    write(&b, header(), &[2], Some(texts(0.0)))?;
    merge(&[&a, &b], &both, MergeParams::default())?;
    for file in FILES {
        let read = |out: &Path| fs::read(place(out, file)).expect("a file");
        assert_eq!(read(&both), read(&a), "{file}");
    }
    assert!(check(&both)?.passed());
    // Another drive is another data set.
    write(&c, header(), &[2], Some(texts(0.5)))?;
    let error = merge(&[&a, &c], &dir.path().join("never"), MergeParams::default());
    let error = error.expect_err("they differ").to_string();
    assert!(error.contains("inertial measurements"), "{error}");
    Ok(())
}

#[test]
fn a_unit_that_is_elsewhere_is_found() -> Result<(), Error> {
    let dir = tempfile::tempdir().expect("a folder");
    let told = |imu: EurocFiles| -> Result<String, Error> {
        write(dir.path(), header(), &[0, 1, 2], Some(imu))?;
        let report = check(dir.path())?;
        assert!(!report.passed());
        Ok(report.to_string())
    };
    let report = told(texts(0.03))?;
    assert!(report.contains("the unit is 0.030 m"), "{report}");
    let mut short = texts(0.0);
    for text in [&mut short.samples, &mut short.states] {
        let end = text.trim_end().rfind('\n').expect("lines") + 1;
        text.truncate(end);
    }
    let report = told(short)?;
    assert!(
        report.contains("has 50 samples from the first frame to the last: 51 are made"),
        "{report}"
    );
    let mut broken = texts(0.0);
    broken.samples.push_str("1020000000,0,0,0\n");
    let report = told(broken)?;
    assert!(report.contains("data.csv"), "{report}");
    Ok(())
}

#[test]
fn what_the_header_does_not_say_is_refused() {
    let dir = tempfile::tempdir().expect("a folder");
    for (header, imu) in [(small(), Some(texts(0.0))), (header(), None)] {
        let error = write(dir.path(), header, &[0], imu).expect_err("contradiction");
        assert!(error.to_string().contains("track.imu"), "{error}");
    }
    let mut wrong = header();
    wrong.sequences[0].lidars[0].name = "imu".to_owned();
    let error = write(dir.path(), wrong, &[0], Some(texts(0.0))).expect_err("two of one name");
    assert!(error.to_string().contains("not that of the imu"), "{error}");
    let mut wrong = header();
    wrong.sequences[0].imu = Some(ImuSpec {
        rate_hz: 0.0,
        ..spec()
    });
    let error = write(dir.path(), wrong, &[0], Some(texts(0.0))).expect_err("no rate");
    assert!(error.to_string().contains("imu.rate_hz"), "{error}");
}
