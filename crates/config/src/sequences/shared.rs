//! What would make parts of worlds the same in different splits.
//!
//! A file stands for its content, as everywhere: another path to it, or a copy, is the same.

use std::collections::BTreeMap;
use std::path::Path;

use nemoral_dataset::Split;
use toml::Value;

use super::Sequences;
use crate::Error;
use crate::config_errors::{ConfigError, ConfigErrors, ErrorLocation};
use crate::dotted_keys::{most_bytes, value_at};
use crate::quotations::shown;
use crate::source::Source;

/// A key by which worlds have something in common if they have the same value of it.
struct SharingKey {
    path: &'static str,
    /// What they have in common then.
    what: &'static str,
    /// What the value must be instead.
    allowed: &'static str,
}

/// What must differ between the sequences of different splits. A value of 0 or "" is none.
const SHARING_KEYS: [SharingKey; 4] = [
    SharingKey {
        path: "assets.seed",
        what: "plants and textures",
        allowed: "0, which gives each split a seed of its own, or another one in each split",
    },
    SharingKey {
        path: "site.stems.path",
        what: "trees",
        allowed: OF_SITE,
    },
    SharingKey {
        path: "site.terrain.path",
        what: "ground",
        allowed: OF_SITE,
    },
    SharingKey {
        path: "site.trails.path",
        what: "trails",
        allowed: OF_SITE,
    },
];

const OF_SITE: &str = "\"\", or another file in each split; without [splits], each of several data \
    sets may have a site";

impl Sequences {
    /// Refuses plants and sites that sequences of different splits would have in common.
    pub(super) fn refuse_shared_worlds(&self) -> Result<(), Error> {
        let found = SHARING_KEYS.iter().filter_map(|key| self.shared_by(key));
        ConfigErrors::from_iter(found).into_result()?;
        Ok(())
    }

    /// What is wrong with a key if sequences of different splits have the same value of it.
    fn shared_by(&self, key: &SharingKey) -> Option<ConfigError> {
        let mut first_with: BTreeMap<String, (usize, Split)> = BTreeMap::new();
        // Each file is read once.
        let mut identities: BTreeMap<String, String> = BTreeMap::new();
        for (number, &split) in self.splits.iter().enumerate() {
            let found = self.value_of(key.path, number as u32);
            let Some((value, location)) = found.filter(|(value, _)| !is_none(value)) else {
                continue;
            };
            let identity = identities
                .entry(value.to_string())
                .or_insert_with(|| identity(key.path, &value));
            let &mut (first, of_first) =
                (first_with.entry(identity.clone())).or_insert((number, split));
            if of_first != split {
                let SharingKey {
                    path,
                    what,
                    allowed,
                } = key;
                let message = format!(
                    "{path} = {}: sequences {first} ({of_first}) and {number} ({split}) would have \
                     {what} in common: with [splits], it must be {allowed}",
                    shown(&value)
                );
                return Some(ConfigError {
                    path: (*path).to_owned(),
                    message,
                    location: location(),
                });
            }
        }
        None
    }

    /// The value that the sources or their draws give to a key in a sequence, and what finds its
    /// place.
    fn value_of<'a>(
        &'a self,
        path: &'static str,
        sequence: u32,
    ) -> Option<(Value, impl Fn() -> Option<ErrorLocation> + 'a)> {
        let of_source = |(number, source): (usize, &'a Source)| {
            let drawn = (self.variations.iter().rev())
                .filter(|v| v.source() == number)
                .find_map(|v| v.value_of(path, self.seed, sequence));
            let is_drawn = drawn.is_some();
            let set = || value_at(&source.table, path).cloned();
            Some((drawn.or_else(set)?, is_drawn, source))
        };
        // What a source draws is over what it sets, and a later source is over both.
        let (value, is_drawn, source) =
            self.sources.iter().enumerate().rev().find_map(of_source)?;
        let location = move || match is_drawn {
            true => source.location_of_drawn(path),
            false => source.location_of(path),
        };
        Some((value, location))
    }
}

/// What equal values have in common: the content of the file that a path names. A file that cannot
/// be read is refused where its sequence is made.
fn identity(path: &str, value: &Value) -> String {
    let content = value.as_str().and_then(|file| {
        let bytes = nemoral_files::read(Path::new(file), most_bytes(path)).ok()?;
        Some(blake3::hash(&bytes).to_string())
    });
    content.unwrap_or_else(|| value.to_string())
}

/// Whether a value stands for no seed or no file.
fn is_none(value: &Value) -> bool {
    match value {
        Value::Integer(seed) => *seed == 0,
        Value::String(path) => path.is_empty(),
        _ => false,
    }
}
