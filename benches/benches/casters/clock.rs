//! Time of the calling thread on a processor: what other processes do beside it does not count.

use cpu_time::ThreadTime;

/// Seconds of this thread that `work` takes.
pub(crate) fn seconds(work: impl FnOnce()) -> f64 {
    let start = ThreadTime::now();
    work();
    start.elapsed().as_secs_f64()
}
