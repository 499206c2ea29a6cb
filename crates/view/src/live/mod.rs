//! A forest that is looked at while it grows and changes.

mod growth;
mod half_width;
mod interruptible_caster;
mod rendering;
mod shadow_cache;
mod world;

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;

use nemoral_pipeline::config::{Config, SequenceConfig};
use nemoral_pipeline::plan::{Cache, Store};
use nemoral_pipeline::{Backend, InputFiles};
use nemoral_scene::glam::DVec2;
use serde::Serialize;

pub use rendering::{RenderedImage, ViewImage};

use crate::controls::{CONTROLS, Control, Values, changed, stands, values};
use crate::view_request::{ImageKind, ViewRequest, drive_from, this_view};
use crate::{Error, controls};
use interruptible_caster::InterruptibleCaster;
use world::WorldSnapshot;

/// How the forest is made.
#[derive(Clone, Debug)]
pub struct ForestParams {
    /// What is grown first, with the files that it names.
    pub sequence: SequenceConfig,
    /// The renderer of pictures.
    pub backend: Backend,
    /// Threads for pictures, and for growing.
    pub threads: usize,
    /// Where grown plants are stored.
    pub cache: Option<Arc<Cache>>,
}

/// A forest that is looked at while it grows and changes.
///
/// Nothing that is asked of it waits for plants: it is seen as far as it has grown, on a thread of
/// its own, and after a change the old one is seen until the new one is there.
#[derive(Debug)]
pub struct LiveForest {
    shared: Arc<Shared>,
}

/// What the threads share.
#[derive(Debug)]
struct Shared {
    inputs: InputFiles,
    backend: Backend,
    threads: usize,
    store: Store,
    /// Pictures have threads of their own, so that they do not queue behind what grows.
    render_pool: rayon::ThreadPool,
    /// Held while a picture is made.
    render_lock: Mutex<()>,
    state: Mutex<SharedState>,
    changed: Condvar,
    /// Who waits for a whole picture that is being made, and how it is given up.
    still: Mutex<Option<(u64, Arc<AtomicBool>)>>,
    /// How many drafts are being made or waited for.
    drafts: AtomicUsize,
    /// Whether the next draft is halved.
    halved: AtomicBool,
}

fn too_many(threads: usize, error: &dyn std::fmt::Display) -> Error {
    Error::value("threads", threads, format!("fewer: {error}"))
}

/// What is wanted and what there is.
#[derive(Debug)]
struct SharedState {
    /// The config that is wanted, and the number of the change that made it.
    wanted: Config,
    revision: u64,
    /// The number of the newest change, which may have been given up.
    last: u64,
    /// Where somebody looks from; none until the start of the robot's path is known.
    place_m: Option<DVec2>,
    /// Whether they hold still there.
    rests: bool,
    shown: Option<Arc<WorldSnapshot>>,
    growing: Option<GrowthProgress>,
    error: Option<String>,
    /// The revision that failed to grow.
    failed: Option<u64>,
    stopping: bool,
}

/// How far growing is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct GrowthProgress {
    /// What grows: first the plants, then the land with them.
    pub what: GrowthStage,
    /// Pieces of land that are grown.
    pub done: usize,
    /// Pieces of land that will be.
    pub total: usize,
}

/// What grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum GrowthStage {
    /// One plant of each kind.
    Plants,
    /// The land around, where copies of them stand.
    Land,
}

