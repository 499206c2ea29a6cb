//! Access to one folder and to nothing outside of it.

use std::fs::{self, File, Metadata, TryLockError};
use std::io::{self, Write};
use std::path::{self, Component, Path, PathBuf};

use crate::{Error, InnerPath, PendingFile, operation, read};

/// Gives access to everything below one root by [`InnerPath`]s. The root may be reached through
/// links. Below it no link is followed, neither to folders on the way nor to files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Folder {
    root: PathBuf,
}

/// What a name stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EntryKind {
    /// A regular file.
    File,
    /// A folder.
    Folder,
    /// A symbolic link, a device, a pipe or a socket, none of which this crate makes.
    Other,
}

/// A name in a folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// The name; characters that are not Unicode are replaced.
    pub name: String,
    /// What the name stands for.
    pub kind: EntryKind,
}

/// A lock that keeps other processes from writing until it is dropped.
#[derive(Debug)]
pub struct Lock {
    /// It is held open and never used.
    _file: File,
}

impl Folder {
    /// A folder that may not exist yet.
    #[must_use]
    pub fn new(root: &Path) -> Self {
        Self {
            root: root.to_owned(),
        }
    }

    /// The root.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// A user's path relative to the root, if it lies below it, whether or not it exists. It is
    /// `None` for names that are no inner paths, too: [`Folder::contains`] knows these.
    #[must_use]
    pub fn inner_path_of(&self, path: &Path) -> Option<InnerPath> {
        let place = named_place(path)?;
        let relative = place.strip_prefix(place_of(&self.root)).ok()?;
        let components: Option<Vec<&str>> = relative.iter().map(|c| c.to_str()).collect();
        InnerPath::new(components?.join("/")).ok()
    }

    /// Whether a user's path is the root or lies below it, by its own name or by where it leads,
    /// whatever its name is. Neither the path nor the root need exist.
    #[must_use]
    pub fn contains(&self, path: &Path) -> bool {
        let root = place_of(&self.root);
        // A link lies where its name is, and leads elsewhere.
        let is_named_so = named_place(path).is_some_and(|place| place.starts_with(&root));
        is_named_so || place_of(path).starts_with(&root)
    }

    /// The path of a name, if there is no link on the way to it. The file itself need not exist.
    fn resolve(&self, name: &InnerPath) -> Result<PathBuf, Error> {
        let mut path = self.root.clone();
        let mut components = name.components().peekable();
        while let Some(component) = components.next() {
            path.push(component);
            match fs::symlink_metadata(&path) {
                Ok(meta) if meta.is_symlink() => return Err(Error::Link { path }),
                Ok(meta) if components.peek().is_some() && !meta.is_dir() => {
                    let source = io::Error::from(io::ErrorKind::NotADirectory);
                    return Err(Error::Io { path, source });
                }
                Ok(_) => {}
                Err(e) if e.kind() == io::ErrorKind::NotFound => {
                    path.extend(components);
                    return Ok(path);
                }
                Err(source) => return Err(Error::Io { path, source }),
            }
        }
        Ok(path)
    }

    fn metadata(&self, name: &InnerPath) -> Result<(PathBuf, Option<Metadata>), Error> {
        let path = self.resolve(name)?;
        match fs::symlink_metadata(&path) {
            Ok(meta) => Ok((path, Some(meta))),
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok((path, None)),
            Err(source) => Err(Error::Io { path, source }),
        }
    }

    /// What a name stands for; `None` if it does not exist.
    ///
    /// # Errors
    /// [`Error::Link`] and [`Error::Io`].
    pub fn kind(&self, name: &InnerPath) -> Result<Option<EntryKind>, Error> {
        let kind = |meta: Metadata| kind(meta.file_type());
        Ok(self.metadata(name)?.1.map(kind))
    }

    /// The bytes of a regular file of at most `limit` bytes.
    ///
    /// # Errors
    /// [`Error::Link`], [`Error::NotRegular`], [`Error::TooLarge`], [`Error::Io`].
    pub fn read(&self, name: &InnerPath, limit: u64) -> Result<Vec<u8>, Error> {
        match self.metadata(name)? {
            (path, Some(meta)) => read::read_checked(&path, &meta, limit),
            (path, None) => Err(missing(path)),
        }
    }

