//! The commands of the program as functions.

use std::ffi::OsString;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nemoral_convert::{ClassMapping, ConversionSummary, ConvertParams, FormatName, OutputMode};
use nemoral_dataset::{
    Cloud, CloudParams, CloudPoses, FrameProgress, MergeParams, OpenMode, ProgressMonitor,
    Quantiles,
};
use nemoral_pipeline::{FrameSelection, FrameWritten, GenerateParams, Observer, SequenceFrames};
use pyo3::prelude::*;
use pyo3::types::PyList;
use serde_json::json;

use crate::config;
use crate::failure::Failure;
use crate::work::{self, Event, Tell};
use crate::worlds::{CacheLocation, backend_of};

/// Runs the program with these arguments, the first of which is its name; the result is its exit
/// code. `program` is the file of this module.
#[pyfunction]
pub(crate) fn run_program(py: Python<'_>, arguments: Vec<OsString>, program: PathBuf) -> u8 {
    py.detach(|| nemoral_cli::run(arguments, Some(program.as_path())))
}

/// Hands what a run tells to the calling thread.
struct Reporter(Tell);

impl Observer for Reporter {
    fn note(&self, message: &str) {
        (self.0)(Event::Note(message.to_owned()));
    }

    fn frame(&self, done: FrameWritten) {
        (self.0)(Event::Frame {
            done: done.count,
            total: done.total,
            sequence: done.sequence,
            frame: done.frame,
        });
    }

    fn converting(&self, _: FormatName, frame: FrameProgress) {
        (self.0)(event(frame));
    }

    fn converted(&self, format: FormatName, folder: &Path, converted: ConversionSummary) {
        (self.0)(Event::Note(format!("as {format} in {}", folder.display())));
        for note in converted.notes {
            (self.0)(Event::Note(format!("{format}: {note}")));
        }
    }
}

fn event(done: FrameProgress) -> Event {
    Event::Frame {
        done: done.done,
        total: done.total,
        sequence: done.sequence,
        frame: done.frame,
    }
}

/// Hands the progress of work on a data set to the calling thread, and ends the work if that wants
/// it to end.
fn monitor(tell: &Tell, stop: &Arc<AtomicBool>) -> ProgressMonitor {
    let (tell, stop) = (Arc::clone(tell), Arc::clone(stop));
    ProgressMonitor::new(move |done| {
        tell(event(done));
        match stop.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    })
}

/// Makes a data set; the result is how many frames it has. `frames` are half-open ranges of each
/// sequence; all if none. `shard` is (index, count).
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the keywords of one function")]
pub(crate) fn generate(
    py: Python<'_>,
    preset: Option<String>,
    file: Option<PathBuf>,
    settings: &Bound<'_, PyList>,
    out: PathBuf,
    frames: Option<Vec<(u64, u64)>>,
    shard: Option<(u64, u64)>,
    mode: &str,
    backend: &str,
    cache: Option<PathBuf>,
    program: PathBuf,
    progress: Option<Py<PyAny>>,
) -> PyResult<u64> {
    let request = config::Request::new(preset, file, settings)?;
    let mode = open_mode(mode).map_err(|e| e.raise(py))?;
    let backend = backend.to_owned();
    let location = CacheLocation { cache, program };
    let threads = crate::pool::threads(py)?;
    work::run_stoppable(py, progress, move |tell, stop| {
        let sequences = request.sequences()?;
        let config = sequences.get(0)?.config;
        let of_each = match &frames {
            Some(ranges) => ranges.iter().map(|&(from, to)| from..to).collect(),
            None => FrameSelection::first(config.frames),
        };
        let mut frames = SequenceFrames::new(of_each, sequences.len());
        if let Some((index, count)) = shard {
            if index >= count {
                let allowed = "(index, count) with 0 <= index < count";
                let found = format!("({index}, {count})");
                return Err(Failure::argument("shard", found, allowed));
            }
            frames = frames.shard(index, count);
        }
        let params = GenerateParams {
            backend: backend_of(&backend, &config)?,
            sequences,
            frames,
            out,
            mode,
            is_shard: shard.is_some(),
            threads,
            cache: location.cache(),
        };
        let reporter = Reporter(Arc::clone(tell));
        let manifest = nemoral_pipeline::generate(&params, &reporter, stop)?;
        Ok(manifest.frames.len() as u64)
    })
}

fn open_mode(mode: &str) -> Result<OpenMode, Failure> {
    match mode {
        "fresh" => Ok(OpenMode::Fresh),
        "resume" => Ok(OpenMode::Resume),
        "overwrite" => Ok(OpenMode::Overwrite),
        _ => Err(Failure::argument(
            "mode",
            format!("{mode:?}"),
            "\"fresh\", \"resume\" or \"overwrite\"",
        )),
    }
}

/// Whether a data set passed, the report in words, and each problem: its file, and what is wrong.
type Checked = (bool, String, Vec<(String, String)>);

/// Checks a data set.
#[pyfunction]
pub(crate) fn check(
    py: Python<'_>,
    dir: PathBuf,
    progress: Option<Py<PyAny>>,
) -> PyResult<Checked> {
    work::run_stoppable(py, progress, move |tell, stop| {
        let report = nemoral_dataset::check_with_progress(&dir, &monitor(tell, stop))?;
        let problems = report.problems.iter();
        let mut problems: Vec<_> = problems
            .map(|p| (p.path.clone(), p.message.clone()))
            .collect();
        let failures = report.agreement.failures().into_iter();
        problems.extend(failures.map(|f| ("agreement".to_owned(), f.to_string())));
        Ok((report.passed(), report.to_string(), problems))
    })
}

