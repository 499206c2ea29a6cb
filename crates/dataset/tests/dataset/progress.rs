//! A progress monitor is told about each frame of work on a data set, and may end the work.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Arc, Mutex};

use nemoral_dataset::{
    Cloud, CloudParams, Error, FrameProgress, MergeParams, OpenMode, ProgressMonitor,
    check_with_progress, merge_with_progress, stats_with_progress,
};

use super::common::*;

/// A monitor that ends the work after some frames, and what it was told.
fn monitor(frames: u64) -> (ProgressMonitor, Arc<Mutex<Vec<FrameProgress>>>) {
    let told: Arc<Mutex<Vec<FrameProgress>>> = Arc::default();
    let list = Arc::clone(&told);
    let monitor = ProgressMonitor::new(move |done| {
        list.lock().expect("a list").push(done);
        match done.done < frames {
            true => ControlFlow::Continue(()),
            false => ControlFlow::Break(()),
        }
    });
    (monitor, told)
}

#[test]
fn each_frame_is_told_until_the_work_is_ended() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = |name: &str| dir.path().join(name);
    let whole = path("whole");
    write(&whole, &small(), &[0, 1, 2, 3]);
    write(&path("a"), &small(), &[0, 2]);
    write(&path("b"), &small(), &[1, 3]);
    let (a, b) = (path("a"), path("b"));
    let parts: [&Path; 2] = [&a, &b];
    type Work<'a> = Box<dyn Fn(&ProgressMonitor) -> Result<(), Error> + 'a>;
    let merge = |monitor: &ProgressMonitor, mode| {
        let partial = false;
        merge_with_progress(
            &parts,
            &path("merged"),
            MergeParams { mode, partial },
            monitor,
        )
        .map(drop)
    };
    let works: [(Work<'_>, [u64; 4]); 4] = [
        (
            Box::new(|w| check_with_progress(&whole, w).map(drop)),
            [0, 1, 2, 3],
        ),
        (
            Box::new(|w| stats_with_progress(&whole, w).map(drop)),
            [0, 1, 2, 3],
        ),
        (
            Box::new(|w| {
                let cloud = Cloud::open(&whole, CloudParams::default())?;
                cloud
                    .with_progress(w.clone())
                    .for_each(|_| Ok(()))
                    .map(drop)
            }),
            [0, 1, 2, 3],
        ),
        (Box::new(|w| merge(w, OpenMode::Overwrite)), [0, 2, 1, 3]),
    ];
    for (work, frames) in &works {
        let (two, told) = monitor(2);
        let stopped = work(&two).expect_err("ended");
        let is_stop = matches!(stopped, Error::Stopped { done: 2, total: 4 });
        assert!(is_stop, "{stopped}");
        assert_eq!(told.lock().expect("a list").len(), 2);
        let (all, told) = monitor(5);
        work(&all).expect("done");
        let told = told.lock().expect("a list");
        let expected = (1..).zip(frames).map(|(done, &frame)| FrameProgress {
            done,
            total: 4,
            sequence: 0,
            frame,
        });
        assert_eq!(*told, expected.collect::<Vec<_>>());
    }
    // A merge that was ended goes on.
    merge(&monitor(1).0, OpenMode::Overwrite).expect_err("ended");
    merge(&ProgressMonitor::default(), OpenMode::Resume).expect("merged");
    assert!(tree(&path("merged")) == tree(&whole));
}
