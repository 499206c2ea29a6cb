//! The tables beside a registered cloud: what it shows of each tree, and where the scanners were.

use std::collections::HashMap;
use std::path::Path;

use nemoral_dataset::{
    Cloud, CloudFormat, CloudParams, CloudPoint, CloudPoses, Crop, DatasetHeader, Error, OpenMode,
    SequenceSpec, SiteSpec, Track, WorldTables, Writer,
};
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{PointFlags, RigidTransform, Semantic, TreeRecord};

use crate::common::{
    START, cloud_points as points, objects, see, small, track, trees as trees_of_world,
};

const FRAMES: usize = 3;
const SITE: SiteSpec = SiteSpec {
    epsg: Some(25_829),
    origin_m: [553_220.0, 4_450_330.0, 73.0],
};

/// The world's trees; the second one's stem is a ball, whose diameter is that 1.3 m above its foot.
fn trees() -> Vec<TreeRecord> {
    let mut trees = trees_of_world();
    trees[1].dbh_m = 2.0 * (1.5_f64 * 1.5 - 1.3 * 1.3).sqrt();
    trees
}

fn write(out: &Path, header: &DatasetHeader, track: &Track) -> Result<(), Error> {
    let writer = Writer::create(out, OpenMode::Fresh, header.clone())?;
    for frame in 0..FRAMES {
        writer.write_frame(&see(header, frame).data(header))?;
    }
    let tables = WorldTables {
        trees: &trees(),
        objects: &objects(),
        ..WorldTables::default()
    };
    writer.write_sequence(track, &tables)?;
    writer.finish().map(drop)
}

/// The rows of a table, by the names of its columns.
fn rows(path: &Path) -> Vec<HashMap<String, String>> {
    let mut reader = csv::Reader::from_path(path).expect("a table");
    let rows = reader.deserialize().map(|row| row.expect("a row"));
    rows.collect()
}

fn number(row: &HashMap<String, String>, column: &str) -> f64 {
    row[column].parse().expect(column)
}

fn place(row: &HashMap<String, String>) -> DVec3 {
    DVec3::from_array(["x_m", "y_m", "z_m"].map(|column| number(row, column)))
}

#[test]
fn a_plots_table_says_what_the_cloud_shows_of_each_tree() -> Result<(), Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let (data, csv) = (folder.path().join("data"), folder.path().join("plot.csv"));
    write(&data, &small(), &track(FRAMES))?;
    let all = points(&data, CloudParams::default())?;
    // The second tree's foot is outside, and most of its stem, but not all.
    let crop = Crop::Circle {
        centre_m: START.truncate() + DVec2::new(10.0, -1.5),
        radius_m: 1.0,
    };
    for (pure, crop) in [(false, None), (false, Some(crop)), (true, Some(crop))] {
        let params = CloudParams {
            pure,
            crop,
            ..CloudParams::default()
        };
        let contains = |p: DVec3| crop.is_none_or(|crop| crop.contains(p.truncate()));
        let cloud = Cloud::open(&data, params)?;
        let count = cloud.write_trees(&csv, CloudFormat::Ply)?;
        let found = rows(&csv);
        assert_eq!(found.len(), count);
        let mut expected = 0;
        for (i, tree) in trees().into_iter().enumerate() {
            let id = (i + 1).to_string();
            let row = found.iter().find(|row| row["tree_id"] == id);
            let is_kept = |p: &&CloudPoint| {
                let is_mixed = p.recorded.point.flags.has(PointFlags::MIXED);
                p.recorded.point.object == tree.object && !(pure && is_mixed)
            };
            let own = all.iter().filter(is_kept);
            let (inside, outside): (Vec<_>, Vec<_>) = own.partition(|p| contains(p.world_m));
            let is_told = contains(tree.position_m) || !inside.is_empty();
            assert_eq!(row.is_some(), is_told, "tree {id}");
            let Some(row) = row else { continue };
            expected += 1;
            assert_eq!(row["id"], tree.object.to_u64().to_string());
            assert_eq!(row["species"], tree.species);
            assert_eq!(place(row), tree.position_m);
            let foot_inside = contains(tree.position_m).to_string();
            assert_eq!(row["foot_inside"], foot_inside);
            assert_eq!(row["points"], inside.len().to_string());
            assert_eq!(row["points_cropped"], outside.len().to_string());
            let height_m = |p: &CloudPoint| p.world_m.z - tree.position_m.z;
            let highest_m = inside.iter().map(|&p| height_m(p)).fold(f64::MIN, f64::max);
            if inside.is_empty() {
                assert_eq!(row["highest_point_m"], "");
            } else {
                let off_m = number(row, "highest_point_m") - highest_m;
                assert!(off_m.abs() < 6e-4, "{row:?}, not {highest_m}");
            }
            let at_breast = inside.iter().filter(|p| {
                let is_stem = p.recorded.point.semantic == Semantic::Stem;
                is_stem && (1.25..=1.35).contains(&height_m(p))
            });
            let at_breast = at_breast.count();
            assert_eq!(row["stem_points_1_3m"], at_breast.to_string());
            let sectors = number(row, "stem_sectors_1_3m");
            assert_eq!(sectors > 0.0, at_breast > 0);
            if id == "2" && crop.is_none() {
                // It is seen from one side, and less than half of it from below.
                let is_half_seen = at_breast > 20 && (4.0..=8.0).contains(&sectors);
                assert!(is_half_seen, "{row:?}");
            }
            if id == "2" && crop.is_some() {
                let is_cut = !inside.is_empty() && outside.len() > inside.len();
                assert!(is_cut, "{row:?}");
            }
        }
        assert_eq!(count, expected);
        assert_eq!(count, if crop.is_none() { 2 } else { 1 });
    }
    Ok(())
}