/// The statistics of a data set as JSON, and in words.
#[pyfunction]
pub(crate) fn stats(
    py: Python<'_>,
    dir: PathBuf,
    progress: Option<Py<PyAny>>,
) -> PyResult<(String, String)> {
    work::run_stoppable(py, progress, move |tell, stop| {
        let stats = nemoral_dataset::stats_with_progress(&dir, &monitor(tell, stop))?;
        let quantiles = |q: Option<Quantiles>| {
            q.map(|q| {
                json!({
                    "min": q.min, "p05": q.p05, "median": q.median, "p95": q.p95, "max": q.max,
                })
            })
        };
        let classes = stats
            .classes
            .iter()
            .map(|c| json!({ "id": c.id, "name": c.name, "pixels": c.pixels, "points": c.points }));
        let all = json!({
            "sequences": stats.sequences,
            "frames": stats.frames,
            "bytes": stats.bytes,
            "classes": classes.collect::<Vec<_>>(),
            "trees": stats.trees,
            "measured_trees": stats.measured_trees,
            "dbh_m": quantiles(stats.dbh_m),
            "tree_height_m": quantiles(stats.tree_height_m),
            "depth_m": quantiles(stats.depth_m),
            "range_m": quantiles(stats.range_m),
            "overlap": quantiles(stats.overlap),
            "balance": stats.balance.iter().map(|b| json!({
                "name": b.name, "goal": b.goal, "before": b.before, "after": b.after,
            })).collect::<Vec<_>>(),
        });
        Ok((all.to_string(), stats.to_string()))
    })
}

/// Joins shards; the result is how many frames there are.
#[pyfunction]
pub(crate) fn merge(
    py: Python<'_>,
    parts: Vec<PathBuf>,
    out: PathBuf,
    partial: bool,
    mode: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<u64> {
    let mode = open_mode(mode).map_err(|e| e.raise(py))?;
    work::run_stoppable(py, progress, move |tell, stop| {
        let parts: Vec<_> = parts.iter().map(PathBuf::as_path).collect();
        let (params, monitor) = (MergeParams { mode, partial }, monitor(tell, stop));
        let reporter = Reporter(Arc::clone(tell));
        let merged = nemoral_pipeline::merge(&parts, &out, params, &monitor, &reporter, stop)?;
        Ok(merged.frames.len() as u64)
    })
}

/// Writes a registered cloud; the result is how many points it has.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the keywords of one function")]
pub(crate) fn cloud(
    py: Python<'_>,
    dir: PathBuf,
    out: PathBuf,
    voxel_m: Option<f64>,
    pure: bool,
    estimated_poses: bool,
    poses: Option<PathBuf>,
    sequence: Option<u32>,
    only: Vec<String>,
    progress: Option<Py<PyAny>>,
) -> PyResult<u64> {
    let params = CloudParams {
        voxel_m,
        pure,
        poses: match poses {
            Some(file) => CloudPoses::File(file),
            None if estimated_poses => CloudPoses::Estimated,
            None => CloudPoses::True,
        },
        sequence,
        only,
        ..CloudParams::default()
    };
    work::run_stoppable(py, progress, move |tell, stop| {
        let cloud = Cloud::open(&dir, params)?.with_progress(monitor(tell, stop));
        Ok(cloud.write_ply(&out)?)
    })
}

/// Converts a data set; the result is how many frames, files and bytes were written.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the keywords of one function")]
pub(crate) fn convert(
    py: Python<'_>,
    dir: PathBuf,
    out: PathBuf,
    format: &str,
    ontology: Option<String>,
    min_px: u32,
    mode: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<(usize, usize, u64)> {
    let mode = match open_mode(mode).map_err(|e| e.raise(py))? {
        OpenMode::Fresh => OutputMode::Fresh,
        OpenMode::Resume => OutputMode::Resume,
        OpenMode::Overwrite => OutputMode::Overwrite,
    };
    let named = format.parse::<FormatName>();
    let format = named.map_err(|_| {
        let names = FormatName::ALL.map(FormatName::name).join(", ");
        Failure::argument("format", format!("{format:?}"), format!("one of {names}")).raise(py)
    })?;
    work::run_stoppable(py, progress, move |tell, stop| {
        let params = ConvertParams {
            format,
            ontology: ontology.as_deref().map(ClassMapping::load).transpose()?,
            min_px,
            mode,
        };
        let monitor = monitor(tell, stop);
        let done = nemoral_convert::convert_with_progress(&dir, &out, &params, &monitor)?;
        for note in done.notes {
            tell(Event::Note(note));
        }
        Ok((done.frames, done.files, done.bytes))
    })
}

/// Writes the page of a data set; the result is its frames and the page's bytes.
#[pyfunction]
pub(crate) fn report(py: Python<'_>, dir: PathBuf, out: PathBuf) -> PyResult<(usize, usize)> {
    work::run(py, move || {
        let made = nemoral_report::report(&dir, &out)?;
        Ok((made.frames, made.bytes))
    })
}
