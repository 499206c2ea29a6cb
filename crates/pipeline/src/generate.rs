//! Makes a data set from a request.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use nemoral_convert::{ConversionSummary, FormatName};
use nemoral_dataset::{
    CameraData, FrameChoice, FrameData, FrameProgress, LidarData, Manifest, OpenMode, WorldTables,
    Writer,
};
use nemoral_render::CameraImages;
use nemoral_scene::{Annotations, LidarPoint};

use crate::chunks::ChunkManager;
use crate::config::Sequences;
use crate::formats::{check_formats, probe_formats, write_formats};
use crate::header::header;
use crate::imu::imu_files;
use crate::plan::{Cache, ForestCoordinate, Hasher, Runner, Stage, Store};
use crate::preflight::within_sequence;
use crate::recording::pose::FramePose;
use crate::sequence_tables::{inventory, track};
use crate::stages::balance::ChoiceStage;
use crate::stages::scene_objects::SceneObjectStage;
use crate::world::balance::BalanceChoice;
use crate::worlds::{World, Worlds};
use crate::{Backend, Error, ForestPlan, SequenceFrames};

/// What is to be made, and where.
#[derive(Clone, Debug)]
pub struct GenerateParams {
    /// The worlds and their sensors.
    pub sequences: Sequences,
    /// Which frames of the sequences.
    pub frames: SequenceFrames,
    /// The output folder.
    pub out: PathBuf,
    /// What to do if the folder is not empty.
    pub mode: OpenMode,
    /// Whether `frames` are a part of a data set that is made in parts. The other formats that it
    /// asks for are then left to [`merge`](crate::merge).
    pub is_shard: bool,
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
    fn frame(&self, done: FrameWritten);

    /// Reports, after the last frame, where the time of the run went.
    fn timings(&self, timings: RunTimings) {
        let _ = timings;
    }

    /// Reports a frame that is done in another format.
    fn converting(&self, format: FormatName, frame: FrameProgress) {
        let _ = (format, frame);
    }

    /// Reports that the data set is written in another format, too, and where.
    fn converted(&self, format: FormatName, folder: &Path, converted: ConversionSummary) {
        let _ = (format, folder, converted);
    }
}

/// Where the time of a run went. The rest went into waiting for the disk, and into tables of trees
/// and objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RunTimings {
    /// Growing plants and land, by the wall.
    pub growing: Duration,
    /// Taking pictures and scans, by the wall.
    pub sensors: Duration,
}

/// Adds the time that something takes.
fn timed<T>(total: &mut Duration, work: impl FnOnce() -> T) -> T {
    let begun = Instant::now();
    let result = work();
    *total += begun.elapsed();
    result
}

/// A frame that is on disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameWritten {
    /// The frame's sequence.
    pub sequence: u32,
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
    choice: Option<Arc<BalanceChoice>>,
    images: Arc<Vec<CameraImages>>,
    annotations: Arc<Vec<Annotations>>,
    scans: Arc<Vec<Vec<LidarPoint>>>,
    key: [u8; 32],
}

