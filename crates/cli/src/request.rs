//! What several commands ask for in the same way: sequences, threads, the cache.

use std::path::Path;
use std::sync::Arc;

use etcetera::BaseStrategy;
use nemoral_pipeline::config::{ConfigLayers, Sequences};
use nemoral_pipeline::plan::Cache;
use nemoral_pipeline::{Backend, Recorder};

use crate::arguments::{CacheArgs, SequenceArgs, World};
use crate::failure::Failure;

/// The sequences that are asked for.
pub(crate) fn load(world: &World) -> Result<Sequences, Failure> {
    Ok(layers(world).sequences()?)
}

/// What a command line asks for, in layers.
pub(crate) fn layers(world: &World) -> ConfigLayers {
    let mut settings = world.settings.clone();
    settings.extend(world.seed.map(|seed| format!("seed={seed}")));
    settings.extend(world.sequences.map(|n| format!("sequences={n}")));
    ConfigLayers {
        preset: world.preset.clone(),
        file: world.config.clone(),
        settings,
    }
}

/// A recorder of one sequence, and a message if the cache cannot be used although one was wanted.
pub(crate) fn recorder(
    of: &SequenceArgs,
    program: Option<&Path>,
) -> Result<(Recorder, Option<String>), Failure> {
    let sequence = load(&of.world)?.get(of.sequence)?;
    let (cache, no_cache) = cache(&of.cache_args, program);
    let recorder = Recorder::new(sequence, Backend::Cpu, cache, threads(&of.world)?)?;
    Ok((recorder, no_cache))
}

/// The number of threads to use, which is handed to rayon.
pub(crate) fn threads(world: &World) -> Result<usize, Failure> {
    let threads = match world.threads {
        Some(n) => n as usize,
        None => std::thread::available_parallelism().map_or(1, Into::into),
    };
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .map_err(|e| Failure {
            message: format!("cannot start threads: {e}"),
            is_request: false,
        })?;
    Ok(threads)
}

/// The cache folder, and a message if it cannot be used although one was wanted.
pub(crate) fn cache(
    cache_args: &CacheArgs,
    program: Option<&Path>,
) -> (Option<Arc<Cache>>, Option<String>) {
    if cache_args.no_cache {
        return (None, None);
    }
    let of_user = || etcetera::choose_base_strategy().map(|base| base.cache_dir().join("nemoral"));
    let folder = match &cache_args.cache {
        Some(folder) => folder.clone(),
        None => match of_user() {
            Ok(folder) => folder,
            // There is no home folder, hence no user to store anything for.
            Err(_) => return (None, None),
        },
    };
    let opened = match program {
        Some(program) => Cache::open_for(&folder, program),
        None => Cache::open(&folder),
    };
    match opened {
        Ok(cache) => (Some(Arc::new(cache)), None),
        Err(e) => {
            let folder = folder.display();
            let note = format!("cannot keep grown trees in {folder}: {e}; --cache DIR elsewhere");
            (None, Some(note))
        }
    }
}
