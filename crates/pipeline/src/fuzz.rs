//! Readers of users' files that the crate keeps to itself. They are there for the fuzzers and the replay
//! of what these have found, and are no part of the crate's interface.

use std::path::Path;

use crate::Error;
use crate::config::Config;
use crate::stages::sky_image;

/// A sky image.
///
/// # Errors
/// If the file is no image of a sky.
pub fn sky(path: &Path) -> Result<(), Error> {
    let mut sky = Config::default().sky;
    sky.image = path.display().to_string();
    sky_image::read(&sky).map(drop)
}
