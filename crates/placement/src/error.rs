//! What can be wrong with parameters.

/// Parameters that cannot be met, with the field, its value and what is allowed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ParamError {
    /// A field is outside of its range (or not a number).
    #[error("{field} = {value}: must be {allowed}")]
    OutOfRange {
        /// The field's path, such as `layers[0].per_chunk`.
        field: String,
        /// The value given.
        value: String,
        /// What is allowed.
        allowed: String,
    },
    /// A layer's radii do not leave room for its number.
    #[error(
        "layers[{layer}].per_chunk = {per_chunk} ({name}): with these radii, spacing_factor and \
         density_factor at most about {at_most:.1} per chunk find room; lower per_chunk, \
         spacing_factor or the radii of this layer or of those before it"
    )]
    TooDense {
        /// The layer's index.
        layer: usize,
        /// The layer's name.
        name: String,
        /// The number asked for.
        per_chunk: f64,
        /// About the largest number that fits.
        at_most: f64,
    },
}

impl ParamError {
    pub(crate) fn range(
        field: impl Into<String>,
        value: impl std::fmt::Debug,
        allowed: impl Into<String>,
    ) -> Self {
        Self::OutOfRange {
            field: field.into(),
            value: format!("{value:?}"),
            allowed: allowed.into(),
        }
    }
}

/// Refuses a value outside of `low..=high`, and NaN.
pub(crate) fn within(field: &str, value: f64, low: f64, high: f64) -> Result<(), ParamError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(ParamError::range(
        field,
        value,
        format!("from {low} to {high}"),
    ))
}
