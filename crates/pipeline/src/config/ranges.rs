//! Numbers drawn once for a world, from ranges.

use nemoral_seed::{Domain, Draw, Key};
use toml::{Table, Value};

use super::errors::{ConfigError, ConfigErrors};
use super::schema::{Allowed, SectionSpec};
use super::source::{Source, join, section};
use super::words::{cut, shown};

const RANGES: Domain = Domain::new("pipeline.ranges");

/// Ranges.
pub(super) const SECTION: SectionSpec = SectionSpec {
    path: "ranges",
    doc: " Numbers drawn from the seed: `\"placement.trees\" = [60, 140]` draws that key once, \
        both ends included. Every key that is a number may be named. The numbers that were drawn \
        are in the data set's config.toml and dataset.json. A value that is set later, by `--set` \
        over a file, overrides the range.",
    choice: None,
    keys: &[],
};

/// One range, and the source that gives it.
#[derive(Debug)]
pub(super) struct Range {
    path: String,
    low: f64,
    high: f64,
    /// Whether whole numbers are drawn.
    whole: bool,
    source: usize,
}

/// Takes the ranges out of the sources. A later source's range or value replaces an earlier range.
pub(super) fn take(sources: &mut [Source], errors: &mut ConfigErrors) -> Vec<Range> {
    let mut ranges: Vec<Range> = Vec::new();
    for (number, source) in sources.iter_mut().enumerate() {
        let said = source.table.remove("ranges");
        ranges.retain(|r| value_at(&source.table, &r.path).is_none());
        let mut found = Vec::new();
        match said {
            None => continue,
            Some(Value::Table(table)) => flatten("", table, &mut found),
            Some(other) => {
                let message = format!("ranges = {}: must be a table, [ranges]", shown(&other));
                errors.add(|| source.error("ranges", message));
            }
        }
        for (path, value) in found {
            match ends(&path, &value, source) {
                Ok((low, high, whole)) => {
                    ranges.retain(|r| r.path != path);
                    ranges.push(Range {
                        path,
                        low,
                        high,
                        whole,
                        source: number,
                    });
                }
                Err(message) => errors.add(|| ConfigError {
                    place: place(source, &path),
                    message,
                    path: join("ranges", &path),
                }),
            }
        }
    }
    ranges
}

/// Draws each range's number into a merged config, keyed by the world's seed and the key's path.
pub(super) fn draw(
    ranges: &[Range],
    sources: &[Source],
    merged: &mut Table,
    errors: &mut ConfigErrors,
) {
    let seed = merged.get("seed").and_then(Value::as_integer).unwrap_or(0);
    let world = Key::world(seed.unsigned_abs()).domain(RANGES);
    for Range {
        path,
        low,
        high,
        whole,
        source,
    } in ranges
    {
        let mut rng = world.domain(Domain::new(path)).rng();
        let drawn = if *whole {
            let drawn = (low + rng.unit_f64() * (high - low + 1.0)).floor();
            Value::Integer(drawn.min(*high) as i64)
        } else {
            Value::Float(rng.range_f64(*low, *high))
        };
        // A variant's table that was not in the preset has only the keys that were named.
        let (table, key) = path.rsplit_once('.').unwrap_or(("", path));
        let inside = match table {
            "" => Some(&mut *merged),
            table => value_at_mut(merged, table).and_then(Value::as_table_mut),
        };
        match inside {
            Some(inside) => {
                inside.insert(key.to_owned(), drawn);
            }
            None => {
                errors.add(|| ConfigError {
                    path: join("ranges", path),
                    message: format!(
                        "ranges.\"{path}\": there is no [{table}] in this config; name it to \
                         choose it"
                    ),
                    place: place(&sources[*source], path),
                });
            }
        }
    }
}

/// The place of a key's range, if there is one.
pub(super) fn place_of(ranges: &[Range], sources: &[Source], path: &str) -> Option<super::Place> {
    let range = ranges.iter().find(|r| r.path == path)?;
    place(&sources[range.source], path)
}

fn place(source: &Source, path: &str) -> Option<super::Place> {
    // It may be one quoted key, or nested tables.
    let quoted = source.place_of_parts(&["ranges", path]);
    quoted.or_else(|| source.place_of(&join("ranges", path)))
}

/// The two ends of a range and whether it is of whole numbers, or the error in it.
fn ends(path: &str, value: &Value, source: &Source) -> Result<(f64, f64, bool), String> {
    let (table, key) = path.rsplit_once('.').unwrap_or(("", path));
    let spec = section(table).and_then(|s| s.keys.iter().find(|k| k.name == key));
    let Some(spec) = spec else {
        let path = cut(path);
        return Err(format!("ranges.\"{path}\": there is no key {path}"));
    };
    let number = matches!(
        spec.allowed,
        Allowed::Real(..) | Allowed::RealAbove(..) | Allowed::Whole(..)
    );
    if !number || path == "seed" {
        let why = if number {
            "what is drawn is drawn from it"
        } else {
            "only numbers are drawn from ranges"
        };
        return Err(format!("ranges.\"{path}\": {why}"));
    }
    if value_at(&source.table, path).is_some() {
        return Err(format!(
            "ranges.\"{path}\": {path} is set beside it; keep one"
        ));
    }
    let as_number = |v: &Value| match v {
        Value::Integer(i) => Some(*i as f64),
        Value::Float(f) => Some(*f),
        _ => None,
    };
    match value.as_array().map(Vec::as_slice) {
        Some([low, high]) if spec.allowed.allows(low) && spec.allowed.allows(high) => {
            match (as_number(low), as_number(high)) {
                (Some(low), Some(high)) if low <= high => {
                    return Ok((low, high, matches!(spec.allowed, Allowed::Whole(..))));
                }
                _ => {}
            }
        }
        _ => {}
    }
    Err(format!(
        "ranges.\"{path}\" = {}: must be [least, most], each {}",
        shown(value),
        spec.allowed.describe()
    ))
}

/// Turns keys of nested tables into paths; quoted paths are paths already.
fn flatten(path: &str, table: Table, out: &mut Vec<(String, Value)>) {
    for (key, value) in table {
        let full = join(path, &key);
        match value {
            Value::Table(inner) => flatten(&full, inner, out),
            other => out.push((full, other)),
        }
    }
}

fn value_at<'a>(table: &'a Table, path: &str) -> Option<&'a Value> {
    let (key, rest) = path
        .split_once('.')
        .map_or((path, None), |(k, r)| (k, Some(r)));
    let value = table.get(key)?;
    match rest {
        None => Some(value),
        Some(rest) => value_at(value.as_table()?, rest),
    }
}

fn value_at_mut<'a>(table: &'a mut Table, path: &str) -> Option<&'a mut Value> {
    let (key, rest) = path
        .split_once('.')
        .map_or((path, None), |(k, r)| (k, Some(r)));
    let value = table.get_mut(key)?;
    match rest {
        None => Some(value),
        Some(rest) => value_at_mut(value.as_table_mut()?, rest),
    }
}
