//! What the user sees: a bar on a terminal, plain lines otherwise.

use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use nemoral_pipeline::{Done, Observer, Spent};
use serde_json::{Value, json};

use crate::arguments::Progress;

/// Writes an error to standard error.
pub(crate) fn complain(message: &str) {
    let _ = writeln!(io::stderr(), "error: {message}");
}

/// Writes a note to standard error.
pub(crate) fn note(message: &str) {
    let _ = writeln!(io::stderr(), "note: {message}");
}

/// Writes a line to standard output. A closed pipe is no error, as the reader wants no more.
pub(crate) fn say(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout();
    match writeln!(stdout, "{text}").and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(e),
        _ => Ok(()),
    }
}

/// Where a run is reported.
enum Report {
    Nowhere,
    Bar(ProgressBar),
    Lines,
    Json,
}

/// Reports a run to a person, or to a program.
pub(crate) struct Reporter {
    report: Report,
    sequences: u32,
    started: Instant,
    last_line: Mutex<Option<Instant>>,
    bytes: Mutex<u64>,
    spent: Mutex<Spent>,
    /// Printed with the first frame, so that a request that is refused prints its reason and
    /// nothing else.
    with_first: Mutex<Vec<String>>,
}

impl Reporter {
    /// Reports a run of this number of frames of so many sequences.
    pub(crate) fn new(frames: u64, sequences: u32, progress: Progress, quiet: bool) -> Self {
        let bar = || {
            let bar = ProgressBar::new(frames);
            let template = "{bar:32} {pos}/{len} frames  {msg}  {eta} left";
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style);
            }
            bar.set_message("growing the forest");
            bar.enable_steady_tick(Duration::from_millis(250));
            bar
        };
        let report = match progress {
            _ if quiet => Report::Nowhere,
            Progress::Auto if io::stderr().is_terminal() => Report::Bar(bar()),
            Progress::Auto | Progress::Lines => Report::Lines,
            Progress::Json => Report::Json,
        };
        Self {
            report,
            sequences,
            started: Instant::now(),
            last_line: Mutex::new(None),
            bytes: Mutex::new(0),
            spent: Mutex::default(),
            with_first: Mutex::default(),
        }
    }

    /// Notes something with the first frame.
    pub(crate) fn note_with_first(&self, message: String) {
        lock(&self.with_first).push(message);
    }

    fn line(&self, text: &str) {
        match &self.report {
            Report::Bar(bar) => bar.println(text),
            Report::Lines => {
                let _ = writeln!(io::stderr(), "{text}");
            }
            Report::Nowhere | Report::Json => {}
        }
    }

    /// Writes an event for a program. If nobody reads it any more, the run goes on.
    fn event(&self, event: &Value) {
        let _ = say(&event.to_string());
    }

    /// Ends the report of a run that failed.
    pub(crate) fn fail(&self) {
        if let Report::Bar(bar) = &self.report {
            bar.finish_and_clear();
        }
    }

    /// Ends the report of a run whose data set now has this number of frames.
    pub(crate) fn finish(&self, frames: usize, out: &Path) {
        self.fail();
        let (megabytes, seconds) = self.totals();
        let out = out.display();
        if let Report::Json = self.report {
            let (bytes, spent) = (*lock(&self.bytes), *lock(&self.spent));
            self.event(&json!({
                "event": "done",
                "frames": frames,
                "out": out.to_string(),
                "bytes": bytes,
                "elapsed_s": seconds,
                "growing_s": spent.growing.as_secs_f64(),
                "sensors_s": spent.sensors.as_secs_f64(),
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

    fn spent(&self, spent: Spent) {
        *lock(&self.spent) = spent;
    }

    fn frame(&self, done: Done) {
        *lock(&self.bytes) += done.bytes;
        let first = std::mem::take(&mut *lock(&self.with_first));
        for message in first {
            self.note(&message);
        }
        let elapsed = self.started.elapsed().as_secs_f64();
        let rate = elapsed / done.count as f64;
        if let Report::Json = self.report {
            self.event(&json!({
                "event": "frame",
                "sequence": done.sequence,
                "frame": done.frame,
                "done": done.count,
                "total": done.total,
                "bytes": done.bytes,
                "resumed": done.resumed,
                "elapsed_s": elapsed,
            }));
            return;
        }
        if let Report::Bar(bar) = &self.report {
            bar.set_position(done.count);
            bar.set_message(format!("{rate:.2} s a frame"));
            return;
        }
        // Logs of long runs stay short: a line a second, and the last.
        let mut last = lock(&self.last_line);
        let due = last.is_none_or(|t| t.elapsed() >= Duration::from_secs(1));
        if due || done.count == done.total {
            *last = Some(Instant::now());
            let left = rate * (done.total - done.count) as f64;
            let of = if self.sequences > 1 {
                format!("sequence {}, ", done.sequence)
            } else {
                String::new()
            };
            let kept = if done.resumed { " (was there)" } else { "" };
            self.line(&format!(
                "{of}frame {}{kept}: {} of {}, {rate:.2} s a frame, {left:.0} s left",
                done.frame, done.count, done.total
            ));
        }
    }
}
