//! The `nemoral` program.

use std::process::ExitCode;

/// All threads allocate while a forest grows, and chunks are made by one thread and dropped by
/// another, for hours. The C library's heap grows by that. This one does not, and its threads do
/// not wait for each other.
#[cfg(all(unix, feature = "heap"))]
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    ExitCode::from(nemoral_cli::run(std::env::args_os(), None))
}
