//! Changes to the files of a data set by an input's bytes.
//!
//! Random bytes alone never match a checksum. So an input is a list of small instructions (which
//! file, which change), after which the checksums are corrected, as an attacker could do too,
//! unless the input asks for leaving them.

use serde_json::Value;

use nemoral_dataset::fuzz;

use crate::base::Files;

/// Takes values from the front of an input, and zeros after its end.
#[derive(Debug)]
pub(crate) struct Instructions<'a>(pub(crate) &'a [u8]);

impl<'a> Instructions<'a> {
    pub(crate) fn has_more(&self) -> bool {
        !self.0.is_empty()
    }

    pub(crate) fn byte(&mut self) -> u8 {
        let (first, rest) = self.0.split_first().unwrap_or((&0, &[]));
        self.0 = rest;
        *first
    }

    fn word(&mut self) -> usize {
        usize::from(self.byte()) << 8 | usize::from(self.byte())
    }

    /// As many bytes as the next byte says.
    fn bytes(&mut self) -> &'a [u8] {
        let length = usize::from(self.byte()).min(self.0.len());
        let (bytes, rest) = self.0.split_at(length);
        self.0 = rest;
        bytes
    }

    fn text(&mut self) -> String {
        String::from_utf8_lossy(self.bytes()).into_owned()
    }
}

/// Hostile values in the place of a number or a name.
const VALUES: [&str; 28] = [
    "0",
    "1",
    "-1",
    "255",
    "256",
    "8192",
    "65535",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "-9223372036854775808",
    "1e308",
    "-1e308",
    "1e-308",
    "0.1",
    "null",
    "true",
    "[]",
    "{}",
    "\"\"",
    "\"../outside\"",
    "\"../../outside/velodyne\"",
    "\"/etc/passwd\"",
    "\"sequences/00\"",
    "\".nemoral\"",
    "\"velodyne\"",
    "\"a\\u0000b\"",
];

/// Names under which an instruction may put something into a folder.
const NAMES: [&str; 13] = [
    ".nemoral/header.json",
    ".nemoral/lock",
    ".nemoral/frames/00-000000.json",
    ".nemoral/frames/00-000001.json",
    ".nemoral/frames/x",
    "sequences/00/velodyne/000001.bin",
    "sequences/00/velodyne/000009.bin",
    "sequences/01/poses.txt",
    "sequences/00/rear",
    "notes.txt",
    "dataset.json",
    "sequences",
    "sequences/00/poses_estimated.txt",
];

/// Targets of links, relative to a data set's folder.
const LEADS: [&str; 5] = [
    "../outside",
    "../outside/kept.txt",
    "..",
    "/dev/zero",
    "loop",
];

/// An entry of a data set's folder.
#[derive(Clone, Debug)]
pub(crate) enum Thing {
    File(Vec<u8>),
    Link(&'static str),
    Folder,
}

/// A data set's folder that is being changed.
#[derive(Debug)]
pub(crate) struct Part {
    pub(crate) things: Vec<(String, Thing)>,
    /// The names of files that have changed.
    changed: Vec<String>,
    /// Whether the checksums are left as they are.
    is_left_unsealed: bool,
}

impl Part {
    pub(crate) fn new(files: &Files) -> Self {
        let things = files.iter();
        Self {
            things: things
                .map(|(name, bytes)| (name.clone(), Thing::File(bytes.clone())))
                .collect(),
            changed: Vec::new(),
            is_left_unsealed: false,
        }
    }

    fn put(&mut self, name: &str, thing: Thing) {
        self.things.retain(|(n, _)| n != name);
        self.things.push((name.to_owned(), thing));
        self.changed.push(name.to_owned());
    }

    fn bytes(&mut self, name: &str) -> Option<&mut Vec<u8>> {
        let found = self.things.iter_mut().find(|(n, _)| n == name);
        match found {
            Some((_, Thing::File(bytes))) => Some(bytes),
            _ => None,
        }
    }

    fn json(&mut self, name: &str) -> Option<Value> {
        serde_json::from_slice(self.bytes(name)?).ok()
    }

