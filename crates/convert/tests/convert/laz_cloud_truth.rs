//! Clouds as LAZ: what points say of their trees, pulses and sides.

use std::collections::BTreeSet;

use nemoral_convert::{ClassMapping, FormatName, LazCloudParams, laz_cloud};
use nemoral_dataset::{Cloud, CloudParams, CloudPoint, Crop, Error};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ObjectId, RigidTransform, Semantic};

use crate::common::{Made, START, header, made, made_of, objects, pose, with_lidars};
use crate::las::LasFile;

/// A part of a data set as a cloud, its points, and its file.
fn cloud_of(made: &Made, crop: Option<Crop>, table: Option<&str>) -> (Vec<CloudPoint>, LasFile) {
    let params = CloudParams {
        crop,
        ..CloudParams::default()
    };
    let cloud = Cloud::open(made.dataset.root(), params).expect("a cloud");
    let mut points = Vec::new();
    let put = |point: &CloudPoint| {
        points.push(*point);
        Ok::<_, Error>(())
    };
    cloud.for_each(put).expect("points");
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("plot.laz");
    let laz = LazCloudParams {
        ontology: table.map(|name| ClassMapping::load(name).expect("a table")),
        ..LazCloudParams::default()
    };
    laz_cloud(&cloud, &out, &laz).expect("written");
    let file = LasFile::read(&out);
    assert_eq!(file.points().len(), points.len());
    (points, file)
}

fn circle(centre_m: DVec2, radius_m: f64) -> Option<Crop> {
    Some(Crop::Circle { centre_m, radius_m })
}

#[test]
fn trees_outside_of_a_crop_are_out_points_where_a_table_has_them() {
    let made = made(FormatName::Laz);
    let tree = objects()[0].object;
    let is_of_tree = |p: &CloudPoint| p.recorded.point.object == tree;
    let (all, _) = cloud_of(&made, None, None);
    let hit_m = all.iter().find(|p| is_of_tree(p)).expect("a tree").world_m;
    let (hit_m, foot_m) = (hit_m.truncate(), START.truncate());
    assert!(hit_m.distance(foot_m) > 1.5, "{hit_m}");
    let (around_hit, around_foot) = (circle(hit_m, 1.0), circle(foot_m, 100.0));
    for (crop, table, is_outside) in [
        (around_hit, Some("for-instance"), true),
        (around_foot, Some("for-instance"), false),
        (None, Some("for-instance"), false),
        // ASPRS has no such class.
        (around_hit, None, false),
    ] {
        let (points, file) = cloud_of(&made, crop, table);
        let mut of_tree = 0;
        for (p, found) in points.iter().zip(file.points()) {
            let told = (found.class(), found.u32("treeID"));
            if !is_of_tree(p) {
                assert!(told.0 != 3 || table.is_none(), "{told:?}");
                assert_eq!(told.1, 0);
                continue;
            }
            of_tree += 1;
            let class = match (table, p.recorded.point.semantic) {
                (None, _) | (_, Semantic::Leaf) => 5,
                (_, semantic) => {
                    assert_eq!(semantic, Semantic::Stem);
                    4
                }
            };
            // It is in the second row of its table.
            assert_eq!(told, if is_outside { (3, 0) } else { (class, 2) });
        }
        assert!(of_tree > 0);
    }
    // What no object is, is no tree.
    let mut objects = all.iter().map(|p| p.recorded.point.object);
    assert!(objects.any(ObjectId::is_none));
}

#[test]
fn no_two_returns_of_a_cloud_have_the_same_pulse_and_number() {
    let mount = header().sequences[0].lidars[0].body_from_lidar;
    let mut header = with_lidars(&[mount; 5]);
    header.sequences[0].half_scan_s = Some(30.0);
    let made = made_of(FormatName::Laz, &header);
    let (points, file) = cloud_of(&made, None, None);
    let mut seen = BTreeSet::new();
    for (p, found) in points.iter().zip(file.points()) {
        assert_eq!(found.channel(), (0, p.lidar % 4, 0));
        let apart_ns = i32::from(p.recorded.point.ring) + 256 * i32::from(p.lidar);
        let expected_s = 31.0 + p.fired_s() + 1e-9 * f64::from(apart_ns);
        assert!((found.time_s() - expected_s).abs() < 1e-11);
        assert_eq!(found.source(), p.source_id());
        seen.insert((found.time_s().to_bits(), found.returns().0));
    }
    assert!(!points.is_empty() && seen.len() == points.len());
}

#[test]
fn angles_of_a_lidar_that_is_mounted_backwards_have_the_signs_of_the_body() {
    let forwards = header().sequences[0].lidars[0].body_from_lidar;
    let half_turn = std::f64::consts::PI;
    let backwards = RigidTransform::from_xyz_rpy(forwards.translation_m, 0.0, 0.0, half_turn);
    let made = made_of(FormatName::Laz, &with_lidars(&[backwards]));
    let (points, file) = cloud_of(&made, None, None);
    let mut sides = [[0; 2]; 2];
    for (p, found) in points.iter().zip(file.points()) {
        let left_m = p.from_scanner_m.dot(pose(p.frame).1.level_left());
        let is_left = left_m > 0.0;
        assert_eq!(found.angle_deg() < 0.0, is_left, "{left_m}");
        sides[usize::from(p.lidar)][usize::from(is_left)] += 1;
    }
    assert!(sides.as_flattened().iter().all(|n| *n > 9), "{sides:?}");
}
