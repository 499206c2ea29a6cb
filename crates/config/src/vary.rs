//! What is drawn anew for each sequence: `[vary]`, and its other name `[ranges]`.

mod parse;

use std::collections::BTreeMap;

use nemoral_seed::{Domain, Key};
use toml::{Table, Value};

use super::config_errors::ConfigErrors;
use super::dotted_keys::{most_bytes, value_at};
use super::latin_hypercube::spread;
use super::quotations::shown;
use super::schema::SectionSpec;
use super::source::{Source, VARY_TABLES};

const VARY_DRAWS: Domain = Domain::new("pipeline.vary");

/// What differs between sequences.
pub(super) const VARY: SectionSpec = SectionSpec {
    path: "vary",
    doc: " What is drawn from the seed for each sequence, as if the drawn value were written in \
        the place of the draw. A key with a number: `\"placement.trees\" = [60, 140]` draws from \
        this range, both ends included. A key with words or flags: `\"lidar.device\" = [\"mid70\", \
        \"vlp16\"]` draws one of these, and `preset = { beech = 2, spruce = 1 }` does so by \
        weight. What belongs together is a group, of which one alternative is drawn, with its \
        `weight` if it has one: `[[vary.group.season]]`, then keys with values or with draws, once \
        for each alternative. The draws of each 8 sequences cover a range or alternatives evenly. \
        What was drawn is in the sequence's config.toml and in dataset.json. A value that is set \
        later, by `--set` over a file, overrides the draw.",
    choice: None,
    keys: &[],
    named: None,
    defaults: toml::Table::new,
};

/// The other name.
pub(super) const RANGES: SectionSpec = SectionSpec {
    path: "ranges",
    doc: " Another name of [vary].",
    choice: None,
    keys: &[],
    named: None,
    defaults: toml::Table::new,
};

/// One draw, of a key or of a group.
#[derive(Clone, Debug)]
pub(super) struct Variation {
    /// The key's path, or `group.NAME`.
    name: String,
    draw: Draw,
    /// The position of its source.
    source: usize,
}

/// How a value is drawn.
#[derive(Clone, Debug)]
enum Draw {
    /// A number, both ends included.
    Number { low: f64, high: f64, whole: bool },
    /// One of these values, by weight.
    Choice(Vec<(f64, Value)>),
    /// One of these sets of values, by weight.
    Group(Vec<(f64, Vec<(String, Member)>)>),
}

/// A key's value in an alternative of a group.
#[derive(Clone, Debug)]
enum Member {
    Fixed(Value),
    Drawn(Draw),
}

/// Takes the draws out of the sources. A later source's draw or value replaces an earlier draw.
pub(super) fn take(sources: &mut [Source], errors: &mut ConfigErrors) -> Vec<Variation> {
    let mut all: Vec<Variation> = Vec::new();
    for (number, source) in sources.iter_mut().enumerate() {
        let said = VARY_TABLES.map(|name| (name, source.table.remove(name)));
        all.retain(|v| value_at(&source.table, &v.name).is_none());
        for (table, value) in said {
            let found = match value {
                None => continue,
                Some(Value::Table(found)) => found,
                Some(other) => {
                    let message =
                        format!("{table} = {}: must be a table, [{table}]", shown(&other));
                    errors.add(|| source.error(table, message));
                    continue;
                }
            };
            for (name, mut draw) in parse::table(table, found, source, errors) {
                draw.for_each_file(&name, &mut |key, file| source.resolve(key, file, errors));
                all.retain(|v| v.name != name);
                all.push(Variation {
                    name,
                    draw,
                    source: number,
                });
            }
        }
    }
    all
}