/// What the page is told.
#[derive(Clone, Debug, Serialize)]
pub struct ForestStatus {
    /// The number of the newest change.
    pub revision: u64,
    /// The number of the change that pictures show; none before the first.
    pub shown: Option<u64>,
    /// How far growing is, if something grows.
    pub growing: Option<GrowthProgress>,
    /// Why the last change was given up.
    pub error: Option<String>,
    /// Where the robot's path begins: east, north, heading.
    pub start: Option<(f64, f64, f64)>,
    /// Height of the robot's eye, metres.
    pub eye_m: f64,
    /// Pixels of the config's camera.
    pub size_px: (u32, u32),
    /// The controls' values.
    pub values: Values,
    /// The sliders.
    pub controls: &'static [Control],
    /// The stands and what they are.
    pub stands: Vec<(&'static str, &'static str)>,
    /// What can be looked at.
    pub maps: Vec<&'static str>,
    /// The classes and their colours.
    pub classes: Vec<(String, [u8; 3])>,
    /// The renderer.
    pub backend: String,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A panic of another thread leaves what these guard consistent.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl LiveForest {
    /// Begins to grow.
    ///
    /// # Errors
    /// If the config is impossible, or threads cannot be started.
    pub fn new(params: ForestParams) -> Result<Self, Error> {
        let ForestParams {
            sequence,
            backend,
            threads,
            cache,
        } = params;
        let threads = threads.max(1);
        // What can be refused at once is.
        world::plan(&sequence.config, &sequence.inputs, &backend)?;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let render_pool = pool.thread_name(|i| format!("renderer {i}")).build();
        let shared = Arc::new(Shared {
            inputs: sequence.inputs,
            backend,
            threads,
            store: Store::unlimited().with_cache(cache),
            render_pool: render_pool.map_err(|e| too_many(threads, &e))?,
            render_lock: Mutex::new(()),
            state: Mutex::new(SharedState {
                wanted: sequence.config,
                revision: 1,
                last: 1,
                place_m: None,
                rests: false,
                shown: None,
                growing: None,
                error: None,
                failed: None,
                stopping: false,
            }),
            changed: Condvar::new(),
            still: Mutex::new(None),
            drafts: AtomicUsize::new(0),
            halved: AtomicBool::new(false),
        });
        let growing = Arc::clone(&shared);
        let grower = thread::Builder::new().name("grower".to_owned());
        let grow = move || grow(&growing);
        grower.spawn(grow).map_err(|e| too_many(threads, &e))?;
        Ok(Self { shared })
    }

    /// What can be changed, what grows, and what went wrong.
    #[must_use]
    pub fn status(&self) -> ForestStatus {
        let state = lock(&self.shared.state);
        let ontology = world::ontology(&state.wanted);
        let classes = ontology.classes().iter();
        ForestStatus {
            revision: state.revision,
            shown: state.shown.as_ref().map(|s| s.world.revision),
            growing: state.growing,
            error: state.error.clone(),
            start: state.shown.as_ref().map(|s| s.world.start),
            eye_m: state.wanted.camera.mount_z_m,
            size_px: (state.wanted.camera.width_px, state.wanted.camera.height_px),
            values: values(&state.wanted),
            controls: CONTROLS,
            stands: stands().map(|p| (p.name, p.doc)).collect(),
            maps: ImageKind::ALL.map(|(_, name)| name).into(),
            classes: classes.map(|c| (c.name.to_string(), c.colour)).collect(),
            backend: self.shared.backend.name(),
        }
    }

    /// Changes values. What this needs is grown while the forest before is still seen.
    ///
    /// # Errors
    /// If a value is not allowed, or not with the others; then nothing changes. What can only be
    /// refused while it grows is in [`ForestStatus::error`] later, and the values are as before.
    pub fn change(&self, asked: &BTreeMap<String, controls::Value>) -> Result<(), Error> {
        let mut state = lock(&self.shared.state);
        let config = changed(&state.wanted, asked)?;
        config.check(&self.shared.inputs)?;
        state.error = None;
        if config != state.wanted {
            state.wanted = config;
            state.last += 1;
            state.revision = state.last;
            self.shared.changed.notify_all();
        }
        Ok(())
    }

    /// The image that is asked for; `None` if there is nothing to see yet, or something newer was
    /// asked for meanwhile.
    ///
    /// # Errors
    /// If the request is impossible, or the renderer fails.
    pub fn picture(&self, request: &ViewRequest) -> Result<Option<ViewImage>, Error> {
        request.check()?;
        let shared = &*self.shared;
        let given_up = Arc::new(AtomicBool::new(false));
        let _waiting = (!request.still).then(|| Waiting::new(&shared.drafts));
        if let Some((viewer, before)) = &*lock(&shared.still) {
            // Who moves comes before who rests, and a viewer needs one picture only.
            if !request.still || *viewer == request.viewer {
                before.store(true, Ordering::SeqCst);
            }
        }
        let _rendering = lock(&shared.render_lock);
        if request.still {
            *lock(&shared.still) = Some((request.viewer, Arc::clone(&given_up)));
            if shared.drafts.load(Ordering::SeqCst) > 0 {
                given_up.store(true, Ordering::SeqCst);
            }
        }
        let picture = self.render(request, &given_up);
        if request.still {
            *lock(&shared.still) = None;
        }
        Ok(picture?.filter(|_| !given_up.load(Ordering::SeqCst)))
    }

    fn render(
        &self,
        request: &ViewRequest,
        given_up: &AtomicBool,
    ) -> Result<Option<ViewImage>, Error> {
        let shared = &*self.shared;
        let Some(shown) = lock(&shared.state).shown.clone() else {
            return Ok(None);
        };
        let mut viewpoint = request.viewpoint;
        viewpoint.position_m = shown
            .world
            .clear_of_obstacles(shared, viewpoint.position_m)?;
        let newest = {
            let mut state = lock(&shared.state);
            state.place_m = Some(viewpoint.position_m);
            state.rests = request.still;
            state.revision
        };
        shared.changed.notify_all();
        let caster = InterruptibleCaster {
            caster: &*shown.scene.caster,
            stop: given_up,
        };
        let seen = this_view(&shown.world.config, &viewpoint, request.size_px);
        let render = || rendering::render(shared, &shown, &seen, request, &caster);
        let Some(rendered) =
            interruptible_caster::unless_given_up(|| shared.render_pool.install(render))
        else {
            return Ok(None);
        };
        let rendered = rendered?;
        Ok(Some(ViewImage {
            rendered,
            viewpoint,
            revision: shown.world.revision,
            is_final: shown.complete
                && shown.centre_m == viewpoint.position_m
                && shown.world.revision == newest
                && request.still,
        }))
    }

    /// The config of what is seen as TOML, which `generate` takes: a single frame, the picture of
    /// this place and size, or a drive that begins here.
    ///
    /// # Errors
    /// If the place is impossible.
    pub fn config(&self, request: &ViewRequest, drive: bool) -> Result<String, Error> {
        request.check()?;
        let state = lock(&self.shared.state);
        // What is seen, not what may come.
        let config = state
            .shown
            .as_ref()
            .map_or(&state.wanted, |s| &s.world.config);
        let config = if drive {
            drive_from(config, &request.viewpoint)
        } else {
            this_view(config, &request.viewpoint, request.size_px)
        };
        Ok(config.to_toml())
    }
}

/// A draft that is being made or waited for.
struct Waiting<'a>(&'a AtomicUsize);

impl<'a> Waiting<'a> {
    fn new(count: &'a AtomicUsize) -> Self {
        count.fetch_add(1, Ordering::SeqCst);
        Self(count)
    }
}

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

impl Drop for LiveForest {
    fn drop(&mut self) {
        lock(&self.shared.state).stopping = true;
        self.shared.changed.notify_all();
    }
}

/// Grows what is wanted, until the forest is dropped.
fn grow(shared: &Shared) {
    while let Some(task) = growth::next(shared) {
        let grown = catch_unwind(AssertUnwindSafe(|| growth::grow(shared, &task)));
        let error = match grown {
            Ok(Ok(())) => None,
            Ok(Err(error)) => Some(error.to_string()),
            Err(_) => Some("growing failed: the program's own output has the reason".to_owned()),
        };
        let mut state = lock(&shared.state);
        state.growing = None;
        if let Some(error) = error {
            state.error = Some(error);
            state.failed = Some(task.revision);
            // The values are again those of what is seen.
            if let Some(shown) = state
                .shown
                .clone()
                .filter(|_| state.revision == task.revision)
            {
                state.wanted = shown.world.config.clone();
                state.revision = shown.world.revision;
            }
        }
    }
}
