//! Values kept on disk from run to run.

#![allow(
    clippy::disallowed_methods,
    reason = "the one module of this crate that looks after files: their ages and sizes"
)]

use std::error::Error;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use nemoral_files::{Folder, InnerPath, PendingFile, is_temporary_name};

use crate::{Fingerprint, Hasher};

/// A folder of values by their keys. A file's name is the hash of the value's key and of the
/// program that made it, and its content contains its own hash. Hence no file is ever stale, and a
/// damaged file is treated as missing. Any file may be deleted at any time, which only costs the
/// time to make it again. Any number of processes may share the folder, as a file gets its name
/// when it is whole.
///
/// The cache is never needed: errors of reading and writing are ignored.
#[derive(Debug)]
pub struct Cache {
    folder: Folder,
    /// The program that makes the values.
    maker: Fingerprint,
    limit_bytes: u64,
}

/// How a stage's output is stored in a [`Cache`].
#[derive(Debug)]
pub struct CacheCodec<T> {
    /// Writes the output, in pieces of any size.
    pub write: fn(&T, &mut dyn Write) -> io::Result<()>,
    /// The output from its bytes, equal to the bit; `None` if they are not valid.
    pub from_bytes: fn(&[u8]) -> Option<T>,
}

const ENDING: &str = "nemoral";
/// The most bytes that are kept; beyond that, the least recently used files are deleted.
const LIMIT_BYTES: u64 = 2_000_000_000;
/// The largest program that is hashed, bytes.
const PROGRAM_BYTES: u64 = 4 << 30;
/// As much as is written and hashed at a time.
const BUFFER_BYTES: usize = 1 << 18;
/// Files are written in seconds, so one that is unfinished after this time was left by a killed
/// process.
const ABANDONED: Duration = Duration::from_secs(3600);

/// A file, and the hash of what has been written to it.
#[derive(Debug)]
struct Hashed {
    file: PendingFile,
    hash: blake3::Hasher,
}

impl Write for Hashed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.hash.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Cache {
    /// Opens the cache of this program's values in a folder, which is made if it does not exist.
    /// Files that killed processes have left there are deleted.
    ///
    /// # Errors
    /// If the folder cannot be made, or the program cannot read itself.
    pub fn open(folder: impl Into<PathBuf>) -> io::Result<Self> {
        Self::open_for(folder, &std::env::current_exe()?)
    }

    /// The same for a program that is not the process's own file, such as a library that an
    /// interpreter has loaded.
    ///
    /// # Errors
    /// If the folder cannot be made, or the program cannot be read.
    pub fn open_for(folder: impl Into<PathBuf>, program: &Path) -> io::Result<Self> {
        let program = nemoral_files::read(program, PROGRAM_BYTES);
        let mut hasher = Hasher::new("maker");
        hasher.write_bytes(&program.map_err(io::Error::other)?);
        Self::of_maker(folder.into(), hasher.finish())
    }

    fn of_maker(folder: PathBuf, maker: Fingerprint) -> io::Result<Self> {
        fs::create_dir_all(&folder)?;
        let cache = Self {
            folder: Folder::new(&folder),
            maker,
            limit_bytes: LIMIT_BYTES,
        };
        cache.remove_abandoned();
        Ok(cache)
    }

    fn name(&self, key: Fingerprint) -> InnerPath {
        let mut hasher = Hasher::new("kept");
        hasher.write_bytes(&self.maker.0);
        hasher.write_bytes(&key.0);
        let name = format!("{}.{ENDING}", hasher.finish());
        InnerPath::new(name).expect("hexadecimal digits and an ending")
    }

    fn path(&self, key: Fingerprint) -> PathBuf {
        self.name(key).below(self.folder.root())
    }

    /// Whether there is a file for this key.
    pub(crate) fn has(&self, key: Fingerprint) -> bool {
        self.path(key).is_file()
    }

    /// The bytes that were put, if they are there and whole.
    pub(crate) fn get(&self, key: Fingerprint) -> Option<Vec<u8>> {
        let mut bytes = self.folder.read(&self.name(key), self.limit_bytes).ok()?;
        let whole = bytes.len().checked_sub(blake3::OUT_LEN)?;
        let hash = blake3::hash(&bytes[..whole]);
        if bytes[whole..] != *hash.as_bytes() {
            return None;
        }
        bytes.truncate(whole);
        // The new date says that the file was used just now. A reader without write permission
        // cannot set it.
        if let Ok(file) = File::options().append(true).open(self.path(key)) {
            let _ = file.set_modified(now());
        }
        Some(bytes)
    }

