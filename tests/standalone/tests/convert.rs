//! Use of `nemoral-convert` alone: another simulator's data set becomes files for KITTI's loaders.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::error::Error;
use std::fs;
use std::path::Path;

use nemoral_convert::{ConvertParams, FormatName, convert};
use nemoral_dataset::{
    DatasetHeader, FrameData, LidarData, LidarSpec, OpenMode, Track, WorldTables, Writer,
};
use nemoral_scene::glam::DVec3;
use nemoral_scene::{ChunkCoord, Ontology, RigidTransform, Twist};

/// A LiDAR that drives 1 m a frame along x and measures nothing.
fn write(out: &Path) -> Result<(), Box<dyn Error>> {
    let mut header = DatasetHeader::new("somebody", "1.0", 7, Ontology::paper());
    header.sequences[0].lidars = vec![LidarSpec {
        name: "top".into(),
        body_from_lidar: RigidTransform::IDENTITY,
        deskewed: true,
        pointing_errors: false,
        ply: false,
    }];
    let pose = |index: u64| RigidTransform::from_xyz_rpy(DVec3::X * index as f64, 0.0, 0.0, 0.0);
    let writer = Writer::create(out, OpenMode::Fresh, header)?;
    for index in 0..3 {
        writer.write_frame(&FrameData {
            sequence: 0,
            index,
            time_s: index as f64,
            world_from_body: pose(index),
            body_motion: Twist::STILL,
            balance: None,
            cameras: vec![],
            lidars: vec![LidarData {
                name: "top",
                points: &[],
                sensor_chunk: ChunkCoord::new(0, 0),
            }],
            frame_key: [index as u8; 32],
        })?;
    }
    let (poses, lines) = ((0..3).map(|i| (i as f64, pose(i))).collect(), vec![]);
    let track = Track {
        sequence: 0,
        poses,
        balance: None,
        stands: false,
        estimated: Vec::new(),
        lines,
        imu: None,
    };
    writer.write_sequence(&track, &WorldTables::default())?;
    writer.finish()?;
    Ok(())
}

#[test]
fn poses_are_relative_to_the_first() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let (dataset, out) = (folder.path().join("drive"), folder.path().join("kitti"));
    write(&dataset)?;
    let done = convert(&dataset, &out, &ConvertParams::new(FormatName::Kitti))?;
    assert_eq!(done.frames, 3);
    let poses = fs::read_to_string(out.join("poses/00.txt"))?;
    let mut driven_m = Vec::new();
    for line in poses.lines() {
        let row: Vec<f64> = line.split(' ').map(str::parse).collect::<Result<_, _>>()?;
        assert_eq!(row.len(), 12);
        driven_m.push((row[3].powi(2) + row[7].powi(2) + row[11].powi(2)).sqrt());
    }
    assert_eq!(driven_m.len(), 3);
    for (frame, driven_m) in driven_m.into_iter().enumerate() {
        assert!((driven_m - frame as f64).abs() < 1e-9, "{driven_m} m");
    }
    Ok(())
}
