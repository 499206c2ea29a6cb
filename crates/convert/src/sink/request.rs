//! What a conversion was asked for, by which one that is there is gone on with or replaced.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::OutputMode;
use crate::{Error, digest};

/// What decides a conversion's bytes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Request {
    /// This program.
    pub(crate) converter: String,
    /// The format's name.
    pub(crate) format: String,
    /// The digest of what all states of the data set have in common, which may get further frames
    /// and sequences; `None` in conversions of layout 5 and before.
    #[serde(default)]
    pub(crate) data_set: Option<String>,
    /// The digest of the data set's `dataset.json`.
    pub(crate) source: String,
    /// The digest of the class table, if one was given.
    pub(crate) ontology: Option<String>,
    /// The fewest pixels of an object that is listed.
    #[serde(default)]
    pub(crate) min_px: u32,
}

impl Request {
    pub(super) fn digest(&self) -> String {
        digest(&serde_json::to_vec(self).expect("a request has string keys"))
    }

    /// Whether a conversion that was found is gone on with; `false` if it is replaced.
    ///
    /// # Errors
    /// [`Error::Mismatch`] if it may be neither.
    pub(super) fn goes_on(
        &self,
        path: &Path,
        found: &Self,
        mode: OutputMode,
    ) -> Result<bool, Error> {
        match mode {
            OutputMode::Fresh | OutputMode::Overwrite => Ok(false),
            OutputMode::Resume => {
                self.compare(path, found)?;
                self.same(path, found, "source", |r| Some(r.source.clone()))?;
                Ok(true)
            }
            OutputMode::Renew => {
                self.compare_data_set(path, found)?;
                Ok(found.source == self.source)
            }
        }
    }

    /// Refuses a conversion that was made of another data set, or in another way. It may have been
    /// made of another state of the data set.
    pub(super) fn compare_data_set(&self, path: &Path, found: &Self) -> Result<(), Error> {
        self.compare(path, found)?;
        self.same(path, found, "data set", |r| r.data_set.clone())
    }

    /// Refuses a conversion that was made in another way, whatever it was made of.
    fn compare(&self, path: &Path, found: &Self) -> Result<(), Error> {
        self.same(path, found, "converter", |r| Some(r.converter.clone()))?;
        self.same(path, found, "format", |r| Some(r.format.clone()))?;
        self.same(path, found, "ontology", |r| r.ontology.clone())?;
        self.same(path, found, "min_px", |r| Some(r.min_px.to_string()))
    }

    fn same(
        &self,
        path: &Path,
        found: &Self,
        field: &'static str,
        value: impl Fn(&Self) -> Option<String>,
    ) -> Result<(), Error> {
        let (found, asked) = (value(found), value(self));
        if found == asked {
            return Ok(());
        }
        let shown = |value: Option<String>| value.unwrap_or_else(|| "none".to_owned());
        Err(Error::Mismatch {
            path: path.to_owned(),
            field,
            found: shown(found),
            asked: shown(asked),
        })
    }
}
