//! Layering and checking: preset, then file, then `--set`.

use std::collections::BTreeSet;
use std::fmt;
use std::path::{Path, PathBuf};

use serde::Serialize;
use toml::{Table, Value};

use super::schema::SectionSpec;
use super::{Config, Lidar, Preset, SECTIONS, devices, ranges};
use crate::Error;

/// One thing that is wrong with a request.
#[derive(Clone, Debug, PartialEq)]
pub struct ConfigError {
    /// The dotted key.
    pub path: String,
    /// What is wrong: the value and what is allowed.
    pub message: String,
    /// Where: file, line, column and the line's text.
    pub place: Option<Place>,
}

/// Where a request says something.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// In a file.
    File {
        /// The file's name.
        name: String,
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// The line.
        text: String,
        /// How many characters are meant.
        length: usize,
    },
    /// In an argument, such as `--set a.b=c`.
    Argument(String),
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            None => f.write_str(&self.message),
            Some(Place::Argument(argument)) => write!(f, "{argument}: {}", self.message),
            Some(Place::File {
                name,
                line,
                column,
                text,
                length,
            }) => {
                writeln!(f, "{name}:{line}:{column}: {}", self.message)?;
                let margin = line.to_string().len();
                let carets = "^".repeat((*length).max(1));
                writeln!(f, "{:margin$} |\n{line} | {text}", "")?;
                write!(
                    f,
                    "{:margin$} | {:indent$}{carets}",
                    "",
                    "",
                    indent = column - 1
                )
            }
        }
    }
}

/// Everything that is wrong with a request.
#[derive(Clone, Debug, PartialEq)]
pub struct ConfigErrors(pub Vec<ConfigError>);

impl fmt::Display for ConfigErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, error) in self.0.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{error}")?;
        }
        Ok(())
    }
}

impl std::error::Error for ConfigErrors {}

/// What a user asked for, in layers: a preset, a file over it, settings over that.
#[derive(Clone, Debug, Default)]
pub struct Layers {
    /// The preset's name; `default` if none. A file may name its own with `preset = "…"`.
    pub preset: Option<String>,
    /// A TOML file.
    pub file: Option<PathBuf>,
    /// `key=value` settings.
    pub settings: Vec<String>,
}

impl Layers {
    /// Reads, checks and merges the layers.
    ///
    /// # Errors
    /// Everything that is wrong: unreadable or malformed files, unknown keys, values that are not
    /// allowed, combinations that cannot be, with the numbers that `[ranges]` drew.
    pub fn load(&self) -> Result<Config, Error> {
        let mut sources = Vec::new();
        if let Some(path) = &self.file {
            sources.push(Source::file(path)?);
        }
        for setting in &self.settings {
            sources.push(Source::setting(setting)?);
        }
        let preset = self.base(&mut sources)?;
        resolve(&preset, &mut sources)
    }

    /// The preset, asked for by argument or by the file.
    fn base(&self, sources: &mut [Source]) -> Result<Preset, Error> {
        let mut name = self.preset.clone();
        let mut place = None;
        for source in sources {
            if let Some(value) = source.table.remove("preset") {
                place = source.place_of("preset");
                let text = value
                    .as_str()
                    .map_or_else(|| value.to_string(), str::to_owned);
                // The argument wins over the file.
                name = name.or(Some(text));
            }
        }
        let name = name.unwrap_or_else(|| "default".to_owned());
        Preset::by_name(&name).ok_or_else(|| {
            let names: Vec<_> = Preset::ALL.iter().map(|p| p.name).collect();
            let message = format!("preset = \"{name}\": must be one of {}", names.join(", "));
            ConfigErrors(vec![ConfigError {
                path: "preset".to_owned(),
                message,
                place,
            }])
            .into()
        })
    }
}

