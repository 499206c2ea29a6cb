//! The `nemoral` program.

use std::process::ExitCode;

/// Chunks are made by one thread and dropped by another, for hours. The C library's heap grows
/// under that pattern; this one does not.
#[global_allocator]
static ALLOCATOR: dlmalloc::GlobalDlmalloc = dlmalloc::GlobalDlmalloc;

fn main() -> ExitCode {
    ExitCode::from(nemoral_cli::run(std::env::args_os(), None))
}
