//! The `nemoral` program: arguments, progress, exit codes; nothing else.

mod arguments;
mod commands;
mod frames;
mod progress;
mod view;

use std::process::ExitCode;

use clap::Parser;

/// Chunks are made by one thread and dropped by another, for hours. The C library's heap grows
/// under that pattern; this one does not.
#[global_allocator]
static ALLOCATOR: dlmalloc::GlobalDlmalloc = dlmalloc::GlobalDlmalloc;

/// The program's exit code for a request that is wrong.
const WRONG_REQUEST: u8 = 2;

fn main() -> ExitCode {
    let arguments = arguments::Arguments::parse();
    match commands::run(arguments) {
        Ok(true) => ExitCode::SUCCESS,
        // The command ran, and its answer is no; for example, `check` found a fault.
        Ok(false) => ExitCode::FAILURE,
        Err(failure) => {
            progress::complain(&failure.message);
            ExitCode::from(if failure.is_request { WRONG_REQUEST } else { 1 })
        }
    }
}
