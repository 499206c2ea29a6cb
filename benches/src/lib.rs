//! Workloads for the benchmarks in `benches/`, with fixed seeds.
//!
//! The LiDAR and frame groups are those of the paper's Tables I and II: 31, 96 and 210 trees in a
//! chunk of 50 m, 25,000, 50,000 and 100,000 points, everything visible to 100 m.

use nemoral_lidar::ScanRequest;
use nemoral_pipeline::config::{Config, ConfigLayers};
use nemoral_pipeline::plan::{Runner, Store};
use nemoral_pipeline::{Error, ForestPlan};
use nemoral_scene::LidarPoint;
use nemoral_seed::Key;

/// The paper's densities, as the names of our presets.
pub const DENSITIES: [&str; 3] = ["low", "medium", "high"];

/// The paper's numbers of points.
pub const POINTS: [u32; 3] = [25_000, 50_000, 100_000];

/// A preset's config with a number of pulses.
///
/// # Errors
/// If there is no such preset.
pub fn config(preset: &str, pulses: u32) -> Result<Config, Error> {
    settings(preset, &[format!("lidar.pulses={pulses}")])
}

/// A preset's config overridden by settings, each `key=value`.
///
/// # Errors
/// If there is no such preset, or a setting is refused.
pub fn settings(preset: &str, settings: &[String]) -> Result<Config, Error> {
    let layers = ConfigLayers {
        preset: Some(preset.to_owned()),
        file: None,
        settings: settings.to_vec(),
    };
    Ok(layers.load()?)
}

/// A forest whose chunks around frame 0 are already computed.
#[derive(Debug)]
pub struct Grown {
    /// The plans of the forest.
    pub forest: ForestPlan,
    /// The computed values.
    pub store: Store,
}

impl Grown {
    /// Computes what frame 0 of a config sees.
    ///
    /// # Errors
    /// If a stage fails.
    pub fn new(config: &Config) -> Result<Self, Error> {
        let grown = Self {
            forest: ForestPlan::new(config)?,
            store: Store::unlimited(),
        };
        let (forest, runner) = (&grown.forest, grown.runner());
        runner.get(forest.camera_scene, 0)?;
        runner.get(forest.lidar_scene, 0)?;
        Ok(grown)
    }

    /// A function that repeats the scan of frame 0 by the first LiDAR, with all fields and noise.
    ///
    /// # Errors
    /// If a stage fails.
    pub fn first_scan(&self) -> Result<impl Fn() -> Vec<LidarPoint> + Sync + use<>, Error> {
        let runner = self.runner();
        let pose = runner.get(self.forest.pose, 0)?;
        let scene = runner.get(self.forest.lidar_scene, 0)?;
        let rigs = runner.get(self.forest.lidars, ())?;
        let assets = runner.get(self.forest.assets, ())?;
        let track = pose.track.relative_to(scene.origin_m);
        Ok(move || {
            let rig = &rigs[0];
            rig.scanner.scan(&ScanRequest {
                first_pulse: rig.scanner.first_pulse_at(pose.time_s),
                caster: &*scene.caster,
                materials: &assets.library.materials,
                scene_from_lidar_at: &|offset_s| track.at(offset_s) * rig.body_from_lidar,
                range_model: &rig.noise,
                key: Key::world(1),
            })
        })
    }

    /// A runner of the forest's plans.
    #[must_use]
    pub fn runner(&self) -> Runner<'_> {
        let threads = std::thread::available_parallelism().map_or(1, Into::into);
        Runner::new(self.forest.plan(), &self.store, threads)
    }
}
