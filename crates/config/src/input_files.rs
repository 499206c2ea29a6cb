//! The files that a config names, each read once.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use nemoral_dataset::input_path;
use nemoral_files::{Folder, InnerPath};
use nemoral_import::{
    HeightMap, ImportError, Model, ModelFiles, ModelKind, TrailLines, read_trail_lines,
};
use nemoral_plan::{Encode, Encoder, Hasher, KeyEncoder};

use super::dotted_keys::{is_model, most_bytes};
use super::{Config, ConfigError, ConfigErrors, Error, InputPath};

/// A file: its path, its content, and a digest of the content. A model is one file together with
/// those that it names: an archive of all of them.
#[derive(Clone)]
pub struct InputFile {
    path: PathBuf,
    bytes: Arc<[u8]>,
    digest: [u8; 32],
    /// Whether the content is an archive of the file at the path and others.
    is_packed: bool,
    /// The model, by kind, when it was asked for.
    models: Arc<[ReadOnce<Model>; KINDS.len()]>,
    /// The height map, if it is a GeoTIFF: that of a PNG depends on another file.
    height_map: Arc<ReadOnce<HeightMap>>,
    trail_lines: Arc<ReadOnce<TrailLines>>,
}

/// What is read when it is asked for first.
type ReadOnce<T> = OnceLock<Result<Arc<T>, ImportError>>;

const KINDS: [ModelKind; 4] = [
    ModelKind::Tree,
    ModelKind::Shrub,
    ModelKind::Rock,
    ModelKind::Log,
];

impl InputFile {
    fn new(path: &Path, bytes: Vec<u8>) -> Self {
        Self {
            path: path.to_owned(),
            digest: *blake3::hash(&bytes).as_bytes(),
            bytes: bytes.into(),
            is_packed: false,
            models: Arc::default(),
            height_map: Arc::default(),
            trail_lines: Arc::default(),
        }
    }

    /// A model with the files that it names, which lie in its folder or below.
    fn of_model(path: &Path, bytes: Vec<u8>) -> Result<Self, ImportError> {
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
        let folder = Folder::new(parent.unwrap_or(Path::new(".")));
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let mut find = |name: &str, limit: u64| {
            let inner = InnerPath::new(name);
            let inner = inner.map_err(|e| ImportError::File(format!("names a file: {e}")))?;
            match folder.read(&inner, limit) {
                Ok(bytes) => Ok(Some(bytes)),
                Err(e) if e.is_not_found() => Ok(None),
                Err(e) => Err(ImportError::File(format!("names a file: {e}"))),
            }
        };
        let archive = ModelFiles::gather(&name, bytes.clone(), &mut find)?.to_tar()?;
        Ok(Self {
            is_packed: archive != bytes,
            ..Self::new(path, archive)
        })
    }

    /// The model that the file is, read as one of this kind when it is asked for first.
    ///
    /// # Errors
    /// If it is none.
    pub fn model(&self, kind: ModelKind) -> Result<Arc<Model>, ImportError> {
        let index = KINDS.iter().position(|k| *k == kind).unwrap_or(0);
        let read = || {
            let name = self.path.file_name().unwrap_or_default().to_string_lossy();
            let files = ModelFiles::gather(&name, self.bytes.to_vec(), &mut |_, _| Ok(None))?;
            Model::read(&files, kind).map(Arc::new)
        };
        self.models[index].get_or_init(read).clone()
    }

    /// The GeoTIFF that the file is, read when it is asked for first.
    ///
    /// # Errors
    /// If it is none.
    pub(crate) fn height_map(&self) -> Result<Arc<HeightMap>, ImportError> {
        let read = || HeightMap::from_tiff(&self.bytes).map(Arc::new);
        self.height_map.get_or_init(read).clone()
    }

    /// The trail lines that the file has, read when they are asked for first.
    ///
    /// # Errors
    /// If it has none.
    pub(crate) fn trail_lines(&self) -> Result<Arc<TrailLines>, ImportError> {
        let read = || read_trail_lines(&self.bytes).map(Arc::new);
        self.trail_lines.get_or_init(read).clone()
    }

    /// Its path, as the config has it.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its content.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Its content as text.
    ///
    /// # Errors
    /// If it is not UTF-8.
    pub fn text(&self) -> Result<&str, Error> {
        std::str::from_utf8(&self.bytes).map_err(|e| {
            let (path, at) = (self.path.display(), e.valid_up_to());
            Error::request(format!("{path}: is not UTF-8 text (byte {at})"))
        })
    }

    /// Its place in a data set that carries it.
    pub(crate) fn carried_path(&self) -> InnerPath {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let end = if self.is_packed { ".tar" } else { "" };
        input_path(&format!("{name}{end}"), &self.bytes)
    }

    /// BLAKE3 of its bytes.
    #[must_use]
    pub fn digest(&self) -> [u8; 32] {
        self.digest
    }
}

impl fmt::Debug for InputFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "InputFile({}, {} bytes)",
            self.path.display(),
            self.bytes.len()
        )
    }
}

/// All files that a config names, by their paths.
///
/// They are read when a config becomes a plan, before anything else is done; no stage opens a file.
/// So checks, a plan's keys and its stages use the same bytes, whatever happens to the file
/// meanwhile.
#[derive(Clone, Debug, Default)]
pub struct InputFiles(Arc<BTreeMap<String, InputFile>>);

