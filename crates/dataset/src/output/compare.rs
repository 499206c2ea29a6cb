//! Where two headers differ.

use std::collections::BTreeMap;
use std::path::Path;

use nemoral_scene::excerpt;
use serde::Serialize;
use serde_json::Value;

use crate::{DatasetHeader, Error};

/// Refuses a header that differs from the one in the folder, and says where.
pub(crate) fn compare(
    root: &Path,
    found: &DatasetHeader,
    asked: &DatasetHeader,
) -> Result<(), Error> {
    let count = [found, asked].map(|header| Value::from(header.sequences.len()));
    let sequences = found.sequences.iter().zip(&asked.sequences);
    let (found, asked) = (without_sequences(found), without_sequences(asked));
    // The most informative fields come first.
    for field in ["generator", "version", "seed", "backend"] {
        differs(root, field, &found[field], &asked[field])?;
    }
    // The values of one sequence at a time are in memory.
    for (i, (found, asked)) in sequences.enumerate() {
        let (found, asked) = (value(found), value(asked));
        for field in ["seed", "split", "config"] {
            let path = format!("sequences.{i}.{field}");
            differs(root, &path, &found[field], &asked[field])?;
        }
        differs(root, &format!("sequences.{i}"), &found, &asked)?;
    }
    // Lists of different lengths are told by their lengths.
    differs(root, "number of sequences", &count[0], &count[1])?;
    differs(root, "", &found, &asked)
}

fn value(of: &impl Serialize) -> Value {
    serde_json::to_value(of).expect("a header has string keys")
}

/// What a header says of the whole data set.
fn without_sequences(header: &DatasetHeader) -> Value {
    value(&DatasetHeader {
        generator: header.generator.clone(),
        version: header.version.clone(),
        seed: header.seed,
        backend: header.backend.clone(),
        licence: header.licence.clone(),
        ontology: header.ontology.clone(),
        sequences: Vec::new(),
        config_toml: String::new(),
        input_files: BTreeMap::new(),
    })
}

fn differs(root: &Path, field: &str, found: &Value, asked: &Value) -> Result<(), Error> {
    if found == asked {
        return Ok(());
    }
    if let (Value::Object(a), Value::Object(b)) = (found, asked) {
        for name in a.keys().chain(b.keys()) {
            let shown = excerpt(name, 80);
            let dotted = if field.is_empty() {
                shown
            } else {
                format!("{field}.{shown}")
            };
            let at = |map: &serde_json::Map<String, Value>| map.get(name).cloned();
            match (at(a), at(b)) {
                (Some(a), Some(b)) => differs(root, &dotted, &a, &b)?,
                (a, b) => return Err(mismatch(root, &dotted, a.as_ref(), b.as_ref())),
            }
        }
    }
    Err(mismatch(root, field, Some(found), Some(asked)))
}

fn mismatch(root: &Path, field: &str, found: Option<&Value>, asked: Option<&Value>) -> Error {
    let short = |value: Option<&Value>| {
        let text = value.map_or_else(|| "nothing".to_owned(), Value::to_string);
        excerpt(&text, 120)
    };
    Error::Mismatch {
        path: root.to_owned(),
        field: field.to_owned(),
        found: short(found),
        asked: short(asked),
    }
}