    /// Carries out one instruction.
    pub(crate) fn edit(&mut self, from: &mut Instructions<'_>) {
        let operation = from.byte();
        let at = usize::from(from.byte());
        let name = match self.things.get(at % self.things.len().max(1)) {
            Some((name, _)) => name.clone(),
            None => return,
        };
        match operation % 14 {
            0 => {
                let (at, bytes) = (from.word(), from.bytes());
                self.change(&name, |old| {
                    for (to, byte) in old.iter_mut().skip(at).zip(bytes) {
                        *to = *byte;
                    }
                });
            }
            1 => {
                let length = from.word();
                self.change(&name, |old| old.truncate(length));
            }
            2 => {
                let (at, bytes) = (from.word(), from.bytes());
                self.change(&name, |old| {
                    let at = at.min(old.len());
                    old.splice(at..at, bytes.iter().copied());
                });
            }
            3 => self.things.retain(|(n, _)| *n != name),
            4 => {
                let bytes = from.bytes();
                self.put(&name, Thing::File(bytes.to_vec()));
            }
            5 => self.set_leaf(from, |from| {
                let value = VALUES[usize::from(from.byte()) % VALUES.len()];
                serde_json::from_str(value).expect("they are JSON")
            }),
            6 => self.set_leaf(from, |from| Value::String(from.text())),
            7 => self.remove_or_repeat(from),
            8 => {
                let lead = LEADS[usize::from(from.byte()) % LEADS.len()];
                // The link replaces the file, or a folder above it.
                let depth = usize::from(from.byte()) % 4;
                let parts: Vec<&str> = name.split('/').collect();
                let link = parts[..parts.len() - depth.min(parts.len() - 1)].join("/");
                let below = format!("{link}/");
                self.things.retain(|(n, _)| !n.starts_with(&below));
                self.put(&link, Thing::Link(lead));
            }
            9 => {
                let other = usize::from(from.byte()) % self.things.len();
                if let (other, Thing::File(bytes)) = self.things[other].clone() {
                    let ours = self.bytes(&name).map(|b| std::mem::replace(b, bytes));
                    if let Some(ours) = ours {
                        self.put(&other, Thing::File(ours));
                        self.changed.push(name);
                    }
                }
            }
            10 => {
                let bytes = from.bytes().to_vec();
                self.put(NAMES[at % NAMES.len()], Thing::File(bytes));
            }
            11 => self.put(NAMES[at % NAMES.len()], Thing::Folder),
            12 => self.unfinish(from),
            _ => self.number(&name, from),
        }
        self.is_left_unsealed |= operation >= 0xf0;
    }

    fn change(&mut self, name: &str, how: impl FnOnce(&mut Vec<u8>)) {
        if let Some(bytes) = self.bytes(name) {
            how(bytes);
            self.changed.push(name.to_owned());
        }
    }

    /// The JSON that is changed: the manifest, or the header or a record of an unfinished data set.
    fn document(&mut self, from: &mut Instructions<'_>) -> Option<(&'static str, Value)> {
        let at = usize::from(from.byte()) % 8;
        let name = *["dataset.json", NAMES[0], NAMES[2], NAMES[3]]
            .get(at)
            .unwrap_or(&"dataset.json");
        let json = if name == "dataset.json" {
            self.json(name)?
        } else {
            let mut sealed = self.json(name)?;
            sealed.get_mut("content")?.take()
        };
        Some((name, json))
    }

    fn put_document(&mut self, name: &str, json: &Value) {
        let text = if name == "dataset.json" {
            serde_json::to_string_pretty(json).expect("JSON")
        } else {
            fuzz::seal(&json.to_string())
        };
        self.put(name, Thing::File(text.into_bytes()));
    }