/// Makes a data set, and writes it in the formats of `output.formats`, too.
///
/// `stop` is checked between frames. Once it is true, frames that were begun are finished and the
/// run ends with [`Error::Interrupted`], leaving a folder that [`OpenMode::Resume`] can continue.
///
/// # Errors
/// A wrong request is refused before anything is written; later, the error is that of the first
/// stage or file that fails.
pub fn generate(
    params: &GenerateParams,
    observer: &dyn Observer,
    stop: &AtomicBool,
) -> Result<Manifest, Error> {
    // Everything that can be refused is refused before anything is written.
    let header = header(&params.sequences, &params.backend)?;
    Writer::probe(&params.out, params.mode, &header)?;
    if params.is_shard {
        check_formats(&header)?;
    } else {
        probe_formats(&header, &params.out, params.mode)?;
    }
    let store = Store::unlimited().with_cache(params.cache.clone());
    let (backend, threads) = (&params.backend, params.threads);
    let worlds = Worlds::new(&params.sequences, backend, &store, threads);
    let numbers: Vec<u32> = params.frames.sequences().collect();
    let mut timings = RunTimings::default();
    if numbers.len() > 1 {
        let count = numbers.len();
        observer.note(&format!(
            "the worlds of {count} sequences are checked before the first frame"
        ));
    }
    for &number in &numbers {
        let world = worlds.enter(number)?;
        if let Some(last) = params.frames.last() {
            within_sequence(&world.sequence.config, last)?;
        }
        if let Some(note) = timed(&mut timings.growing, || worlds.preflight(&world))? {
            observer.note(&note);
        }
    }

    let writer = Writer::create(&params.out, params.mode, header)?;
    let mut done = 0;
    for &number in &numbers {
        let world = worlds.enter(number)?;
        let runner = worlds.runner(&world);
        let of_world = record(params, (&world, done), &runner, &writer, observer, stop)?;
        timings.growing += of_world.growing;
        timings.sensors += of_world.sensors;
        done += params.frames.of(number).count();
        if done == params.frames.count() {
            note_memory(&world, &runner, observer)?;
        }
        conclude(&world, &runner, &writer, observer)?;
    }
    // A resumed folder may have frames of sequences of which none are asked for now.
    let mut others: Vec<u32> = writer
        .frames()
        .into_iter()
        .map(|(number, _)| number)
        .collect();
    others.dedup();
    others.retain(|number| !numbers.contains(number));
    for number in others {
        let world = worlds.enter(number)?;
        conclude(&world, &worlds.runner(&world), &writer, observer)?;
    }
    let manifest = writer.finish()?;
    observer.timings(timings);
    if !params.is_shard {
        let GenerateParams { out, mode, .. } = params;
        write_formats(&manifest.header, out, *mode, observer, stop)?;
    }
    Ok(manifest)
}

/// Notes the memory of GPUs, once for each renderer.
fn note_memory(world: &World, runner: &Runner<'_>, observer: &dyn Observer) -> Result<(), Error> {
    let rigs = runner.get(world.forest.cameras, ())?;
    for (i, rig) in rigs.iter().enumerate() {
        let known = (rigs[..i].iter()).any(|other| Arc::ptr_eq(&other.renderer, &rig.renderer));
        if let Some(memory) = rig.renderer.gpu_memory().filter(|_| !known) {
            observer.note(&memory);
        }
    }
    Ok(())
}

/// Writes the files of a sequence whose frames are done.
fn conclude(
    world: &World,
    runner: &Runner<'_>,
    writer: &Writer,
    observer: &dyn Observer,
) -> Result<(), Error> {
    // The frames are done, and the rest needs only what is of the world, and objects, which are
    // little.
    let needed = [ChoiceStage::ID, SceneObjectStage::ID];
    (runner.store()).retain(|stage, at| at == ForestCoordinate::World || needed.contains(&stage));
    let (number, config) = (world.sequence.number, &world.sequence.config);
    let mut track = track((number, config), &world.forest, runner)?;
    let frames = writer.frames().into_iter();
    let frames = frames.filter(|f| f.0 == number).map(|f| f.1);
    let all = inventory(config, &world.forest, runner, frames)?;
    if config.imu.enabled {
        let (files, measured) = imu_files(config, &world.forest, runner)?;
        if let Some(note) = measured.range_note() {
            observer.note(&note);
        }
        track.imu = Some(files);
    }
    let tables = WorldTables {
        trees: &all.trees,
        deadwood: &all.deadwood,
        objects: &all.objects,
    };
    Ok(writer.write_sequence(&track, &tables)?)
}

