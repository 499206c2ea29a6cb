//! The error of a parameter that is refused.

use std::error::Error;
use std::fmt;
use std::ops::RangeInclusive;

use crate::excerpt;

/// The most characters of a value that are shown.
const MOST_SHOWN: usize = 200;

/// A parameter is outside of what is allowed.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ParamError {
    /// The refused field, as a path such as `errors.dropout` or `layers[0].per_chunk`.
    pub field: String,
    /// Its value, as text of at most 200 characters.
    pub value: String,
    /// What is allowed, with units.
    pub allowed: String,
}

impl ParamError {
    /// An error about one field.
    #[must_use]
    pub fn new(
        field: impl Into<String>,
        value: impl fmt::Display,
        allowed: impl Into<String>,
    ) -> Self {
        Self {
            field: field.into(),
            value: excerpt(&value.to_string(), MOST_SHOWN),
            allowed: allowed.into(),
        }
    }

    /// Refuses a value unless a condition holds.
    ///
    /// # Errors
    /// If `holds` is false.
    pub fn check(
        holds: bool,
        field: &str,
        value: impl fmt::Display,
        allowed: &str,
    ) -> Result<(), Self> {
        if holds {
            Ok(())
        } else {
            Err(Self::new(field, value, allowed))
        }
    }

    /// Refuses a number outside of a range; NaN is outside of every range.
    ///
    /// # Errors
    /// If `value` is not in `range`.
    pub fn check_range(
        field: &str,
        value: f64,
        range: RangeInclusive<f64>,
        allowed: &str,
    ) -> Result<(), Self> {
        Self::check(range.contains(&value), field, Shown(value), allowed)
    }

    /// The same, with an error that states the range.
    ///
    /// # Errors
    /// If `value` is not from `low` to `high`.
    pub fn check_within(
        field: impl Into<String>,
        value: f64,
        low: f64,
        high: f64,
    ) -> Result<(), Self> {
        if (low..=high).contains(&value) {
            Ok(())
        } else {
            Err(Self::new(
                field,
                Shown(value),
                format!("from {low} to {high}"),
            ))
        }
    }

    /// Refuses a number that is negative, infinite or NaN.
    ///
    /// # Errors
    /// If `value` is not finite or below 0.
    pub fn check_at_least_zero(field: &str, value: f64) -> Result<(), Self> {
        let holds = value.is_finite() && value >= 0.0;
        Self::check(holds, field, Shown(value), "finite and at least 0")
    }

    /// Refuses a number that is not above 0, infinite or NaN.
    ///
    /// # Errors
    /// If `value` is not finite or not above 0.
    pub fn check_positive(field: &str, value: f64) -> Result<(), Self> {
        let holds = value.is_finite() && value > 0.0;
        Self::check(holds, field, Shown(value), "finite and greater than 0")
    }
}

/// A number; one that would have many digits is written with an exponent.
struct Shown(f64);

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(value) = self;
        if *value == 0.0 || !value.is_finite() || (1e-7..1e16).contains(&value.abs()) {
            write!(f, "{value}")
        } else {
            write!(f, "{value:e}")
        }
    }
}

impl fmt::Display for ParamError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            field,
            value,
            allowed,
        } = self;
        write!(f, "{field} = {value}: must be {allowed}")
    }
}

impl Error for ParamError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_message_names_field_value_and_range() {
        let error = ParamError::check_range("dropout", 1.5, 0.0..=1.0, "0..=1").expect_err("1.5");
        assert_eq!(error.to_string(), "dropout = 1.5: must be 0..=1");
        let error = ParamError::check_within("scale_m", 1e-300, 1.0, 1000.0).expect_err("1e-300");
        assert_eq!(
            error.to_string(),
            "scale_m = 1e-300: must be from 1 to 1000"
        );
        let error = ParamError::new("name", "x".repeat(1 << 20), "short");
        assert_eq!(error.value, "x".repeat(200) + "…");
        assert!(ParamError::check_range("dropout", f64::NAN, 0.0..=1.0, "0..=1").is_err());
        assert!(ParamError::check_range("dropout", 1.0, 0.0..=1.0, "0..=1").is_ok());
        assert!(ParamError::check_positive("range_m", 0.0).is_err());
        assert!(ParamError::check_at_least_zero("range_m", 0.0).is_ok());
        assert!(ParamError::check_at_least_zero("range_m", f64::INFINITY).is_err());
    }
}
