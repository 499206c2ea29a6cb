//! Plants that are grown once for all tests, as `nemoral_realism::grown`.

use std::io;
use std::path::PathBuf;
use std::sync::{Arc, LazyLock};

use nemoral_pipeline::plan::Cache;

/// The cache of grown plants of all tests of this program, and of others of the same build if
/// `NEMORAL_TEST_CACHE` says where.
pub(crate) fn grown() -> Option<Arc<Cache>> {
    static GROWN: LazyLock<Option<Arc<Cache>>> = LazyLock::new(|| open().ok().map(Arc::new));
    GROWN.clone()
}

fn open() -> io::Result<Cache> {
    if let Some(folder) = std::env::var_os("NEMORAL_TEST_CACHE") {
        let folder = PathBuf::from(folder);
        let build = folder.join("build");
        return Cache::open_for(folder, &build);
    }
    // Programs are in target/debug/deps. Another build has another hash, and grows its own.
    let program = std::env::current_exe()?;
    let target = program.ancestors().nth(3).ok_or(io::ErrorKind::NotFound)?;
    Cache::open(target.join("tmp/grown"))
}