impl Config {
    /// The config as TOML, every key present.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(&to_table(self)).expect("a config is plain data")
    }

    /// A config from TOML that [`Config::to_toml`] wrote, or that a user did.
    ///
    /// # Errors
    /// As [`Layers::load`].
    pub fn from_toml(text: &str) -> Result<Self, Error> {
        let mut source = Source::parse("config.toml", false, text.to_owned())?;
        let layers = Layers::default();
        let preset = layers.base(std::slice::from_mut(&mut source))?;
        resolve(&preset, std::slice::from_mut(&mut source))
    }
}

/// A preset with the sources over it, their ranges drawn, proved possible.
fn resolve(preset: &Preset, sources: &mut [Source]) -> Result<Config, Error> {
    let mut errors = Vec::new();
    let ranges = ranges::take(sources, &mut errors);
    let sources: &[Source] = sources;
    let mut merged = with_sensors(preset, sources);
    for source in sources {
        check_table("", &source.table, source, &mut errors);
        merge("", &mut merged, &source.table);
    }
    ranges::draw(&ranges, sources, &mut merged, &mut errors);
    if !errors.is_empty() {
        return Err(ConfigErrors(errors).into());
    }
    let config: Config = Value::Table(merged)
        .try_into()
        .expect("a table that passed the checks is a config");
    let place = |path: &str| {
        let said = sources.iter().rev().find_map(|s| s.place_of(path));
        ranges::place_of(&ranges, sources, path).or(said)
    };
    let errors: Vec<_> = config
        .problems()
        .into_iter()
        .map(|(path, message)| ConfigError {
            place: place(&path),
            path,
            message,
        })
        .collect();
    if errors.is_empty() {
        Ok(config)
    } else {
        Err(ConfigErrors(errors).into())
    }
}

/// A preset, and over it what the sensors bring along that the sources name: LiDARs what is in their
/// data sheets, further cameras what the first one is.
fn with_sensors(preset: &Preset, sources: &[Source]) -> Table {
    let mut merged = to_table(&preset.config());
    let lidar_of = |device: Option<String>| device.and_then(|name| devices::layer(&name));
    if let Some(layer) = lidar_of(last_text(sources, &["lidar", "device"])) {
        merge("lidar", table_at(&mut merged, "lidar"), &layer);
    }
    let mut first = table_at(&mut merged, "camera").clone();
    for said in sources.iter().filter_map(|s| s.table.get("camera")) {
        if let Value::Table(said) = said {
            merge("camera", &mut first, said);
        }
    }
    for name in names(sources, "cameras") {
        table_at(&mut merged, "cameras").insert(name, Value::Table(first.clone()));
    }
    for name in names(sources, "lidars") {
        let path = format!("lidars.{name}");
        let mut lidar = to_table(&Lidar::default());
        if let Some(layer) = lidar_of(last_text(sources, &["lidars", &name, "device"])) {
            merge(&path, &mut lidar, &layer);
        }
        table_at(&mut merged, "lidars").insert(name, Value::Table(lidar));
    }
    merged
}

/// The keys of a table in all sources.
fn names(sources: &[Source], table: &str) -> BTreeSet<String> {
    let tables = sources
        .iter()
        .filter_map(|s| s.table.get(table)?.as_table());
    tables.flat_map(|t| t.keys().cloned()).collect()
}

fn table_at<'a>(table: &'a mut Table, key: &str) -> &'a mut Table {
    let inner = table.get_mut(key).and_then(Value::as_table_mut);
    inner.expect("a config has all its tables")
}

/// What the last source that says it says.
fn last_text(sources: &[Source], path: &[&str]) -> Option<String> {
    let (key, tables) = path.split_last()?;
    let said = |s: &Source| {
        let table = tables
            .iter()
            .try_fold(&s.table, |t, part| t.get(*part)?.as_table())?;
        Some(table.get(*key)?.as_str()?.to_owned())
    };
    sources.iter().rev().find_map(said)
}

