//! The worlds of a request's sequences.

use crate::config::{SequenceConfig, Sequences};
use crate::plan::{Runner, Store};
use crate::preflight::preflight;
use crate::{Backend, Error, ForestPlan};

/// The worlds of a request, one at a time, with the store that they share.
pub(crate) struct Worlds<'a> {
    sequences: &'a Sequences,
    backend: &'a Backend,
    store: &'a Store,
    threads: usize,
}

/// The world of a sequence.
pub(crate) struct World {
    pub(crate) sequence: SequenceConfig,
    pub(crate) forest: ForestPlan,
}

impl<'a> Worlds<'a> {
    pub(crate) fn new(
        sequences: &'a Sequences,
        backend: &'a Backend,
        store: &'a Store,
        threads: usize,
    ) -> Self {
        Self {
            sequences,
            backend,
            store,
            threads,
        }
    }

    /// Leaves the world before, whose values are dropped, except those that this world has, too:
    /// grown plants, or all of them if it is the same world.
    pub(crate) fn enter(&self, number: u32) -> Result<World, Error> {
        let sequence = self.sequences.get(number)?;
        let (config, inputs) = (&sequence.config, &sequence.inputs);
        let forest = ForestPlan::with_inputs(config, inputs, self.backend.clone());
        let forest = forest.map_err(|e| e.in_sequence(number, self.sequences.len()))?;
        self.store.retain_plan(forest.plan());
        Ok(World { sequence, forest })
    }

    pub(crate) fn runner<'b>(&self, world: &'b World) -> Runner<'b>
    where
        'a: 'b,
    {
        Runner::new(world.forest.plan(), self.store, self.threads)
    }

    /// Computes everything that a world's frames have in common. The result is a note for the user.
    pub(crate) fn preflight(&self, world: &World) -> Result<Option<String>, Error> {
        let note = preflight(&world.sequence.config, &world.forest, &self.runner(world));
        note.map_err(|e| e.in_sequence(world.sequence.number, self.sequences.len()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::ConfigLayers;
    use crate::plan::Stage;
    use crate::stages::assets::{AssetStage, LibraryStage};

    #[test]
    fn worlds_share_what_they_have_in_common() -> Result<(), Error> {
        let layers = ConfigLayers {
            preset: Some("demo".to_owned()),
            settings: vec!["sequences=2".to_owned()],
            ..ConfigLayers::default()
        };
        let (sequences, store) = (layers.sequences()?, Store::unlimited());
        let worlds = Worlds::new(&sequences, &Backend::Cpu, &store, 2);
        worlds.preflight(&worlds.enter(0)?)?;
        let computed = store.computed();
        // The same world is entered again when its frames are made.
        worlds.preflight(&worlds.enter(0)?)?;
        assert_eq!(store.computed(), computed);
        // Another one has the same plants, and nothing else.
        worlds.enter(1)?;
        assert_eq!(store.count(LibraryStage::ID), 1);
        assert_eq!(store.count(AssetStage::ID), 1);
        assert_eq!(store.len(), 2);
        Ok(())
    }
}
