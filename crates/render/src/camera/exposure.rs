//! Exposure: the light that becomes middle grey.

use crate::error::{ParamError, check};

/// A light meter's reading at EV 0, ISO 100: K / 100 with K = 12.5 (ISO 2720), cd/m².
const LUMINANCE_AT_EV_0: f64 = 0.125;

/// The displayed reflectance of the metered luminance: middle grey.
pub(super) const MIDDLE_GREY: f64 = 0.18;

/// The exposure of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Automatic, as in a camera: the picture's log-mean luminance becomes `key` (0.18 is middle
    /// grey), made brighter by `bias_ev` stops.
    Auto {
        /// 0.01..=1.
        key: f64,
        /// −10..=10 stops.
        bias_ev: f64,
        /// The least exposure value at ISO 100, −10..=25, at which shutter, aperture and gain end:
        /// what is darker stays dark.
        least_ev100: f64,
    },
    /// Fixed: a luminance of 0.125 · 2^ev100 cd/m² becomes middle grey. It is about 15 in sunshine,
    /// 12 in shade, and 7..10 under closed crowns.
    Fixed {
        /// −10..=25.
        ev100: f64,
    },
}

impl Default for Exposure {
    fn default() -> Self {
        Self::metered(0.0)
    }
}

impl Exposure {
    /// The exposure of a light meter, made brighter by `bias_ev` stops.
    #[must_use]
    pub const fn metered(bias_ev: f64) -> Self {
        Self::Auto {
            key: MIDDLE_GREY,
            bias_ev,
            least_ev100: -10.0,
        }
    }

    /// The same, if it is automatic, down to an exposure value at which shutter and gain end.
    #[must_use]
    pub fn down_to(self, least_ev100: f64) -> Self {
        match self {
            Self::Auto { key, bias_ev, .. } => Self::Auto {
                key,
                bias_ev,
                least_ev100,
            },
            Self::Fixed { .. } => self,
        }
    }

    pub(crate) fn check(&self) -> Result<(), ParamError> {
        match *self {
            Self::Auto {
                key,
                bias_ev,
                least_ev100,
            } => {
                check("exposure.least_ev100", least_ev100, -10.0, 25.0, "-10..=25")?;
                check("exposure.key", key, 0.01, 1.0, "0.01..=1")?;
                check("exposure.bias_ev", bias_ev, -10.0, 10.0, "-10..=10 stops")
            }
            Self::Fixed { ev100 } => check("exposure.ev100", ev100, -10.0, 25.0, "-10..=25"),
        }
    }

    /// The EV at ISO 100 for a picture with this log-mean luminance, cd/m².
    pub(crate) fn ev100(&self, log_mean: f64) -> f64 {
        match *self {
            Self::Fixed { ev100 } => ev100,
            Self::Auto {
                key,
                bias_ev,
                least_ev100,
            } => {
                let metered = log_mean / LUMINANCE_AT_EV_0 * (MIDDLE_GREY / key);
                (libm::log2(metered) - bias_ev).max(least_ev100)
            }
        }
    }
}

/// The factor on luminance that turns the metered one into middle grey.
pub(super) fn scale_of(ev100: f64) -> f32 {
    (MIDDLE_GREY / (LUMINANCE_AT_EV_0 * libm::exp2(ev100))) as f32
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::super::metering::log_mean_luminance;
    use super::*;

    proptest! {
        #[test]
        fn a_stop_of_error_doubles_the_light(ev in -5.0..20.0) {
            let ratio = scale_of(ev - 1.0) / scale_of(ev);
            prop_assert!((ratio - 2.0).abs() < 1e-5, "{ratio}");
        }
    }

    #[test]
    fn black_pictures_and_bad_settings() {
        assert!(log_mean_luminance(&[Vec3::ZERO; 4]) > 0.0);
        assert!(Exposure::Fixed { ev100: f64::NAN }.check().is_err());
        assert!(
            Exposure::Auto {
                key: 0.0,
                least_ev100: -10.0,
                bias_ev: 0.0
            }
            .check()
            .is_err()
        );
    }
}
