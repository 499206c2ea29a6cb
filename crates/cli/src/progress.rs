//! What the user sees: a bar on a terminal, plain lines otherwise.

use std::io::{self, IsTerminal, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use nemoral_pipeline::{Done, Observer};

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

/// Reports a run to a person.
pub(crate) struct Reporter {
    bar: Option<ProgressBar>,
    quiet: bool,
    sequences: u32,
    started: Instant,
    last_line: Mutex<Option<Instant>>,
    bytes: Mutex<u64>,
    /// Printed with the first frame, so that a request that is refused prints its reason and
    /// nothing else.
    with_first: Mutex<Vec<String>>,
}

impl Reporter {
    /// Reports a run of this number of frames of so many sequences.
    pub(crate) fn new(frames: u64, sequences: u32, quiet: bool) -> Self {
        let bar = (!quiet && io::stderr().is_terminal()).then(|| {
            let bar = ProgressBar::new(frames);
            let template = "{bar:32} {pos}/{len} frames  {msg}  {eta} left";
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style);
            }
            bar.set_message("growing the forest");
            bar.enable_steady_tick(Duration::from_millis(250));
            bar
        });
        Self {
            bar,
            quiet,
            sequences,
            started: Instant::now(),
            last_line: Mutex::new(None),
            bytes: Mutex::new(0),
            with_first: Mutex::default(),
        }
    }

    /// Notes something with the first frame.
    pub(crate) fn note_with_first(&self, message: String) {
        self.with_first
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
            .push(message);
    }

    fn line(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.println(text),
            None if self.quiet => {}
            None => {
                let _ = writeln!(io::stderr(), "{text}");
            }
        }
    }

    /// Ends the report, with a last line if there is something to say.
    pub(crate) fn finish(&self, text: &str) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        if !text.is_empty() {
            self.line(text);
        }
    }

    /// Megabytes written and seconds taken.
    pub(crate) fn totals(&self) -> (f64, f64) {
        let bytes = *self
            .bytes
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        (bytes as f64 / 1e6, self.started.elapsed().as_secs_f64())
    }
}

impl Observer for Reporter {
    fn note(&self, message: &str) {
        self.line(&format!("note: {message}"));
    }

    fn frame(&self, done: Done) {
        *self
            .bytes
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner) += done.bytes;
        let first = std::mem::take(
            &mut *self
                .with_first
                .lock()
                .unwrap_or_else(std::sync::PoisonError::into_inner),
        );
        for message in first {
            self.note(&message);
        }
        let elapsed = self.started.elapsed().as_secs_f64();
        let rate = elapsed / done.count as f64;
        if let Some(bar) = &self.bar {
            bar.set_position(done.count);
            bar.set_message(format!("{rate:.2} s a frame"));
            return;
        }
        // Logs of long runs stay short: a line a second, and the last.
        let mut last = self
            .last_line
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
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
