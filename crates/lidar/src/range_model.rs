//! The port to models of range measurement.

use nemoral_scene::EchoObservation;
use nemoral_seed::Key;

/// How a scanner's receiver measures ranges. Any `Fn(&EchoObservation, Key) -> Option<f64>` is one.
pub trait RangeModel: Send + Sync {
    /// The measured range in metres, finite and at least 0, or `None` if the echo is not seen. A
    /// scanner takes another number for `None`, too. A range may be beyond the scanner's, which
    /// limits what echoes there are, not what is measured wrong.
    ///
    /// `key` is this echo's own, and the only source of randomness.
    fn measure(&self, o: &EchoObservation, key: Key) -> Option<f64>;

    /// Measures many echoes, each with its key. Models that measure many faster than one by one
    /// override this; each range must be what [`measure`](Self::measure) returns, to the bit.
    fn measure_each(&self, os: &[EchoObservation], keys: &[Key], ranges_m: &mut [Option<f64>]) {
        for ((o, key), range_m) in os.iter().zip(keys).zip(ranges_m) {
            *range_m = self.measure(o, *key);
        }
    }
}

impl<F> RangeModel for F
where
    F: Fn(&EchoObservation, Key) -> Option<f64> + Send + Sync,
{
    fn measure(&self, o: &EchoObservation, key: Key) -> Option<f64> {
        self(o, key)
    }
}

/// Measures every echo exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExactRange;

impl RangeModel for ExactRange {
    fn measure(&self, o: &EchoObservation, _: Key) -> Option<f64> {
        Some(o.range_m)
    }
}
