//! Where two headers differ.

use std::path::Path;

use nemoral_scene::excerpt;
use serde_json::Value;

use crate::{DatasetHeader, Error};

/// Refuses a header that differs from the one in the folder, and says where.
pub(crate) fn compare(
    root: &Path,
    found: &DatasetHeader,
    asked: &DatasetHeader,
) -> Result<(), Error> {
    let value = |h| serde_json::to_value(h).expect("a header has string keys");
    let (found, asked) = (value(found), value(asked));
    // The most informative fields come first.
    for field in ["generator", "version", "seed", "backend"] {
        differs(root, field, &found[field], &asked[field])?;
    }
    let sequences = |header: &'_ Value| header["sequences"].as_array().map_or(0, Vec::len);
    for i in 0..sequences(&found).min(sequences(&asked)) {
        let (found, asked) = (&found["sequences"][i], &asked["sequences"][i]);
        for field in ["seed", "split", "config"] {
            let path = format!("sequences.{i}.{field}");
            differs(root, &path, &found[field], &asked[field])?;
        }
        differs(root, &format!("sequences.{i}"), found, asked)?;
    }
    // Lists of different lengths are told by their lengths.
    let [there, wanted] = [&found, &asked].map(|h| Value::from(sequences(h)));
    differs(root, "number of sequences", &there, &wanted)?;
    differs(root, "", &found, &asked)
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
