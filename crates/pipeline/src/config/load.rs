//! Layering and checking: preset, then file, then `--set`.

use std::collections::BTreeSet;
use std::fmt;
use std::path::{Path, PathBuf};

use serde::Serialize;
use toml::{Table, Value};

use super::schema::SectionSpec;
use super::words::{cut, did_you_mean, shown};
use super::{Allowed, Config, Lidar, Preset, SECTIONS, devices, ranges};
use crate::{Error, InputFiles};

/// The largest config file.
const FILE_BYTES: u64 = 4 << 20;
/// So many of a request's errors are told, and of the rest their number.
const TOLD: usize = 10;
/// So many characters of a long line are shown, and so many of them before the error.
const LINE: usize = 100;
const BEFORE: usize = 30;

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
            Some(Place::Argument(argument)) => write!(f, "{}: {}", cut(argument), self.message),
            Some(Place::File {
                name,
                line,
                column,
                text,
                length,
            }) => {
                writeln!(f, "{name}:{line}:{column}: {}", self.message)?;
                let margin = line.to_string().len();
                let (text, indent, most) = part_of_line(text, column - 1);
                let carets = "^".repeat((*length).clamp(1, most.max(1)));
                writeln!(f, "{:margin$} |\n{line} | {text}", "")?;
                write!(f, "{:margin$} | {:indent$}{carets}", "", "",)
            }
        }
    }
}

/// The part of a line that is shown, how far in it something stands that is at `start` of the whole, and
/// how many characters there are from there on.
fn part_of_line(line: &str, start: usize) -> (String, usize, usize) {
    let length = line.chars().count();
    if length <= LINE {
        return (line.to_owned(), start, length.saturating_sub(start));
    }
    let from = start.saturating_sub(BEFORE).min(length - LINE);
    let (before, after) = (from > 0, from + LINE < length);
    let mut part: String = if before { "…" } else { "" }.to_owned();
    part.extend(line.chars().skip(from).take(LINE));
    if after {
        part.push('…');
    }
    let indent = start - from + usize::from(before);
    let shown = LINE - (start - from).min(LINE);
    (part, indent, shown)
}

/// What is wrong with a request: all of it, or the first of much and how much more there is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ConfigErrors {
    /// At most ten.
    pub errors: Vec<ConfigError>,
    /// How many more there are.
    pub more: usize,
}

impl ConfigErrors {
    /// Adds an error, which is made only if it is told.
    pub(super) fn add(&mut self, make: impl FnOnce() -> ConfigError) {
        if self.errors.len() < TOLD {
            self.errors.push(make());
        } else {
            self.more += 1;
        }
    }

    fn into_result(self) -> Result<(), Error> {
        if self.errors.is_empty() {
            Ok(())
        } else {
            Err(self.into())
        }
    }
}

impl FromIterator<ConfigError> for ConfigErrors {
    fn from_iter<T: IntoIterator<Item = ConfigError>>(errors: T) -> Self {
        let mut all = Self::default();
        for error in errors {
            all.add(|| error);
        }
        all
    }
}

impl fmt::Display for ConfigErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, error) in self.errors.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{error}")?;
        }
        match self.more {
            0 => Ok(()),
            1 => write!(f, "\n… and one more error"),
            more => write!(f, "\n… and {more} more errors"),
        }
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
    /// allowed, combinations that cannot be, with the numbers that `[ranges]` drew, files that are
    /// named and cannot be read.
    pub fn load(&self) -> Result<Config, Error> {
        self.load_with_inputs().map(|(config, _)| config)
    }

    /// The same, with the files that the config names: they are read only here.
    ///
    /// # Errors
    /// As [`Layers::load`].
    pub fn load_with_inputs(&self) -> Result<(Config, InputFiles), Error> {
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
        // The argument wins over the file; what the file says must be right all the same.
        let argument = self.preset.as_deref().map(|name| by_name(name, None));
        let mut preset = argument.transpose()?;
        for source in sources {
            if let Some(value) = source.table.remove("preset") {
                let place = source.place_of("preset");
                let named = match value.as_str() {
                    Some(name) => by_name(name, place)?,
                    None => return Err(no_preset(&shown(&value), &[], place)),
                };
                preset = preset.or(Some(named));
            }
        }
        Ok(preset.unwrap_or(Preset::ALL[0]))
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
        resolve(&preset, std::slice::from_mut(&mut source)).map(|(config, _)| config)
    }
}

fn by_name(name: &str, place: Option<Place>) -> Result<Preset, Error> {
    let names: Vec<&str> = Preset::ALL.iter().map(|p| p.name).collect();
    let quoted = format!("\"{}\"", cut(name));
    Preset::by_name(name).ok_or_else(|| {
        let near: Vec<&str> = did_you_mean(name, &names).into_iter().collect();
        no_preset(&quoted, &near, place)
    })
}

fn no_preset(value: &str, near: &[&str], place: Option<Place>) -> Error {
    let names: Vec<_> = Preset::ALL.iter().map(|p| p.name).collect();
    let near = near.iter().map(|name| format!("; did you mean `{name}`?"));
    let message = format!(
        "preset = {value}: must be one of {}{}",
        names.join(", "),
        near.collect::<String>()
    );
    let error = ConfigError {
        path: "preset".to_owned(),
        message,
        place,
    };
    ConfigErrors::from_iter([error]).into()
}