/// The sources of a sequence: after each source what its draws give. `seed` is that of the data
/// set.
pub(super) fn drawn(
    sources: &[Source],
    variations: &[Variation],
    seed: u64,
    sequence: u32,
) -> Vec<Source> {
    let mut all = Vec::new();
    for (number, source) in sources.iter().enumerate() {
        all.push(source.clone());
        let mut table = Table::new();
        for variation in variations.iter().filter(|v| v.source == number) {
            for (path, value) in variation.values(seed, sequence) {
                insert(&mut table, &path, value);
            }
        }
        if !table.is_empty() {
            all.push(Source {
                table,
                is_drawn: true,
                ..source.clone()
            });
        }
    }
    all
}

/// The keys that a sequence's draws set, with the values that a merged config has for them.
pub(super) fn report(
    variations: &[Variation],
    seed: u64,
    sequence: u32,
    preset: &str,
    merged: &Table,
) -> BTreeMap<String, Value> {
    let mut report = BTreeMap::new();
    for variation in variations {
        for (path, _) in variation.values(seed, sequence) {
            let value = match path.as_str() {
                "preset" => Some(Value::from(preset)),
                path => value_at(merged, path).cloned(),
            };
            report.extend(value.map(|value| (path, value)));
        }
    }
    report
}

impl Variation {
    /// The same with other paths of files.
    pub(super) fn with_files(&self, rename: &dyn Fn(&str) -> String) -> Self {
        let mut renamed = self.clone();
        (renamed.draw).for_each_file(&self.name, &mut |_, file| *file = rename(file));
        renamed
    }

    /// The key's path, or `group.NAME`.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Whether it may set this key.
    pub(super) fn sets(&self, path: &str) -> bool {
        self.draw.paths(&self.name).contains(&path)
    }

    /// The position of the source that it comes from.
    pub(super) fn source(&self) -> usize {
        self.source
    }

    /// The value that it gives to a key in a sequence; `None` if it does not set the key there.
    pub(super) fn value_of(&self, path: &str, seed: u64, sequence: u32) -> Option<Value> {
        if !self.sets(path) {
            return None;
        }
        let mut values = self.values(seed, sequence).into_iter();
        values.find_map(|(of, value)| (of == path).then_some(value))
    }

    fn key(&self, seed: u64) -> Key {
        Key::world(seed)
            .domain(VARY_DRAWS)
            .domain(Domain::new(&self.name))
    }

    /// The keys and values for a sequence.
    fn values(&self, seed: u64, sequence: u32) -> Vec<(String, Value)> {
        let key = self.key(seed);
        let at = |draw: &Draw, key| draw.value(spread(key, sequence));
        match &self.draw {
            Draw::Group(alternatives) => {
                let members = &alternatives[chosen(alternatives, spread(key, sequence))].1;
                let value = |(path, member): &(String, Member)| {
                    let value = match member {
                        Member::Fixed(value) => value.clone(),
                        Member::Drawn(draw) => at(draw, key.domain(Domain::new(path))),
                    };
                    (path.clone(), value)
                };
                members.iter().map(value).collect()
            }
            draw => vec![(self.name.clone(), at(draw, key))],
        }
    }

    /// The alternative that a sequence gets; `None` for a number.
    pub(super) fn alternative(&self, seed: u64, sequence: u32) -> Option<usize> {
        let u = spread(self.key(seed), sequence);
        match &self.draw {
            Draw::Number { .. } => None,
            Draw::Choice(values) => Some(chosen(values, u)),
            Draw::Group(alternatives) => Some(chosen(alternatives, u)),
        }
    }
}

impl Draw {
    /// Calls `change` with the key and the path of each file that may be drawn.
    fn for_each_file(&mut self, path: &str, change: &mut dyn FnMut(&str, &mut String)) {
        let mut of_value = |path: &str, value: &mut Value| match value {
            Value::String(file) if most_bytes(path) > 0 => change(path, file),
            _ => {}
        };
        match self {
            Self::Number { .. } => {}
            Self::Choice(values) => values.iter_mut().for_each(|(_, v)| of_value(path, v)),
            Self::Group(alternatives) => {
                for (path, member) in alternatives.iter_mut().flat_map(|(_, members)| members) {
                    match member {
                        Member::Fixed(value) => of_value(path, value),
                        Member::Drawn(Self::Choice(values)) => {
                            values.iter_mut().for_each(|(_, v)| of_value(path, v));
                        }
                        Member::Drawn(_) => {}
                    }
                }
            }
        }
    }