    /// Stores what `write` writes, if there is room.
    pub(crate) fn put(
        &self,
        key: Fingerprint,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) {
        // The folder may have been removed; then nothing is stored any more.
        if self.folder.root().is_dir() {
            let _ = self.write(&self.name(key), write);
        }
        self.tidy(&self.path(key));
    }

    fn write(
        &self,
        name: &InnerPath,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), Box<dyn Error>> {
        let hashed = Hashed {
            file: self.folder.begin(name)?,
            hash: blake3::Hasher::new(),
        };
        let mut writer = BufWriter::with_capacity(BUFFER_BYTES, hashed);
        write(&mut writer)?;
        let Hashed { mut file, hash } = writer.into_inner()?;
        file.write_all(hash.finalize().as_bytes())?;
        Ok(file.commit()?)
    }

    /// Every file whose name `is_ours` accepts, with its date.
    fn files(&self, is_ours: fn(&str) -> bool) -> Vec<(SystemTime, PathBuf, u64)> {
        let Ok(folder) = fs::read_dir(self.folder.root()) else {
            return Vec::new();
        };
        let file = |entry: io::Result<fs::DirEntry>| {
            let entry = entry.ok()?;
            // The metadata of the entry itself, as links are not followed.
            let meta = entry.metadata().ok()?;
            let known = is_ours(entry.file_name().to_str()?) && meta.is_file();
            known.then_some((meta.modified().ok()?, entry.path(), meta.len()))
        };
        let mut files: Vec<_> = folder.filter_map(file).collect();
        files.sort();
        files
    }

    /// Deletes the least recently used files until the rest is within the limit, but never
    /// `newest`.
    fn tidy(&self, newest: &Path) {
        let files = self.files(is_value);
        let mut total: u64 = files.iter().map(|(_, _, size)| size).sum();
        for (_, path, size) in files {
            if total <= self.limit_bytes {
                return;
            }
            if path != newest && fs::remove_file(&path).is_ok() {
                total -= size;
            }
        }
    }

    /// Deletes files that were begun and never finished.
    fn remove_abandoned(&self) {
        let now = now();
        for (time, path, _) in self.files(is_unfinished) {
            if now.duration_since(time).is_ok_and(|age| age > ABANDONED) {
                let _ = fs::remove_file(&path);
            }
        }
    }
}

/// Whether this is the name of a value: 64 hexadecimal digits and our ending.
fn is_value(name: &str) -> bool {
    let digits = name.strip_suffix(ENDING).and_then(|n| n.strip_suffix('.'));
    digits.is_some_and(is_hash)
}

/// Whether this is the name of a file that is being written, by this version or an earlier one.
fn is_unfinished(name: &str) -> bool {
    let stem = name.strip_suffix(ENDING).and_then(|n| n.strip_suffix('.'));
    let by_process = stem
        .and_then(|n| n.split_once('.'))
        .is_some_and(|(hash, process)| {
            is_hash(hash) && process.bytes().all(|b| b.is_ascii_digit())
        });
    by_process || is_temporary_name(name)
}

fn is_hash(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|b| b.is_ascii_hexdigit())
}

