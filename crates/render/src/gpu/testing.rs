//! The GPU that unit tests draw on.

use std::io::Write;

use super::{AcceptedGpus, Gpu};

/// A GPU for one test, so that it may be lost; otherwise as in `nemoral_tests::gpu::gpu`.
pub(super) fn gpu(test: &str) -> Option<Gpu> {
    Gpu::open(AcceptedGpus::Any)
        .map_err(|e| {
            let message = format!("SKIPPED: {test}: {e}\n");
            assert!(
                std::env::var_os("NEMORAL_REQUIRE_GPU").is_none(),
                "{message}"
            );
            let _ = std::io::stderr().write_all(message.as_bytes());
        })
        .ok()
}
