//! Statistics.
use crate::*;
use std::path::Path;

/// Share of a class.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassShare {
    /// Class id.
    pub id: u8,
    /// Its name.
    pub name: String,
    /// Pixels of this class.
    pub pixels: u64,
    /// LiDAR points of this class.
    pub points: u64,
}

/// What is in a data set.
#[derive(Clone, Debug, PartialEq)]
pub struct Stats {
    /// By class.
    pub classes: Vec<ClassShare>,
}

impl std::fmt::Display for Stats {
    fn fmt(&self, _f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        todo!()
    }
}

/// Reads a whole data set and counts.
///
/// # Errors
/// If the folder holds no data set or cannot be read.
pub fn stats(_dir: &Path) -> Result<Stats, Error> {
    todo!()
}
