//! Diameters at breast height from scans, by a circle in a slice as in forestry, with their true
//! values.

use std::collections::BTreeMap;

use nemoral_pipeline::ForestPlan;
use nemoral_pipeline::config::Config;
use nemoral_pipeline::plan::Runner;
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{ChunkCoord, ObjectId, Semantic, TreeRecord};

use super::circle;

/// Breast height above ground, metres.
const BREAST_M: f64 = 1.3;
/// Half of the slice's thickness, metres.
const HALF_SLICE_M: f64 = 0.06;
/// Greatest distance of a stem from the scanner, metres.
const FARTHEST_M: f64 = 15.0;
/// Least number of points on a stem.
const LEAST_POINTS: usize = 30;
/// Least diameter of a tree, metres.
const LEAST_DBH_M: f64 = 0.07;

/// Settings that make a preset's robot a scanner on a tripod without range errors, at nine stations
/// with different stems.
pub const STATIONS: [&str; 13] = [
    "frames=9",
    "chunks.visible_radius_m=20",
    "chunks.undergrowth_radius_m=15",
    "chunks.delete_radius_m=60",
    "camera.enabled=false",
    "robot.stations.columns=3",
    "robot.stations.rows=3",
    "robot.stations.distance_m=32",
    "lidar.panorama.low_deg=-11",
    "lidar.panorama.high_deg=11",
    "lidar.pulses=400000",
    "lidar.mount_z_m=1.35",
    "lidar.noise.model=off",
];

/// A stem in a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScannedStem {
    /// Its diameter by the circle, metres.
    pub found_m: f64,
    /// Its diameter at breast height by the inventory, metres.
    pub true_m: f64,
    /// How many points the circle was fitted to.
    pub points: usize,
}

/// The stems of a world's scans.
#[derive(Clone, Debug, PartialEq)]
pub struct ScannedDiameters {
    /// The stems; each counts once for each scan that it is in.
    pub stems: Vec<ScannedStem>,
}

impl ScannedDiameters {
    /// Diameters of living trees within 15 m of the scanner, with at least 30 points in a slice 12
    /// cm thick at breast height. The truth tells which points belong to a stem, as segmentation is
    /// another question.
    ///
    /// # Panics
    /// If the world cannot be grown or scanned.
    #[must_use]
    pub fn of(forest: &ForestPlan, config: &Config, runner: &Runner<'_>) -> Self {
        let assets = runner.get(forest.assets, ()).expect("assets");
        let mut stems = Vec::new();
        for frame in 0..config.frames {
            let pose = runner.get(forest.pose, frame).expect("a pose");
            let scan = &runner.get(forest.scans, frame).expect("a scan")[0];
            let from_lidar = pose.world_from_body() * config.lidar.body_from_lidar();
            let here = from_lidar.translation_m;
            let near = ChunkCoord::within(here.truncate(), FARTHEST_M, config.chunks.size_m);
            let things = runner.demand(forest.objects).all(&near).expect("things");
            let records = things.iter().flat_map(|t| t.0.iter());
            let trees: BTreeMap<ObjectId, TreeRecord> = records
                .filter_map(|t| assets.tree_record(t))
                .filter(|t| t.alive && t.dbh_m >= LEAST_DBH_M)
                .map(|t| (t.object, t))
                .collect();
            let mut slices: BTreeMap<ObjectId, Vec<DVec2>> = BTreeMap::new();
            for point in scan.iter().filter(|p| p.semantic == Semantic::Stem) {
                let Some(tree) = trees.get(&point.object) else {
                    continue;
                };
                let at: DVec3 = from_lidar.transform_point(point.position_m.as_dvec3());
                let above_m = at.z - tree.position_m.z;
                if (above_m - BREAST_M).abs() < HALF_SLICE_M && at.distance(here) < FARTHEST_M {
                    slices.entry(point.object).or_default().push(at.truncate());
                }
            }
            for (object, points) in slices {
                if points.len() >= LEAST_POINTS
                    && let Some(circle) = circle(&points)
                {
                    stems.push(ScannedStem {
                        found_m: 2.0 * circle.radius,
                        true_m: trees[&object].dbh_m,
                        points: points.len(),
                    });
                }
            }
        }
        Self { stems }
    }

    /// Mean error, metres; NaN without stems.
    #[must_use]
    pub fn bias_m(&self) -> f64 {
        self.mean(|s| s.found_m - s.true_m)
    }

    /// Root mean square error, metres.
    #[must_use]
    pub fn rmse_m(&self) -> f64 {
        self.mean(|s| (s.found_m - s.true_m).powi(2)).sqrt()
    }

    /// Mean true diameter, metres.
    #[must_use]
    pub fn mean_m(&self) -> f64 {
        self.mean(|s| s.true_m)
    }

    fn mean(&self, of: impl Fn(&ScannedStem) -> f64) -> f64 {
        self.stems.iter().map(of).sum::<f64>() / self.stems.len() as f64
    }
}
