//! Makes a data set from a request.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc;

use nemoral_dataset::{
    CameraData, FrameData, LidarData, Manifest, OpenMode, Track, WorldTables, Writer,
};
use nemoral_render::CameraImages;
use nemoral_scene::{Annotations, ChunkCoord, LidarPoint, ObjectRecord, TreeRecord};

use crate::chunks::ChunkManager;
use crate::config::Config;
use crate::header::header;
use crate::plan::{At, Cache, Hasher, Runner, Store};
use crate::prove::{prove, within_sequence};
use crate::recording::pose::FramePose;
use crate::recording::scene::visible_chunks;
use crate::world::trajectory::Surroundings;
use crate::{Backend, Error, ForestPlan, FrameSelection, InputFiles};

/// The number of the one sequence of a data set.
const SEQUENCE: u32 = 0;
/// What is to be made, and where.
#[derive(Clone, Debug)]
pub struct Request {
    /// The world and its sensors.
    pub config: Config,
    /// The files that the config names, read with it.
    pub inputs: InputFiles,
    /// Which frames of the sequence.
    pub frames: FrameSelection,
    /// The output folder.
    pub out: PathBuf,
    /// What to do if the folder is not empty.
    pub mode: OpenMode,
    /// How many threads compute chunks. Pixels and pulses are shared among rayon's threads.
    pub threads: usize,
    /// The renderer that takes the pictures.
    pub backend: Backend,
    /// The cache of grown libraries, which does not change the result.
    pub cache: Option<Arc<Cache>>,
}

/// Is told about the progress of a run.
pub trait Observer: Sync {
    /// Reports something that the user should know.
    fn note(&self, message: &str);

    /// Reports that a frame is on disk.
    fn frame(&self, done: Done);
}

/// A frame that is on disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Done {
    /// The frame.
    pub frame: u64,
    /// How many frames of this run are on disk now.
    pub count: u64,
    /// How many there will be.
    pub total: u64,
    /// Size of its files.
    pub bytes: u64,
    /// True if it was there already.
    pub resumed: bool,
}

/// One frame as it goes to the writer.
struct Finished {
    frame: u64,
    pose: Arc<FramePose>,
    images: Arc<Vec<CameraImages>>,
    annotations: Arc<Vec<Annotations>>,
    scans: Arc<Vec<Vec<LidarPoint>>>,
    key: [u8; 32],
}

/// Makes a data set.
///
/// `stop` is checked between frames. Once it is true, frames that were begun are finished and the
/// run ends with [`Error::Interrupted`], leaving a folder that [`OpenMode::Resume`] can continue.
///
/// # Errors
/// A wrong request is refused before anything is written; later, the error is that of the first
/// stage or file that fails.
pub fn generate(
    request: &Request,
    observer: &dyn Observer,
    stop: &AtomicBool,
) -> Result<Manifest, Error> {
    let config = &request.config;
    let forest = ForestPlan::with_inputs(config, &request.inputs, request.backend.clone())?;
    let store = Store::unlimited().with_cache(request.cache.clone());
    let runner = Runner::new(forest.plan(), &store, request.threads);

    // Everything that can be refused is refused before anything is written.
    let header = header(config, &forest)?;
    Writer::probe(&request.out, request.mode, &header)?;
    if let Some(last) = request.frames.last() {
        within_sequence(config, last)?;
    }
    if let Some(note) = prove(config, &forest, &runner)? {
        observer.note(&note);
    }
    let rigs = runner.get(forest.cameras, ())?;

    let writer = Writer::create(&request.out, request.mode, header)?;
    record(request, &forest, &runner, &writer, observer, stop)?;
    for (i, rig) in rigs.iter().enumerate() {
        let known = (rigs[..i].iter()).any(|other| Arc::ptr_eq(&other.renderer, &rig.renderer));
        if let Some(memory) = rig.renderer.gpu_memory().filter(|_| !known) {
            observer.note(&memory);
        }
    }
    // The frames are done, and the rest needs only values of the world.
    store.retain(|_, at| at == At::World);
    let tracks = tracks(config, &forest, &runner)?;
    let frames: Vec<u64> = writer
        .frames()
        .into_iter()
        .map(|(_, frame)| frame)
        .collect();
    let (trees, objects) = inventory(config, &forest, &runner, &frames)?;
    let tables = WorldTables {
        trees: &trees,
        objects: &objects,
    };
    Ok(writer.finish(&tables, &[tracks])?)
}

