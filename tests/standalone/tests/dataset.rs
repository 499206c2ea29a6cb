//! Use of `nemoral-dataset` alone: another simulator writes and reads a data set.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::error::Error;
use std::fs;
use std::path::Path;

use nemoral_dataset::{
    CameraData, CameraSpec, Dataset, DatasetHeader, FrameData, LidarData, LidarSpec, MergeParams,
    OpenMode, Track, WorldTables, Writer, check, merge, stats,
};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{
    AnnotationKinds, Annotations, ChunkCoord, Image, Intrinsics, LidarPoint, ObjectId, Ontology,
    PointFlags, RigidTransform, Semantic, Shutter, TruthImages, Twist,
};

/// A wall 8 m ahead, seen by a camera and by a LiDAR at the same place.
fn write(out: &Path, frames: std::ops::Range<u64>) -> Result<(), Box<dyn Error>> {
    let intrinsics = Intrinsics::from_fov(32, 24, 1.0)?;
    let mut header = DatasetHeader::new("somebody", "1.0", 7, Ontology::paper());
    header.sequences[0].cameras = vec![CameraSpec {
        name: "eye".into(),
        intrinsics,
        body_from_camera: RigidTransform::body_from_optical(),
        annotations: AnnotationKinds::default(),
        shutter: Shutter::INSTANT,
        noisy: false,
        processed: false,
    }];
    header.sequences[0].lidars = vec![LidarSpec {
        name: "top".into(),
        body_from_lidar: RigidTransform::IDENTITY,
        deskewed: true,
        pointing_errors: false,
        ply: true,
    }];
    let pose = |index: u64| RigidTransform::from_xyz_rpy(DVec3::X * index as f64, 0.0, 0.0, 0.0);
    let whole = |value: f32| Image::new(32, 24, vec![value; 32 * 24]);
    let truth = TruthImages {
        semantic: whole(0.0).map(|_| Semantic::Rock),
        object: whole(0.0).map(|_| ObjectId::NONE),
        depth_m: whole(8.0),
        normal: whole(0.0).map(|_| Vec3::NEG_Z),
    };
    let rgb = whole(0.0).map(|_| [90, 80, 70]);
    let points: Vec<LidarPoint> = (0..100_u16).map(point).collect();
    let writer = Writer::create(out, OpenMode::Fresh, header)?;
    let annotations = Annotations::default();
    for index in frames {
        writer.write_frame(&FrameData {
            sequence: 0,
            index,
            time_s: index as f64,
            world_from_body: pose(index),
            body_motion: Twist::STILL,
            balance: None,
            cameras: vec![CameraData {
                name: "eye",
                rgb: &rgb,
                radiance: None,
                truth: &truth,
                annotations: &annotations,
            }],
            lidars: vec![LidarData {
                name: "top",
                points: &points,
                sensor_chunk: ChunkCoord::new(0, 0),
            }],
            frame_key: [index as u8; 32],
        })?;
    }
    let poses = (0..4).map(|i| (i as f64, pose(i))).collect();
    let track = Track {
        sequence: 0,
        poses,
        balance: None,
        stands: false,
        estimated: Vec::new(),
        lines: vec![],
        imu: None,
    };
    writer.write_sequence(&track, &WorldTables::default())?;
    writer.finish()?;
    Ok(())
}

fn point(i: u16) -> LidarPoint {
    let position_m = Vec3::new(
        8.0,
        f32::from(i % 10) * 0.5 - 2.25,
        f32::from(i / 10) * 0.5 - 2.25,
    );
    let range_m = position_m.length();
    LidarPoint {
        position_m,
        true_range_m: range_m,
        range_m,
        intensity: 0.4,
        reflectivity: 60,
        semantic: Semantic::Rock,
        object: ObjectId::NONE,
        ring: 0,
        return_number: 1,
        returns: 1,
        time_ns: 1000 * i64::from(i),
        pulse: u32::from(i),
        incidence_cos: 8.0 / range_m,
        normal: Vec3::NEG_X,
        flags: PointFlags::default(),
    }
}

#[test]
fn what_is_written_is_read_checked_and_counted() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let out = folder.path().join("whole");
    write(&out, 0..4)?;
    let dataset = Dataset::open(&out)?;
    assert_eq!(dataset.frames().len(), 4);
    let frame = dataset.read_frame(3)?;
    assert_eq!(frame.lidars[0].points.len(), 100);
    assert_eq!(frame.lidars[0].points[0], [8.0, -2.25, -2.25, 0.4]);
    assert_eq!(*frame.cameras[0].depth_m.at(31, 23), 8.0);
    assert_eq!(*frame.cameras[0].rgb.at(0, 0), [90, 80, 70]);
    assert_eq!(dataset.poses(0)?.len(), 4);
    let report = check(&out)?;
    assert!(report.passed(), "{report}");
    assert!(stats(&out)?.to_string().contains("Rocks"));

    // A loader that knows nothing but KITTI reads the scan.
    let scan = fs::read(out.join("sequences/00/velodyne/000003.bin"))?;
    assert_eq!(scan.len(), 100 * 16);
    assert_eq!(scan[..4], 8.0_f32.to_le_bytes());
    Ok(())
}

#[test]
fn two_halves_make_the_whole() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let [whole, first, second, merged] =
        ["whole", "first", "second", "merged"].map(|name| folder.path().join(name));
    write(&whole, 0..4)?;
    write(&first, 0..2)?;
    write(&second, 2..4)?;
    merge(&[&second, &first], &merged, MergeParams::default())?;
    let manifest = |dataset: &Path| fs::read(dataset.join("dataset.json"));
    // The manifest has the checksums of all files.
    assert_eq!(manifest(&merged)?, manifest(&whole)?);
    assert!(check(&merged)?.passed());
    Ok(())
}

#[test]
fn a_folder_of_somebody_elses_is_left_alone() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let out = folder.path().join("thesis");
    fs::create_dir_all(&out)?;
    fs::write(out.join("thesis.tex"), "text")?;
    let error = write(&out, 0..1).expect_err("it is not empty");
    assert!(error.to_string().contains("thesis.tex"), "{error}");
    assert_eq!(fs::read_dir(&out)?.count(), 1);
    Ok(())
}
