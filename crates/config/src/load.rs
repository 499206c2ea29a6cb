//! Layering and checking: preset, then file, then `--set`.

use std::collections::BTreeSet;
use std::path::PathBuf;

use toml::{Table, Value};

use super::config_errors::{ConfigError, ConfigErrors, ErrorLocation};
use super::dotted_keys::{join, section, to_table, value_at};
use super::quotations::{cut, did_you_mean, shown};
use super::schema::SectionSpec;
use super::source::Source;
use super::{
    CameraCalibration, Config, Error, InputFiles, Model, Preset, SECTIONS, Sequences, devices,
};

/// What a user asked for, in layers: a preset, a file over it, settings over that.
#[derive(Clone, Debug, Default)]
pub struct ConfigLayers {
    /// The preset's name; `default` if none. A file may name its own with `preset = "…"`.
    pub preset: Option<String>,
    /// A TOML file.
    pub file: Option<PathBuf>,
    /// `key=value` settings.
    pub settings: Vec<String>,
}

impl ConfigLayers {
    /// Reads, checks and merges the layers.
    ///
    /// # Errors
    /// All errors: unreadable or malformed files, unknown keys, values that are not allowed,
    /// impossible combinations (with what `[vary]` drew), and named files that cannot
    /// be read.
    pub fn load(&self) -> Result<Config, Error> {
        self.load_with_inputs().map(|(config, _)| config)
    }

    /// The same, with the files that the config names, which are read only here.
    ///
    /// # Errors
    /// As [`ConfigLayers::load`].
    pub fn load_with_inputs(&self) -> Result<(Config, InputFiles), Error> {
        let first = self.sequences()?.get(0)?;
        Ok((first.config, first.inputs))
    }

    /// All sequences of the request, each with its own config.
    ///
    /// # Errors
    /// As [`ConfigLayers::load`], for the first sequence, and if the splits are impossible.
    pub fn sequences(&self) -> Result<Sequences, Error> {
        Sequences::new(self.preset.clone(), self.sources()?)
    }

    /// The file and the settings.
    pub(super) fn sources(&self) -> Result<Vec<Source>, Error> {
        let mut sources = Vec::new();
        if let Some(path) = &self.file {
            sources.push(Source::file(path)?);
        }
        for setting in &self.settings {
            sources.push(Source::setting(setting)?);
        }
        Ok(sources)
    }
}

/// The preset, which the argument or the sources name. The argument overrides the sources, whose
/// own presets must be valid all the same.
pub(super) fn base(argument: Option<&str>, sources: &mut [Source]) -> Result<Preset, Error> {
    let mut preset = argument.map(|name| by_name(name, None)).transpose()?;
    for source in sources {
        if let Some(value) = source.table.remove("preset") {
            let location = source.location_of("preset");
            let named = match value.as_str() {
                Some(name) => by_name(name, location)?,
                None => return Err(no_preset(&shown(&value), &[], location)),
            };
            preset = preset.or(Some(named));
        }
    }
    Ok(preset.unwrap_or(Preset::ALL[0]))
}

impl Config {
    /// The config as TOML, every key present.
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(&to_table(self)).expect("a config is plain data")
    }

    /// Refuses values that their keys do not allow, and impossible combinations of those that they
    /// do.
    ///
    /// # Errors
    /// All values that are not allowed; if there are none, all impossible combinations.
    pub fn check(&self, inputs: &InputFiles) -> Result<(), Error> {
        self.check_values(inputs)?;
        let problems = self.problems(inputs).into_iter();
        let errors = problems.map(|(path, message)| ConfigError {
            path,
            message,
            location: None,
        });
        ConfigErrors::from_iter(errors).into_result()?;
        Ok(())
    }

    /// Refuses values that their keys do not allow, which only code can set, as layers refuse them;
    /// and files that are not those of this config.
    ///
    /// # Errors
    /// All such values, or the first file that was not read with the config.
    pub fn check_values(&self, inputs: &InputFiles) -> Result<(), Error> {
        // TOML has no whole numbers beyond this, so they are in no table.
        let whole = [
            ("seed", self.seed),
            ("frames", self.frames),
            ("assets.seed", self.assets.seed),
        ];
        let too_large = whole
            .into_iter()
            .filter(|(_, number)| i64::try_from(*number).is_err());
        let errors = too_large.map(|(key, number)| ConfigError {
            path: key.to_owned(),
            message: format!("{key} = {number}: must be at most {}", i64::MAX),
            location: None,
        });
        ConfigErrors::from_iter(errors).into_result()?;
        let mut errors = ConfigErrors::default();
        check_table("", &to_table(self), &mut |path, message| {
            errors.add(|| ConfigError {
                path: path.to_owned(),
                message: message(),
                location: None,
            });
        });
        errors.into_result()?;
        inputs.check(self)
    }

    /// A config from TOML that [`Config::to_toml`] or a user wrote.
    ///
    /// # Errors
    /// As [`ConfigLayers::load`].
    pub fn from_toml(text: &str) -> Result<Self, Error> {
        let source = Source::parse("config.toml", false, text.to_owned())?;
        Ok(Sequences::new(None, vec![source])?.get(0)?.config)
    }
}

