//! The port to whatever measures ranges.

use nemoral_seed::Key;

/// The echo of one pulse, as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EchoObservation {
    /// True distance to the surface, metres.
    pub range_m: f64,
    /// Cosine of the angle between beam and surface normal, 1 (head-on) to 0.
    pub incidence_cos: f64,
    /// Diffuse reflectance at the laser's wavelength, 0..1.
    pub reflectance: f64,
}

/// How a scanner's receiver measures: any `Fn(&EchoObservation, Key) -> Option<f64>`.
pub trait RangeModel: Send + Sync {
    /// The measured range in metres, finite and at least 0, or `None` if the echo is not seen.
    ///
    /// `key` is this pulse's own: randomness comes from nowhere else.
    fn measure(&self, o: &EchoObservation, key: Key) -> Option<f64>;

    /// The same of many echoes, each with its key. Models that measure many quicker than one by one override
    /// this; each is what [`measure`](Self::measure) says, to the bit.
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
