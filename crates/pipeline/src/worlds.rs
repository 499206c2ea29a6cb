//! The worlds of a request's sequences.

use crate::config::{SequenceConfig, Sequences};
use crate::plan::{Fingerprint, Runner, Stage, Store};
use crate::prove::prove;
use crate::stages::assets::LibraryStage;
use crate::{Backend, Error, ForestPlan};

/// The worlds of a request, one at a time, with the store that they share.
pub(crate) struct Worlds<'a> {
    sequences: &'a Sequences,
    backend: &'a Backend,
    store: &'a Store,
    threads: usize,
    /// The key of the library that is in the store.
    library: Option<Fingerprint>,
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
            library: None,
        }
    }

    /// Leaves the world before, whose values are dropped, except grown plants that this world has,
    /// too.
    pub(crate) fn enter(&mut self, number: u32) -> Result<World, Error> {
        let sequence = self.sequences.get(number)?;
        let (config, inputs) = (&sequence.config, &sequence.inputs);
        let forest = ForestPlan::with_inputs(config, inputs, self.backend.clone());
        let forest = forest.map_err(|e| e.in_sequence(number, self.sequences.len()))?;
        let library = forest.plan().key(forest.library, ());
        if self.library != Some(library) {
            self.store.retain(|_, _| false);
        } else {
            self.store.retain(|id, _| id == LibraryStage::ID);
        }
        self.library = Some(library);
        Ok(World { sequence, forest })
    }

    pub(crate) fn runner<'b>(&self, world: &'b World) -> Runner<'b>
    where
        'a: 'b,
    {
        Runner::new(world.forest.plan(), self.store, self.threads)
    }

    /// Computes everything that a world's frames have in common. The result is a note for the user.
    pub(crate) fn prove(&self, world: &World) -> Result<Option<String>, Error> {
        let note = prove(&world.sequence.config, &world.forest, &self.runner(world));
        note.map_err(|e| e.in_sequence(world.sequence.number, self.sequences.len()))
    }
}
