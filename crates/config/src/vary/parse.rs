//! Reading draws.

use toml::{Table, Value};

use super::{Draw, Member};
use crate::Preset;
use crate::config_errors::{ConfigError, ConfigErrors};
use crate::dotted_keys::{join, section, value_at};
use crate::quotations::{cut, shown};
use crate::schema::AllowedValues;
use crate::source::Source;

/// Keys that are the same in all sequences.
const FIXED: [&str; 3] = ["seed", "sequences", "frames"];
/// Tables that are the same in all sequences.
const FIXED_TABLES: [&str; 2] = ["output", "splits"];

/// The draws of one table, by key or as `group.NAME`.
pub(super) fn table(
    name: &str,
    table: Table,
    source: &Source,
    errors: &mut ConfigErrors,
) -> Vec<(String, Draw)> {
    let mut found = Vec::new();
    flatten("", table, &mut found);
    let mut draws = Vec::new();
    for (path, value) in found {
        let draw = match path.strip_prefix("group.") {
            Some(_) => group(&value, source),
            None => draw(&path, &value, source),
        };
        match draw.and_then(|draw| twice(&path, &draw, &draws).map_or(Ok(draw), Err)) {
            Ok(draw) => draws.push((path, draw)),
            Err(message) => errors.add(|| ConfigError {
                location: source.location_of_drawn(&path),
                message: format!("{name}.\"{}\"{message}", cut(&path)),
                path: join(name, &path),
            }),
        }
    }
    draws
}

/// What is wrong if a draw sets a key that another one sets.
fn twice(name: &str, draw: &Draw, others: &[(String, Draw)]) -> Option<String> {
    let paths = draw.paths(name);
    let of_other = |(other, d): &(String, Draw)| {
        let path = d.paths(other).into_iter().find(|p| paths.contains(p))?;
        Some(format!(": `{}` draws {path} too; keep one", cut(other)))
    };
    others.iter().find_map(of_other)
}

/// Turns keys of nested tables into paths; quoted paths are paths already. A table below a key of
/// the config is its value.
fn flatten(path: &str, table: Table, out: &mut Vec<(String, Value)>) {
    for (key, value) in table {
        let full = join(path, &key);
        match value {
            Value::Table(inner) if allowed(&full).is_none() && !inner.is_empty() => {
                flatten(&full, inner, out);
            }
            other => out.push((full, other)),
        }
    }
}

/// Whether a key is the same in all sequences.
fn is_fixed(path: &str) -> bool {
    let table = path.split_once('.').map(|(table, _)| table);
    FIXED.contains(&path) || table.is_some_and(|t| FIXED_TABLES.contains(&t))
}

/// What values a key may have; `None` if there is no such key.
fn allowed(path: &str) -> Option<AllowedValues> {
    if path == "preset" {
        return Some(AllowedValues::OneOf(Preset::NAMES));
    }
    let (table, key) = path.rsplit_once('.').unwrap_or(("", path));
    section(table)?.allowed(key)
}

/// The draw of one key, or what is wrong with it.
fn draw(path: &str, value: &Value, source: &Source) -> Result<Draw, String> {
    let Some(allowed) = allowed(path) else {
        return Err(format!(": there is no key {}", cut(path)));
    };
    if path == "seed" {
        return Err(": what is drawn is drawn from it".to_owned());
    }
    if is_fixed(path) {
        return Err(": it is the same in all sequences".to_owned());
    }
    if value_at(&source.table, path).is_some() {
        return Err(format!(": {path} is set beside it; keep one"));
    }
    let is_number = matches!(
        allowed,
        AllowedValues::Real(..) | AllowedValues::RealAbove(..) | AllowedValues::Whole(..)
    );
    if is_number {
        range(value, &allowed)
    } else {
        choice(value, &allowed)
    }
}

/// `[least, most]`.
fn range(value: &Value, allowed: &AllowedValues) -> Result<Draw, String> {
    let as_number = |v: &Value| match v {
        Value::Integer(i) => Some(*i as f64),
        Value::Float(f) => Some(*f),
        _ => None,
    };
    if let Some([low, high]) = value.as_array().map(Vec::as_slice)
        && allowed.allows(low)
        && allowed.allows(high)
        && let (Some(low), Some(high)) = (as_number(low), as_number(high))
        && low <= high
    {
        let whole = matches!(allowed, AllowedValues::Whole(..));
        return Ok(Draw::Number { low, high, whole });
    }
    Err(format!(
        " = {}: must be [least, most], each {}",
        shown(value),
        allowed.describe()
    ))
}

/// `[a, b, …]` or `{ a = weight, b = weight, … }`.
fn choice(value: &Value, allowed: &AllowedValues) -> Result<Draw, String> {
    let values: Option<Vec<(f64, Value)>> = match value {
        Value::Array(values) => Some(values.iter().map(|v| (1.0, v.clone())).collect()),
        Value::Table(weights) => (weights.iter())
            .map(|(word, weight)| {
                let word = match (allowed, word.as_str()) {
                    (AllowedValues::Flag, "true") => Value::Boolean(true),
                    (AllowedValues::Flag, "false") => Value::Boolean(false),
                    (_, word) => Value::from(word),
                };
                Some((weight_of(weight)?, word))
            })
            .collect(),
        _ => None,
    };
    match values {
        Some(values) if !values.is_empty() && values.iter().all(|(_, v)| allowed.allows(v)) => {
            Ok(Draw::Choice(values))
        }
        _ => Err(format!(
            " = {}: must be [a, b, …] or {{ a = weight, b = weight, … }} with weights above 0, \
             each {}",
            shown(value),
            allowed.describe()
        )),
    }
}

fn weight_of(value: &Value) -> Option<f64> {
    let weight = match value {
        Value::Integer(i) => *i as f64,
        Value::Float(f) => *f,
        _ => return None,
    };
    (weight > 0.0 && weight <= 1e9).then_some(weight)
}

/// The alternatives of a group: `[[vary.group.NAME]]`, each a table.
fn group(value: &Value, source: &Source) -> Result<Draw, String> {
    let not_tables = || format!(" = {}: must be a list of tables", shown(value));
    let alternatives = value.as_array().filter(|a| !a.is_empty());
    let alternatives = alternatives.ok_or_else(not_tables)?;
    let mut all = Vec::new();
    for (i, alternative) in alternatives.iter().enumerate() {
        let mut table = alternative.as_table().cloned().ok_or_else(not_tables)?;
        let weight = match table.remove("weight") {
            None => 1.0,
            Some(weight) => weight_of(&weight).ok_or_else(|| {
                let weight = shown(&weight);
                format!(", alternative {i}: weight = {weight}: must be above 0, at most 1e9")
            })?,
        };
        let mut flat = Vec::new();
        flatten("", table, &mut flat);
        let mut members = Vec::new();
        for (path, value) in flat {
            let about = |message: String| format!(", alternative {i}: {}{message}", cut(&path));
            let member = match allowed(&path) {
                Some(allowed) if allowed.allows(&value) && !is_fixed(&path) => Member::Fixed(value),
                // The name of a variant, which has only defaults.
                None if value.as_table().is_some_and(Table::is_empty)
                    && section(&path).is_some() =>
                {
                    Member::Fixed(value)
                }
                _ => Member::Drawn(draw(&path, &value, source).map_err(about)?),
            };
            members.push((path, member));
        }
        all.push((weight, members));
    }
    Ok(Draw::Group(all))
}