impl InputFiles {
    /// Reads the files that a config names.
    ///
    /// # Errors
    /// All files that cannot be read, because they are missing, not regular, or too large.
    pub fn read(config: &Config) -> Result<Self, Error> {
        let (files, problems) = Self::read_all(config, &Self::default());
        if problems.is_empty() {
            return Ok(files);
        }
        let errors = problems.into_iter().map(|(path, message)| ConfigError {
            path,
            message,
            location: None,
        });
        Err(ConfigErrors::from_iter(errors).into())
    }

    /// The files that can be read, and for each of the others the key that names it and the reason.
    /// Files that are known are not read again.
    pub(crate) fn read_all(config: &Config, known: &Self) -> (Self, Vec<(String, String)>) {
        let (mut files, mut problems) = (BTreeMap::new(), Vec::new());
        for (key, name) in named(config) {
            let Entry::Vacant(vacant) = files.entry(name) else {
                continue;
            };
            if let Some(file) = known.0.get(vacant.key()) {
                vacant.insert(file.clone());
                continue;
            }
            let path = PathBuf::from(vacant.key());
            match nemoral_files::read(&path, most_bytes(&key)) {
                Ok(bytes) if is_model(&key) => match InputFile::of_model(&path, bytes) {
                    Ok(file) => {
                        vacant.insert(file);
                    }
                    Err(e) => {
                        let path = path.display();
                        problems.push((key.clone(), format!("{key} = \"{path}\": {e}")));
                    }
                },
                Ok(bytes) => {
                    vacant.insert(InputFile::new(&path, bytes));
                }
                Err(e) => problems.push((key.clone(), format!("{key}: cannot read {e}"))),
            }
        }
        (Self(Arc::new(files)), problems)
    }

    /// The paths of the files, in order of their names.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        self.0.values().map(InputFile::path)
    }

    /// The name of a file in a data set that carries it, below the data set's folder. A file that
    /// was not read, because no sequence has it, has the name of an empty one.
    pub(crate) fn carried_name(&self, path: &str) -> String {
        if path.is_empty() {
            return String::new();
        }
        let unread = || {
            let name = Path::new(path).file_name().unwrap_or_default();
            input_path(&name.to_string_lossy(), &[])
        };
        let known = self.0.get(path).map(InputFile::carried_path);
        known.unwrap_or_else(unread).as_str().to_owned()
    }

    /// The content of all files by their places in a data set that carries them.
    #[must_use]
    pub fn carried(&self) -> BTreeMap<InnerPath, Arc<[u8]>> {
        let files = self.0.values();
        files
            .map(|file| (file.carried_path(), Arc::clone(&file.bytes)))
            .collect()
    }

    /// These files and those of another config.
    pub(crate) fn and(&self, others: &Self) -> Self {
        let mut all = BTreeMap::clone(&self.0);
        all.extend((others.0.iter()).map(|(name, file)| (name.clone(), file.clone())));
        Self(Arc::new(all))
    }

    /// Checks that these are the files of a config.
    pub(crate) fn check(&self, config: &Config) -> Result<(), Error> {
        match named(config)
            .into_iter()
            .find(|(_, name)| !self.0.contains_key(name))
        {
            None => Ok(()),
            Some((key, name)) => Err(Error::request(format!(
                "{key} = \"{name}\": the file was not read with the config"
            ))),
        }
    }

    /// A file that the config names; `None` for the empty name.
    ///
    /// # Panics
    /// If it was not read, because these are the files of another config.
    #[must_use]
    pub fn get(&self, path: &InputPath) -> Option<&InputFile> {
        (!path.is_empty()).then(|| self.named(path.as_str()))
    }

    fn named(&self, path: &str) -> &InputFile {
        let file = self.0.get(path);
        file.expect("a plan checks that the files of its config were read")
    }

    /// Encodes a part of the config, with files by their content.
    ///
    /// # Panics
    /// If it names a file that was not read, because these are the files of another config.
    pub fn encode(&self, hasher: &mut Hasher, value: &dyn Encode) {
        value.encode(&mut KeyEncoder::new(hasher, &|path| {
            self.named(path).digest
        }));
    }
}

/// The files that a config names, each with its key.
fn named(config: &Config) -> Vec<(String, String)> {
    let mut found = Found::default();
    config.encode(&mut found);
    found.files
}

/// An encoder that collects files.
#[derive(Default)]
struct Found {
    key: Vec<String>,
    files: Vec<(String, String)>,
}

impl Encoder for Found {
    fn open(&mut self, name: &str) {
        self.key.push(name.to_owned());
    }

    fn close(&mut self) {
        self.key.pop();
    }

    fn file(&mut self, path: &str) {
        if !path.is_empty() {
            self.files.push((self.key.join("."), path.to_owned()));
        }
    }

    fn count(&mut self, _: usize) {}
    fn whole(&mut self, _: u64) {}
    fn signed(&mut self, _: i64) {}
    fn real(&mut self, _: f64) {}
    fn flag(&mut self, _: bool) {}
    fn text(&mut self, _: &str) {}
}
