//! The configs of a data set's sequences.

mod shared;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use nemoral_dataset::Split;
use nemoral_seed::{Domain, Key};
use toml::{Table, Value};

use super::config_errors::{ConfigError, ConfigErrors};
use super::dotted_keys::{most_bytes, to_table, value_at};
use super::file_paths::{SEQUENCE_UP, for_each_file};
use super::latin_hypercube::even;
use super::load::{base, merge, merged, resolve};
use super::source::Source;
use super::vary::{self, Variation};
use super::{Config, Error, InputFiles, Preset, Splits};

const SEEDS: Domain = Domain::new("pipeline.sequence");
const SPLITS: Domain = Domain::new("pipeline.split");
const PLANTS: Domain = Domain::new("pipeline.plants");

/// The sequences of a request. Each is a config of its own, made when it is asked for.
///
/// ```
/// use nemoral_config::ConfigLayers;
///
/// let stands = "vary.preset=[\"beech\", \"spruce\"]";
/// let settings = ["sequences=8", "splits.train=0.75", "splits.test=0.25", stands];
/// let settings = settings.map(String::from).into();
/// let layers = ConfigLayers { settings, ..ConfigLayers::default() };
/// let sequences = layers.sequences()?;
/// assert_eq!(sequences.len(), 8);
/// let third = sequences.get(3)?;
/// println!("seed {}, {:?}, {:?}", third.config.seed, third.split, third.drawn);
/// # Ok::<(), nemoral_config::Error>(())
/// ```
#[derive(Clone)]
pub struct Sequences {
    preset: Option<String>,
    sources: Vec<Source>,
    variations: Vec<Variation>,
    /// What was asked for, with what was drawn for sequence 0.
    asked: Config,
    seed: u64,
    /// Of each sequence, if the data set is split.
    splits: Vec<Split>,
    /// The files that the configs made so far name. Each is read once, so that all plans of the
    /// request see the same bytes, whatever happens to the file meanwhile.
    files: Arc<Mutex<InputFiles>>,
}

/// A sequence of a request.
#[derive(Clone, Debug)]
pub struct SequenceConfig {
    /// Its number.
    pub number: u32,
    /// Its world and sensors.
    pub config: Config,
    /// The files that the config names, read with it.
    pub inputs: InputFiles,
    /// What was drawn for it, by key.
    pub drawn: BTreeMap<String, Value>,
    /// What it is for, if the data set is split.
    pub split: Option<Split>,
}

impl SequenceConfig {
    /// The config with the names that its files have in a data set that carries them, below the
    /// data set's folder: they do not depend on where the files lay.
    #[must_use]
    pub fn as_carried(&self) -> Config {
        (self.config).with_files(&|path| self.inputs.carried_name(path))
    }

    /// The TOML of the config in a data set, where the names of files start at the sequence's own
    /// folder.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let from_sequence = |path: &str| match self.inputs.carried_name(path) {
            name if name.is_empty() => name,
            name => format!("{SEQUENCE_UP}{name}"),
        };
        self.config.with_files(&from_sequence).to_toml()
    }

    /// What was drawn, by key, with files as in [`SequenceConfig::as_carried`].
    #[must_use]
    pub fn drawn_as_carried(&self) -> serde_json::Map<String, serde_json::Value> {
        let of = |(key, value): (&String, &Value)| {
            let path = value.as_str().filter(|_| most_bytes(key) > 0);
            let value = match path {
                Some(path) => self.inputs.carried_name(path).into(),
                None => serde_json::to_value(value).expect("TOML is plain data"),
            };
            (key.clone(), value)
        };
        self.drawn.iter().map(of).collect()
    }
}

impl std::fmt::Debug for Sequences {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names = self.variations.iter().map(Variation::name);
        f.debug_struct("Sequences")
            .field("preset", &self.preset)
            .field("count", &self.asked.sequences)
            .field("seed", &self.seed)
            .field("vary", &names.collect::<Vec<_>>())
            .field("splits", &self.splits)
            .finish_non_exhaustive()
    }
}

