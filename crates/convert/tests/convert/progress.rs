//! A progress monitor is told about each frame of a conversion, and may end it.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};

use nemoral_convert::{ConvertParams, Error, FormatName, OutputMode, convert_with_progress};
use nemoral_dataset::{FrameProgress, ProgressMonitor};

use super::common::*;

#[test]
fn each_frame_is_told_once_and_a_stopped_conversion_goes_on() {
    let dir = tempfile::tempdir().expect("a folder");
    let source = dir.path().join("dataset");
    write(&source, &annotated(), &[0, 1, 2]);
    for format in FormatName::ALL {
        let told: Arc<Mutex<Vec<FrameProgress>>> = Arc::default();
        let list = Arc::clone(&told);
        let monitor = ProgressMonitor::new(move |done| {
            list.lock().expect("a list").push(done);
            ControlFlow::Continue(())
        });
        let whole = dir.path().join(format!("whole-{format}"));
        let params = ConvertParams::new(format);
        convert_with_progress(&source, &whole, &params, &monitor).expect("converted");
        // A conversion that is finished is told as its last frame.
        let resume = ConvertParams {
            mode: OutputMode::Resume,
            ..params.clone()
        };
        let before = told.lock().expect("a list").len();
        convert_with_progress(&source, &whole, &resume, &monitor).expect("finished");
        let mut told = told.lock().expect("a list");
        assert_eq!(told.pop().map(|last| last.done), Some(3), "{format}");
        assert_eq!(told.len(), before, "{format}");
        let last = told.last().copied().expect("the last frame is told");
        assert_eq!((last.done, last.total, last.frame), (3, 3, 2), "{format}");
        assert!(told.windows(2).all(|two| two[0].done < two[1].done));

        let out = dir.path().join(format!("out-{format}"));
        let monitor = ProgressMonitor::new(|_| ControlFlow::Break(()));
        let stopped = convert_with_progress(&source, &out, &params, &monitor).expect_err("stopped");
        let is_stop = matches!(
            stopped,
            Error::Dataset(nemoral_dataset::Error::Stopped { total: 3, .. })
        );
        assert!(is_stop, "{format}: {stopped}");
        assert!(!out.join("conversion.json").exists());
        run(&source, &out, format, OutputMode::Resume).expect("converted");
        assert!(tree(&out) == tree(&whole), "{format}");
    }
}
