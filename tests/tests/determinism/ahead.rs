//! A GPU draws a frame while the previous one is read back and scanned, and this changes no byte.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

use nemoral_dataset::OpenMode;
use nemoral_pipeline::config::Sequences;
use nemoral_pipeline::{
    Backend, BackendChoice, FrameWritten, GenerateParams, Observer, SequenceFrames, generate,
};
use nemoral_tests::gpu::gpu;
use nemoral_tests::{config, grown};

#[derive(Default)]
struct Notes(Mutex<Vec<String>>);

impl Observer for Notes {
    fn note(&self, message: &str) {
        self.0
            .lock()
            .expect("nobody panics")
            .push(message.to_owned());
    }

    fn frame(&self, _: FrameWritten) {}
}

#[test]
#[ignore = "minutes: .ci/full runs it"]
fn frames_drawn_ahead_are_those_drawn_in_turn() {
    let frames = [0_u64, 1, 3];
    if gpu("frames drawn ahead").is_none() {
        return;
    }
    let config = config(
        "demo",
        &[
            "frames=4",
            "placement.trees=10",
            "camera.width_px=120",
            "camera.height_px=80",
            "camera.edge_samples=1",
            "lidar.pulses=500",
            "chunks.visible_radius_m=10",
            "chunks.undergrowth_radius_m=3",
            "assets.individuals=1",
        ],
    );
    let (backend, _) = Backend::for_config(BackendChoice::Gpu, &config).expect("a GPU");
    assert!(backend.draws_ahead() && !Backend::Cpu.draws_ahead());
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let notes = Notes::default();
    let make = |frames: &[u64], name: &str, mode| {
        let params = GenerateParams {
            frames: SequenceFrames::new(frames.iter().map(|&frame| frame..frame + 1).collect(), 1),
            sequences: Sequences::of(&config).expect("valid"),
            out: folder.join(name),
            mode,
            is_shard: false,
            threads: 2,
            backend: backend.clone().with_gpu_memory(1500),
            cache: grown(),
        };
        generate(&params, &notes, &AtomicBool::new(false)).expect("a data set");
    };
    make(&frames, "ahead", OpenMode::Fresh);
    // A frame without a next one is drawn alone; a frame that is already recorded is not drawn
    // again.
    let (first, last) = (frames[0], frames[frames.len() - 1]);
    make(&[last], "in-turn", OpenMode::Fresh);
    make(&[last, first], "in-turn", OpenMode::Resume);
    for frame in [first, last] {
        for kind in ["image_2", "instance", "depth", "velodyne"] {
            let read = |name: &str| {
                let of_kind = folder.join(name).join("sequences/00").join(kind);
                let files = std::fs::read_dir(&of_kind).expect("a folder");
                let named = |f: &std::fs::DirEntry| {
                    f.file_name()
                        .to_string_lossy()
                        .starts_with(&format!("{frame:06}"))
                };
                let file = files.flatten().find(named).expect("a file");
                std::fs::read(file.path()).expect("its bytes")
            };
            assert!(read("ahead") == read("in-turn"), "{kind} of frame {frame}");
        }
    }
    let notes = notes.0.into_inner().expect("nobody panics");
    let memory: Vec<&String> = notes.iter().filter(|n| n.contains("GPU memory")).collect();
    assert_eq!(memory.len(), 3, "{notes:?}");
    assert!(
        memory.iter().all(|n| n.contains("of 1500 MiB")),
        "{notes:?}"
    );
}