#[test]
fn voxels_do_not_mix_what_is_kept_with_what_is_cropped() -> Result<(), Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let data = folder.path().join("data");
    write(&data, &small(), &track(FRAMES))?;
    let params = CloudParams {
        voxel_m: Some(0.4),
        crop: Some(Crop::Circle {
            centre_m: START.truncate() + DVec2::new(7.0, 1.7),
            radius_m: 1.0,
        }),
        ..CloudParams::default()
    };
    let kept = points(&data, params.clone())?;
    let seen = Cloud::open(&data, params)?.seen_trees()?;
    for seen in &seen {
        let own = |p: &&CloudPoint| p.recorded.point.object == seen.tree.object;
        assert_eq!(seen.points, kept.iter().filter(own).count() as u64);
    }
    assert!(
        seen.iter().any(|s| s.points > 5 && s.points_cropped > 5),
        "{seen:?}"
    );
    Ok(())
}

#[test]
fn tables_are_in_the_coordinates_of_the_cloud_beside_them() -> Result<(), Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let [here, invented] = ["here", "invented"].map(|name| folder.path().join(name));
    let mut header = small();
    write(&invented, &header, &track(FRAMES))?;
    header.sequences[0].site = Some(SITE);
    write(&here, &header, &track(FRAMES))?;
    let csv = folder.path().join("table.csv");
    let mount = header.sequences[0].lidars[0].body_from_lidar;
    let poses = track(FRAMES).poses.into_iter();
    let scanners: Vec<DVec3> = poses
        .map(|(_, pose)| (pose * mount).translation_m)
        .collect();
    for (data, format, origin_m) in [
        (&here, CloudFormat::Laz, DVec3::from_array(SITE.origin_m)),
        (&here, CloudFormat::Ply, DVec3::ZERO),
        (&invented, CloudFormat::Laz, DVec3::ZERO),
        (&invented, CloudFormat::Ply, DVec3::ZERO),
    ] {
        let cloud = Cloud::open(data, CloudParams::default())?;
        cloud.write_trees(&csv, format)?;
        let found: Vec<DVec3> = rows(&csv).iter().map(place).collect();
        let expected = trees().into_iter().map(|tree| tree.position_m + origin_m);
        assert_eq!(found, expected.collect::<Vec<_>>());
        assert_eq!(cloud.write_trajectory(&csv, format)?, FRAMES);
        for (i, (row, expected)) in rows(&csv).iter().zip(&scanners).enumerate() {
            // Its steps are 0.1 mm, and each scan of a drive has a number of its own.
            let found = place(row);
            assert_eq!(row["point_source_id"], (i + 1).to_string());
            assert!(
                found.distance(*expected + origin_m) < 1e-4,
                "{found} {expected}"
            );
        }
    }
    let cloud = Cloud::open(&here, CloudParams::default())?;
    let refused = cloud.write_trajectory(&folder.path().join("t.txt"), CloudFormat::Laz);
    assert!(refused.expect_err("refused").to_string().contains(".csv"));
    Ok(())
}