/// Makes the missing frames of a sequence one after the other, while others are written and a GPU
/// draws the next one. `done` is how many frames of other sequences are done.
fn record(
    params: &GenerateParams,
    (world, done): (&World, u64),
    runner: &Runner<'_>,
    writer: &Writer,
    observer: &dyn Observer,
    stop: &AtomicBool,
) -> Result<RunTimings, Error> {
    let total = params.frames.count();
    let World { sequence, forest } = world;
    let number = sequence.number;
    let frames = params.frames.of(number);
    let manager = ChunkManager::new(sequence.config.chunks.clone());
    if let Some(pilot) = forest.balance_pilot
        && let Some(note) = runner.get(pilot, ())?.note()
    {
        observer.note(&note);
    }
    let failed = AtomicBool::new(false);
    let mut timings = RunTimings::default();
    std::thread::scope(|scope| {
        // At most two frames wait, so that a slow disk delays the frames rather than filling the
        // memory.
        let (sender, receiver) = mpsc::sync_channel::<Result<Finished, u64>>(2);
        let (writer, failed) = (&writer, &failed);
        let writing = scope.spawn(move || {
            for (before, item) in (done..).zip(receiver) {
                let (frame, bytes, resumed) = match item {
                    Err(frame) => (frame, 0, true),
                    Ok(finished) => {
                        let bytes = write(writer, number, &finished).inspect_err(|_| {
                            failed.store(true, Ordering::Relaxed);
                        })?;
                        (finished.frame, bytes, false)
                    }
                };
                observer.frame(FrameWritten {
                    sequence: number,
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
            let mut frames = frames.iter().peekable();
            while let Some(frame) = frames.next() {
                if stop.load(Ordering::Relaxed) {
                    return Err(Error::Interrupted);
                }
                if failed.load(Ordering::Relaxed) {
                    break;
                }
                let key = frame_key(forest, frame);
                let item = if writer.has_frame(number, frame, &key) {
                    Err(frame)
                } else {
                    let coming = frames.peek().copied();
                    let is_drawn_ahead = |next: &u64| {
                        params.backend.draws_ahead()
                            && !writer.has_frame(number, *next, &frame_key(forest, *next))
                    };
                    if let Some(next) = coming.filter(is_drawn_ahead) {
                        // The GPU draws the next frame while this frame's pictures are read back
                        // and its scans are taken. An error there is ignored, as it occurs again
                        // when that frame is made.
                        scope.spawn(move || runner.get(forest.images, next).map(drop));
                    }
                    Ok(make(
                        forest,
                        runner,
                        &manager,
                        &mut timings,
                        (frame, key),
                        coming,
                    )?)
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
    })?;
    Ok(timings)
}

fn make(
    forest: &ForestPlan,
    runner: &Runner<'_>,
    manager: &ChunkManager,
    timings: &mut RunTimings,
    (frame, key): (u64, [u8; 32]),
    coming: Option<u64>,
) -> Result<Finished, Error> {
    let choice = forest.balance_choice.map(|node| runner.get(node, frame));
    let pose = runner.get(forest.pose, frame)?;
    timed(&mut timings.growing, || {
        runner.get(forest.camera_scene, frame)?;
        runner.get(forest.lidar_scene, frame)
    })?;
    let sensed = Instant::now();
    let images = runner.get(forest.images, frame)?;
    let annotations = runner.get(forest.annotations, frame)?;
    let scans = runner.get(forest.scans, frame)?;
    timings.sensors += sensed.elapsed();
    // Flow has asked for the scene of the next frame, and a GPU may draw it already.
    manager.evict(
        runner.store(),
        pose.world_from_body().translation_m.truncate(),
        coming.as_slice(),
    );
    Ok(Finished {
        frame,
        pose,
        choice: choice.transpose()?,
        images,
        annotations,
        scans,
        key,
    })
}

fn write(writer: &Writer, number: u32, finished: &Finished) -> Result<u64, Error> {
    let sequence = writer.header().sequence(number);
    let sequence = sequence.expect("the header has all sequences of the request");
    let pictures = finished.images.iter().zip(&*finished.annotations);
    let cameras = sequence.cameras.iter().zip(pictures);
    let cameras = cameras.map(|(spec, (image, annotations))| CameraData {
        name: &spec.name,
        rgb: &image.rgb,
        radiance: image.linear.as_ref(),
        truth: &image.truth,
        annotations,
    });
    let lidars = sequence.lidars.iter().zip(&*finished.scans);
    let lidars = lidars.map(|(spec, points)| LidarData {
        name: &spec.name,
        points,
        sensor_chunk: finished.pose.chunk,
    });
    let record = writer.write_frame(&FrameData {
        sequence: number,
        index: finished.frame,
        time_s: finished.pose.time_s,
        world_from_body: finished.pose.world_from_body(),
        body_motion: finished.pose.motion,
        balance: finished.choice.as_ref().map(|choice| FrameChoice {
            candidate: choice.candidate,
            shares: choice.shares.clone(),
        }),
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
