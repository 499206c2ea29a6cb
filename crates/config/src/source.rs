//! The TOML sources of a request: their values, and the places of these.

use std::ops::Range;
use std::path::Path;

use nemoral_scene::on_deep_stack;
use toml::Table;
use toml::de::{DeTable, DeValue};

use super::Error;
use super::config_errors::{ConfigError, ConfigErrors, ErrorLocation};
use super::dotted_keys::join;
use super::file_paths::{Base, for_each_file};
use super::quotations::cut;

/// The tables that say what is drawn for each sequence: `ranges` is the older name.
pub(super) const VARY_TABLES: [&str; 2] = ["vary", "ranges"];

/// The largest config file: as large as those that a data set may have.
const FILE_BYTES: u64 = nemoral_dataset::CONFIG_BYTES;

/// The most values in each other: a config has six levels, and what walks values recurses.
const MOST_LEVELS: usize = 32;

/// TOML text with its name and its values.
#[derive(Clone)]
pub(super) struct Source {
    pub(super) name: String,
    pub(super) is_argument: bool,
    pub(super) text: String,
    pub(super) table: Table,
    /// Whether the values are what the text's draws gave.
    pub(super) is_drawn: bool,
    /// Where relative paths of files start.
    pub(super) base: Base,
}

impl Source {
    pub(super) fn file(path: &Path) -> Result<Self, Error> {
        let text = nemoral_files::read_text(path, FILE_BYTES)?;
        let mut source = Self::parse(&path.display().to_string(), false, text)?;
        source.base = Base::of_config(path);
        let mut errors = ConfigErrors::default();
        let mut table = std::mem::take(&mut source.table);
        for_each_file(&mut table, "", &mut |key, name| {
            source.resolve(key, name, &mut errors);
        });
        source.table = table;
        errors.into_result()?;
        Ok(source)
    }

    /// Makes the path of a file one that starts at the working folder.
    pub(super) fn resolve(&self, key: &str, name: &mut String, errors: &mut ConfigErrors) {
        match self.base.resolve(key, name) {
            Ok(path) => *name = path,
            Err(message) => errors.add(|| self.error(key, message)),
        }
    }

    /// A `--set` argument. `terrain.octaves=3` is TOML already; a bare word is taken as text.
    pub(super) fn setting(setting: &str) -> Result<Self, Error> {
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

    pub(super) fn parse(name: &str, is_argument: bool, text: String) -> Result<Self, Error> {
        let read = on_deep_stack(|| table_of(&text))
            .map_err(|e| Error::request(format!("{}: {e}", cut(name))))?;
        match read {
            Ok(table) => Ok(Self {
                name: name.to_owned(),
                is_argument,
                text,
                table,
                is_drawn: false,
                base: Base::WorkingFolder,
            }),
            Err((message, span)) => {
                let location = if is_argument {
                    ErrorLocation::Argument(name.to_owned())
                } else {
                    location(name, &text, span)
                };
                let error = ConfigError {
                    path: String::new(),
                    message,
                    location: Some(location),
                };
                Err(ConfigErrors::from_iter([error]).into())
            }
        }
    }

    /// An error about a dotted key of this source.
    pub(super) fn error(&self, path: &str, message: String) -> ConfigError {
        ConfigError {
            path: path.to_owned(),
            message,
            location: self.location_of(path),
        }
    }

    /// The location of a dotted key in this source.
    pub(super) fn location_of(&self, path: &str) -> Option<ErrorLocation> {
        if self.is_drawn {
            return self.location_of_drawn(path);
        }
        let parts: Vec<&str> = path.split('.').collect();
        self.location_of_parts(&parts)
    }

    /// The location of a drawn key.
    pub(super) fn location_of_drawn(&self, path: &str) -> Option<ErrorLocation> {
        for table in VARY_TABLES {
            // It may be one quoted key, or nested tables.
            let quoted = self.location_of_parts(&[table, path]);
            let location = quoted.or_else(|| {
                let path = join(table, path);
                self.location_of_parts(&path.split('.').collect::<Vec<_>>())
            });
            if location.is_some() {
                return location;
            }
        }
        // It is in a group; which one is not known.
        self.location_of_parts(&["vary", "group"])
    }

    /// The location of a key whose parts may contain dots.
    pub(super) fn location_of_parts(&self, parts: &[&str]) -> Option<ErrorLocation> {
        let parsed = DeTable::parse(&self.text).ok()?;
        let mut table = parsed.get_ref();
        let mut parts = parts.iter().peekable();
        while let Some(part) = parts.next() {
            let (key, value) = table.get_key_value(*part)?;
            if parts.peek().is_none() {
                if self.is_argument {
                    return Some(ErrorLocation::Argument(self.name.clone()));
                }
                let end = if value.get_ref().is_table() {
                    key.span().end
                } else {
                    value.span().end
                };
                return Some(location(&self.name, &self.text, key.span().start..end));
            }
            table = value.get_ref().as_table()?;
        }
        None
    }
}

/// The values of a text, or what is wrong with it, and where. It needs a deep stack.
fn table_of(text: &str) -> Result<Table, (String, Range<usize>)> {
    let wrong = |e: toml::de::Error| (cut(e.message()), e.span().unwrap_or_default());
    let parsed = DeTable::parse(text).map_err(wrong)?;
    if is_deeper(parsed.get_ref(), MOST_LEVELS) {
        let message = format!("values lie in each other deeper than {MOST_LEVELS} levels");
        return Err((message, 0..0));
    }
    text.parse::<Table>().map_err(wrong)
}

/// Whether values lie in each other on more levels than `most`.
fn is_deeper(table: &DeTable<'_>, most: usize) -> bool {
    let mut left: Vec<_> = table.values().map(|v| (v.get_ref(), 1)).collect();
    while let Some((value, level)) = left.pop() {
        if level > most {
            return true;
        }
        match value {
            DeValue::Table(inner) => left.extend(inner.values().map(|v| (v.get_ref(), level + 1))),
            DeValue::Array(inner) => left.extend(inner.iter().map(|v| (v.get_ref(), level + 1))),
            _ => {}
        }
    }
    false
}

fn location(name: &str, text: &str, span: Range<usize>) -> ErrorLocation {
    let start = span.start.min(text.len());
    let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
    let line_end = text[start..].find('\n').map_or(text.len(), |i| start + i);
    let end = span.end.clamp(start, line_end);
    ErrorLocation::File {
        name: name.to_owned(),
        line: text[..start].matches('\n').count() + 1,
        column: text[line_start..start].chars().count() + 1,
        text: text[line_start..line_end].to_owned(),
        length: text[start..end].chars().count(),
    }
}
