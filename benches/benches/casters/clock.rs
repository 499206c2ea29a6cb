//! Processor time, in which other processes do not count.

use cpu_time::ProcessTime;

/// Processor seconds that `work` takes. Only one thread at a time may do it: this one or the
/// pool's.
pub(crate) fn seconds(work: impl FnOnce()) -> f64 {
    let start = ProcessTime::now();
    work();
    start.elapsed().as_secs_f64()
}
