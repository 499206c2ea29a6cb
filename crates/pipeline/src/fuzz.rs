//! Readers of users' files that the crate keeps to itself. They are there for the fuzzers and the
//! replay of what these have found, and are no part of the crate's interface.

use std::path::Path;

use crate::config::{Config, InputPath, sky_image};
use crate::{Error, InputFiles};

/// A sky image.
///
/// # Errors
/// If the file is no image of a sky.
pub fn sky(path: &Path) -> Result<(), Error> {
    let mut config = Config::default();
    config.sky.image = InputPath::from(&*path.to_string_lossy());
    let inputs = InputFiles::read(&config)?;
    sky_image(&config.sky, &inputs).map(drop)
}
