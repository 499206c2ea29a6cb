//! Workloads for the benchmarks in `benches/`, with fixed seeds.
//!
//! The LiDAR and frame groups are laid out as the paper's Tables I and II: 31, 96 and 210 trees in a
//! 50 m chunk, 25,000, 50,000 and 100,000 points, everything visible to 100 m.

use nemoral_pipeline::config::{Config, Layers};
use nemoral_pipeline::plan::{Runner, Store};
use nemoral_pipeline::{Error, ForestPlan};

/// The paper's densities: the names of our presets.
pub const DENSITIES: [&str; 3] = ["low", "medium", "high"];

/// The paper's numbers of points.
pub const POINTS: [u32; 3] = [25_000, 50_000, 100_000];

/// A preset's config with a number of pulses.
///
/// # Errors
/// If there is no such preset.
pub fn config(preset: &str, pulses: u32) -> Result<Config, Error> {
    let settings = vec![format!("lidar.pulses={pulses}")];
    Layers {
        preset: Some(preset.to_owned()),
        file: None,
        settings,
    }
    .load()
}

/// A forest whose chunks around frame 0 are grown already.
#[derive(Debug)]
pub struct Grown {
    /// Its plans.
    pub forest: ForestPlan,
    /// What is grown.
    pub store: Store,
}

impl Grown {
    /// Grows what frame 0 of a config sees.
    ///
    /// # Errors
    /// If a stage fails.
    pub fn new(config: &Config) -> Result<Self, Error> {
        let grown = Self {
            forest: ForestPlan::new(config)?,
            store: Store::unlimited(),
        };
        grown.runner().get(grown.forest.scene, 0)?;
        Ok(grown)
    }

    /// Runs its plans.
    #[must_use]
    pub fn runner(&self) -> Runner<'_> {
        let threads = std::thread::available_parallelism().map_or(1, Into::into);
        Runner::new(self.forest.plan(), &self.store, threads)
    }
}