/// A preset with the sources over it, their ranges drawn, proved possible.
fn resolve(preset: &Preset, sources: &mut [Source]) -> Result<(Config, InputFiles), Error> {
    let mut errors = ConfigErrors::default();
    let ranges = ranges::take(sources, &mut errors);
    let sources: &[Source] = sources;
    let mut merged = with_sensors(preset, sources);
    for source in sources {
        check_table("", &source.table, source, &mut errors);
        merge("", &mut merged, &source.table);
    }
    ranges::draw(&ranges, sources, &mut merged, &mut errors);
    errors.into_result()?;
    let config: Config = Value::Table(merged)
        .try_into()
        .expect("a table that passed the checks is a config");
    let place = |path: &str| {
        let said = sources.iter().rev().find_map(|s| s.place_of(path));
        ranges::place_of(&ranges, sources, path).or(said)
    };
    let (inputs, unreadable) = InputFiles::read_all(&config);
    let problems = if unreadable.is_empty() {
        config.problems(&inputs)
    } else {
        unreadable
    };
    let mut errors = ConfigErrors::default();
    for (path, message) in problems {
        errors.add(|| ConfigError {
            place: place(&path),
            path,
            message,
        });
    }
    errors.into_result()?;
    Ok((config, inputs))
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
        let text = nemoral_files::read_text(path, FILE_BYTES)?;
        Self::parse(&path.display().to_string(), false, text)
    }

    /// `terrain.octaves=3` is TOML already; a bare word is text.
    fn setting(setting: &str) -> Result<Self, Error> {
        let name = format!("--set {setting}");
        let Some((key, value)) = setting.split_once('=') else {
            return Err(Error::request(format!("{}: must be KEY=VALUE", cut(&name))));
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
                let error = ConfigError {
                    path: String::new(),
                    message: cut(error.message()),
                    place,
                };
                Err(ConfigErrors::from_iter([error]).into())
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
            let (key, value) = table.get_key_value(*part)?;
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

/// The most bytes of the file that a key names; 0 of a key that names none.
pub(crate) fn most_bytes(key: &str) -> u64 {
    let (table, name) = key.rsplit_once('.').unwrap_or(("", key));
    let spec = section(table).and_then(|s| s.keys.iter().find(|k| k.name == name));
    match spec.map(|k| k.allowed) {
        Some(Allowed::File(most)) => most,
        _ => 0,
    }
}

/// Collects everything that is wrong with one layer.
fn check_table(path: &str, table: &Table, source: &Source, errors: &mut ConfigErrors) {
    let spec = section(path).expect("only sections are entered");
    let mut wrong = |path: &str, message: &dyn Fn() -> String| {
        errors.add(|| source.error(path, message()));
    };
    let mut inner = Vec::new();
    let mut chosen: Vec<(&str, String)> = Vec::new();
    for (key, value) in table {
        let full = join(path, key);
        if let Some(sub) = section(&full) {
            match value {
                Value::Table(sub_table) => inner.push((full.clone(), sub_table)),
                _ => wrong(&full, &|| {
                    let (key, value) = (cut(&full), shown(value));
                    format!("{key} = {value}: must be a table, [{key}]")
                }),
            }
            if let Some(choice) = sub.choice {
                match chosen.iter().find(|(c, _)| *c == choice) {
                    Some((_, other)) => wrong(&full, &|| {
                        format!("[{full}] and [{other}] both give {choice}: keep one")
                    }),
                    None => chosen.push((choice, full.clone())),
                }
            }
        } else if let Some(spec) = spec.keys.iter().find(|k| k.name == key) {
            if !spec.allowed.allows(value) {
                wrong(&full, &|| {
                    let allowed = spec.allowed.describe();
                    format!("{full} = {}: must be {allowed}", shown(value))
                });
            }
        } else {
            wrong(&full, &|| unknown(path, key, value, spec));
        }
    }
    for (path, table) in inner {
        check_table(&path, table, source, errors);
    }
}

fn unknown(path: &str, key: &str, value: &Value, spec: &SectionSpec) -> String {
    // A further sensor's path is not its definition's.
    let prefix = if spec.path.is_empty() {
        String::new()
    } else {
        format!("{}.", spec.path)
    };
    let tables = SECTIONS.iter().filter_map(|s| {
        s.path
            .strip_prefix(&prefix)
            .filter(|rest| !rest.is_empty() && !rest.contains('.'))
    });
    let keys = spec.keys.iter().map(|k| k.name);
    let full = cut(&join(path, key));
    // Somebody who sets a value means no table, and the other way round.
    let alike: Vec<&str> = if value.is_table() {
        tables.clone().collect()
    } else {
        keys.clone().collect()
    };
    if let Some(name) = did_you_mean(key, &alike) {
        return format!("{full}: no such key; did you mean `{name}`?");
    }
    let names: Vec<&str> = keys.chain(tables).collect();
    if names.is_empty() {
        return format!("{full}: no such key; [{path}] has none");
    }
    format!("{full}: no such key; there are {}", names.join(", "))
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