    /// Opens a regular file of at most `limit` bytes, for what is too large for memory. Bytes that
    /// are added to it later, beyond the limit, are not read.
    ///
    /// # Errors
    /// As [`Folder::read`].
    pub fn open(&self, name: &InnerPath, limit: u64) -> Result<io::Take<File>, Error> {
        match self.metadata(name)? {
            (path, Some(meta)) => read::open_checked(&path, &meta, limit),
            (path, None) => Err(missing(path)),
        }
    }

    /// The same for UTF-8 text.
    ///
    /// # Errors
    /// As [`Folder::read`], and [`Error::NotText`].
    pub fn read_text(&self, name: &InnerPath, limit: u64) -> Result<String, Error> {
        read::into_text(&name.below(&self.root), self.read(name, limit)?)
    }

    /// Everything directly in the root, by name; nothing if there is no such folder.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn entries(&self) -> Result<Vec<Entry>, Error> {
        entries(&self.root)
    }

    /// Everything directly in a folder below the root, by name; nothing if there is no such folder.
    ///
    /// # Errors
    /// [`Error::Link`] and [`Error::Io`].
    pub fn entries_of(&self, folder: &InnerPath) -> Result<Vec<Entry>, Error> {
        entries(&self.resolve(folder)?)
    }

    /// Makes a folder and those above it, the root's own included.
    ///
    /// # Errors
    /// [`Error::Link`] and [`Error::Io`].
    pub fn create_folders(&self, folder: &InnerPath) -> Result<(), Error> {
        let path = self.resolve(folder)?;
        if path.is_dir() {
            return Ok(());
        }
        self.create_root()?;
        let mut path = self.root.clone();
        for component in folder.components() {
            path.push(component);
            if !path.is_dir() {
                operation::create_folder(&path).map_err(Error::io(&path))?;
            }
        }
        Ok(())
    }

    /// Makes the root and the folders above it.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create_root(&self) -> Result<(), Error> {
        let above: Vec<&Path> = self.root.ancestors().collect();
        for folder in above.into_iter().rev() {
            if !folder.as_os_str().is_empty() && !folder.exists() {
                operation::create_folder(folder).map_err(Error::io(folder))?;
            }
        }
        Ok(())
    }

    /// Writes a file whole or not at all, replacing an older one, and makes its folders.
    ///
    /// Nothing is synced: see [`Syncer`](crate::Syncer).
    ///
    /// # Errors
    /// [`Error::Link`], [`Error::NotRegular`] if a folder or a device bears the name,
    /// [`Error::Io`].
    pub fn put(&self, name: &InnerPath, bytes: &[u8]) -> Result<(), Error> {
        self.begin_with(name, bytes)?.commit()
    }

    /// Does the same, and syncs the content before the file gets its name, and the name after that.
    ///
    /// # Errors
    /// As [`Folder::put`].
    pub fn put_synced(&self, name: &InnerPath, bytes: &[u8]) -> Result<(), Error> {
        self.begin_with(name, bytes)?.commit_synced()
    }

    fn begin_with(&self, name: &InnerPath, bytes: &[u8]) -> Result<PendingFile, Error> {
        let mut file = self.begin(name)?;
        (file.write_all(bytes)).map_err(Error::io(&name.below(&self.root)))?;
        Ok(file)
    }

    /// Begins a file that gets its name when it is whole, and makes its folders.
    ///
    /// # Errors
    /// As [`Folder::put`].
    pub fn begin(&self, name: &InnerPath) -> Result<PendingFile, Error> {
        if let Some(folder) = name.parent() {
            self.create_folders(&folder)?;
        } else {
            self.create_root()?;
        }
        let (path, meta) = self.metadata(name)?;
        if let Some(meta) = meta.filter(|meta| !meta.is_file()) {
            let found = read::kind(meta.file_type());
            return Err(Error::NotRegular { path, found });
        }
        PendingFile::beside(&path).map_err(Error::io(&path))
    }

    /// Removes a regular file. A missing file is no error.
    ///
    /// # Errors
    /// [`Error::Link`], [`Error::NotRegular`], [`Error::Io`].
    pub fn remove_file(&self, name: &InnerPath) -> Result<(), Error> {
        match self.metadata(name)? {
            (path, Some(meta)) if !meta.is_file() => {
                let found = read::kind(meta.file_type());
                Err(Error::NotRegular { path, found })
            }
            (path, Some(_)) => operation::remove_file(&path).map_err(Error::io(&path)),
            (_, None) => Ok(()),
        }
    }

    /// Removes a folder if it exists and is empty; returns whether it is gone.
    ///
    /// # Errors
    /// [`Error::Link`] and [`Error::Io`].
    pub fn remove_empty_folder(&self, name: &InnerPath) -> Result<bool, Error> {
        match self.metadata(name)? {
            (path, Some(meta)) if meta.is_dir() => {
                if !entries(&path)?.is_empty() {
                    return Ok(false);
                }
                operation::remove_folder(&path).map_err(Error::io(&path))?;
                Ok(true)
            }
            (_, Some(_)) => Ok(false),
            (_, None) => Ok(true),
        }
    }

    /// Waits until a file's content is on the medium.
    ///
    /// # Errors
    /// [`Error::Link`] and [`Error::Io`].
    pub fn sync_file(&self, name: &InnerPath) -> Result<(), Error> {
        let path = self.resolve(name)?;
        operation::sync_file(&path).map_err(Error::io(&path))
    }

    /// Waits until the names in a folder are on the medium; `None` stands for the root.
    ///
    /// # Errors
    /// [`Error::Link`] and [`Error::Io`].
    pub fn sync_folder(&self, name: Option<&InnerPath>) -> Result<(), Error> {
        let path = match name {
            Some(name) => self.resolve(name)?,
            None => self.root.clone(),
        };
        operation::sync_folder(&path).map_err(Error::io(&path))
    }

    /// Locks a file, which is made if necessary. Where the file system has no locks nothing is
    /// locked, and the user has to take care.
    ///
    /// # Errors
    /// [`Error::Locked`] if another process holds it, [`Error::Link`], [`Error::NotRegular`],
    /// [`Error::Io`].
    pub fn lock(&self, name: &InnerPath) -> Result<Lock, Error> {
        if let Some(folder) = name.parent() {
            self.create_folders(&folder)?;
        }
        let (path, meta) = self.metadata(name)?;
        if let Some(meta) = meta.filter(|meta| !meta.is_file()) {
            let found = read::kind(meta.file_type());
            return Err(Error::NotRegular { path, found });
        }
        let file = File::create(&path).map_err(Error::io(&path))?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => Err(Error::Locked {
                path: self.root.clone(),
            }),
            Ok(()) | Err(TryLockError::Error(_)) => Ok(Lock { _file: file }),
        }
    }

    /// Tests whether a file can be written here. It leaves nothing behind.
    ///
    /// # Errors
    /// [`Error::Io`], naming the root.
    pub fn probe(&self) -> Result<(), Error> {
        // A file is made in the folder, or in the one that it will be made in, because permissions
        // alone do not tell.
        let there = self.root.ancestors().find(|folder| folder.exists());
        let there = there.filter(|folder| !folder.as_os_str().is_empty());
        let here = there.unwrap_or(Path::new("."));
        (PendingFile::beside(&here.join("probe")).map(drop)).map_err(Error::io(&self.root))
    }
}

