//! Requests that tests make data sets of, in a small world.

use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

use nemoral_dataset::{Dataset, OpenMode};
use nemoral_pipeline::config::{self, ConfigLayers, Sequences};
use nemoral_pipeline::{
    Backend, Error, FrameSelection, FrameWritten, GenerateParams, Observer, SequenceFrames,
    generate,
};
use nemoral_realism::grown;

/// The sequences of the preset `demo` with these settings.
pub(crate) fn sequences(settings: &[&str]) -> Result<Sequences, config::Error> {
    let layers = ConfigLayers {
        preset: Some("demo".to_owned()),
        settings: settings.iter().map(|&s| s.to_owned()).collect(),
        ..ConfigLayers::default()
    };
    layers.sequences()
}

/// Why these settings are refused.
pub(crate) fn refused(settings: &[&str]) -> String {
    let refused = sequences(settings).and_then(|all| all.get(0)).map(|_| ());
    refused.expect_err("is refused").to_string()
}

/// What a run tells its user.
#[derive(Default)]
pub(crate) struct Notes(pub(crate) Mutex<Vec<String>>);

impl Observer for Notes {
    fn note(&self, message: &str) {
        self.0.lock().expect("no panic").push(message.to_owned());
    }

    fn frame(&self, _: FrameWritten) {}
}

/// Makes the first frames of a request. Also returns what is told.
pub(crate) fn recorded(
    out: &Path,
    frames: u64,
    settings: &[&str],
) -> Result<(Dataset, String), Error> {
    let params = GenerateParams {
        sequences: sequences(settings)?,
        frames: SequenceFrames::new(FrameSelection::first(frames), 1),
        out: out.to_owned(),
        mode: OpenMode::Fresh,
        is_shard: false,
        threads: 2,
        backend: Backend::Cpu,
        cache: grown(),
    };
    let notes = Notes::default();
    generate(&params, &notes, &AtomicBool::new(false))?;
    let told = notes.0.into_inner().expect("no panic").join("\n");
    Ok((Dataset::open(out)?, told))
}
