//! Accounting of device memory.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// The device memory of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GpuMemory {
    /// Bytes in use now.
    pub bytes: u64,
    /// Bytes that may be used at most.
    pub limit_bytes: u64,
    /// Prototypes that are resident.
    pub shapes: usize,
    /// Prototypes that were evicted to make room for others, so far.
    pub evicted: u64,
}

/// Device memory of a picture that is being rendered; it is released on drop.
#[derive(Debug)]
pub(crate) struct MemoryReservation {
    pub(crate) bytes: u64,
    /// Bytes of all reservations together.
    total: Arc<AtomicU64>,
}

impl MemoryReservation {
    /// An empty reservation, counted in `total` with those of all other pictures.
    pub(crate) fn new(total: &Arc<AtomicU64>) -> Self {
        Self {
            bytes: 0,
            total: Arc::clone(total),
        }
    }

    pub(crate) fn add(&mut self, bytes: u64) {
        self.bytes += bytes;
        self.total.fetch_add(bytes, Ordering::Relaxed);
    }
}

impl Drop for MemoryReservation {
    fn drop(&mut self) {
        self.total.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}