#[test]
fn a_trajectory_has_the_clock_the_angles_and_the_numbers_of_the_cloud() -> Result<(), Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let (data, csv) = (folder.path().join("data"), folder.path().join("path.csv"));
    let mut header = small();
    let sequence = &mut header.sequences[0];
    let mut rear = sequence.lidars[0].clone();
    rear.name = "rear".to_owned();
    rear.body_from_lidar.translation_m = DVec3::new(-0.4, 0.1, 1.0);
    sequence.lidars.push(rear);
    sequence.half_scan_s = Some(30.0);
    sequence.has_estimated_poses = true;
    // Each pose is a metre too far in the east.
    let mut track = track(FRAMES);
    track.lines = vec![0, 2];
    let off = |(_, pose): &(f64, RigidTransform)| RigidTransform {
        translation_m: pose.translation_m + DVec3::X,
        ..*pose
    };
    track.estimated = track.poses.iter().map(off).collect();
    write(&data, &header, &track)?;
    for (poses, off_m) in [(CloudPoses::True, 0.0), (CloudPoses::Estimated, 1.0)] {
        let params = CloudParams {
            poses,
            ..CloudParams::default()
        };
        let in_cloud = points(&data, params.clone())?;
        let cloud = Cloud::open(&data, params)?;
        for (format, shift_s, first) in [(CloudFormat::Ply, 0.0, 0), (CloudFormat::Laz, 31.0, 1)] {
            let count = cloud.write_trajectory(&csv, format)?;
            let found = rows(&csv);
            assert_eq!((count, found.len()), (2 * FRAMES, 2 * FRAMES));
            for (i, row) in found.iter().enumerate() {
                let (frame, lidar) = (i / 2, i % 2);
                let (time_s, pose) = track.poses[frame];
                let mount = header.sequences[0].lidars[lidar].body_from_lidar;
                let at = (pose * mount).translation_m + DVec3::X * off_m;
                assert!(place(row).distance(at) < 1e-4, "{row:?}, not {at}");
                assert_eq!(number(row, "gps_time"), time_s + shift_s);
                assert_eq!(row["lidar"], (first + lidar).to_string());
                let k = frame as f64;
                for (column, angle) in [
                    ("roll_deg", (0.01 * k).to_degrees()),
                    ("pitch_deg", 0.0),
                    ("heading_deg", 90.0 - (0.02 * k).to_degrees()),
                ] {
                    assert!((number(row, column) - angle).abs() < 2e-6, "{row:?}");
                }
                // As of the scan's points.
                let mut own = (in_cloud.iter())
                    .filter(|p| p.frame == frame as u64 && usize::from(p.lidar) == lidar)
                    .peekable();
                assert!(own.peek().is_some());
                for point in own {
                    assert_eq!(row["point_source_id"], point.source_id().to_string());
                    let scanner_m = point.world_m - point.from_scanner_m;
                    assert!(scanner_m.distance(at) < 1e-6);
                }
            }
            let lines: Vec<&str> = found.iter().map(|r| &*r["point_source_id"]).collect();
            assert_eq!(lines, ["1", "1", "1", "1", "2", "2"]);
        }
    }
    Ok(())
}

#[test]
fn points_know_how_far_they_are_to_the_left_of_the_scanner() -> Result<(), Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let data = folder.path().join("data");
    write(&data, &small(), &track(FRAMES))?;
    let mount = small().sequences[0].lidars[0].body_from_lidar;
    let mut sides = [0, 0];
    for point in points(&data, CloudParams::default())? {
        let (_, pose) = track(FRAMES).poses[point.frame as usize];
        let from_scanner_m = point.world_m - (pose * mount).translation_m;
        let heading = pose.transform_vector(DVec3::X).truncate();
        let left_m = heading.perp().normalize().dot(from_scanner_m.truncate());
        assert!(
            (point.left_m - left_m).abs() < 1e-6,
            "{point:?}, not {left_m}"
        );
        sides[usize::from(point.left_m > 0.0)] += 1;
    }
    assert!(sides.iter().all(|side| *side > 1000), "{sides:?}");
    Ok(())
}

#[test]
fn times_of_laz_are_later_by_the_least_number_of_seconds_that_makes_all_positive() {
    for (half_scan_s, shift_s) in [
        (None, 1.0),
        (Some(0.0), 1.0),
        (Some(0.05), 1.0),
        (Some(1.0), 2.0),
        (Some(29.98), 30.0),
        (Some(30.0), 31.0),
    ] {
        let spec = SequenceSpec {
            half_scan_s,
            ..SequenceSpec::new(0, 7)
        };
        assert_eq!(spec.las_time_shift_s(), shift_s, "{half_scan_s:?}");
    }
}

/// A link stands for a folder whose names may be in capitals or in small letters.
#[cfg(unix)]
#[test]
fn two_names_of_one_file_are_one() {
    let dir = tempfile::tempdir().expect("a folder");
    let [trees, trajectory] = ["trees.csv", "trajectory.csv"].map(|name| dir.path().join(name));
    Cloud::check_apart(&trees, &trajectory).expect("two files");
    std::fs::write(&trees, "").expect("written");
    std::os::unix::fs::symlink(&trees, &trajectory).expect("linked");
    let error = Cloud::check_apart(&trees, &trajectory).expect_err("one file");
    assert!(error.to_string().contains("another file"), "{error}");
}
