//! Checks of parameters.

pub use nemoral_scene::ParamError;

/// Refuses a value outside of `low..=high`, and NaN.
pub(crate) fn check(
    field: &str,
    value: f64,
    low: f64,
    high: f64,
    allowed: &str,
) -> Result<(), ParamError> {
    ParamError::check_range(field, value, low..=high, allowed)
}