/// Makes the missing frames one after the other, while others are written and a GPU draws the next
/// one.
fn record(
    request: &Request,
    forest: &ForestPlan,
    runner: &Runner<'_>,
    writer: &Writer,
    observer: &dyn Observer,
    stop: &AtomicBool,
) -> Result<(), Error> {
    let total = request.frames.count();
    let manager = ChunkManager::new(request.config.chunks.clone());
    let failed = AtomicBool::new(false);
    std::thread::scope(|scope| {
        // At most two frames wait, so that a slow disk delays the frames rather than filling the
        // memory.
        let (sender, receiver) = mpsc::sync_channel::<Result<Finished, u64>>(2);
        let (writer, failed) = (&writer, &failed);
        let writing = scope.spawn(move || {
            for (before, item) in (0_u64..).zip(receiver) {
                let (frame, bytes, resumed) = match item {
                    Err(frame) => (frame, 0, true),
                    Ok(finished) => {
                        let bytes = write(writer, &finished).inspect_err(|_| {
                            failed.store(true, Ordering::Relaxed);
                        })?;
                        (finished.frame, bytes, false)
                    }
                };
                observer.frame(Done {
                    frame,
                    count: before + 1,
                    total,
                    bytes,
                    resumed,
                });
            }
            Ok::<_, Error>(())
        });
        let made = (|| {
            let mut frames = request.frames.iter().peekable();
            while let Some(frame) = frames.next() {
                if stop.load(Ordering::Relaxed) {
                    return Err(Error::Interrupted);
                }
                if failed.load(Ordering::Relaxed) {
                    break;
                }
                let key = frame_key(forest, frame);
                let item = if writer.has_frame(SEQUENCE, frame, &key) {
                    Err(frame)
                } else {
                    let is_drawn_ahead = |next: &u64| {
                        request.backend.draws_ahead()
                            && !writer.has_frame(SEQUENCE, *next, &frame_key(forest, *next))
                    };
                    let coming = frames.peek().copied().filter(is_drawn_ahead);
                    if let Some(next) = coming {
                        // The GPU draws the next frame while this frame's pictures are read back
                        // and its scans are taken. An error there is ignored, as it occurs again
                        // when that frame is made.
                        scope.spawn(move || runner.get(forest.images, next).map(drop));
                    }
                    Ok(make(forest, runner, &manager, (frame, key), coming)?)
                };
                if sender.send(item).is_err() {
                    break;
                }
            }
            Ok(())
        })();
        drop(sender);
        // The writer's error is the cause if there are two.
        writing.join().unwrap_or(Err(Error::StagePanicked))?;
        made
    })
}

fn make(
    forest: &ForestPlan,
    runner: &Runner<'_>,
    manager: &ChunkManager,
    (frame, key): (u64, [u8; 32]),
    coming: Option<u64>,
) -> Result<Finished, Error> {
    let pose = runner.get(forest.pose, frame)?;
    let images = runner.get(forest.images, frame)?;
    let annotations = runner.get(forest.annotations, frame)?;
    let scans = runner.get(forest.scans, frame)?;
    manager.evict(
        runner.store(),
        pose.world_from_body().translation_m.truncate(),
        coming.as_slice(),
    );
    Ok(Finished {
        frame,
        pose,
        images,
        annotations,
        scans,
        key,
    })
}

fn write(writer: &Writer, finished: &Finished) -> Result<u64, Error> {
    let pictures = finished.images.iter().zip(&*finished.annotations);
    let cameras = writer.header().cameras.iter().zip(pictures);
    let cameras = cameras.map(|(spec, (image, annotations))| CameraData {
        name: &spec.name,
        rgb: &image.rgb,
        radiance: image.linear.as_ref(),
        truth: &image.truth,
        annotations,
    });
    let lidars = writer.header().lidars.iter().zip(&*finished.scans);
    let lidars = lidars.map(|(spec, points)| LidarData {
        name: &spec.name,
        points,
        sensor_chunk: finished.pose.chunk,
    });
    let record = writer.write_frame(&FrameData {
        sequence: SEQUENCE,
        index: finished.frame,
        time_s: finished.pose.time_s,
        world_from_body: finished.pose.world_from_body(),
        body_motion: finished.pose.motion,
        cameras: cameras.collect(),
        lidars: lidars.collect(),
        frame_key: finished.key,
    })?;
    Ok(record.bytes())
}