fn missing(path: PathBuf) -> Error {
    let source = io::Error::new(io::ErrorKind::NotFound, "No such file");
    Error::Io { path, source }
}

/// Where a path leads, from the root of the file system. Links are followed as far as the path
/// exists; what is still to be made is taken by its names, as plain folders will bear them.
fn place_of(path: &Path) -> PathBuf {
    let is_empty = path.as_os_str().is_empty();
    let path = if is_empty { Path::new(".") } else { path };
    let whole = path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut place = PathBuf::new();
    for component in whole.components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir => {
                place.pop();
            }
            Component::Prefix(_) | Component::RootDir => place.push(component),
            Component::Normal(name) => {
                place.push(name);
                place = fs::canonicalize(&place).unwrap_or(place);
            }
        }
    }
    place
}

/// The place of a path's own name, which may be that of a link; `None` if it ends in `..`.
fn named_place(path: &Path) -> Option<PathBuf> {
    let (folder, name) = (path.parent()?, path.file_name()?);
    Some(place_of(folder).join(name))
}

fn kind(of: fs::FileType) -> EntryKind {
    if of.is_file() {
        EntryKind::File
    } else if of.is_dir() {
        EntryKind::Folder
    } else {
        EntryKind::Other
    }
}

fn entries(folder: &Path) -> Result<Vec<Entry>, Error> {
    let read = match fs::read_dir(folder) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        read => read.map_err(Error::io(folder))?,
    };
    let mut entries = Vec::new();
    for entry in read {
        let entry = entry.map_err(Error::io(folder))?;
        entries.push(Entry {
            name: entry.file_name().to_string_lossy().into_owned(),
            kind: kind(entry.file_type().map_err(Error::io(folder))?),
        });
    }
    entries.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(entries)
}
