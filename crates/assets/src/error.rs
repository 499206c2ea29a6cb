//! What is wrong with a parameter.

/// A parameter that cannot be: which, its value, and what is allowed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field} = {value}: must be {allowed}")]
#[non_exhaustive]
pub struct ParamError {
    /// The offending field, as a path such as `stands[1].dbh_mean_m`.
    pub field: String,
    /// Its value, as text.
    pub value: String,
    /// What is allowed, with units.
    pub allowed: String,
}

impl ParamError {
    /// An error about one field.
    pub(crate) fn new(
        field: impl Into<String>,
        value: impl ToString,
        allowed: impl Into<String>,
    ) -> Self {
        Self {
            field: field.into(),
            value: value.to_string(),
            allowed: allowed.into(),
        }
    }

    /// Refuses a number outside `low..=high` (and NaN).
    pub(crate) fn check_range(
        field: impl Into<String>,
        value: f64,
        low: f64,
        high: f64,
    ) -> Result<(), Self> {
        if (low..=high).contains(&value) {
            Ok(())
        } else {
            Err(Self::new(field, value, format!("{low}..={high}")))
        }
    }
}
