//! Dotted keys, such as `camera.pinhole.hfov_deg`, in tables of TOML.

use serde::Serialize;
use toml::{Table, Value};

use super::schema::SectionSpec;
use super::{AllowedValues, SECTIONS};

/// Plain data as a table.
pub(super) fn to_table(config: &impl Serialize) -> Table {
    Table::try_from(config).expect("a config is plain data")
}

/// The definition of a table. A further sensor or lamp has that of the first one, a model that of
/// NAME.
pub(super) fn section(path: &str) -> Option<&'static SectionSpec> {
    let further = [
        ("cameras.", "camera"),
        ("lidars.", "lidar"),
        ("lamps.", "lamp"),
    ];
    let of_first = further.iter().find_map(|(prefix, first)| {
        let rest = path.strip_prefix(prefix)?.split_once('.');
        Some(rest.map_or((*first).to_owned(), |(_, rest)| format!("{first}.{rest}")))
    });
    let of_model = path
        .strip_prefix("models.")
        .filter(|name| !name.contains('.'));
    let of_first = of_first.or_else(|| of_model.map(|_| "models.NAME".to_owned()));
    let path = of_first.as_deref().unwrap_or(path);
    SECTIONS.iter().find(|s| s.path == path)
}

pub(super) fn join(path: &str, key: &str) -> String {
    if path.is_empty() {
        key.to_owned()
    } else {
        format!("{path}.{key}")
    }
}

/// The value of a dotted key.
pub(super) fn value_at<'a>(table: &'a Table, path: &str) -> Option<&'a Value> {
    let (key, rest) = path
        .split_once('.')
        .map_or((path, None), |(k, r)| (k, Some(r)));
    let value = table.get(key)?;
    match rest {
        None => Some(value),
        Some(rest) => value_at(value.as_table()?, rest),
    }
}

/// The most bytes of the file that a key names; 0 for a key that names no file.
pub(super) fn most_bytes(key: &str) -> u64 {
    match allowed(key) {
        Some(AllowedValues::File(most) | AllowedValues::Model(most)) => most,
        _ => 0,
    }
}

/// Whether a key names a model, which has other files beside it.
pub(super) fn is_model(key: &str) -> bool {
    matches!(allowed(key), Some(AllowedValues::Model(_)))
}

/// The greatest value of a key that has real numbers; 0 for others.
pub(super) fn greatest(key: &str) -> f64 {
    match allowed(key) {
        Some(AllowedValues::Real(_, most)) => most,
        _ => 0.0,
    }
}

fn allowed(key: &str) -> Option<AllowedValues> {
    let (table, name) = key.rsplit_once('.').unwrap_or(("", key));
    section(table)?.allowed(name)
}
