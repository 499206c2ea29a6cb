//! Why a command fails, for the user and for the exit code.

use std::fmt::Display;

use nemoral_pipeline::Error;

/// Why a command failed.
pub(crate) struct Failure {
    pub(crate) message: String,
    pub(crate) is_request: bool,
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let remedy = match &error {
            Error::Dataset(error) => remedy(error),
            Error::Convert(error) => remedy_of_conversion(error),
            Error::Interrupted => "; go on with --resume",
            _ => "",
        };
        Self {
            message: format!("{error}{remedy}"),
            is_request: error.is_request(),
        }
    }
}

impl From<nemoral_pipeline::config::Error> for Failure {
    fn from(error: nemoral_pipeline::config::Error) -> Self {
        Error::from(error).into()
    }
}

impl From<nemoral_dataset::Error> for Failure {
    fn from(error: nemoral_dataset::Error) -> Self {
        Error::from(error).into()
    }
}

/// What to do about a folder that holds something already.
const RESUME_OR_OVERWRITE: &str = "; use --resume to go on with it or --overwrite to replace it";

/// The options by which a command could go on all the same.
fn remedy(error: &nemoral_dataset::Error) -> &'static str {
    match error {
        nemoral_dataset::Error::Exists { .. } => RESUME_OR_OVERWRITE,
        nemoral_dataset::Error::Incomplete { .. } => "; --partial merges what there is",
        _ => "",
    }
}

fn remedy_of_conversion(error: &nemoral_convert::Error) -> &'static str {
    match error {
        nemoral_convert::Error::Exists { .. } => RESUME_OR_OVERWRITE,
        nemoral_convert::Error::Mismatch { .. } => {
            "; remove that folder, or replace it by `nemoral convert --overwrite`"
        }
        nemoral_convert::Error::TileExists { .. } => {
            "; --overwrite replaces all tiles of this name"
        }
        _ => "",
    }
}

impl From<nemoral_convert::Error> for Failure {
    fn from(error: nemoral_convert::Error) -> Self {
        Error::from(error).into()
    }
}

impl From<nemoral_report::Error> for Failure {
    fn from(error: nemoral_report::Error) -> Self {
        let is_request = error.is_request();
        match error {
            nemoral_report::Error::Dataset(e) => e.into(),
            error => Self {
                message: error.to_string(),
                is_request,
            },
        }
    }
}

impl From<nemoral_export::Error> for Failure {
    fn from(error: nemoral_export::Error) -> Self {
        Self {
            message: error.to_string(),
            is_request: error.is_request(),
        }
    }
}

impl From<nemoral_view::Error> for Failure {
    fn from(error: nemoral_view::Error) -> Self {
        Self {
            message: error.to_string(),
            is_request: error.is_request(),
        }
    }
}

/// The commands themselves write to standard output alone, so an I/O error is about that.
impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        Self {
            message: format!("cannot write to standard output: {error}"),
            is_request: false,
        }
    }
}

/// A wrong request.
pub(crate) fn wrong(message: impl Display) -> Failure {
    Failure {
        message: message.to_string(),
        is_request: true,
    }
}