    /// Replaces a value by another one.
    fn set_leaf(
        &mut self,
        from: &mut Instructions<'_>,
        value: impl FnOnce(&mut Instructions<'_>) -> Value,
    ) {
        let Some((name, mut json)) = self.document(from) else {
            return;
        };
        let mut number = from.word();
        let value = value(from);
        let count = leaves(&json);
        number %= count.max(1);
        if let Some(leaf) = leaf(&mut json, &mut number) {
            *leaf = value;
        }
        self.put_document(name, &json);
    }

    /// Removes an entry of a list or a table, or repeats an entry of a list.
    fn remove_or_repeat(&mut self, from: &mut Instructions<'_>) {
        let Some((name, mut json)) = self.document(from) else {
            return;
        };
        let mut inside = &mut json;
        for _ in 0..from.byte() % 6 {
            let step = usize::from(from.byte());
            if !holds_others(inside) {
                break;
            }
            let next = match inside {
                Value::Array(list) => {
                    let step = step % list.len();
                    list.get_mut(step)
                }
                Value::Object(table) => {
                    let step = step % table.len();
                    table.values_mut().nth(step)
                }
                _ => None,
            };
            let next = next.expect("below the length");
            inside = next;
        }
        let (what, at) = (from.byte(), usize::from(from.byte()));
        match inside {
            Value::Array(list) if !list.is_empty() => {
                let at = at % list.len();
                if what.is_multiple_of(2) {
                    list.remove(at);
                } else {
                    let again = list[at].clone();
                    list.insert(at, again);
                }
            }
            Value::Object(table) if !table.is_empty() => {
                let key = table.keys().nth(at % table.len()).cloned();
                table.remove(&key.expect("below the length"));
            }
            _ => {}
        }
        self.put_document(name, &json);
    }

    /// Turns the data set into an unfinished one.
    fn unfinish(&mut self, from: &mut Instructions<'_>) {
        let Some(Value::Object(mut manifest)) = self.json("dataset.json") else {
            return;
        };
        let frames = manifest.remove("frames").unwrap_or_default();
        for (i, frame) in frames.as_array().into_iter().flatten().enumerate() {
            let index = frame["index"].as_u64().unwrap_or(i as u64);
            let name = format!(".nemoral/frames/00-{index:06}.json");
            let sealed = fuzz::seal(&frame.to_string());
            self.put(&name, Thing::File(sealed.into_bytes()));
        }
        let version = nemoral_dataset::FORMAT_VERSION;
        let state = serde_json::json!({ "format_version": version, "header": manifest });
        self.put_document(NAMES[0], &state);
        if from.byte().is_multiple_of(2) {
            self.things.retain(|(n, _)| n != "dataset.json");
        }
    }

    /// Replaces a number in a text by a value.
    fn number(&mut self, name: &str, from: &mut Instructions<'_>) {
        let (at, value) = (from.word(), usize::from(from.byte()));
        self.change(name, |bytes| {
            let Ok(text) = std::str::from_utf8(bytes) else {
                return;
            };
            let is_number = |c: char| c.is_ascii_alphanumeric() || "+-._".contains(c);
            let words: Vec<&str> = text.split(|c| !is_number(c)).collect();
            let word = words[at % words.len()];
            let start = word.as_ptr() as usize - text.as_ptr() as usize;
            let value = VALUES[value % VALUES.len()].trim_matches('"').as_bytes();
            let end = start + word.len();
            bytes.splice(start..end, value.iter().copied());
        });
    }

    /// Corrects the checksums, unless they are to be left.
    pub(crate) fn seal(&mut self) {
        if self.is_left_unsealed {
            return;
        }
        let Some(mut manifest) = self.json("dataset.json") else {
            return;
        };
        let changed = std::mem::take(&mut self.changed);
        if changed.is_empty() {
            return;
        }
        let lists = |manifest: &mut Value| -> Vec<Value> {
            let mut lists = vec![manifest["files"].take()];
            let frames = manifest["frames"].as_array_mut();
            lists.extend(frames.into_iter().flatten().map(|f| f["files"].take()));
            lists
        };
        if !manifest.is_object() || !is_list_of_tables(&manifest["frames"]) {
            return;
        }
        let mut lists = lists(&mut manifest);
        for record in lists.iter_mut().filter_map(Value::as_array_mut).flatten() {
            let path = record["path"].as_str().unwrap_or_default().to_owned();
            if changed.contains(&path)
                && let Some(bytes) = self.bytes(&path)
            {
                let digest = blake3::hash(bytes).to_hex().to_string();
                record["bytes"] = bytes.len().into();
                record["blake3"] = digest.into();
            }
        }
        let mut lists = lists.into_iter();
        manifest["files"] = lists.next().unwrap_or_default();
        for frame in manifest["frames"].as_array_mut().into_iter().flatten() {
            frame["files"] = lists.next().unwrap_or_default();
        }
        manifest["checksum"] = "0".repeat(64).into();
        let text = serde_json::to_string_pretty(&manifest).expect("JSON");
        let text = fuzz::stamp(&text).into_bytes();
        self.put("dataset.json", Thing::File(text));
    }
}

fn is_list_of_tables(value: &Value) -> bool {
    let list = value.as_array().map(Vec::as_slice).unwrap_or_default();
    let of_tables = |v: &Value| {
        v.is_object()
            && v["files"]
                .as_array()
                .is_none_or(|f| f.iter().all(Value::is_object))
    };
    value.is_null() || list.iter().all(of_tables)
}

/// Whether it is a list or a table with entries.
fn holds_others(json: &Value) -> bool {
    match json {
        Value::Array(list) => !list.is_empty(),
        Value::Object(table) => !table.is_empty(),
        _ => false,
    }
}

/// The number of values that are not themselves lists or tables with entries.
fn leaves(json: &Value) -> usize {
    match json {
        Value::Array(list) if !list.is_empty() => list.iter().map(leaves).sum(),
        Value::Object(table) if !table.is_empty() => table.values().map(leaves).sum(),
        _ => 1,
    }
}

/// The leaf with this number, which is counted down.
fn leaf<'a>(json: &'a mut Value, number: &mut usize) -> Option<&'a mut Value> {
    if !holds_others(json) {
        if *number == 0 {
            return Some(json);
        }
        *number -= 1;
        return None;
    }
    match json {
        Value::Array(list) => list.iter_mut().find_map(|v| leaf(v, number)),
        Value::Object(table) => table.values_mut().find_map(|v| leaf(v, number)),
        _ => None,
    }
}
