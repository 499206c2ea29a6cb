//! What the user sees: a bar on a terminal, plain lines otherwise.

use std::io::{self, IsTerminal};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use nemoral_convert::{ConversionSummary, FormatName};
use nemoral_dataset::{FrameProgress, ProgressMonitor};
use nemoral_pipeline::{FrameWritten, Observer, RunTimings};
use serde_json::{Value, json};

use crate::arguments::{Progress, ProgressArgs};
use crate::terminal::{harmless, print_data, say, tell};

/// Where a run is reported.
enum Report {
    Nowhere,
    Bar(ProgressBar),
    Lines,
    Json,
}

impl Report {
    fn choose(progress_args: ProgressArgs, bar: impl FnOnce() -> ProgressBar) -> Self {
        match progress_args.progress {
            _ if progress_args.quiet => Self::Nowhere,
            Progress::Auto if io::stderr().is_terminal() => Self::Bar(bar()),
            Progress::Auto | Progress::Lines => Self::Lines,
            Progress::Json => Self::Json,
        }
    }
}

/// Reports a run to a person, or to a program.
pub(crate) struct Reporter {
    report: Report,
    names_sequences: bool,
    started: Instant,
    /// The other format that is being written, and since when.
    converting: Mutex<Option<(FormatName, Instant)>>,
    last_line: Mutex<Option<Instant>>,
    bytes: Mutex<u64>,
    timings: Mutex<RunTimings>,
    /// Printed with the first frame, so that a request that is refused prints its reason and
    /// nothing else.
    with_first: Mutex<Vec<String>>,
}

impl Reporter {
    /// Reports a run of this number of frames of so many sequences.
    pub(crate) fn new(frames: u64, sequences: u32, progress_args: ProgressArgs) -> Self {
        Self::begin(
            "growing the forest",
            Some(frames),
            sequences > 1,
            progress_args,
        )
    }

    /// Reports work on a data set, whose frames it learns from [`monitor`](Self::monitor); `doing`
    /// is what a terminal shows until the first one is done.
    pub(crate) fn of_data_set(doing: &'static str, progress_args: ProgressArgs) -> Arc<Self> {
        Arc::new(Self::begin(doing, None, true, progress_args))
    }

