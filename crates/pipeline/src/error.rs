//! The error of this crate.

use std::sync::Arc;

use nemoral_plan::StageError;

use crate::config::{self, ConfigErrors};
use crate::coordinate::ForestCoordinate;

/// An error of the pipeline. Cheap to clone: several waiting threads may get the same one.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The request is wrong; nothing was done.
    #[error("{0}")]
    Config(Arc<ConfigErrors>),
    /// The request is wrong, outside the config file.
    #[error("{0}")]
    Request(Arc<str>),
    /// A stage failed.
    #[error("{}{source}", place_of(.stage, .at))]
    Stage {
        /// The stage's id; empty until the error has left the stage, or if there was none.
        stage: &'static str,
        /// The coordinate.
        at: String,
        /// The stage's own error.
        source: Arc<dyn std::error::Error + Send + Sync>,
    },
    /// The renderer could not be started.
    #[error("{0}")]
    Renderer(Arc<str>),
    /// A stage panicked on another thread, which has reported it.
    #[error("a stage that this one waited for panicked")]
    StagePanicked,
    /// A file that the request names could not be read.
    #[error("cannot read {0}")]
    Read(Arc<nemoral_files::Error>),
    /// A data set could not be written, opened or resumed.
    #[error("{0}")]
    Dataset(Arc<nemoral_dataset::Error>),
    /// A data set could not be written in another format.
    #[error("{0}")]
    Convert(Arc<nemoral_convert::Error>),
    /// The run was asked to stop.
    #[error("interrupted: the data set is whole up to its last frame, and can be resumed")]
    Interrupted,
}

/// What stands before the error of a stage.
fn place_of(stage: &str, at: &str) -> String {
    if stage.is_empty() {
        return String::new();
    }
    format!("stage {stage} at {at}: ")
}

impl Error {
    /// Wraps the error of a stage's crate.
    pub(crate) fn of_stage(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self::Stage {
            stage: "",
            at: String::new(),
            source: Arc::new(error),
        }
    }

    pub(crate) fn request(message: impl Into<String>) -> Self {
        Self::Request(message.into().into())
    }

    /// Says in which of several sequences a request is wrong.
    pub(crate) fn in_sequence(self, number: u32, of: u32) -> Self {
        if of > 1 && self.is_request() {
            Self::request(format!("sequence {number}: {self}"))
        } else {
            self
        }
    }

    /// Whether the request was wrong (exit code 2), rather than its execution (1).
    #[must_use]
    pub fn is_request(&self) -> bool {
        match self {
            // Only files that the request names are read.
            Self::Config(_) | Self::Request(_) | Self::Read(_) => true,
            Self::Dataset(e) => {
                use nemoral_dataset::Error as E;
                matches!(
                    **e,
                    E::Foreign { .. }
                        | E::Exists { .. }
                        | E::Damaged { .. }
                        | E::Unowned { .. }
                        | E::Incomplete { .. }
                        | E::Mismatch { .. }
                        | E::Invalid { .. }
                )
            }
            Self::Convert(e) => e.is_request(),
            _ => false,
        }
    }
}

impl StageError<ForestCoordinate> for Error {
    /// Adds the place to a new stage error; one that comes from a deeper stage does not change. If
    /// a world stage fails, the request is wrong, because the stage depends on nothing else.
    fn in_stage(self, stage: &'static str, at: ForestCoordinate) -> Self {
        match self {
            Self::Stage {
                stage: "", source, ..
            } => {
                let at = match at {
                    ForestCoordinate::World => return Self::request(format!("{stage}: {source}")),
                    ForestCoordinate::Chunk(c) => format!("chunk {c}"),
                    ForestCoordinate::Frame(i) => format!("frame {i}"),
                };
                Self::Stage { stage, at, source }
            }
            other => other,
        }
    }

    fn panicked(_: &'static str, _: ForestCoordinate) -> Self {
        Self::StagePanicked
    }
}

impl From<nemoral_dataset::Error> for Error {
    fn from(error: nemoral_dataset::Error) -> Self {
        Self::Dataset(Arc::new(error))
    }
}

impl From<nemoral_convert::Error> for Error {
    fn from(error: nemoral_convert::Error) -> Self {
        use nemoral_dataset::Error as E;
        match error {
            nemoral_convert::Error::Dataset(E::Stopped { .. }) => Self::Interrupted,
            nemoral_convert::Error::Dataset(error) => error.into(),
            error => Self::Convert(Arc::new(error)),
        }
    }
}

impl From<nemoral_files::Error> for Error {
    fn from(error: nemoral_files::Error) -> Self {
        Self::Read(Arc::new(error))
    }
}

impl From<config::Error> for Error {
    fn from(error: config::Error) -> Self {
        match error {
            config::Error::Config(errors) => Self::Config(errors),
            config::Error::Read(error) => Self::Read(error),
            config::Error::Request(message) => Self::Request(message),
            other => Self::request(other.to_string()),
        }
    }
}

impl From<ConfigErrors> for Error {
    fn from(errors: ConfigErrors) -> Self {
        Self::Config(Arc::new(errors))
    }
}

#[cfg(test)]
mod tests {
    use nemoral_scene::ParamError;

    use super::*;

    #[test]
    fn an_error_names_its_stage_if_it_was_in_one() {
        let error = Error::of_stage(ParamError::new("size_m", 0, "positive"));
        assert_eq!(error.to_string(), "size_m = 0: must be positive");
        let error = error.in_stage("frame.images", ForestCoordinate::Frame(3));
        let told = "stage frame.images at frame 3: size_m = 0: must be positive";
        assert_eq!(error.to_string(), told);
    }
}
