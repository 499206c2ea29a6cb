//! A GPU camera that drives from chunk to chunk: old chunks are evicted, new ones are uploaded, and
//! no picture depends on what was in memory before.

use nemoral_pipeline::ChunkManager;
use nemoral_pipeline::config::Config;
use nemoral_pipeline::plan::{Runner, Store};
use nemoral_pipeline::{Backend, BackendChoice, ForestPlan, Renderer};
use nemoral_render::{CameraImages, GpuMemory};
use nemoral_tests::config;
use nemoral_tests::gpu::gpu;

/// Frames in descending order. No two have a chunk in common.
const FRAMES: [u64; 3] = [2, 1, 0];
const AMPLE_MIB: u32 = 4096;

/// A forest and its computed values.
struct Forest {
    config: Config,
    backend: Backend,
    store: Store,
}

/// The results of a drive: the last picture, and the camera's memory after each frame.
struct Driven {
    last: CameraImages,
    memory: Vec<GpuMemory>,
}

impl Forest {
    /// Takes frames with a new camera. After each frame the chunk manager deletes chunks farther
    /// away than `delete_radius_m`.
    fn drive(&self, frames: &[u64], memory_mib: u32, delete_radius_m: f64) -> Driven {
        let backend = self.backend.clone().with_gpu_memory(memory_mib);
        let forest = ForestPlan::on(&self.config, backend).expect("a plan");
        self.store
            .retain(|stage, _| !["world.cameras", "frame.images"].contains(&stage));
        let runner = Runner::new(forest.plan(), &self.store, 2);
        let mut chunks = self.config.chunks.clone();
        chunks.delete_radius_m = delete_radius_m;
        let manager = ChunkManager::new(chunks);
        let rigs = runner.get(forest.cameras, ()).expect("cameras");
        let Renderer::Gpu(camera) = &*rigs[0].renderer else {
            panic!("a GPU was asked for");
        };
        let mut last = None;
        let memory = frames.iter().map(|&frame| {
            let images = runner.get(forest.images, frame).expect("pictures");
            last = Some(images[0].clone());
            let pose = runner.get(forest.pose, frame).expect("a pose");
            let place = pose.world_from_body().translation_m.truncate();
            manager.evict(&self.store, place, &[]);
            camera.memory()
        });
        let memory = memory.collect();
        Driven {
            last: last.expect("a frame"),
            memory,
        }
    }
}

#[test]
#[ignore = "minutes: .ci/full runs it"]
fn chunks_come_and_go_without_a_trace() {
    if gpu("chunks that come and go").is_none() {
        return;
    }
    // The memory holds mostly ground, some megabytes per chunk; trees are few and the same
    // everywhere.
    let settings = [
        "frames=3",
        "placement.trees=4",
        "camera.width_px=120",
        "camera.height_px=80",
        "camera.edge_samples=1",
        "lidar.pulses=10",
        "chunks.size_m=100",
        "chunks.visible_radius_m=20",
        "chunks.undergrowth_radius_m=5",
        "terrain.cell_m=0.5",
        "terrain.fine_cell_m=0.1",
        "robot.spacing_m=120",
    ];
    let config = config("demo", &settings);
    let (backend, _) = Backend::for_config(BackendChoice::Gpu, &config).expect("a GPU");
    let forest = Forest {
        config,
        backend,
        store: Store::unlimited(),
    };
    let drive = |what: &str, frames: &[u64], memory_mib, delete_radius_m| {
        let driven = forest.drive(frames, memory_mib, delete_radius_m);
        println!("{what}: {:?}", driven.memory);
        let is_bounded = |m: &GpuMemory| m.bytes <= m.limit_bytes;
        assert!(driven.memory.iter().all(is_bounded));
        driven
    };
    let evicted = |driven: &Driven| driven.memory[driven.memory.len() - 1].evicted;

    let fresh = drive("a fresh camera", &[0], AMPLE_MIB, 1000.0);
    // Chunks that the manager deletes leave the GPU without any need for room.
    let deleted = drive("chunks deleted", &FRAMES, AMPLE_MIB, 20.0);
    assert!(deleted.last == fresh.last);
    assert_eq!(evicted(&deleted), 0);
    // The most memory used so far, and half a page for temporary buffers of a picture, is the limit
    // for drives in which the manager keeps chunks.
    let most = deleted.memory.iter().map(|m| m.bytes).max();
    let little_mib = (most.expect("a frame") >> 20) as u32 + 8;
    let kept = drive("chunks kept, little memory", &FRAMES, little_mib, 1000.0);
    assert!(kept.last == fresh.last);
    assert!(evicted(&kept) > 0);
}
