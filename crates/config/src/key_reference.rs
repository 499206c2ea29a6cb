//! The definition of the keys, as pages for people and as a schema for editors.

use std::fmt::Write;

use serde_json::{Map, Value, json};

use super::load::merge;
use super::schema::SectionSpec;
use super::{CameraCalibration, Config, Model, Preset, SECTIONS, devices};

/// A config as commented TOML: every key with its purpose, its allowed values and the source of its
/// default.
#[must_use]
pub fn annotated_toml(config: &Config) -> String {
    let values: toml::Table = config.to_toml().parse().expect("our own TOML parses");
    let mut out = String::new();
    for section in SECTIONS {
        let Some(table) = lookup(&values, section.path) else {
            continue;
        };
        if !out.is_empty() {
            out.push('\n');
        }
        let _ = writeln!(out, "#{}", section.doc);
        if let Some(further) = further(section.path) {
            out.push_str(&further.tables(&values, table));
            continue;
        }
        if section.named.is_some() {
            out.push_str(&named_keys(section.path, table));
            continue;
        }
        if !section.path.is_empty() {
            let _ = writeln!(out, "[{}]", section.path);
        }
        if let Some(choice) = section.choice {
            let others: Vec<String> = SECTIONS
                .iter()
                .filter(|s| s.choice == Some(choice) && s.path != section.path)
                .map(|s| format!("[{}]", s.path))
                .collect();
            let _ = writeln!(out, "# Gives {choice}. Instead: {}.", others.join(", "));
        }
        for key in section.keys {
            let value = &table[key.name];
            let _ = writeln!(
                out,
                "#{} {}; {}.",
                key.doc,
                sentence(&key.allowed.describe()),
                key.source
            );
            let _ = writeln!(out, "{} = {value}", key.name);
        }
    }
    out
}

/// A table with keys of a user's names, or a commented example.
fn named_keys(path: &str, table: &toml::Table) -> String {
    let mut out = format!("[{path}]\n");
    for (name, value) in table {
        let _ = writeln!(out, "{name} = {value}");
    }
    if table.is_empty() {
        out.push_str("# rocks = 0.05             # of each view, on average\n# logs = 0.02\n");
    }
    out
}

/// Tables for further sensors, lamps and models.
struct Further {
    /// The table that contains them.
    path: &'static str,
    /// The table whose values they inherit; empty if they inherit none.
    first: &'static str,
    /// The example that is shown in a config without them.
    example: &'static str,
}

fn further(path: &str) -> Option<Further> {
    match path {
        "cameras" => Some(Further {
            path: "cameras",
            first: "camera",
            example: "\
# [cameras.right]          # the right eye of a stereo pair
# mount_y_m = -0.12
# [cameras.rear]           # one that looks back, wider
# mount_yaw_deg = 180.0
# [cameras.rear.fov]
# horizontal_deg = 100.0
",
        }),
        "models" => Some(Further {
            path: "models",
            first: "",
            example: "\
# [models.old_oak]         # a tree that you scanned, instead of every fifth one
# file = \"old_oak.glb\"
# share = 0.2
# [models.erratic]
# file = \"erratic/rock.obj\"
# kind = \"rock\"
",
        }),
        "lamps" => Some(Further {
            path: "lamps",
            first: "lamp",
            example: "\
# [lamps.right]            # on the other side of the camera; shines if [lamp] does
# mount_y_m = -0.25
",
        }),
        "lidars" => Some(Further {
            path: "lidars",
            first: "lidar",
            example: "\
# [lidars.top]             # one by its data sheet, above the first
# device = \"vlp16\"
# mount_z_m = 1.8
",
        }),
        _ => None,
    }
}

impl Further {
    /// Their tables, or a commented example.
    fn tables(&self, values: &toml::Table, further: &toml::Table) -> String {
        if further.is_empty() {
            return self.example.to_owned();
        }
        let first = match self.first {
            "" => toml::Table::new(),
            first => lookup(values, first).cloned().unwrap_or_default(),
        };
        let named = further.iter().map(|(name, table)| {
            let table = table.as_table().unwrap_or(&first);
            // A device of its own lies over what is inherited.
            let mut inherited = first.clone();
            let device = table
                .get("device")
                .filter(|&d| first.get("device") != Some(d));
            if let Some(layer) = device
                .and_then(toml::Value::as_str)
                .and_then(devices::layer)
            {
                merge(&format!("{}.{name}", self.path), &mut inherited, &layer);
            }
            let mut said = differing(&inherited, table);
            said.extend(device.map(|d| ("device".to_owned(), d.clone())));
            (name.clone(), toml::Value::Table(said))
        });
        let named = toml::Value::Table(named.collect());
        let all: toml::Table = [(self.path.to_owned(), named)].into_iter().collect();
        toml::to_string(&all).expect("a config is plain data")
    }
}

/// The values of a table that differ from those of another.
fn differing(first: &toml::Table, table: &toml::Table) -> toml::Table {
    let mut out = toml::Table::new();
    for (key, value) in table {
        let said = match (first.get(key), value) {
            (Some(toml::Value::Table(first)), toml::Value::Table(table)) => {
                let inner = differing(first, table);
                (!inner.is_empty()).then_some(toml::Value::Table(inner))
            }
            (Some(first), value) if first == value => None,
            _ => Some(value.clone()),
        };
        out.extend(said.map(|said| (key.clone(), said)));
    }
    out
}

fn sentence(text: &str) -> String {
    let mut chars = text.chars();
    chars
        .next()
        .map_or_else(String::new, |c| c.to_uppercase().chain(chars).collect())
}

