//! The worlds of the sequences of a request, and how their plants and pictures are made.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use etcetera::BaseStrategy;
use nemoral_dataset::SequenceSpec;
use nemoral_pipeline::config::{Config, Sequences};
use nemoral_pipeline::plan::Cache;
use nemoral_pipeline::{Backend, BackendChoice, Recorder};
use nemoral_scene::Ontology;

use crate::failure::Failure;

/// The most worlds that are kept at a time: the current one and the next one.
const WORLDS: usize = 2;

/// The renderer of pictures.
pub(crate) fn backend_of(name: &str, config: &Config) -> Result<Backend, Failure> {
    let choice = match name {
        "auto" => BackendChoice::Auto,
        "cpu" => BackendChoice::Cpu,
        "gpu" => BackendChoice::Gpu,
        _ => {
            let (name, allowed) = (format!("{name:?}"), "\"auto\", \"cpu\" or \"gpu\"");
            return Err(Failure::argument("backend", name, allowed));
        }
    };
    Ok(Backend::for_config(choice, config)?.0)
}

/// Where grown plants are kept between runs: a folder; the user's own if it is empty; nowhere if
/// there is none.
#[derive(Clone, Debug)]
pub(crate) struct CacheLocation {
    pub(crate) cache: Option<PathBuf>,
    /// The file of this module, by whose content values are told from those of other versions.
    pub(crate) program: PathBuf,
}

impl CacheLocation {
    /// The cache. Without one, plants are grown again; so it is no error if it cannot be used.
    pub(crate) fn cache(&self) -> Option<Arc<Cache>> {
        let mut folder = self.cache.clone()?;
        if folder.as_os_str().is_empty() {
            folder = match std::env::var_os("NEMORAL_CACHE") {
                Some(folder) => folder.into(),
                None => {
                    let base = etcetera::choose_base_strategy().ok()?;
                    base.cache_dir().join("nemoral")
                }
            };
        }
        let cache = Cache::open_for(folder, &self.program).ok()?;
        Some(Arc::new(cache))
    }
}

/// The worlds of a request's sequences, of which the latest are kept.
pub(crate) struct Worlds {
    pub(crate) sequences: Sequences,
    pub(crate) ontology: Arc<Ontology>,
    pub(crate) backend: Backend,
    pub(crate) cache: Option<Arc<Cache>>,
    /// The latest last.
    pub(crate) grown: Mutex<Vec<Arc<World>>>,
}

/// The grown world of a sequence.
pub(crate) struct World {
    pub(crate) number: u32,
    pub(crate) recorder: Recorder,
    pub(crate) spec: Arc<SequenceSpec>,
}

impl Worlds {
    pub(crate) fn grown(&self) -> MutexGuard<'_, Vec<Arc<World>>> {
        self.grown.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What a data set's manifest says about a sequence. Its world is not grown for that, so that
    /// none of the worlds that are kept goes.
    pub(crate) fn spec(&self, number: u32) -> Result<Arc<SequenceSpec>, Failure> {
        let grown = self.grown().iter().find(|w| w.number == number).cloned();
        if let Some(world) = grown {
            return Ok(Arc::clone(&world.spec));
        }
        let sequence = self.sequences.get(number)?;
        let recorder = Recorder::new(sequence, self.backend.clone(), None, 1)?;
        Ok(Arc::new(recorder.spec().clone()))
    }

    /// The world of a sequence.
    pub(crate) fn get(&self, number: u32) -> Result<Arc<World>, Failure> {
        let mut grown = self.grown();
        if let Some(i) = grown.iter().position(|w| w.number == number) {
            let world = grown.remove(i);
            grown.push(Arc::clone(&world));
            return Ok(world);
        }
        let last = grown.last().cloned();
        drop(grown);
        let sequence = self.sequences.get(number)?;
        let (backend, cache) = (self.backend.clone(), self.cache.clone());
        // Whoever uses it says by how many threads.
        let mut recorder = Recorder::new(sequence, backend, cache, 1)?;
        if let Some(last) = last {
            recorder = recorder.with_plants_of(&last.recorder);
        }
        let world = Arc::new(World {
            number,
            spec: Arc::new(recorder.spec().clone()),
            recorder,
        });
        let mut grown = self.grown();
        if let Some(theirs) = grown.iter().find(|w| w.number == number) {
            return Ok(Arc::clone(theirs));
        }
        grown.push(Arc::clone(&world));
        let surplus = grown.len().saturating_sub(WORLDS);
        let dropped: Vec<_> = grown.drain(..surplus).collect();
        drop(grown);
        drop(dropped);
        Ok(world)
    }
}
