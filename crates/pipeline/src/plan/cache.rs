//! Values kept on disk from run to run.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::{Fingerprint, Hasher};

/// A folder of values by their keys. It is content-addressed: a file's name is the hash of the value's key
/// and of the program that made it, and its content bears its own hash, so nothing in it is ever stale, and
/// a damaged file is no file. Deleting any of it, at any time, costs the time to make it again. Any number of
/// processes may share it: a file gets its name when it is whole.
///
/// It is a help and never needed: what cannot be read or written is passed over in silence.
#[derive(Debug)]
pub struct Cache {
    folder: PathBuf,
    /// The program that makes the values.
    maker: Fingerprint,
    limit_bytes: u64,
}

/// How a stage's output is kept in a [`Cache`].
#[derive(Debug)]
pub struct Kept<T> {
    /// The output as bytes.
    pub to_bytes: fn(&T) -> Vec<u8>,
    /// The output back, to the bit; `None` if these are not its bytes.
    pub from_bytes: fn(&[u8]) -> Option<T>,
}

const ENDING: &str = "nemoral";
/// When more is kept, what was not used for longest goes.
const LIMIT_BYTES: u64 = 2_000_000_000;

impl Cache {
    /// The cache in a folder, made if it is not there, of the values that this program makes.
    ///
    /// # Errors
    /// If the folder cannot be made, or the program cannot read itself.
    pub fn open(folder: impl Into<PathBuf>) -> io::Result<Self> {
        let program = fs::read(std::env::current_exe()?)?;
        let mut hasher = Hasher::new("maker");
        hasher.write_bytes(&program);
        Self::of_maker(folder.into(), hasher.finish())
    }

    fn of_maker(folder: PathBuf, maker: Fingerprint) -> io::Result<Self> {
        fs::create_dir_all(&folder)?;
        Ok(Self {
            folder,
            maker,
            limit_bytes: LIMIT_BYTES,
        })
    }

    fn path(&self, key: Fingerprint) -> PathBuf {
        let mut hasher = Hasher::new("kept");
        hasher.write_bytes(&self.maker.0);
        hasher.write_bytes(&key.0);
        self.folder.join(format!("{}.{ENDING}", hasher.finish()))
    }

    /// Is there a file for this key?
    pub(super) fn has(&self, key: Fingerprint) -> bool {
        self.path(key).is_file()
    }

    /// The bytes that were put, if they are all there.
    pub(super) fn get(&self, key: Fingerprint) -> Option<Vec<u8>> {
        let path = self.path(key);
        let mut bytes = fs::read(&path).ok()?;
        let whole = bytes.len().checked_sub(blake3::OUT_LEN)?;
        let hash = blake3::hash(&bytes[..whole]);
        if bytes[whole..] != *hash.as_bytes() {
            return None;
        }
        bytes.truncate(whole);
        // Used now: it goes last. A reader of a folder that is not its own cannot say so.
        if let Ok(file) = File::options().append(true).open(&path) {
            let _ = file.set_modified(now());
        }
        Some(bytes)
    }

    /// Keeps bytes, if there is room.
    pub(super) fn put(&self, key: Fingerprint, bytes: &[u8]) {
        let path = self.path(key);
        // A name of this process alone; one that was killed leaves it, and it goes when its time comes.
        let part = path.with_extension(format!("{}.{ENDING}", std::process::id()));
        let write = || {
            let mut file = File::create(&part)?;
            file.write_all(bytes)?;
            file.write_all(blake3::hash(bytes).as_bytes())?;
            drop(file);
            fs::rename(&part, &path)
        };
        if write().is_err() {
            let _ = fs::remove_file(&part);
        }
        self.tidy(&path);
    }

    /// Deletes what was not used for longest until the rest is within the limit; never `newest`.
    fn tidy(&self, newest: &Path) {
        let Ok(folder) = fs::read_dir(&self.folder) else {
            return;
        };
        let file = |entry: io::Result<fs::DirEntry>| {
            let path = entry.ok()?.path();
            let meta = fs::metadata(&path).ok()?;
            let is_ours = path.extension()? == ENDING && meta.is_file();
            is_ours.then_some((meta.modified().ok()?, path, meta.len()))
        };
        let mut files: Vec<_> = folder.filter_map(file).collect();
        files.sort();
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
        of_one.put(key(7), b"a wood");
        assert!(of_one.has(key(7)));
        assert_eq!(of_one.get(key(7)).as_deref(), Some(b"a wood".as_slice()));
        assert_eq!(of_one.get(key(8)), None);
        assert_eq!(cache(dir.path(), 2).get(key(7)), None);
        let again = cache(dir.path(), 1);
        assert_eq!(again.get(key(7)).as_deref(), Some(b"a wood".as_slice()));
        assert_eq!(fs::read_dir(&of_one.folder).expect("a folder").count(), 1);
    }

    #[test]
    fn a_damaged_file_is_none_and_is_mended() {
        let dir = tempfile::tempdir().expect("a folder");
        let cache = cache(dir.path(), 1);
        cache.put(key(7), b"a wood");
        let path = cache.path(key(7));
        let whole = fs::read(&path).expect("kept");
        let mut flipped = whole.clone();
        flipped[2] ^= 1;
        for damaged in [&whole[..whole.len() - 1], &whole[..3], &[], &flipped] {
            fs::write(&path, damaged).expect("a file");
            assert_eq!(cache.get(key(7)), None, "{damaged:?}");
        }
        cache.put(key(7), b"a wood");
        assert!(cache.get(key(7)).is_some());
    }

    #[test]
    fn what_was_not_used_for_longest_goes_first() {
        let dir = tempfile::tempdir().expect("a folder");
        let mut cache = cache(dir.path(), 1);
        fs::write(cache.folder.join("not ours.txt"), [0; 500]).expect("a file");
        cache.limit_bytes = 3 * (100 + 32);
        for n in 0..3 {
            cache.put(key(n), &[n as u8; 100]);
            let file = File::options().append(true).open(cache.path(key(n)));
            let past = now() - Duration::from_secs(1000 - n);
            let aged = file.and_then(|f| f.set_modified(past));
            aged.expect("a file");
        }
        // Used again: the second is the oldest now.
        assert!(cache.get(key(0)).is_some());
        cache.put(key(3), &[3; 100]);
        let left: Vec<bool> = (0..4).map(|n| cache.has(key(n))).collect();
        assert_eq!(left, [true, false, true, true]);
        assert!(cache.folder.join("not ours.txt").exists());
    }

    #[test]
    fn without_a_folder_nothing_is_kept_and_nothing_fails() {
        let dir = tempfile::tempdir().expect("a folder");
        let cache = cache(dir.path(), 1);
        fs::remove_dir_all(&cache.folder).expect("was there");
        cache.put(key(7), b"a wood");
        assert_eq!(cache.get(key(7)), None);
        let file = dir.path().join("file");
        fs::write(&file, b"").expect("a file");
        assert!(Cache::of_maker(file.join("below"), key(1)).is_err());
    }
}
