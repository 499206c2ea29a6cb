//! Diameters at breast height from scans, as foresters measure them: a slice, a circle, the truth beside it.

use nemoral_pipeline::stages::sensors::body_from_lidar;
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{ChunkCoord, ObjectId, Semantic, TreeRecord};
use nemoral_tests::World;
use nemoral_tests::realism::circle;
use std::collections::BTreeMap;

const BREAST_M: f64 = 1.3;
const HALF_SLICE_M: f64 = 0.06;
const FARTHEST_M: f64 = 15.0;
const LEAST_POINTS: usize = 30;

/// Circles fitted to the slice of stems: found and true diameter, the points of each.
fn stems(world: &World) -> Vec<(f64, f64, usize)> {
    let runner = world.runner(2);
    let assets = runner.get(world.forest.assets, ()).expect("assets");
    let mut found = Vec::new();
    for frame in 0..world.config.frames {
        let pose = runner.get(world.forest.pose, frame).expect("a pose");
        let scan = &runner.get(world.forest.scans, frame).expect("a scan")[0];
        let from_lidar = pose.world_from_body() * body_from_lidar(&world.config.lidar);
        let here = from_lidar.translation_m;
        let near = ChunkCoord::within(here.truncate(), FARTHEST_M, world.config.chunks.size_m);
        let things = runner
            .demand(world.forest.things)
            .all(&near)
            .expect("things");
        let records = things.iter().flat_map(|t| t.0.iter());
        let trees: BTreeMap<ObjectId, TreeRecord> = records
            .filter_map(|t| t.tree_record(&assets))
            .filter(|t| t.alive && t.dbh_m >= 0.07)
            .map(|t| (t.object, t))
            .collect();
        let mut slices: BTreeMap<ObjectId, Vec<DVec2>> = BTreeMap::new();
        for point in scan {
            let Some(tree) = trees.get(&point.object) else {
                continue;
            };
            let at: DVec3 = from_lidar.transform_point(point.position_m.as_dvec3());
            let above_m = at.z - tree.position_m.z;
            let stem = point.semantic == Semantic::Stem;
            if stem && (above_m - BREAST_M).abs() < HALF_SLICE_M && at.distance(here) < FARTHEST_M {
                slices.entry(point.object).or_default().push(at.truncate());
            }
        }
        for (object, points) in slices {
            if points.len() >= LEAST_POINTS
                && let Some(circle) = circle(&points)
            {
                found.push((2.0 * circle.radius, trees[&object].dbh_m, points.len()));
            }
        }
    }
    found
}

#[test]
fn a_circle_in_a_slice_gives_the_diameter() {
    let world = World::new(
        "medium",
        &[
            "frames=4",
            "assets.individuals=3",
            "chunks.visible_radius_m=20",
            "chunks.undergrowth_radius_m=0",
            "undergrowth.cover=0",
            "camera.enabled=false",
            "robot.stations.columns=2",
            "robot.stations.rows=2",
            "robot.stations.distance_m=26",
            "lidar.panorama.low_deg=-11",
            "lidar.panorama.high_deg=11",
            "lidar.pulses=400000",
            "lidar.noise.model=off",
        ],
    );
    let found = stems(&world);
    let n = found.len() as f64;
    let errors: Vec<f64> = found.iter().map(|(d, truth, _)| d - truth).collect();
    let bias = errors.iter().sum::<f64>() / n;
    let rmse = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
    let thickness = found.iter().map(|f| f.1).sum::<f64>() / n;
    println!(
        "{n} stems of {thickness:.3} m on average: bias {:+.1} mm, RMSE {:.1} mm",
        1000.0 * bias,
        1000.0 * rmse
    );
    assert!(found.len() >= 20, "{n} stems");
    assert!(rmse < 0.02, "{rmse}: {found:?}");
    assert!(bias.abs() < 0.01, "{bias}");
    // It can fail: the same stems a tenth thicker than they are written to be.
    let thicker = found
        .iter()
        .map(|(d, truth, _)| d * 1.1 - truth)
        .sum::<f64>()
        / n;
    assert!(thicker > 0.01, "{thicker}");
}