impl Sequences {
    pub(super) fn new(preset: Option<String>, sources: Vec<Source>) -> Result<Self, Error> {
        let mut errors = ConfigErrors::default();
        let mut sequences = Self::drawing(preset, sources, &mut errors);
        let (preset, sources) = sequences.layers(0)?;
        let (config, files) = resolve(&preset, &sources, errors, &InputFiles::default(), |_| {})?;
        sequences.files = Arc::new(Mutex::new(files));
        sequences.asked = config;
        let splits = &sequences.asked.splits;
        if splits.train + splits.val + splits.test > 0.0 {
            sequences.splits = sequences.split(splits)?;
            sequences.refuse_shared_worlds()?;
        }
        Ok(sequences)
    }

    /// What is asked for with what is drawn for sequence 0, though combinations of values may be
    /// impossible, and no file is read.
    pub(super) fn unchecked(preset: Option<String>, sources: Vec<Source>) -> Result<Config, Error> {
        let mut errors = ConfigErrors::default();
        let sequences = Self::drawing(preset, sources, &mut errors);
        let (preset, sources) = sequences.layers(0)?;
        merged(&preset, &sources, errors)
    }

    /// The sources with their draws, of which none is resolved.
    fn drawing(
        preset: Option<String>,
        mut sources: Vec<Source>,
        errors: &mut ConfigErrors,
    ) -> Self {
        let variations = vary::take(&mut sources, errors);
        let said = |path: &str| sources.iter().rev().find_map(|s| value_at(&s.table, path));
        let seed = said("seed").and_then(Value::as_integer);
        Self {
            preset,
            asked: Config::default(),
            seed: seed.map_or(Config::default().seed, i64::unsigned_abs),
            splits: Vec::new(),
            files: Arc::default(),
            variations,
            sources,
        }
    }

    /// The sequences of a config that code has made, which draws nothing.
    ///
    /// # Errors
    /// If a value or a combination of values is impossible, or a file that it names cannot be read.
    pub fn of(config: &Config) -> Result<Self, Error> {
        let source = Source::parse("config", false, config.to_toml())?;
        Self::new(None, vec![source])
    }

    /// How many there are, at least one.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "there is at least one")]
    pub fn len(&self) -> u32 {
        self.asked.sequences
    }

    /// What was asked for, with what was drawn for sequence 0.
    #[must_use]
    pub fn asked(&self) -> &Config {
        &self.asked
    }

    /// The seed from which those of the sequences come.
    #[must_use]
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// The config of a sequence.
    ///
    /// # Errors
    /// If there is no such sequence, or what was drawn for it is impossible.
    pub fn get(&self, number: u32) -> Result<SequenceConfig, Error> {
        if number >= self.len() {
            let last = self.len() - 1;
            let message = format!("sequence {number}: must be 0 to {last}; sequences = N has more");
            return Err(Error::request(message));
        }
        let (preset, sources) = self.layers(number)?;
        let split = self.splits.get(number as usize).copied();
        let adjust = |config: &mut Config| {
            config.sequences = 1;
            config.seed = self.seed_of(number);
            config.splits = Splits::default();
            if self.len() > 1 && config.assets.own_seed().is_none() {
                config.assets.seed = self.plants_of(split);
            }
        };
        let mut known = self.files.lock().unwrap_or_else(PoisonError::into_inner);
        let resolved = resolve(&preset, &sources, ConfigErrors::default(), &known, adjust);
        let (config, inputs) = resolved.map_err(|e| e.in_sequence(number, self.len()))?;
        *known = known.and(&inputs);
        drop(known);
        if config.frames != self.asked.frames {
            let message = format!(
                "frames = 0: the path of sequence {number} has {} places and that of sequence 0 \
                 {}: must be a number, as all sequences of a data set have equally many frames",
                config.frames, self.asked.frames
            );
            return Err(Error::request(message));
        }
        let merged = to_table(&config);
        Ok(SequenceConfig {
            number,
            drawn: vary::report(&self.variations, self.seed, number, preset.name, &merged),
            config,
            inputs,
            split,
        })
    }

