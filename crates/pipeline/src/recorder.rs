//! Single frames in memory, in any order, along the robot's path or anywhere else.

mod body_state;
mod surroundings;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nemoral_dataset::SequenceSpec;
use nemoral_render::CameraImages;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{Annotations, ChunkCoord, LidarPoint, RigidTransform, Twist};

pub use self::body_state::BodyState;
pub use self::surroundings::InventoryItem;

use self::body_state::noise_of;
use crate::chunks::ChunkManager;
use crate::config::{Config, SequenceConfig};
use crate::header::sequence_spec;
use crate::plan::{Cache, Runner, Stage, Store};
use crate::pool::in_pool;
use crate::preflight::preflight;
use crate::recording::annotations::AnnotationRecipe;
use crate::recording::pose::{FramePose, pictures_s};
use crate::recording::recording_context::RecordingContext;
use crate::recording::scene::FrameScene;
use crate::stages::assets::{AssetStage, LibraryStage};
use crate::{Backend, Error, ForestPlan};

/// What the robot's sensors recorded at once.
#[derive(Clone, Debug)]
pub struct RecordedFrame {
    /// When and where.
    pub pose: Arc<FramePose>,
    /// Colour and truth images of each camera.
    pub images: Arc<Vec<CameraImages>>,
    /// The annotations that each camera was asked for.
    pub annotations: Arc<Vec<Annotations>>,
    /// The points of each LiDAR.
    pub scans: Arc<Vec<Vec<LidarPoint>>>,
}

/// Records frames of a sequence in memory. It keeps the chunks around the last place, as
/// [`generate`](crate::generate) does, so that near places follow quickly. Each observation grows a
/// little of what lies ahead in the direction from the place before it, so that none waits for all
/// that comes into sight at once.
///
/// ```no_run
/// use nemoral_pipeline::config::ConfigLayers;
/// use nemoral_pipeline::{Backend, Recorder};
///
/// let sequence = ConfigLayers::default().sequences()?.get(0)?;
/// let recorder = Recorder::new(sequence, Backend::Cpu, None, 2)?;
/// let frame = recorder.frame(41)?;
/// println!("{} points at {:.1} s", frame.scans[0].len(), frame.pose.time_s);
/// # Ok::<(), nemoral_pipeline::Error>(())
/// ```
#[derive(Debug)]
pub struct Recorder {
    sequence: SequenceConfig,
    spec: SequenceSpec,
    forest: ForestPlan,
    store: Store,
    manager: ChunkManager,
    /// Where the body recorded last.
    body_m: Mutex<Option<DVec2>>,
    threads: AtomicUsize,
}