fn by_name(name: &str, location: Option<ErrorLocation>) -> Result<Preset, Error> {
    let names: Vec<&str> = Preset::ALL.iter().map(|p| p.name).collect();
    let quoted = format!("\"{}\"", cut(name));
    Preset::by_name(name).ok_or_else(|| {
        let near: Vec<&str> = did_you_mean(name, &names).into_iter().collect();
        no_preset(&quoted, &near, location)
    })
}

fn no_preset(value: &str, near: &[&str], location: Option<ErrorLocation>) -> Error {
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
        location,
    };
    ConfigErrors::from_iter([error]).into()
}

/// A preset with the sources over it, checked; `adjust` changes it before that. `errors` are those
/// found so far, `known` the files that were read already.
pub(super) fn resolve(
    preset: &Preset,
    sources: &[Source],
    errors: ConfigErrors,
    known: &InputFiles,
    adjust: impl FnOnce(&mut Config),
) -> Result<(Config, InputFiles), Error> {
    let mut config = merged(preset, sources, errors)?;
    adjust(&mut config);
    let location = |path: &str| {
        let said = sources
            .iter()
            .rev()
            .filter(|s| value_at(&s.table, path).is_some());
        said.into_iter().find_map(|s| s.location_of(path))
    };
    let (inputs, unreadable) = InputFiles::read_all(&config, known);
    if config.frames == 0 {
        // What is wrong with a path is told by its own problems.
        let places = config.robot.places(&inputs).ok().flatten();
        config.frames = places.unwrap_or(0);
    }
    let problems = if unreadable.is_empty() {
        config.problems(&inputs)
    } else {
        unreadable
    };
    let mut errors = ConfigErrors::default();
    for (path, message) in problems {
        errors.add(|| ConfigError {
            location: location(&path),
            path,
            message,
        });
    }
    errors.into_result()?;
    Ok((config, inputs))
}

/// A preset with the sources over it, each value checked, but neither combinations nor files.
pub(super) fn merged(
    preset: &Preset,
    sources: &[Source],
    mut errors: ConfigErrors,
) -> Result<Config, Error> {
    let mut merged = with_sensors(preset, sources);
    for source in sources {
        check_table("", &source.table, &mut |path, message| {
            errors.add(|| source.error(path, message()));
        });
        merge("", &mut merged, &source.table);
    }
    errors.into_result()?;
    CameraCalibration::complete(table_at(&mut merged, "camera"));
    let further = table_at(&mut merged, "cameras").iter_mut();
    for (_, camera) in further {
        camera.as_table_mut().map(CameraCalibration::complete);
    }
    let config = Value::Table(merged).try_into();
    Ok(config.expect("a table that passed the checks is a config"))
}

/// A preset with the defaults of what the sources name: further cameras, LiDARs and lamps have the
/// values of the first one, LiDARs with a device those of its data sheet over them, and models
/// their own.
fn with_sensors(preset: &Preset, sources: &[Source]) -> Table {
    let mut merged = to_table(&preset.config());
    let lidar_of = |device: Option<String>| device.and_then(|name| devices::layer(&name));
    if let Some(layer) = lidar_of(last_text(sources, &["lidar", "device"])) {
        merge("lidar", table_at(&mut merged, "lidar"), &layer);
    }
    for name in names(sources, "models") {
        let model = Value::Table(to_table(&Model::default()));
        table_at(&mut merged, "models").insert(name, model);
    }
    let mut first_of = |key: &str| {
        let mut first = table_at(&mut merged, key).clone();
        for said in sources.iter().filter_map(|s| s.table.get(key)) {
            if let Value::Table(said) = said {
                merge(key, &mut first, said);
            }
        }
        first
    };
    let [camera, lidar, lamp] = ["camera", "lidar", "lamp"].map(&mut first_of);
    for (tables, first) in [("cameras", camera), ("lamps", lamp)] {
        for name in names(sources, tables) {
            table_at(&mut merged, tables).insert(name, Value::Table(first.clone()));
        }
    }
    for name in names(sources, "lidars") {
        let path = format!("lidars.{name}");
        let mut lidar = lidar.clone();
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

/// The text of a key in the last source that has it.
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

/// What is told of each key with which something is wrong: its path, and how to make the message.
type Wrong<'a> = dyn FnMut(&str, &dyn Fn() -> String) + 'a;

/// Tells everything that is wrong with the table at a path.
fn check_table(path: &str, table: &Table, wrong: &mut Wrong<'_>) {
    let spec = section(path).expect("only sections are entered");
    let mut inner = Vec::new();
    let mut chosen: Vec<(&str, String)> = Vec::new();
    for (key, value) in table {
        let full = join(path, key);
        // A quoted key with dots is no path.
        if let Some(sub) = section(&full).filter(|_| !key.contains('.')) {
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
        } else if let Some(allowed) = spec.allowed(key) {
            if !allowed.allows(value) {
                wrong(&full, &|| {
                    let (key, allowed) = (cut(&full), allowed.describe());
                    format!("{key} = {}: must be {allowed}", shown(value))
                });
            }
        } else {
            wrong(&full, &|| unknown(path, key, value, spec));
        }
    }
    for (path, table) in inner {
        check_table(&path, table, wrong);
    }
}

fn unknown(path: &str, key: &str, value: &Value, spec: &SectionSpec) -> String {
    // The path of a further sensor differs from that of its definition.
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
    // A value is compared with keys and a table with tables.
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
pub(super) fn merge(path: &str, base: &mut Table, over: &Table) {
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

#[cfg(test)]
mod tests;
