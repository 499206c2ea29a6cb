//! A world that is seen, and the part of it that has grown.

use std::sync::Arc;

use nemoral_pipeline::config::Config;
use nemoral_pipeline::plan::Runner;
use nemoral_pipeline::recording::scene::FrameScene;
use nemoral_pipeline::world::cameras::CameraRig;
use nemoral_pipeline::world::lidars::LidarRig;
use nemoral_pipeline::world::trajectory::{LOG_REACH_M, WATER_REACH_M, obstacles, waters};
use nemoral_pipeline::{Backend, ForestPlan, InputFiles};
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{ChunkCoord, MaterialLibrary, Ontology};

use super::Shared;
use super::shadow_cache::ShadowCache;
use crate::Error;

/// Distance that is kept from stems, logs, rocks and the banks of deep water, metres.
const CLEARANCE_M: f64 = 0.3;
/// One wades through streams up to this depth, metres, but into no pond.
const WADED_M: f64 = 0.4;
/// How far what is in the way reaches into neighbouring chunks, metres: half of the longest log or
/// of the widest pond, and a metre for half of a log's width and the clearance.
const REACH_M: f64 = LOG_REACH_M.max(WATER_REACH_M) + 1.0;
/// The names of the cameras of drafts, in the order of [`World::cameras`] after the first.
const DRAFTS: [&str; 2] = ["drafts", "drafts by halves"];

/// A world with its light and its sensors.
#[derive(Debug)]
pub(super) struct World {
    pub(super) revision: u64,
    /// As it was asked for.
    pub(super) config: Config,
    pub(super) forest: ForestPlan,
    /// As wet as the weather makes them.
    pub(super) materials: Arc<MaterialLibrary>,
    /// The config's first camera, and those of drafts and, where rays are cast, of halved ones.
    pub(super) cameras: Arc<Vec<CameraRig>>,
    pub(super) lidars: Arc<Vec<LidarRig>>,
    pub(super) ontology: Ontology,
    /// Where the robot's path begins: east, north, heading.
    pub(super) start: (f64, f64, f64),
}

/// A world as far as it has grown.
#[derive(Debug)]
pub(super) struct WorldSnapshot {
    pub(super) world: Arc<World>,
    pub(super) scene: Arc<FrameScene>,
    /// The place that the scene is around.
    pub(super) centre_m: DVec2,
    /// Whether all is there that is visible from that place.
    pub(super) complete: bool,
    /// The shadows that drafts of it have found.
    pub(super) shadows: ShadowCache,
}

/// The config's classes.
pub(super) fn ontology(config: &Config) -> Ontology {
    config.output.ontology.table()
}

/// The plan of a world, with the sensors that the view needs.
pub(super) fn plan(
    config: &Config,
    inputs: &InputFiles,
    backend: &Backend,
) -> Result<ForestPlan, Error> {
    // Lamps shine on the CPU alone.
    let backend = match config.has_lamps() {
        true => &Backend::Cpu,
        false => backend,
    };
    let mut sensors = config.clone();
    sensors.lidars.clear();
    sensors.cameras.clear();
    sensors.lidar.enabled = true;
    let camera = &mut sensors.camera;
    camera.enabled = true;
    camera.radiance = false;
    let mut drafts = camera.clone();
    if !backend.draws_ahead() {
        // A GPU draws whole pictures quickly, and would hold the scene twice.
        drafts.samples = 1;
        drafts.edge_samples = 1;
        drafts.bounces = 0;
        let mut halved = drafts.clone();
        // Light is spread once all columns are there.
        halved.spread_px = 0.0;
        sensors.cameras.insert(DRAFTS[1].to_owned(), halved);
    }
    sensors.cameras.insert(DRAFTS[0].to_owned(), drafts);
    Ok(ForestPlan::with_inputs(&sensors, inputs, backend.clone())?)
}

impl World {
    /// Grows what a world has once: plants, and the start of the path.
    pub(super) fn grow(shared: &Shared, config: Config, revision: u64) -> Result<Self, Error> {
        let forest = plan(&config, &shared.inputs, &shared.backend)?;
        let runner = Runner::new(forest.plan(), &shared.store, shared.threads);
        let cameras = runner.get(forest.cameras, ())?;
        let lidars = runner.get(forest.lidars, ())?;
        let materials = runner.get(forest.materials, ())?;
        let pose = runner.get(forest.pose, 0)?.world_from_body();
        let ahead = pose.transform_vector(DVec3::X);
        let heading_deg = libm::atan2(ahead.x, ahead.y).to_degrees();
        let start = (pose.translation_m.x, pose.translation_m.y, heading_deg);
        Ok(Self {
            revision,
            ontology: ontology(&config),
            config,
            forest,
            materials,
            cameras,
            lidars,
            start,
        })
    }

    pub(super) fn runner<'a>(&'a self, shared: &'a Shared, threads: usize) -> Runner<'a> {
        Runner::new(self.forest.plan(), &shared.store, threads)
    }

    /// Whether another world has the same land: only its light or its sensors differ.
    pub(super) fn has_land_of(&self, other: &Self) -> bool {
        let origin = ChunkCoord::new(0, 0);
        let keys = |world: &Self| {
            let (plan, f) = (world.forest.plan(), &world.forest);
            [
                plan.key(f.assets, ()),
                plan.key(f.object_geometry, origin),
                plan.key(f.undergrowth_geometry, origin),
                plan.key(f.litter_geometry, origin),
                plan.key(f.sky_view_factor, origin),
            ]
        };
        keys(self) == keys(other) && self.config.chunks == other.config.chunks
    }

    /// A place nearby that is clear of stems, logs, rocks and deep water: this one, if it is.
    pub(super) fn clear_of_obstacles(
        &self,
        shared: &Shared,
        mut place_m: DVec2,
    ) -> Result<DVec2, Error> {
        let size_m = self.config.chunks.size_m;
        let runner = self.runner(shared, 1);
        let objects = runner.demand(self.forest.objects);
        let grounds = runner.demand(self.forest.ground);
        // What one obstacle turns away may meet another.
        for _ in 0..3 {
            let mut moved = false;
            for chunk in ChunkCoord::within(place_m, REACH_M, size_m) {
                let (objects, ground) = (objects.at(chunk)?, grounds.at(chunk)?);
                let waters = waters(&ground, WADED_M);
                for disk in objects.0.iter().flat_map(obstacles).chain(waters) {
                    let keep_m = disk.radius_m + CLEARANCE_M;
                    if disk.position_m.distance(place_m) < keep_m {
                        let away = (place_m - disk.position_m).normalize_or(DVec2::X);
                        // A little further, so that rounding does not bring it back.
                        place_m = disk.position_m + away * (keep_m + 1e-6);
                        moved = true;
                    }
                }
            }
            if !moved {
                break;
            }
        }
        Ok(place_m)
    }
}
