//! Long work on a thread of its own, while the calling thread looks after signals and progress.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::failure::Failure;
use crate::pool;

/// How often the calling thread looks for signals.
const LOOK: Duration = Duration::from_millis(50);
/// As deep as the main thread of a program.
const STACK_BYTES: usize = 8 << 20;

/// What long work tells: the arguments of a call of the progress function.
pub(crate) enum Event {
    /// Something that the user should know.
    Note(String),
    /// A frame is done: how many are done of how many.
    Frame {
        done: u64,
        total: u64,
        sequence: u32,
        frame: u64,
    },
}

/// Tells about the progress of work; nobody need listen.
pub(crate) type Tell = Arc<dyn Fn(Event) + Send + Sync>;

enum Message<T> {
    Event(Event),
    Done(Result<T, Failure>),
}

/// Does long work without the interpreter's lock. An interrupt (Ctrl-C) is raised at once, and the
/// work goes on in the background, where its result is kept or dropped.
pub(crate) fn run<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    attend(py, None, None, |_| work())
}

/// The same for work that can be asked to stop, which it then does at the next frame, and that
/// tells about its progress. `progress` is called with the events; an exception that it raises
/// stops the work, too.
pub(crate) fn run_stoppable<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&Tell, &Arc<AtomicBool>) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    attend(py, Some(stop), progress, move |tell| work(tell, &asked))
}

fn attend<T: Send + 'static>(
    py: Python<'_>,
    stop: Option<Arc<AtomicBool>>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&Tell) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    py.detach(pool::ready)?;
    let (sender, mut receiver) = mpsc::channel();
    let builder = thread::Builder::new().stack_size(STACK_BYTES);
    let worker = builder.spawn(move || labour(&sender, work))?;
    // What the caller is told at the end, if the work was stopped.
    let mut raised = None;
    loop {
        let (message, back) = py.detach(move || (receiver.recv_timeout(LOOK), receiver));
        receiver = back;
        let told = match message {
            Ok(Message::Done(result)) => {
                // Its thread ends now; a second fork may not find it.
                let _ = py.detach(move || worker.join());
                let result = result.map_err(|failure| failure.raise(py));
                return raised.map_or(result, Err);
            }
            Ok(Message::Event(event)) => match &progress {
                Some(progress) if raised.is_none() => tell(py, progress, event),
                _ => Ok(()),
            },
            Err(RecvTimeoutError::Timeout) => Ok(()),
            // The thread ended without a result, which it never does.
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Failure::Other("a thread was lost".to_owned()).raise(py));
            }
        };
        if let Err(error) = told.and_then(|()| py.check_signals()) {
            match &stop {
                Some(stop) if raised.is_none() => {
                    stop.store(true, Ordering::Relaxed);
                    raised = Some(error);
                }
                _ => return Err(error),
            }
        }
    }
}

fn labour<T: Send + 'static>(
    sender: &Sender<Message<T>>,
    work: impl FnOnce(&Tell) -> Result<T, Failure>,
) {
    let _busy = pool::Busy::new();
    let events = sender.clone();
    // A caller that was interrupted does not listen any more.
    let tell: Tell = Arc::new(move |event| {
        let _ = events.send(Message::Event(event));
    });
    let result = catch_unwind(AssertUnwindSafe(|| work(&tell)));
    let result = result.unwrap_or_else(|panic| Err(broken(&*panic)));
    let _ = sender.send(Message::Done(result));
}

/// Short work without the interpreter's lock, on the calling thread. It may compute in the pool,
/// but must not hold a lock there that another caller may wait for in the pool.
pub(crate) fn brief<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&ThreadPool) -> Result<T, Failure> + Send,
) -> PyResult<T> {
    let result = py.detach(|| {
        let pool = pool::ready()?;
        let _busy = pool::Busy::new();
        let result = catch_unwind(AssertUnwindSafe(|| work(&pool)));
        Ok::<_, PyErr>(result.unwrap_or_else(|panic| Err(broken(&*panic))))
    })?;
    result.map_err(|failure| failure.raise(py))
}

/// A panic is a defect of the program, and no reason to end its user's.
fn broken(panic: &(dyn Any + Send)) -> Failure {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
    let text = text.unwrap_or("no message");
    Failure::Other(format!(
        "this is a defect of nemoral, please report it: {text}"
    ))
}

fn tell(py: Python<'_>, progress: &Py<PyAny>, event: Event) -> PyResult<()> {
    match event {
        Event::Note(note) => progress.call_method1(py, "note", (note,))?,
        Event::Frame {
            done,
            total,
            sequence,
            frame,
        } => progress.call_method1(py, "frame", (done, total, sequence, frame))?,
    };
    Ok(())
}
