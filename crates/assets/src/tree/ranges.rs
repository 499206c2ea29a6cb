//! Checks of the numbers of a species' file.

use nemoral_scene::ParamError;

/// Ranges of the fields of one table.
pub(super) struct Ranges<'a>(pub(super) &'a str);

impl Ranges<'_> {
    pub(super) fn one(
        &self,
        name: &str,
        value: f64,
        low: f64,
        high: f64,
    ) -> Result<(), ParamError> {
        ParamError::check_within(format!("{}.{name}", self.0), value, low, high)
    }

    /// Checks a least and a greatest value.
    pub(super) fn pair(
        &self,
        name: &str,
        [a, b]: [f64; 2],
        low: f64,
        high: f64,
    ) -> Result<(), ParamError> {
        self.one(name, b, low, high)?;
        self.one(name, a, low, b)
    }

    /// Checks each of several values, in any order.
    pub(super) fn each(
        &self,
        name: &str,
        values: &[f64],
        low: f64,
        high: f64,
    ) -> Result<(), ParamError> {
        values
            .iter()
            .try_for_each(|&v| self.one(name, v, low, high))
    }
}