    /// The keys that it sets.
    fn paths<'a>(&'a self, name: &'a str) -> Vec<&'a str> {
        match self {
            Self::Group(alternatives) => (alternatives.iter())
                .flat_map(|(_, members)| members.iter().map(|(path, _)| &**path))
                .collect(),
            _ => vec![name],
        }
    }

    /// As it is written in a config.
    fn to_value(&self) -> Value {
        match self {
            Self::Number { low, high, whole } => {
                let number = |x: f64| {
                    if *whole {
                        Value::Integer(x as i64)
                    } else {
                        x.into()
                    }
                };
                Value::Array(vec![number(*low), number(*high)])
            }
            Self::Choice(values) if values.iter().all(|(weight, _)| *weight == 1.0) => {
                Value::Array(values.iter().map(|(_, value)| value.clone()).collect())
            }
            Self::Choice(values) => {
                let word = |value: &Value| match value {
                    Value::String(word) => word.clone(),
                    other => other.to_string(),
                };
                let pairs = values
                    .iter()
                    .map(|(weight, v)| (word(v), Value::from(*weight)));
                Value::Table(pairs.collect())
            }
            Self::Group(alternatives) => {
                let table = |(weight, members): &(f64, Vec<(String, Member)>)| {
                    let mut table = Table::new();
                    table.insert("weight".to_owned(), Value::from(*weight));
                    for (path, member) in members {
                        let value = match member {
                            Member::Fixed(value) => value.clone(),
                            Member::Drawn(draw) => draw.to_value(),
                        };
                        table.insert(path.clone(), value);
                    }
                    Value::Table(table)
                };
                Value::Array(alternatives.iter().map(table).collect())
            }
        }
    }

    /// The value at `u` in 0..1.
    fn value(&self, u: f64) -> Value {
        match self {
            Self::Number { low, high, whole } if *whole => {
                let drawn = (low + u * (high - low + 1.0)).floor();
                Value::Integer(drawn.min(*high) as i64)
            }
            Self::Number { low, high, .. } => Value::Float(low + u * (high - low)),
            Self::Choice(values) => values[chosen(values, u)].1.clone(),
            Self::Group(_) => unreachable!("groups are not nested"),
        }
    }
}

/// The position of the alternative at `u` in 0..1, by weight.
fn chosen<T>(alternatives: &[(f64, T)], u: f64) -> usize {
    let total: f64 = alternatives.iter().map(|(weight, _)| weight).sum();
    let mut below = 0.0;
    let found = alternatives.iter().position(|(weight, _)| {
        below += weight;
        u * total < below
    });
    found.unwrap_or(alternatives.len() - 1)
}

/// Sets a dotted key.
fn insert(table: &mut Table, path: &str, value: Value) {
    match path.split_once('.') {
        None => {
            table.insert(path.to_owned(), value);
        }
        Some((first, rest)) => {
            let inner = table
                .entry(first.to_owned())
                .or_insert_with(|| Value::Table(Table::new()));
            if let Value::Table(inner) = inner {
                insert(inner, rest, value);
            }
        }
    }
}

/// The draws as the table `[vary]`, without those of the preset if an argument overrides it.
pub(super) fn to_table(variations: &[Variation], has_preset: bool) -> Table {
    let mut table = Table::new();
    for variation in variations
        .iter()
        .filter(|v| !(has_preset && v.name == "preset"))
    {
        insert(&mut table, &variation.name, variation.draw.to_value());
    }
    table
}
