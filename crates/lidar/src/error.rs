//! Refused parameters.

/// A parameter outside of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[error("{field} is {value}, but must be {allowed}")]
pub struct ParamError {
    /// The field, as in the parameter struct.
    pub field: &'static str,
    /// What was given.
    pub value: f64,
    /// What is allowed.
    pub allowed: &'static str,
}

pub(crate) fn check(
    holds: bool,
    field: &'static str,
    value: f64,
    allowed: &'static str,
) -> Result<(), ParamError> {
    if holds {
        return Ok(());
    }
    Err(ParamError {
        field,
        value,
        allowed,
    })
}
