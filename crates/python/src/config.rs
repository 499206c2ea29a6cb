//! Requests from Python: presets, files, and values of keys.

use std::path::PathBuf;

use nemoral_pipeline::config::{ConfigLayers, Preset, Sequences, json_schema as schema};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString, PyTuple};
use toml::{Table, Value};

use crate::failure::Failure;

/// The deepest table of a config, with room to spare.
const DEPTH: usize = 16;

/// What a request is made of.
#[derive(Clone, Debug, Default)]
pub(crate) struct Request(ConfigLayers);

impl Request {
    /// The layers: a preset, a file over it, and over both the values of keys, the later ones over
    /// the earlier ones.
    pub(crate) fn new(
        preset: Option<String>,
        file: Option<PathBuf>,
        settings: &Bound<'_, PyList>,
    ) -> PyResult<Self> {
        let py = settings.py();
        let mut texts = Vec::new();
        for layer in settings.iter() {
            let layer = layer.cast_into::<PyDict>()?;
            for (key, value) in layer.iter() {
                let key: String = key.extract()?;
                if !is_key(&key) {
                    let message = format!("{key:?}: no such key; keys are names joined by dots");
                    let failure = Failure::Argument {
                        key,
                        message,
                        value: None,
                        allowed: None,
                    };
                    return Err(failure.raise(py));
                }
                let value = toml(&key, &value, DEPTH)?;
                texts.push(format!("{key}={value}"));
            }
        }
        Ok(Self(ConfigLayers {
            preset,
            file,
            settings: texts,
        }))
    }

    pub(crate) fn sequences(&self) -> Result<Sequences, Failure> {
        Ok(self.0.sequences()?)
    }
}

/// Whether this is a key of the config, or a path to one.
fn is_key(key: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    (key.split('.')).all(|part| !part.is_empty() && part.chars().all(plain))
}

/// A value of Python as one of TOML.
fn toml(key: &str, value: &Bound<'_, PyAny>, depth: usize) -> PyResult<Value> {
    if depth == 0 {
        let message = format!("{key}: is nested too deeply");
        return Err(PyTypeError::new_err(message));
    }
    if let Ok(flag) = value.extract::<bool>() {
        return Ok(Value::Boolean(flag));
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(Value::String(text.to_str()?.to_owned()));
    }
    if let Ok(table) = value.cast::<PyDict>() {
        let mut inner = Table::new();
        for (name, value) in table.iter() {
            let name: String = name.extract().map_err(|_| {
                let message = format!("{key}: names of keys must be text");
                PyTypeError::new_err(message)
            })?;
            let full = format!("{key}.{name}");
            inner.insert(name, toml(&full, &value, depth - 1)?);
        }
        return Ok(Value::Table(inner));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let items = value.try_iter()?.map(|item| toml(key, &item?, depth - 1));
        return Ok(Value::Array(items.collect::<PyResult<_>>()?));
    }
    // Arrays and numbers of NumPy and of its like.
    if value.hasattr("dtype")? && value.hasattr("tolist")? {
        return toml(key, &value.call_method0("tolist")?, depth - 1);
    }
    if value.hasattr("__index__")? {
        // A whole number that TOML does not have is refused as the real number that it is.
        return match value.extract::<i64>() {
            Ok(whole) => Ok(Value::Integer(whole)),
            Err(_) => Ok(Value::Float(
                value.extract::<f64>().unwrap_or(f64::INFINITY),
            )),
        };
    }
    if let Ok(real) = value.extract::<f64>() {
        return Ok(Value::Float(real));
    }
    if let Ok(path) = value.extract::<PathBuf>()
        && let Some(text) = path.to_str()
    {
        return Ok(Value::String(text.to_owned()));
    }
    let kind = value.get_type().name()?;
    let message = format!("{key}: a {kind} is no value of a config");
    Err(PyTypeError::new_err(message))
}

/// The presets: name and purpose of each.
#[pyfunction]
pub(crate) fn presets() -> Vec<(&'static str, &'static str)> {
    Preset::ALL.iter().map(|p| (p.name, p.doc)).collect()
}

/// The JSON schema of configs, as text.
#[pyfunction]
pub(crate) fn json_schema() -> String {
    schema().to_string()
}
