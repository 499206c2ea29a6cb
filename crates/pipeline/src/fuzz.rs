//! Private readers of users' files. They are exported for the fuzzers and for the replay of their
//! findings, and are not part of the crate's interface.

use std::path::Path;

use crate::config::{Config, InputPath};
use crate::{Error, InputFiles};

/// A sky image.
///
/// # Errors
/// If the file is not an image of a sky.
pub fn sky(path: &Path) -> Result<(), Error> {
    let mut config = Config::default();
    config.sky.image = InputPath::from(&*path.to_string_lossy());
    let inputs = InputFiles::read(&config)?;
    config.sky.photograph(&inputs)?;
    Ok(())
}