/// The JSON schema (2020-12) of a config, for editors that complete TOML.
#[must_use]
pub fn json_schema() -> Value {
    let names: Vec<&str> = Preset::ALL.iter().map(|p| p.name).collect();
    let mut root = object("");
    root["properties"]["preset"] =
        json!({"enum": names, "description": "The preset under this file."});
    root["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    root["title"] = json!("nemoral config");
    root
}

fn object(path: &str) -> Value {
    let defaults: toml::Table = Config::default()
        .to_toml()
        .parse()
        .expect("our own TOML parses");
    let section = SECTIONS
        .iter()
        .find(|s| s.path == path)
        .expect("only sections are entered");
    let mut properties = Map::new();
    for key in section.keys {
        let mut schema = key.allowed.json_schema();
        schema["description"] = json!(format!("{} Default: {}.", key.doc.trim(), key.source));
        if let Some(value) = default_of(&defaults, section, key.name) {
            schema["default"] = json!(value);
        }
        properties.insert(key.name.to_owned(), schema);
    }
    let prefix = if path.is_empty() {
        String::new()
    } else {
        format!("{path}.")
    };
    for sub in SECTIONS {
        if let Some(name) = sub.path.strip_prefix(&prefix)
            && !name.is_empty()
            && !name.contains('.')
            && sub.path != MODEL
        {
            properties.insert(name.to_owned(), object(sub.path));
        }
    }
    // The keys of further sensors are names, those of draws are paths.
    let of_named = section.named.map(|named| named.json_schema());
    let others = match path {
        _ if of_named.is_some() => json!(of_named),
        "cameras" => object("camera"),
        "lidars" => object("lidar"),
        "lamps" => object("lamp"),
        "models" => object(MODEL),
        "vary" | "ranges" => json!({"type": ["array", "object"]}),
        _ => json!(false),
    };
    json!({
        "type": "object",
        "description": section.doc.trim(),
        "properties": properties,
        "additionalProperties": others,
    })
}

/// The reference page, Markdown.
#[must_use]
pub fn reference_page() -> String {
    let defaults: toml::Table = Config::default()
        .to_toml()
        .parse()
        .expect("our own TOML parses");
    let mut out = String::from("# Config reference\n\n");
    out.push_str(&wrapped(
        "Made by `nemoral config reference`. A config is TOML; what it leaves out is the preset's. \
         `nemoral config init` writes one to start from, `nemoral config check FILE` proves one. \
         Relative paths in it start at the folder of the config file, those of `--set` at the \
         folder in which the program runs. A data set carries the files that its config names, and \
         the config of a data set names no others.",
        "",
    ));
    out.push_str("\n## Presets\n\n");
    for preset in Preset::ALL {
        let line = format!("- `{}`: {}", preset.name, preset.doc);
        out.push_str(&wrapped(&line, "  "));
    }
    for section in SECTIONS {
        let title = if section.path.is_empty() {
            "top level".to_owned()
        } else {
            format!("[{}]", section.path)
        };
        let _ = writeln!(out, "\n## {title}\n");
        out.push_str(&wrapped(section.doc.trim(), ""));
        if let Some(choice) = section.choice {
            let _ = writeln!(out, "\nOne way to give {choice}.");
        }
        if section.keys.is_empty() {
            continue;
        }
        let _ = writeln!(
            out,
            "\n| key | default | allowed | what | source |\n|---|---|---|---|---|"
        );
        for key in section.keys {
            let default = default_of(&defaults, section, key.name);
            let default = default.map_or_else(|| "–".to_owned(), |v| format!("`{v}`"));
            let allowed = key.allowed.describe();
            let _ = writeln!(
                out,
                "| `{}` | {default} | {allowed} | {} | {} |",
                key.name,
                key.doc.trim(),
                key.source
            );
        }
    }
    out
}

/// A paragraph of Markdown in lines of at most 100 columns, of which the second and further ones
/// begin with `indent`. A blank inside of code is not broken at.
fn wrapped(text: &str, indent: &str) -> String {
    const COLUMNS: usize = 100;
    let mut words: Vec<String> = Vec::new();
    let mut is_code = false;
    for word in text.split(' ') {
        match words.last_mut() {
            Some(last) if is_code => last.extend([" ", word]),
            _ => words.push(word.to_owned()),
        }
        is_code ^= word.matches('`').count() % 2 == 1;
    }
    let (mut out, mut columns) = (String::new(), 0);
    for word in words {
        let width = word.chars().count();
        if columns > 0 && columns + 1 + width > COLUMNS {
            out.push('\n');
            out.push_str(indent);
            columns = indent.len();
        } else if columns > 0 {
            out.push(' ');
            columns += 1;
        }
        out.push_str(&word);
        columns += width;
    }
    out.push('\n');
    out
}

/// The table that stands for that of each model.
const MODEL: &str = Model::SPEC.path;

/// The value of a key that a config leaves out, though it has its table; `None` if it follows
/// from other keys, or has to be given.
fn default_of(defaults: &toml::Table, section: &SectionSpec, key: &str) -> Option<toml::Value> {
    if section.path == CameraCalibration::SPEC.path {
        return None;
    }
    match lookup(defaults, section.path) {
        Some(table) => table.get(key).cloned(),
        None => {
            let value = (section.defaults)().remove(key);
            value.filter(|v| v.as_str() != Some(""))
        }
    }
}

fn lookup<'a>(table: &'a toml::Table, path: &str) -> Option<&'a toml::Table> {
    if path.is_empty() {
        return Some(table);
    }
    path.split('.')
        .try_fold(table, |t, part| t.get(part)?.as_table())
}
