//! Time on a processor: what other processes do beside this one does not count.

use cpu_time::ProcessTime;

/// Seconds that `work` takes, which is done by one thread at a time: this one or the pool's.
pub(crate) fn seconds(work: impl FnOnce()) -> f64 {
    let start = ProcessTime::now();
    work();
    start.elapsed().as_secs_f64()
}
