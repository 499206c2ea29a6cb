//! A small world with its own store, for tests of what grows and lies in chunks.
#![allow(dead_code, reason = "each test uses a part")]

mod grown;

use nemoral_pipeline::ForestPlan;
use nemoral_pipeline::config::{Config, Layers};
use nemoral_pipeline::plan::{Runner, Store};

pub(crate) use grown::grown;

pub(crate) struct World {
    pub(crate) forest: ForestPlan,
    store: Store,
}

impl World {
    /// The world of a preset with these settings.
    pub(crate) fn new(preset: &str, settings: &[&str]) -> Self {
        let forest = ForestPlan::new(&config(preset, settings)).unwrap_or_else(|e| panic!("{e}"));
        Self {
            forest,
            store: store(),
        }
    }

    pub(crate) fn runner(&self) -> Runner<'_> {
        self.runner_of(2)
    }

    pub(crate) fn runner_of(&self, threads: usize) -> Runner<'_> {
        Runner::new(self.forest.plan(), &self.store, threads)
    }
}

/// A store that keeps every value, and takes plants that other worlds have grown.
pub(crate) fn store() -> Store {
    Store::unlimited().with_cache(grown())
}

/// The config of a preset with these settings.
pub(crate) fn config(preset: &str, settings: &[&str]) -> Config {
    let layers = Layers {
        preset: Some(preset.to_owned()),
        file: None,
        settings: settings.iter().map(|s| (*s).to_owned()).collect(),
    };
    layers.load().unwrap_or_else(|e| panic!("{e}"))
}
