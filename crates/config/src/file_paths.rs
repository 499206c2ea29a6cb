//! Where the files lie that a config names.

use std::path::{Path, PathBuf};

use nemoral_dataset::input_path;
use nemoral_files::{Folder, InnerPath};
use nemoral_import::ModelFiles;
use toml::{Table, Value};

use super::Config;
use super::dotted_keys::{is_model, join, most_bytes, to_table};
use super::quotations::cut;

/// Where the relative paths of a source start.
#[derive(Clone, Debug)]
pub(super) enum Base {
    /// Where the program runs.
    WorkingFolder,
    /// The folder of the config file.
    Folder(PathBuf),
    /// The config is that of a data set, which names only files that the data set carries.
    Dataset {
        /// The data set's folder.
        root: PathBuf,
        /// The way from the config's folder to that one.
        up: &'static str,
    },
}

/// From the folder of a sequence's config to that of its data set.
pub(super) const SEQUENCE_UP: &str = "../../";

impl Base {
    /// That of a config file.
    pub(super) fn of_config(file: &Path) -> Self {
        let folder = file.parent().unwrap_or(Path::new(""));
        let is_dataset = |root: &Path| {
            let mark = |name: &str| root.join(name).exists();
            mark("dataset.json") || mark(".nemoral/header.json")
        };
        let root = folder.to_owned();
        if is_dataset(&root) {
            return Self::Dataset { root, up: "" };
        }
        let root = folder.join(SEQUENCE_UP);
        let absolute = std::path::absolute(file).unwrap_or_default();
        let of_sequence = absolute.ancestors().nth(2).and_then(Path::file_name);
        if of_sequence.is_some_and(|name| name == "sequences") && is_dataset(&root) {
            let up = SEQUENCE_UP;
            return Self::Dataset { root, up };
        }
        Self::Folder(folder.to_owned())
    }

    /// The path of a file that starts at the working folder, or what is wrong with it.
    pub(super) fn resolve(&self, key: &str, name: &str) -> Result<String, String> {
        let path = match self {
            _ if name.is_empty() => return Ok(String::new()),
            Self::WorkingFolder => return Ok(name.to_owned()),
            Self::Folder(folder) => folder.join(name),
            Self::Dataset { root, up } => {
                let of_dataset = carried(root, up, name, key);
                of_dataset.map_err(|why| format!("{key} = \"{}\": {why}", cut(name)))?
            }
        };
        let text = path.into_os_string().into_string();
        text.map_err(|path| {
            let path = Path::new(&path).display();
            format!("{key} = \"{}\": {path} is not UTF-8", cut(name))
        })
    }
}

/// A file that a data set carries, if it is the one that its name says. Whoever made the data set
/// may be a stranger, whose config must not make this program read, and carry on, other files.
fn carried(root: &Path, up: &str, name: &str, key: &str) -> Result<PathBuf, String> {
    let allowed = || {
        format!(
            "must be {up}inputs/NAME, as the config of a data set names no other files; copy \
                 the config elsewhere to use it with others"
        )
    };
    let inner = name.strip_prefix(up).and_then(|n| InnerPath::new(n).ok());
    let inner = inner.filter(|i| i.parent().is_some_and(|p| p.as_str() == "inputs"));
    let inner = inner.ok_or_else(allowed)?;
    let bytes = Folder::new(root).read(&inner, most_bytes(key));
    let bytes = bytes.map_err(|e| format!("cannot read {e}"))?;
    if input_path(inner.file_name(), &bytes) != inner {
        return Err("its content is not that of which its name has the checksum".to_owned());
    }
    if is_model(key) && !ModelFiles::is_archive(&bytes) {
        return Err(
            "must be an archive, as a model in a data set has no files beside it".to_owned(),
        );
    }
    Ok(inner.below(root))
}

/// Calls `change` with the key and the path of each file that a table of a config names.
pub(super) fn for_each_file(
    table: &mut Table,
    path: &str,
    change: &mut dyn FnMut(&str, &mut String),
) {
    for (key, value) in table {
        let path = join(path, key);
        match value {
            Value::Table(inner) => for_each_file(inner, &path, change),
            Value::String(name) if most_bytes(&path) > 0 => change(&path, name),
            _ => {}
        }
    }
}

impl Config {
    /// The same config with other paths of files.
    pub(super) fn with_files(&self, rename: &dyn Fn(&str) -> String) -> Self {
        let mut table = to_table(self);
        for_each_file(&mut table, "", &mut |_, name| *name = rename(name));
        (Value::Table(table).try_into()).expect("only texts were replaced by texts")
    }
}
