//! Checking.
use crate::*;
use std::path::Path;

/// Something wrong with a data set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Below the data set's folder.
    pub path: String,
    /// What is wrong.
    pub message: String,
}

/// What `check` found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CheckReport {
    /// Everything wrong.
    pub problems: Vec<Problem>,
    /// Frames looked at.
    pub frames: usize,
    /// Agreement of LiDAR and camera.
    pub agreement: Agreement,
}

impl CheckReport {
    /// Is the data set right?
    #[must_use]
    pub fn passed(&self) -> bool {
        todo!()
    }
}

impl std::fmt::Display for CheckReport {
    fn fmt(&self, _f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        todo!()
    }
}

/// Agreement.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Agreement {}
/// Of a class.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClassAgreement {}
/// Depth residual.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Residual {}

/// Checks a data set from its files alone.
///
/// # Errors
/// If the folder holds no data set or cannot be read.
pub fn check(_dir: &Path) -> Result<CheckReport, Error> {
    todo!()
}