#[expect(
    clippy::disallowed_methods,
    reason = "it decides which file goes first, never what is in one"
)]
fn now() -> SystemTime {
    SystemTime::now()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn key(n: u64) -> Fingerprint {
        let mut hasher = Hasher::new("test");
        hasher.write_u64(n);
        hasher.finish()
    }

    fn cache(folder: &Path, maker: u64) -> Cache {
        Cache::of_maker(folder.join("new"), key(maker)).expect("a folder")
    }

    #[test]
    fn bytes_come_back_to_the_same_key_and_maker_alone() {
        let dir = tempfile::tempdir().expect("a folder");
        let of_one = cache(dir.path(), 1);
        assert!(!of_one.has(key(7)) && of_one.get(key(7)).is_none());
        of_one.put(key(7), |out| out.write_all(b"a value"));
        assert!(of_one.has(key(7)));
        assert_eq!(of_one.get(key(7)).as_deref(), Some(b"a value".as_slice()));
        assert_eq!(of_one.get(key(8)), None);
        assert_eq!(cache(dir.path(), 2).get(key(7)), None);
        let again = cache(dir.path(), 1);
        assert_eq!(again.get(key(7)).as_deref(), Some(b"a value".as_slice()));
        assert_eq!(
            fs::read_dir(of_one.folder.root())
                .expect("a folder")
                .count(),
            1
        );
    }

    #[test]
    fn another_program_is_another_maker() {
        let dir = tempfile::tempdir().expect("a folder");
        let program = dir.path().join("program");
        let opened = |bytes: &[u8]| {
            fs::write(&program, bytes).expect("written");
            Cache::open_for(dir.path().join("kept"), &program).expect("a folder")
        };
        opened(b"one").put(key(7), |out| out.write_all(b"a value"));
        assert!(opened(b"one").has(key(7)));
        assert!(!opened(b"two").has(key(7)));
        let none = dir.path().join("none");
        assert!(Cache::open_for(dir.path().join("kept"), &none).is_err());
    }

    #[test]
    fn a_value_that_cannot_be_written_whole_leaves_no_file() {
        let dir = tempfile::tempdir().expect("a folder");
        let cache = cache(dir.path(), 1);
        cache.put(key(7), |out| {
            out.write_all(&[7; 2 * BUFFER_BYTES])?;
            Err(io::Error::other("it ends here"))
        });
        assert!(!cache.has(key(7)));
        let left = fs::read_dir(cache.folder.root()).expect("a folder");
        assert_eq!(left.count(), 0);
    }

    #[test]
    fn a_damaged_file_is_none_and_is_mended() {
        let dir = tempfile::tempdir().expect("a folder");
        let cache = cache(dir.path(), 1);
        cache.put(key(7), |out| out.write_all(b"a value"));
        let path = cache.path(key(7));
        let whole = fs::read(&path).expect("kept");
        let mut flipped = whole.clone();
        flipped[2] ^= 1;
        for damaged in [&whole[..whole.len() - 1], &whole[..3], &[], &flipped] {
            fs::write(&path, damaged).expect("a file");
            assert_eq!(cache.get(key(7)), None, "{damaged:?}");
        }
        cache.put(key(7), |out| out.write_all(b"a value"));
        assert!(cache.get(key(7)).is_some());
    }

    #[test]
    fn what_was_not_used_for_longest_goes_first() {
        let dir = tempfile::tempdir().expect("a folder");
        let mut cache = cache(dir.path(), 1);
        fs::write(cache.folder.root().join("not ours.txt"), [0; 500]).expect("a file");
        cache.limit_bytes = 3 * (100 + 32);
        for n in 0..3 {
            cache.put(key(n), |out| out.write_all(&[n as u8; 100]));
            let file = File::options().append(true).open(cache.path(key(n)));
            let past = now() - Duration::from_secs(1000 - n);
            let aged = file.and_then(|f| f.set_modified(past));
            aged.expect("a file");
        }
        // The first is used again, so the second is the oldest now.
        assert!(cache.get(key(0)).is_some());
        cache.put(key(3), |out| out.write_all(&[3; 100]));
        let left: Vec<bool> = (0..4).map(|n| cache.has(key(n))).collect();
        assert_eq!(left, [true, false, true, true]);
        assert!(cache.folder.root().join("not ours.txt").exists());
    }

    #[test]
    fn what_killed_writes_left_goes_when_it_is_old() {
        let dir = tempfile::tempdir().expect("a folder");
        let folder = dir.path().join("new");
        fs::create_dir_all(&folder).expect("a folder");
        let hash = "0123456789abcdef".repeat(4);
        let unfinished = [
            format!("{hash}.4711.{ENDING}"),
            ".nemoral-Ab3x9Q.tmp".to_owned(),
        ];
        let others = [
            format!("{hash}.{ENDING}"),
            format!("{hash}.of-mine.{ENDING}"),
            "notes.4711.nemoral".to_owned(),
            "nemoral-Ab3x9Q.tmp".to_owned(),
        ];
        let write = |name: &str, age_s: u64| {
            let file = File::create(folder.join(name)).expect("a file");
            let time = now() - Duration::from_secs(age_s);
            file.set_modified(time).expect("a file");
        };
        let is_there = |name: &String| folder.join(name).exists();
        for age_s in [60, 7200] {
            for name in unfinished.iter().chain(&others) {
                write(name, age_s);
            }
            cache(dir.path(), 1);
            // Another process may still be writing it.
            assert_eq!(unfinished.iter().any(is_there), age_s < 3600);
            assert!(others.iter().all(is_there));
        }
    }

    #[test]
    fn without_a_folder_nothing_is_kept_and_nothing_fails() {
        let dir = tempfile::tempdir().expect("a folder");
        let cache = cache(dir.path(), 1);
        fs::remove_dir_all(cache.folder.root()).expect("was there");
        cache.put(key(7), |out| out.write_all(b"a value"));
        assert_eq!(cache.get(key(7)), None);
        let file = dir.path().join("file");
        fs::write(&file, b"").expect("a file");
        assert!(Cache::of_maker(file.join("below"), key(1)).is_err());
    }
}