/// TOML text with its name and its values.
pub(super) struct Source {
    name: String,
    is_argument: bool,
    text: String,
    pub(super) table: Table,
}

impl Source {
    fn file(path: &Path) -> Result<Self, Error> {
        let bytes = std::fs::read(path).map_err(|source| Error::Read {
            path: path.to_owned(),
            source: source.into(),
        })?;
        let text = String::from_utf8(bytes)
            .map_err(|_| Error::request(format!("{}: not UTF-8 text", path.display())))?;
        Self::parse(&path.display().to_string(), false, text)
    }

    /// `terrain.octaves=3` is TOML already; a bare word is text.
    fn setting(setting: &str) -> Result<Self, Error> {
        let name = format!("--set {setting}");
        let Some((key, value)) = setting.split_once('=') else {
            return Err(Error::request(format!("{name}: must be KEY=VALUE")));
        };
        let as_is = format!("{} = {}", key.trim(), value.trim());
        Self::parse(&name, true, as_is).or_else(|error| {
            let quoted = format!("{} = {:?}", key.trim(), value.trim());
            Self::parse(&name, true, quoted).map_err(|_| error)
        })
    }

    fn parse(name: &str, is_argument: bool, text: String) -> Result<Self, Error> {
        match text.parse::<Table>() {
            Ok(table) => Ok(Self {
                name: name.to_owned(),
                is_argument,
                text,
                table,
            }),
            Err(error) => {
                let place = match error.span() {
                    _ if is_argument => Some(Place::Argument(name.to_owned())),
                    span => Some(place(name, &text, span.unwrap_or_default())),
                };
                let message = error.message().to_owned();
                Err(ConfigErrors(vec![ConfigError {
                    path: String::new(),
                    message,
                    place,
                }])
                .into())
            }
        }
    }

    /// What is wrong with a dotted key of this source.
    pub(super) fn error(&self, path: &str, message: String) -> ConfigError {
        ConfigError {
            path: path.to_owned(),
            message,
            place: self.place_of(path),
        }
    }

    /// Where a dotted key stands in this source.
    pub(super) fn place_of(&self, path: &str) -> Option<Place> {
        let parts: Vec<&str> = path.split('.').collect();
        self.place_of_parts(&parts)
    }

    /// Where a key stands whose parts may have dots themselves.
    pub(super) fn place_of_parts(&self, parts: &[&str]) -> Option<Place> {
        let parsed = toml::de::DeTable::parse(&self.text).ok()?;
        let mut table = parsed.get_ref();
        let mut parts = parts.iter().peekable();
        while let Some(part) = parts.next() {
            let (key, value) = table.iter().find(|(k, _)| k.get_ref().as_ref() == *part)?;
            if parts.peek().is_none() {
                if self.is_argument {
                    return Some(Place::Argument(self.name.clone()));
                }
                let end = if value.get_ref().is_table() {
                    key.span().end
                } else {
                    value.span().end
                };
                return Some(place(&self.name, &self.text, key.span().start..end));
            }
            table = value.get_ref().as_table()?;
        }
        None
    }
}

fn place(name: &str, text: &str, span: std::ops::Range<usize>) -> Place {
    let start = span.start.min(text.len());
    let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
    let line_end = text[start..].find('\n').map_or(text.len(), |i| start + i);
    let end = span.end.clamp(start, line_end);
    Place::File {
        name: name.to_owned(),
        line: text[..start].matches('\n').count() + 1,
        column: text[line_start..start].chars().count() + 1,
        text: text[line_start..line_end].to_owned(),
        length: text[start..end].chars().count(),
    }
}

/// The definition of a table. A further sensor has that of the first.
pub(super) fn section(path: &str) -> Option<&'static SectionSpec> {
    let further = [("cameras.", "camera"), ("lidars.", "lidar")];
    let of_first = further.iter().find_map(|(prefix, first)| {
        let rest = path.strip_prefix(prefix)?.split_once('.');
        Some(rest.map_or((*first).to_owned(), |(_, rest)| format!("{first}.{rest}")))
    });
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