    /// The request as the TOML of a data set, from which all sequences can be made again: of a
    /// single sequence every key, of several what was asked for over the presets. Files have the
    /// names under which the data set carries them.
    ///
    /// # Errors
    /// As [`Sequences::get`].
    pub fn to_toml(&self) -> Result<String, Error> {
        if self.len() == 1 {
            return Ok(self.get(0)?.as_carried().to_toml());
        }
        let mut merged = Table::new();
        let draws_preset = self.variations.iter().any(|v| v.sets("preset"));
        let mut sources = self.sources.clone();
        let preset = base(self.preset.as_deref(), &mut sources)?;
        if !draws_preset || self.preset.is_some() {
            merged.insert("preset".to_owned(), preset.name.into());
        }
        for source in &sources {
            merge("", &mut merged, &source.table);
        }
        // Files that no sequence has drawn so far are not carried, but named in the same way.
        let files = self.files.lock().unwrap_or_else(PoisonError::into_inner);
        let rename = |path: &str| files.carried_name(path);
        for_each_file(&mut merged, "", &mut |_, path| *path = rename(path));
        let variations: Vec<Variation> = (self.variations.iter())
            .map(|v| v.with_files(&rename))
            .collect();
        drop(files);
        merged.insert("seed".to_owned(), Value::Integer(self.seed as i64));
        let vary = vary::to_table(&variations, self.preset.is_some());
        if !vary.is_empty() {
            merged.insert("vary".to_owned(), Value::Table(vary));
        }
        Ok(toml::to_string(&merged).expect("a table is plain data"))
    }

    /// The preset and the sources of a sequence, with what is drawn for it.
    fn layers(&self, number: u32) -> Result<(Preset, Vec<Source>), Error> {
        let mut sources = vary::drawn(&self.sources, &self.variations, self.seed, number);
        let preset = base(self.preset.as_deref(), &mut sources)?;
        Ok((preset, sources))
    }

    /// The seed of a sequence's world.
    fn seed_of(&self, number: u32) -> u64 {
        if number == 0 {
            return self.seed;
        }
        // TOML has whole numbers to 2^63 - 1.
        let key = Key::world(self.seed).domain(SEEDS).item(number.into());
        key.to_u64() >> 1
    }

    /// The seed of the plants of a split.
    fn plants_of(&self, split: Option<Split>) -> u64 {
        let key = Key::world(self.seed).domain(PLANTS);
        let key = split.map_or(key, |split| key.domain(Domain::new(split.name())));
        (key.to_u64() >> 1).max(1)
    }

    /// The split of each sequence. It depends on those before, not on those after.
    fn split(&self, splits: &Splits) -> Result<Vec<Split>, Error> {
        let refused = |path: &str, message: String| {
            let location = self.sources.iter().rev().find_map(|s| s.location_of(path));
            let path = path.to_owned();
            let error = ConfigError {
                path,
                message,
                location,
            };
            Err(ConfigErrors::from_iter([error]).into())
        };
        let shares = [splits.train, splits.val, splits.test];
        let sum: f64 = shares.iter().sum();
        if (sum - 1.0).abs() > 1e-6 {
            let message = format!("splits: train + val + test = {sum}: must be 1");
            return refused("splits", message);
        }
        let by = &splits.by;
        let strata = self
            .variations
            .iter()
            .find(|v| v.name() == by || v.name().strip_prefix("group.") == Some(by));
        let is_choice = strata.is_some_and(|v| v.alternative(self.seed, 0).is_some());
        if !by.is_empty() && !is_choice {
            let names: Vec<&str> = (self.variations.iter())
                .filter(|v| v.alternative(self.seed, 0).is_some())
                .map(Variation::name)
                .collect();
            let message = format!(
                "splits.by = \"{by}\": must be a choice or group in [vary], of which there are: {}",
                if names.is_empty() {
                    "none".to_owned()
                } else {
                    names.join(", ")
                }
            );
            return refused("splits.by", message);
        }
        let mut members: BTreeMap<usize, u32> = BTreeMap::new();
        let of = |number: u32| {
            let stratum = strata
                .and_then(|v| v.alternative(self.seed, number))
                .unwrap_or(0);
            let position = members.entry(stratum).or_default();
            let key = Key::world(self.seed).domain(SPLITS).item(stratum as u64);
            let u = even(key, *position);
            *position += 1;
            if u < splits.train {
                Split::Train
            } else if u < splits.train + splits.val {
                Split::Val
            } else {
                Split::Test
            }
        };
        Ok((0..self.len()).map(of).collect())
    }
}

#[cfg(test)]
mod tests;
