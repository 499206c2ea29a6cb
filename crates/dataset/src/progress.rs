//! How far work on a data set has come.

use std::fmt;
use std::ops::ControlFlow;
use std::sync::Arc;

use crate::{Error, FrameRecord};

/// A frame that work is done with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameProgress {
    /// How many frames are done, this one included.
    pub done: u64,
    /// How many there are.
    pub total: u64,
    /// The frame's sequence.
    pub sequence: u32,
    /// The frame's number in its sequence.
    pub frame: u64,
}

/// Who is told about each frame that work is done with, and may end the work by
/// [`ControlFlow::Break`]. By default nobody is.
#[derive(Clone, Default)]
pub struct ProgressMonitor(Option<Arc<Callback>>);

type Callback = dyn Fn(FrameProgress) -> ControlFlow<()> + Send + Sync;

impl ProgressMonitor {
    /// Calls a function after each frame, on the thread that does the work.
    pub fn new(
        callback: impl Fn(FrameProgress) -> ControlFlow<()> + Send + Sync + 'static,
    ) -> Self {
        Self(Some(Arc::new(callback)))
    }

    /// Tells about a frame.
    ///
    /// # Errors
    /// [`Error::Stopped`] if the work is to end.
    pub fn tell(&self, frame: FrameProgress) -> Result<(), Error> {
        match self.0.as_ref().map(|callback| callback(frame)) {
            None | Some(ControlFlow::Continue(())) => Ok(()),
            Some(ControlFlow::Break(())) => {
                let FrameProgress { done, total, .. } = frame;
                Err(Error::Stopped { done, total })
            }
        }
    }

    /// Tells about the frame of a record, the `done`-th of `total`.
    pub(crate) fn done(&self, done: usize, total: usize, frame: &FrameRecord) -> Result<(), Error> {
        self.tell(FrameProgress {
            done: done as u64,
            total: total as u64,
            sequence: frame.sequence,
            frame: frame.index,
        })
    }
}

impl fmt::Debug for ProgressMonitor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() {
            "ProgressMonitor(somebody)"
        } else {
            "ProgressMonitor(nobody)"
        })
    }
}
