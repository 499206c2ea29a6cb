//! Worlds to measure.

use nemoral_pipeline::ForestPlan;
use nemoral_pipeline::config::{Config, ConfigLayers};
use nemoral_pipeline::plan::{ForestCoordinate, Runner, Store};

/// The presets that are recipes of stands.
pub const STANDS: [&str; 7] = [
    "maritime-pine",
    "eucalyptus-plantation",
    "oak-mixed",
    "beech",
    "spruce",
    "boreal-birch-pine",
    "montado",
];

/// A world with its own store.
#[derive(Debug)]
pub struct World {
    /// The config of the world.
    pub config: Config,
    /// The world's plans.
    pub forest: ForestPlan,
    /// The values computed so far.
    pub store: Store,
}

/// The config of a preset overridden by settings, each `key=value`.
///
/// # Panics
/// If it is refused.
#[must_use]
pub fn config(preset: &str, settings: &[&str]) -> Config {
    let layers = ConfigLayers {
        preset: Some(preset.to_owned()),
        file: None,
        settings: settings.iter().map(|s| (*s).to_owned()).collect(),
    };
    layers.load().unwrap_or_else(|e| panic!("{e}"))
}

/// A store that keeps every value, and takes plants that other worlds have grown.
#[must_use]
pub fn store() -> Store {
    Store::unlimited().with_cache(crate::grown())
}

impl World {
    /// The world of a preset overridden by settings.
    ///
    /// # Panics
    /// If the config is refused.
    #[must_use]
    pub fn new(preset: &str, settings: &[&str]) -> Self {
        let config = config(preset, settings);
        let forest = ForestPlan::new(&config).unwrap_or_else(|e| panic!("{e}"));
        Self {
            config,
            forest,
            store: store(),
        }
    }

    /// The world of a preset overridden by settings, for who takes no picture: without cameras no
    /// textures are made, which is much of the time that its plants take.
    ///
    /// # Panics
    /// If the config is refused.
    #[must_use]
    pub fn without_cameras(preset: &str, settings: &[&str]) -> Self {
        Self::new(preset, &[settings, &["camera.enabled=false"]].concat())
    }

    /// A runner that computes this many nodes at once.
    #[must_use]
    pub fn runner(&self, threads: usize) -> Runner<'_> {
        Runner::new(self.forest.plan(), &self.store, threads)
    }

    /// Drops the values of chunks and frames. Those of the whole world are costly and stay.
    pub fn forget(&self) {
        self.store.retain(|_, at| at == ForestCoordinate::World);
    }
}
