//! The command `view`: a page for a browser, until Ctrl-C.

use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;

use nemoral_pipeline::Backend;
use nemoral_view::{ForestParams, LiveForest, Routes, Server};

use crate::arguments::View;
use crate::failure::Failure;
use crate::request::{cache, load, threads};
use crate::terminal::{note, say};

/// Serves the page until it is stopped.
pub(crate) fn run(a: View, program: Option<&Path>) -> Result<bool, Failure> {
    let sequence = load(&a.of.world)?.get(a.of.sequence)?;
    let (backend, of_backend) = Backend::for_config(a.backend.into(), &sequence.config)?;
    let (cache, no_cache) = cache(&a.of.cache_args, program);
    let forest = LiveForest::new(ForestParams {
        sequence,
        backend,
        threads: threads(&a.of.world)?,
        cache,
    })?;
    let server = Server::bind(a.port)?;
    let handle = server.shutdown_handle();
    ctrlc::set_handler(move || handle.shutdown()).map_err(|e| Failure {
        message: format!("cannot listen for signals: {e}"),
        is_request: false,
    })?;
    note(&of_backend);
    if let Some(no_cache) = no_cache {
        note(&no_cache);
    }
    let url = server.url();
    say(&url)?;
    note("open this address in your browser; Ctrl-C ends it");
    if a.open && !open(&url) {
        note("no browser could be opened");
    }
    server.serve(Arc::new(Routes::new(Arc::new(forest))))?;
    Ok(true)
}

/// Opens an address in the user's browser, and says whether something was started.
fn open(url: &str) -> bool {
    let (program, arguments): (&str, &[&str]) = if cfg!(target_os = "macos") {
        ("open", &[])
    } else if cfg!(windows) {
        ("rundll32", &["url.dll,FileProtocolHandler"])
    } else {
        ("xdg-open", &[])
    };
    let mut command = Command::new(program);
    command.args(arguments).arg(url);
    command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command.spawn().is_ok()
}
