//! The `nemoral` program as a function: arguments, progress, exit codes; nothing else.
//!
//! The program itself is a call of [`run`], and so is the command that the Python package brings.
//!
//! ```
//! assert_eq!(nemoral_cli::run(["nemoral", "config", "presets"], None), 0);
//! ```

mod arguments;
mod commands;
mod export;
mod failure;
mod frames;
mod inventory;
mod progress;
mod request;
mod terminal;
mod view;

use std::ffi::OsString;
use std::path::Path;

use clap::Parser;

/// The program's exit code for a request that is wrong.
const WRONG_REQUEST: u8 = 2;

/// Runs the program with these arguments, the first of which is its name, and returns its exit
/// code: 0 for success; 1 if it failed while running, was interrupted, or `check` found a fault; 2
/// if the request was wrong: nothing was done, or a finished data set cannot have a further format.
///
/// `program` is the file whose changes make values that are kept between runs stale, if it is not
/// the process's own.
///
/// A command that computes sets up rayon's global thread pool, and `generate` handles signals, so
/// that a process can run one such command.
pub fn run<A: Into<OsString> + Clone>(
    arguments: impl IntoIterator<Item = A>,
    program: Option<&Path>,
) -> u8 {
    let arguments = match arguments::Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(refused) => {
            // Help and version come this way, too; nobody is left to tell if it cannot be printed.
            let _ = refused.print();
            return if refused.use_stderr() {
                WRONG_REQUEST
            } else {
                0
            };
        }
    };
    match commands::run(arguments, program) {
        Ok(true) => 0,
        // The command ran, and its answer is no; for example, `check` found a fault.
        Ok(false) => 1,
        Err(failure) => {
            terminal::print_error(&failure.message);
            if failure.is_request { WRONG_REQUEST } else { 1 }
        }
    }
}