    fn begin(
        doing: &'static str,
        frames: Option<u64>,
        names_sequences: bool,
        progress_args: ProgressArgs,
    ) -> Self {
        let bar = || {
            let bar = frames.map_or_else(ProgressBar::no_length, ProgressBar::new);
            let template = "{bar:32} {pos}/{len} frames  {msg}  {eta} left";
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style);
            }
            bar.set_message(doing);
            bar.enable_steady_tick(Duration::from_millis(250));
            bar
        };
        Self {
            report: Report::choose(progress_args, bar),
            names_sequences,
            started: Instant::now(),
            converting: Mutex::default(),
            last_line: Mutex::new(None),
            bytes: Mutex::new(0),
            timings: Mutex::default(),
            with_first: Mutex::default(),
        }
    }

    /// What reports each frame of a data set that work is done with.
    pub(crate) fn monitor(self: &Arc<Self>) -> ProgressMonitor {
        let reporter = Arc::clone(self);
        ProgressMonitor::new(move |done| {
            reporter.reach(done, None);
            ControlFlow::Continue(())
        })
    }

    /// Notes something with the first frame.
    pub(crate) fn note_with_first(&self, message: String) {
        lock(&self.with_first).push(message);
    }

    fn line(&self, text: &str) {
        match &self.report {
            Report::Bar(bar) => bar.println(harmless(text)),
            Report::Lines => tell(text),
            Report::Nowhere | Report::Json => {}
        }
    }

    /// Writes an event for a program. If nobody reads it any more, the run goes on.
    fn event(&self, event: &Value) {
        let _ = print_data(&event.to_string());
    }

    /// Takes the bar away; an error or the answer follows.
    pub(crate) fn clear(&self) {
        if let Report::Bar(bar) = &self.report {
            bar.finish_and_clear();
        }
    }

    /// Ends the report of work on a data set: `answer` is for a person, and `facts`, an object, for
    /// a program.
    pub(crate) fn answer(&self, answer: &str, mut facts: Value) -> io::Result<()> {
        self.clear();
        match self.report {
            Report::Nowhere => Ok(()),
            Report::Bar(_) | Report::Lines => say(answer),
            Report::Json => {
                facts["event"] = "done".into();
                facts["elapsed_s"] = self.started.elapsed().as_secs_f64().into();
                self.event(&facts);
                Ok(())
            }
        }
    }

    /// Ends the report of a run whose data set now has this number of frames.
    pub(crate) fn finish(&self, frames: usize, out: &Path) {
        self.clear();
        let (megabytes, seconds) = self.totals();
        let out = out.display();
        if let Report::Json = self.report {
            let (bytes, timings) = (*lock(&self.bytes), *lock(&self.timings));
            self.event(&json!({
                "event": "done",
                "frames": frames,
                "out": out.to_string(),
                "bytes": bytes,
                "elapsed_s": seconds,
                "growing_s": timings.growing.as_secs_f64(),
                "sensors_s": timings.sensors.as_secs_f64(),
            }));
        }
        self.line(&format!(
            "{frames} frames in {out}, {megabytes:.1} MB written in {seconds:.1} s"
        ));
    }

    /// Megabytes written and seconds taken.
    fn totals(&self) -> (f64, f64) {
        let bytes = *lock(&self.bytes);
        (bytes as f64 / 1e6, self.started.elapsed().as_secs_f64())
    }

    /// Reports a frame that is done, and what was written of it if it was recorded.
    fn reach(&self, at: FrameProgress, recorded: Option<&FrameWritten>) {
        let elapsed = self.started.elapsed().as_secs_f64();
        let (format, since) = lock(&self.converting).unzip();
        let since = since.unwrap_or(self.started);
        let rate = since.elapsed().as_secs_f64() / at.done as f64;
        if let Report::Json = self.report {
            let mut event = json!({
                "event": "frame",
                "sequence": at.sequence,
                "frame": at.frame,
                "done": at.done,
                "total": at.total,
                "elapsed_s": elapsed,
            });
            if let Some(format) = format {
                event["format"] = format.name().into();
            }
            if let Some(recorded) = recorded {
                event["bytes"] = recorded.bytes.into();
                event["resumed"] = recorded.resumed.into();
            }
            self.event(&event);
            return;
        }
        if let Report::Bar(bar) = &self.report {
            bar.set_length(at.total);
            bar.set_position(at.done);
            let as_format = format.map_or_else(String::new, |f| format!("as {f}, "));
            bar.set_message(format!("{as_format}{rate:.2} s a frame"));
            return;
        }
        // Logs of long runs stay short: a line a second, and the last.
        let mut last = lock(&self.last_line);
        let due = last.is_none_or(|t| t.elapsed() >= Duration::from_secs(1));
        if due || at.done == at.total {
            *last = Some(Instant::now());
            let left = rate * (at.total - at.done) as f64;
            let mut of = format.map_or_else(String::new, |f| format!("as {f}: "));
            if self.names_sequences {
                of += &format!("sequence {}, ", at.sequence);
            }
            let was_there = recorded.is_some_and(|r| r.resumed);
            let kept = if was_there { " (was there)" } else { "" };
            self.line(&format!(
                "{of}frame {}{kept}: {} of {}, {rate:.2} s a frame, {left:.0} s left",
                at.frame, at.done, at.total
            ));
        }
    }
}

/// A panic of another thread leaves these values consistent, as every change is one statement.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Observer for Reporter {
    fn note(&self, message: &str) {
        if let Report::Json = self.report {
            self.event(&json!({ "event": "note", "message": message }));
        }
        self.line(&format!("note: {message}"));
    }

    fn timings(&self, timings: RunTimings) {
        *lock(&self.timings) = timings;
    }

    fn converting(&self, format: FormatName, frame: FrameProgress) {
        let mut converting = lock(&self.converting);
        if converting.is_none_or(|(before, _)| before != format) {
            *converting = Some((format, Instant::now()));
        }
        drop(converting);
        self.reach(frame, None);
    }

    fn converted(&self, format: FormatName, folder: &Path, converted: ConversionSummary) {
        *lock(&self.converting) = None;
        let ConversionSummary { files, bytes, .. } = converted;
        let out = folder.display();
        if let Report::Json = self.report {
            self.event(&json!({
                "event": "converted",
                "format": format.name(),
                "frames": converted.frames,
                "out": out.to_string(),
                "files": files,
                "bytes": bytes,
            }));
        }
        let megabytes = bytes as f64 / 1e6;
        self.line(&format!(
            "as {format} in {out}: {files} files, {megabytes:.1} MB"
        ));
        for message in converted.notes {
            self.note(&format!("{format}: {message}"));
        }
    }

    fn frame(&self, done: FrameWritten) {
        *lock(&self.bytes) += done.bytes;
        let first = std::mem::take(&mut *lock(&self.with_first));
        for message in first {
            self.note(&message);
        }
        let at = FrameProgress {
            done: done.count,
            total: done.total,
            sequence: done.sequence,
            frame: done.frame,
        };
        self.reach(at, Some(&done));
    }
}
