//! What goes wrong, as exceptions.

use std::path::PathBuf;

use nemoral_pipeline::config::{ConfigErrors, SECTIONS};
use nemoral_scene::ParamError;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

/// Why something could not be done.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The config is wrong.
    Config(ConfigErrors),
    /// An argument is wrong.
    Argument {
        /// Its name, or that of a key; empty if it is not about a single one.
        key: String,
        message: String,
        /// Its value and what is allowed, where they are known apart from the message.
        value: Option<String>,
        allowed: Option<String>,
    },
    /// A file or folder could not be read or written.
    Io {
        path: PathBuf,
        error: std::io::Error,
    },
    /// A data set is not what it should be.
    Dataset(String),
    /// The run was asked to stop.
    Interrupted,
    /// Something failed while running.
    Other(String),
}

impl Failure {
    /// A wrong argument.
    pub(crate) fn argument(
        key: &str,
        value: impl std::fmt::Display,
        allowed: impl std::fmt::Display,
    ) -> Self {
        ParamError::new(key, value, allowed.to_string()).into()
    }

    /// The exception.
    pub(crate) fn raise(self, py: Python<'_>) -> PyErr {
        let made = (|| {
            let errors = py.import("nemoral._errors")?;
            match self {
                Self::Config(found) => {
                    let more = found.more;
                    let each = found.errors.into_iter().map(|e| {
                        let nearest = e.nearest().map(str::to_owned);
                        (allowed(&e.path), e.path, e.message, nearest)
                    });
                    let each: Vec<_> = each.collect();
                    errors.getattr("_of_config")?.call1((each, more))
                }
                Self::Argument {
                    key,
                    message,
                    value,
                    allowed,
                } => (errors.getattr("_of_argument")?).call1((key, message, value, allowed)),
                Self::Io { path, error } => {
                    let (code, text) = (error.raw_os_error(), error.to_string());
                    errors.getattr("_of_file")?.call1((path, code, text))
                }
                Self::Dataset(message) => errors.getattr("DatasetError")?.call1((message,)),
                Self::Interrupted => Ok(PyKeyboardInterrupt::new_err(())
                    .into_value(py)
                    .into_bound(py)
                    .into_any()),
                Self::Other(message) => errors.getattr("Error")?.call1((message,)),
            }
        })();
        made.map_or_else(|error| error, PyErr::from_value)
    }
}

/// What a key of the config may be.
fn allowed(path: &str) -> Option<String> {
    let (table, name) = path.rsplit_once('.').unwrap_or(("", path));
    // A further sensor has the keys of the first one.
    let of_first = [
        ("cameras.", "camera"),
        ("lidars.", "lidar"),
        ("lamps.", "lamp"),
    ]
    .into_iter()
    .find_map(|(prefix, first)| {
        let rest = table.strip_prefix(prefix)?.split_once('.');
        Some(rest.map_or(first.to_owned(), |(_, rest)| format!("{first}.{rest}")))
    });
    let table = of_first.as_deref().unwrap_or(table);
    let section = SECTIONS.iter().find(|s| s.path == table)?;
    let key = section.keys.iter().find(|k| k.name == name)?;
    Some(key.allowed.describe())
}

impl From<ParamError> for Failure {
    fn from(mut error: ParamError) -> Self {
        // Ranges are in Rust's notation.
        error.allowed = error.allowed.replace("..=", " to ");
        Self::Argument {
            message: error.to_string(),
            key: error.field,
            value: Some(error.value),
            allowed: Some(error.allowed),
        }
    }
}

/// What to do about a folder that holds something already.
const RESUME_OR_OVERWRITE: &str =
    "; mode=\"resume\" goes on with it, and mode=\"overwrite\" replaces it";

impl From<nemoral_pipeline::Error> for Failure {
    fn from(error: nemoral_pipeline::Error) -> Self {
        use nemoral_pipeline::Error as E;
        match error {
            E::Config(errors) => Self::Config((*errors).clone()),
            E::Request(message) => {
                let (key, _) = message.split_once(": ").unwrap_or_default();
                let (key, value) = key.split_once(" = ").unwrap_or((key, ""));
                Self::Argument {
                    key: key.to_owned(),
                    value: (!value.is_empty()).then(|| value.to_owned()),
                    allowed: None,
                    message: message.to_string(),
                }
            }
            E::Read(error) => match &*error {
                nemoral_files::Error::Io { path, source } => Self::Io {
                    path: path.clone(),
                    error: copy(source),
                },
                error => Self::Dataset(error.to_string()),
            },
            E::Dataset(error) => Self::of_dataset(&error),
            E::Convert(error) => Self::of_conversion(&error),
            E::Interrupted => Self::Interrupted,
            error => Self::Other(error.to_string()),
        }
    }
}

impl Failure {
    fn of_dataset(error: &nemoral_dataset::Error) -> Self {
        match error {
            nemoral_dataset::Error::Io { path, source } => Self::Io {
                path: path.clone(),
                error: copy(source),
            },
            nemoral_dataset::Error::Stopped { .. } => Self::Interrupted,
            nemoral_dataset::Error::Invalid {
                field,
                value,
                allowed,
            } => Self::argument(field, value, allowed),
            nemoral_dataset::Error::Exists { .. } => {
                Self::Dataset(format!("{error}{RESUME_OR_OVERWRITE}"))
            }
            nemoral_dataset::Error::Incomplete { .. } => {
                Self::Dataset(format!("{error}; partial=True merges what there is"))
            }
            error => Self::Dataset(error.to_string()),
        }
    }

    fn of_conversion(error: &nemoral_convert::Error) -> Self {
        match error {
            nemoral_convert::Error::Exists { .. } => {
                Self::Dataset(format!("{error}{RESUME_OR_OVERWRITE}"))
            }
            error => Self::Dataset(error.to_string()),
        }
    }
}

impl From<nemoral_dataset::Error> for Failure {
    fn from(error: nemoral_dataset::Error) -> Self {
        Self::of_dataset(&error)
    }
}

impl From<nemoral_pipeline::config::Error> for Failure {
    fn from(error: nemoral_pipeline::config::Error) -> Self {
        nemoral_pipeline::Error::from(error).into()
    }
}

impl From<nemoral_convert::Error> for Failure {
    fn from(error: nemoral_convert::Error) -> Self {
        nemoral_pipeline::Error::from(error).into()
    }
}

impl From<nemoral_report::Error> for Failure {
    fn from(error: nemoral_report::Error) -> Self {
        match error {
            nemoral_report::Error::Dataset(error) => error.into(),
            error => Self::Dataset(error.to_string()),
        }
    }
}

fn copy(error: &std::io::Error) -> std::io::Error {
    match error.raw_os_error() {
        Some(code) => std::io::Error::from_raw_os_error(code),
        None => std::io::Error::new(error.kind(), error.to_string()),
    }
}
