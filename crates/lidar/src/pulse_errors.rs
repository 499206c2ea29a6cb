//! Errors of pointing, of detection and of intensity.

use crate::ParamError;

/// Errors of pointing, of detection and of intensity. All are off by default; errors of range are a
/// [`RangeModel`](crate::RangeModel)'s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PulseErrors {
    /// Standard deviation of a pulse's direction, to the side and up, radians, 0..=0.1. The pulse
    /// is cast where it really goes and written where the scanner believes it went.
    pub angular_sigma_rad: f64,
    /// Written ranges are multiples of this, metres, at least 0; 0 for none (Velodyne 0.002, Livox
    /// 0.001).
    pub range_step_m: f64,
    /// Probability that a pulse is lost, whatever it hits, 0..=1.
    pub dropout: f64,
    /// Probability that a pulse from which nothing comes back gives a point all the same, 0..=1, at
    /// any range of the scanner. Livox states less than 1e-4.
    pub false_alarm: f64,
    /// Standard deviation of the intensity of the weakest echo that is seen, as a share of it,
    /// 0..=1; that of stronger ones is less, as 1 / √SNR. The weakest echo is that of
    /// [`AirParams::reference_range_m`](crate::AirParams::reference_range_m). With 0.27 it is 3.72
    /// standard deviations above 0, which noise alone passes once in ten thousand times.
    pub intensity_at_threshold: f64,
    /// Standard deviation of the logarithm of the reflectance of plants and rocks between objects
    /// of one material, 0..=1. The ground, and what is no object, is all alike.
    pub reflectance_spread: f64,
}

impl PulseErrors {
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        ParamError::check(
            (0.0..=0.1).contains(&self.angular_sigma_rad),
            "errors.angular_sigma_rad",
            self.angular_sigma_rad,
            "0..=0.1 rad",
        )?;
        ParamError::check(
            self.range_step_m.is_finite() && self.range_step_m >= 0.0,
            "errors.range_step_m",
            self.range_step_m,
            "finite and at least 0",
        )?;
        for (field, share) in [
            ("errors.dropout", self.dropout),
            ("errors.false_alarm", self.false_alarm),
            ("errors.intensity_at_threshold", self.intensity_at_threshold),
            ("errors.reflectance_spread", self.reflectance_spread),
        ] {
            ParamError::check((0.0..=1.0).contains(&share), field, share, "0..=1")?;
        }
        Ok(())
    }

    /// A range rounded to the written resolution.
    pub(crate) fn quantised_m(&self, range_m: f64) -> f64 {
        if self.range_step_m > 0.0 {
            libm::round(range_m / self.range_step_m) * self.range_step_m
        } else {
            range_m
        }
    }
}
