//! The incidence law of Soudarissanane et al. (\[18\], \[19\] in the paper).

use nemoral_scene::{EchoObservation, ParamError};

use crate::model::{MeanError, Sigma};

/// Parameters of [`IncidenceLaw`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IncidenceLawParams {
    /// Error head-on at the reference range, metres, greater than 0.
    pub error_m: f64,
    /// Reference range, metres, greater than 0.
    pub reference_range_m: f64,
    /// Power of the range, 0 to 4: 1 or 2 are usual.
    pub range_exponent: f64,
    /// Incidence beyond which the error no longer grows, radians, 0 to below π/2.
    pub max_incidence_rad: f64,
}

impl Default for IncidenceLawParams {
    /// A terrestrial scanner: 2 mm at 20 m, growing with range, up to 85°.
    fn default() -> Self {
        Self {
            error_m: 0.002,
            reference_range_m: 20.0,
            range_exponent: 1.0,
            max_incidence_rad: 85.0 * std::f64::consts::PI / 180.0,
        }
    }
}

/// `error · (R / R₀)^p / cos(min(α, α_max))`: the range error of terrestrial scanners as their
/// signal weakens with range and incidence.
///
/// Source: S. Soudarissanane, R. Lindenbergh, M. Menenti, P. Teunissen, "Incidence angle influence
/// on the quality of terrestrial laser scanning points", 2009, and the study of range and incidence
/// of 2008: the error follows the signal-to-noise ratio, whose range equation has `cos α`; above
/// 60° incidence dominates. Theirs is a law of *spread*: use it as a [`Sigma`]. The paper uses it
/// as the *mean* of a Gaussian, which it is here too, as a positive error: a weak echo crosses the
/// receiver's threshold late. The default numbers are of the size they report (millimetres), not
/// read off a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IncidenceLaw {
    params: IncidenceLawParams,
    min_cos: f64,
}

impl IncidenceLaw {
    /// The law with these parameters.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: IncidenceLawParams) -> Result<Self, ParamError> {
        ParamError::check_positive("error_m", params.error_m)?;
        ParamError::check_positive("reference_range_m", params.reference_range_m)?;
        ParamError::check(
            (0.0..=4.0).contains(&params.range_exponent),
            "range_exponent",
            params.range_exponent,
            "from 0 to 4",
        )?;
        ParamError::check(
            (0.0..std::f64::consts::FRAC_PI_2).contains(&params.max_incidence_rad),
            "max_incidence_rad",
            params.max_incidence_rad,
            "from 0 to below π/2",
        )?;
        Ok(Self {
            params,
            min_cos: libm::cos(params.max_incidence_rad),
        })
    }

    fn error_m(&self, o: &EchoObservation) -> f64 {
        let p = &self.params;
        let cos = o.incidence_cos.max(self.min_cos);
        let ratio = o.range_m / p.reference_range_m;
        let growth = if p.range_exponent == 1.0 {
            ratio
        } else {
            libm::pow(ratio, p.range_exponent)
        };
        p.error_m * growth / cos
    }
}

impl Default for IncidenceLaw {
    fn default() -> Self {
        Self::new(IncidenceLawParams::default()).expect("the default parameters are in range")
    }
}

impl MeanError for IncidenceLaw {
    fn mean_error_m(&self, o: &EchoObservation) -> f64 {
        self.error_m(o)
    }
}

impl Sigma for IncidenceLaw {
    fn sigma_m(&self, o: &EchoObservation) -> f64 {
        self.error_m(o)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doubles_at_sixty_degrees_and_with_the_range() {
        let law = IncidenceLaw::default();
        let at = |range_m: f64, deg: f64| {
            law.sigma_m(&EchoObservation::at_angle(range_m, deg.to_radians(), 0.5))
        };
        assert!((at(20.0, 0.0) - 0.002).abs() < 1e-15);
        assert!((at(20.0, 60.0) / at(20.0, 0.0) - 2.0).abs() < 1e-12);
        assert!((at(40.0, 30.0) / at(20.0, 30.0) - 2.0).abs() < 1e-12);
        assert!((at(20.0, 85.0) - at(20.0, 90.0)).abs() < 1e-12);
    }
}
