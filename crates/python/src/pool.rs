//! The thread pool of this process. A forked process has none of its parent's threads, and gets a
//! pool of its own.

use std::process;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

static POOL: Mutex<Option<Current>> = Mutex::new(None);
/// How many threads are at work.
static BUSY: AtomicUsize = AtomicUsize::new(0);
/// Whether this process was forked while its parent's threads were at work.
static IS_TORN: AtomicBool = AtomicBool::new(false);

struct Current {
    process: u32,
    pool: Arc<ThreadPool>,
}

/// Counts a thread at work.
pub(crate) struct Busy(u32);

impl Busy {
    pub(crate) fn new() -> Self {
        BUSY.fetch_add(1, Ordering::SeqCst);
        Self(process::id())
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        if self.0 == process::id() {
            BUSY.fetch_sub(1, Ordering::SeqCst);
        }
    }
}

/// Makes sure that there is a pool, and gives it.
pub(crate) fn ready() -> PyResult<Arc<ThreadPool>> {
    pool_of(None)
}

fn pool_of(threads: Option<usize>) -> PyResult<Arc<ThreadPool>> {
    let mut current = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let here = process::id();
    let count = match &*current {
        Some(c) if c.process == here && threads.is_none() => return Ok(Arc::clone(&c.pool)),
        Some(c) => threads.unwrap_or(c.pool.current_num_threads()),
        None => threads.unwrap_or(0),
    };
    let pool = ThreadPoolBuilder::new().num_threads(count).build();
    let pool = pool.map_err(|e| PyRuntimeError::new_err(format!("cannot start threads: {e}")))?;
    let pool = Arc::new(pool);
    let before = nemoral_pipeline::use_thread_pool(Some(Arc::clone(&pool)));
    let old = current.replace(Current {
        process: here,
        pool: Arc::clone(&pool),
    });
    if let Some(old) = old.filter(|old| old.process != here) {
        IS_TORN.store(BUSY.swap(0, Ordering::SeqCst) > 0, Ordering::SeqCst);
        // Its threads do not exist here, so it cannot be ended.
        std::mem::forget((old, before));
    }
    Ok(pool)
}

/// How many threads this process computes with.
#[pyfunction]
pub(crate) fn threads(py: Python<'_>) -> PyResult<usize> {
    py.detach(|| Ok(ready()?.current_num_threads()))
}

/// Computes with this number of threads from now on.
#[pyfunction]
pub(crate) fn set_threads(py: Python<'_>, threads: usize) -> PyResult<()> {
    if !(1..=1024).contains(&threads) {
        let message = format!("threads = {threads}: must be 1 to 1024");
        return Err(PyValueError::new_err(message));
    }
    py.detach(|| pool_of(Some(threads)).map(drop))
}

/// Whether this process was forked while threads of its parent were at work, so that what they
/// were working on is not usable here.
#[pyfunction]
pub(crate) fn process_changed(py: Python<'_>) -> PyResult<bool> {
    py.detach(ready)?;
    Ok(IS_TORN.load(Ordering::SeqCst))
}
