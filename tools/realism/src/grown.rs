//! Plants that are grown once for all tests.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

use nemoral_pipeline::plan::Cache;

/// The variable that names a new folder, in which all programs of a build keep what they grow. It
/// has a file `build` of any content, which stands for that build.
const FOLDER: &str = "NEMORAL_TEST_CACHE";

/// The cache of grown plants of all tests of this program, and of others of the same build if
/// `NEMORAL_TEST_CACHE` says where: most of the time of a small world goes into growing them.
#[must_use]
pub fn grown() -> Option<Arc<Cache>> {
    static GROWN: LazyLock<Option<Arc<Cache>>> = LazyLock::new(|| open().ok().map(Arc::new));
    GROWN.clone()
}

fn open() -> io::Result<Cache> {
    if let Some(folder) = std::env::var_os(FOLDER) {
        let folder = PathBuf::from(folder);
        let build = folder.join("build");
        return Cache::open_for(folder, &build);
    }
    // Tests are in target/debug/deps, other programs in target/debug. Another build of a test has
    // another hash, and grows its own.
    let program = std::env::current_exe()?;
    let mut folders = program.ancestors().skip(1);
    let profile = folders.find(|folder| !folder.ends_with("deps"));
    let target = profile.and_then(Path::parent);
    let target = target.ok_or(io::ErrorKind::NotFound)?;
    Cache::open(target.join("tmp/grown"))
}
