//! What can be wrong with a request.

/// A parameter out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field} = {value}: must be {allowed}")]
#[non_exhaustive]
pub struct ParamError {
    /// The offending field, dotted.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// What is allowed.
    pub allowed: &'static str,
}

/// `Ok` if `value` lies in `low..=high`; NaN never does.
pub(crate) fn check(
    field: &'static str,
    value: f64,
    low: f64,
    high: f64,
    allowed: &'static str,
) -> Result<(), ParamError> {
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(ParamError {
            field,
            value,
            allowed,
        })
    }
}