/// Collects everything that is wrong with one layer.
fn check_table(path: &str, table: &Table, source: &Source, errors: &mut Vec<ConfigError>) {
    let spec = section(path).expect("only sections are entered");
    let mut wrong = |path: &str, message: String| errors.push(source.error(path, message));
    let mut inner = Vec::new();
    let mut chosen: Vec<(&str, String)> = Vec::new();
    for (key, value) in table {
        let full = join(path, key);
        if let Some(sub) = section(&full) {
            match value {
                Value::Table(sub_table) => inner.push((full.clone(), sub_table)),
                _ => wrong(
                    &full,
                    format!("{full} = {value}: must be a table, [{full}]"),
                ),
            }
            if let Some(choice) = sub.choice {
                match chosen.iter().find(|(c, _)| *c == choice) {
                    Some((_, other)) => {
                        wrong(
                            &full,
                            format!("[{full}] and [{other}] both give {choice}: keep one"),
                        );
                    }
                    None => chosen.push((choice, full.clone())),
                }
            }
        } else if let Some(spec) = spec.keys.iter().find(|k| k.name == key) {
            if !spec.allowed.allows(value) {
                wrong(
                    &full,
                    format!("{full} = {value}: must be {}", spec.allowed.describe()),
                );
            }
        } else {
            wrong(&full, unknown(path, key, spec));
        }
    }
    for (path, table) in inner {
        check_table(&path, table, source, errors);
    }
}

fn unknown(path: &str, key: &str, spec: &SectionSpec) -> String {
    // A further sensor's path is not its definition's.
    let prefix = if spec.path.is_empty() {
        String::new()
    } else {
        format!("{}.", spec.path)
    };
    let subs = SECTIONS.iter().filter_map(|s| {
        s.path
            .strip_prefix(&prefix)
            .filter(|rest| !rest.is_empty() && !rest.contains('.'))
    });
    let names: Vec<&str> = spec.keys.iter().map(|k| k.name).chain(subs).collect();
    let nearest = names.iter().min_by_key(|name| edit_distance(name, key));
    let full = join(path, key);
    match nearest {
        Some(name) if edit_distance(name, key) <= 1 + key.len() / 3 => {
            format!("{full}: no such key; did you mean `{name}`?")
        }
        _ => format!("{full}: no such key; there are {}", names.join(", ")),
    }
}

/// Levenshtein's distance.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

/// Lays `over` on `base`. Choosing a variant of a choice removes the others.
fn merge(path: &str, base: &mut Table, over: &Table) {
    for (key, value) in over {
        let full = join(path, key);
        if let Some(choice) = section(&full).and_then(|s| s.choice) {
            base.retain(|other, _| {
                other == key || section(&join(path, other)).and_then(|s| s.choice) != Some(choice)
            });
        }
        match (base.get_mut(key), value) {
            (Some(Value::Table(below)), Value::Table(above)) => merge(&full, below, above),
            // A whole number is allowed where a real one is expected.
            (Some(below @ Value::Float(_)), Value::Integer(i)) => *below = Value::Float(*i as f64),
            (Some(Value::Array(below)), Value::Array(above)) => {
                *below = above.iter().map(to_float).collect();
            }
            (_, Value::Table(above)) => {
                let mut fresh = Table::new();
                merge(&full, &mut fresh, above);
                base.insert(key.clone(), Value::Table(fresh));
            }
            _ => {
                base.insert(key.clone(), value.clone());
            }
        }
    }
}

fn to_float(value: &Value) -> Value {
    match value {
        Value::Integer(i) => Value::Float(*i as f64),
        other => other.clone(),
    }
}

fn to_table(config: &impl Serialize) -> Table {
    Table::try_from(config).expect("a config is plain data")
}

#[cfg(test)]
mod tests;