/// The key of everything that goes into a frame.
fn frame_key(forest: &ForestPlan, frame: u64) -> [u8; 32] {
    let mut hasher = Hasher::new("frame");
    hasher.write_bytes(&forest.plan().key(forest.annotations, frame).0);
    hasher.write_bytes(&forest.plan().key(forest.scans, frame).0);
    hasher.finish().0
}

/// The number of poses that a thread computes at a time.
const BLOCK: u64 = 256;
/// The number of poses that each thread computes before chunks are freed.
const ROUND: u64 = 4 * BLOCK;

/// The poses of the whole sequence, whichever frames are made here: only that in the middle of each
/// frame's track, computed by all threads.
fn tracks(config: &Config, forest: &ForestPlan, runner: &Runner<'_>) -> Result<Track, Error> {
    let manager = ChunkManager::new(config.chunks.clone());
    let trajectory = runner.get(forest.trajectory, ())?;
    let pose = |frame: u64| {
        let surroundings = Surroundings {
            ground: runner.demand(forest.ground),
            objects: runner.demand(forest.objects),
        };
        let pose = trajectory.pose(frame, 0.0, surroundings)?;
        Ok::<_, Error>((trajectory.time_s(frame), pose))
    };
    let mut poses = Vec::new();
    while (poses.len() as u64) < config.frames {
        let first = poses.len() as u64;
        let end = (first + ROUND * runner.threads() as u64).min(config.frames);
        let next = AtomicU64::new(first);
        let blocks = std::thread::scope(|scope| {
            let work = || {
                let mut done = Vec::new();
                loop {
                    let from = next.fetch_add(BLOCK, Ordering::Relaxed);
                    if from >= end {
                        return Ok::<_, Error>(done);
                    }
                    let block = (from..end.min(from + BLOCK)).map(pose);
                    done.push((from, block.collect::<Result<Vec<_>, _>>()?));
                }
            };
            let workers: Vec<_> = (0..runner.threads()).map(|_| scope.spawn(work)).collect();
            let done = workers
                .into_iter()
                .map(|w| w.join().unwrap_or(Err(Error::StagePanicked)));
            done.collect::<Result<Vec<_>, Error>>()
        })?;
        let blocks: BTreeMap<u64, Vec<_>> = blocks.into_iter().flatten().collect();
        poses.extend(blocks.into_values().flatten());
        if let Some((_, body)) = poses.last() {
            manager.evict(runner.store(), body.translation_m.truncate(), &[]);
        }
    }
    Ok(Track {
        sequence: SEQUENCE,
        poses,
    })
}

/// Every object in a chunk that is visible from one of the frames, in order of id.
fn inventory(
    config: &Config,
    forest: &ForestPlan,
    runner: &Runner<'_>,
    frames: &[u64],
) -> Result<(Vec<TreeRecord>, Vec<ObjectRecord>), Error> {
    let chunks = &config.chunks;
    let mut visible: BTreeSet<ChunkCoord> = BTreeSet::new();
    for &frame in frames {
        let position = runner
            .get(forest.pose, frame)?
            .world_from_body()
            .translation_m
            .truncate();
        visible.extend(visible_chunks(
            position,
            chunks.visible_radius_m,
            chunks.size_m,
        ));
    }
    let assets = runner.get(forest.assets, ())?;
    let (mut trees, mut objects) = (Vec::new(), Vec::new());
    for &chunk in &visible {
        for object in &runner.get(forest.objects, chunk)?.0 {
            objects.push(assets.object_record(object));
            trees.extend(assets.tree_record(object));
        }
        // Chunks come column by column, so those two columns back are no longer needed.
        runner
            .store()
            .retain(|_, at| !matches!(at, At::Chunk(c) if c.x < chunk.x - 2));
    }
    Ok((trees, objects))
}