/// A panic of another thread leaves the place consistent.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Recorder {
    /// A recorder of a sequence. Nothing is grown yet; `cache` may store grown plants.
    ///
    /// # Errors
    /// As [`ForestPlan::with_inputs`].
    pub fn new(
        sequence: SequenceConfig,
        backend: Backend,
        cache: Option<Arc<Cache>>,
        threads: usize,
    ) -> Result<Self, Error> {
        let forest = ForestPlan::with_inputs(&sequence.config, &sequence.inputs, backend)?;
        Ok(Self {
            spec: sequence_spec(&sequence, &forest)?,
            manager: ChunkManager::new(sequence.config.chunks.clone()),
            store: Store::unlimited().with_cache(cache),
            forest,
            sequence,
            body_m: Mutex::default(),
            threads: AtomicUsize::new(threads),
        })
    }

    /// The same recorder, with the plants that another one has grown, if they are its own.
    #[must_use]
    pub fn with_plants_of(self, other: &Self) -> Self {
        for stage in [LibraryStage::ID, AssetStage::ID] {
            self.store.adopt(&other.store, stage);
        }
        // Plants of other species, or of worlds before that one, would never be used.
        self.store.retain_plan(self.forest.plan());
        self
    }

    /// The sequence.
    #[must_use]
    pub fn sequence(&self) -> &SequenceConfig {
        &self.sequence
    }

    /// What a data set's manifest says about the sequence: sensors, seed, keys.
    #[must_use]
    pub fn spec(&self) -> &SequenceSpec {
        &self.spec
    }

    /// The wired plans.
    #[must_use]
    pub fn forest(&self) -> &ForestPlan {
        &self.forest
    }

    /// Grows with this number of threads from the next call on, at least 1. No result depends on
    /// it.
    pub fn set_threads(&self, threads: usize) {
        self.threads.store(threads, Ordering::Relaxed);
    }

    /// A runner of the plans, with the values that are kept.
    #[must_use]
    pub fn runner(&self) -> Runner<'_> {
        let threads = self.threads.load(Ordering::Relaxed);
        Runner::new(self.forest.plan(), &self.store, threads)
    }

    /// Computes what all frames have in common, plants above all: what takes seconds.
    ///
    /// # Errors
    /// As [`generate`](crate::generate) before its first frame.
    pub fn prepare(&self) -> Result<(), Error> {
        let runner = self.runner();
        preflight(self.config(), &self.forest, &runner)?;
        runner.get(self.forest.assets, ())?;
        Ok(())
    }

    /// Records a frame of the sequence: what a data set of it holds.
    ///
    /// # Errors
    /// If the frame is beyond the sequence, or cannot be made.
    pub fn frame(&self, frame: u64) -> Result<RecordedFrame, Error> {
        self.prepare()?;
        crate::preflight::within_sequence(self.config(), frame)?;
        let runner = self.runner();
        let recorded = RecordedFrame {
            pose: runner.get(self.forest.pose, frame)?,
            images: runner.get(self.forest.images, frame)?,
            annotations: runner.get(self.forest.annotations, frame)?,
            scans: runner.get(self.forest.scans, frame)?,
        };
        // Flow has asked for the scene of the next frame.
        self.leave(&recorded.pose, &[frame + 1]);
        Ok(recorded)
    }

    /// When and where a frame of the sequence is recorded.
    ///
    /// # Errors
    /// As [`Recorder::frame`].
    pub fn pose(&self, frame: u64) -> Result<Arc<FramePose>, Error> {
        preflight(self.config(), &self.forest, &self.runner())?;
        crate::preflight::within_sequence(self.config(), frame)?;
        self.runner().get(self.forest.pose, frame)
    }

    /// Records with the same sensors at any place and time. At the pose, time and index of a frame
    /// of the sequence the body moves as it does there, so that the result is that frame;
    /// elsewhere, as the state says. Flow, which leads to a sequence's next frame, is empty
    /// elsewhere.
    ///
    /// # Errors
    /// If the place is beyond the world, or its chunks cannot be made.
    pub fn observe(&self, state: &BodyState) -> Result<RecordedFrame, Error> {
        state.check()?;
        self.prepare()?;
        if let Some(frame) = self.frame_at(state)? {
            return self.frame(frame);
        }
        let config = self.config();
        let (runner, forest) = (self.runner(), &self.forest);
        let lidars = runner.get(forest.lidars, ())?;
        let rigs = runner.get(forest.cameras, ())?;
        let materials = runner.get(forest.materials, ())?;
        let mut pose = FramePose::moving(
            (state.world_from_body, state.motion),
            state.time_s,
            &lidars,
            config.chunks.size_m,
        );
        if pictures_s(config) == 0.0 {
            pose.motion = Twist::STILL;
        }
        let place_m = state.world_from_body.translation_m.truncate();
        let scene = forest.scene_around(&runner, place_m, f64::INFINITY, !rigs.is_empty())?;
        let number = state.index.unwrap_or_else(|| noise_of(state));
        let context = RecordingContext::new(forest.world(), number, &pose, &scene, &materials);
        let picture = |(i, rig)| context.picture(i, rig);
        let images: Vec<CameraImages> = in_pool(|| {
            rigs.iter()
                .enumerate()
                .map(picture)
                .collect::<Result<_, _>>()
        })?;
        let scans = in_pool(|| lidars.iter().map(|rig| context.scan(rig)).collect());
        let annotations = AnnotationRecipe::new(config).annotate(
            &rigs,
            (&pose, &scene, &images),
            runner.demand(forest.uncovered_geometry),
            None,
        )?;
        let before_m = *lock(&self.body_m);
        self.leave(&pose, &[]);
        if let Some(before_m) = before_m {
            let chunks = &config.chunks;
            let spare_m = chunks.delete_radius_m - chunks.visible_radius_m;
            let is_lit = !rigs.is_empty();
            forest.grow_ahead(&runner, (before_m, place_m), spare_m, is_lit);
        }
        Ok(RecordedFrame {
            pose: Arc::new(pose),
            images: Arc::new(images),
            annotations: Arc::new(annotations),
            scans: Arc::new(scans),
        })
    }

    /// The pose of a body that stands on the ground at a place, facing `forward`.
    ///
    /// # Errors
    /// If the ground there cannot be made.
    pub fn pose_on_ground(
        &self,
        position_m: DVec2,
        forward: DVec2,
    ) -> Result<RigidTransform, Error> {
        let runner = self.runner();
        let trajectory = runner.get(self.forest.trajectory, ())?;
        let chunk = ChunkCoord::containing(position_m, self.config().chunks.size_m);
        let ground = runner.get(self.forest.ground, chunk)?;
        let body = &trajectory.trajectory.body;
        Ok(body.pose_on_ground(position_m, forward, &*ground))
    }

    /// Everything that is visible from a body's pose, as rays meet it: its sky view factor is 1
    /// everywhere.
    ///
    /// # Errors
    /// If its chunks cannot be made.
    pub fn scene_at(&self, world_from_body: RigidTransform) -> Result<Arc<FrameScene>, Error> {
        self.prepare()?;
        let place_m = world_from_body.translation_m.truncate();
        let scene = (self.forest).scene_around(&self.runner(), place_m, f64::INFINITY, false)?;
        self.manager.evict(&self.store, place_m, &[]);
        Ok(Arc::new(scene))
    }

    fn config(&self) -> &Config {
        &self.sequence.config
    }

    /// The frame of the sequence that an observation in this state repeats.
    fn frame_at(&self, state: &BodyState) -> Result<Option<u64>, Error> {
        /// What is lost by a matrix on the way: metres, and entries of a rotation.
        const SAME: f64 = 1e-9;
        let Some(frame) = state.index.filter(|&i| i < self.config().frames) else {
            return Ok(None);
        };
        let trajectory = self.runner().get(self.forest.trajectory, ())?;
        if trajectory.time_s(frame) != state.time_s {
            return Ok(None);
        }
        let there = self.pose(frame)?.world_from_body().to_rows();
        let here = state.world_from_body.to_rows();
        let far = |(a, b): (&f64, &f64)| (a - b).abs() > SAME;
        let differ = (there.as_flattened().iter().zip(here.as_flattened())).any(far);
        Ok((!differ).then_some(frame))
    }

    /// Drops what is out of reach of a body, and all frames but those that are coming.
    fn leave(&self, pose: &FramePose, coming: &[u64]) {
        let position_m = pose.world_from_body().translation_m.truncate();
        *lock(&self.body_m) = Some(position_m);
        self.manager.evict(&self.store, position_m, coming);
    }

    /// Drops what is out of reach of a place, wherever the body recorded last.
    pub(crate) fn free_around(&self, place_m: DVec2) {
        self.manager.evict(&self.store, place_m, &[]);
    }

    /// Drops what is out of reach of the body, wherever it recorded last, or of another place if it
    /// has not recorded yet.
    pub(crate) fn stay_near(&self, place_m: DVec2) {
        let body_m = *lock(&self.body_m);
        let place_m = body_m.unwrap_or(place_m);
        self.manager.evict(&self.store, place_m, &[]);
    }
}
