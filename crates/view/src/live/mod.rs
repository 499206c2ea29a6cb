//! A forest that is looked at while it grows and changes.

mod caster;
mod growth;
mod half;
mod known_shadows;
mod paint;
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

pub use paint::{Painted, Picture};

use crate::controls::{CONTROLS, Control, Values, changed, stands, values};
use crate::seen::{Glance, Map, drive_from, this_view};
use crate::{Error, controls};
use caster::Interruptible;
use world::Shown;

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
    painters: rayon::ThreadPool,
    /// Held while a picture is made.
    easel: Mutex<()>,
    mind: Mutex<Mind>,
    changed: Condvar,
    /// Who waits for a whole picture that is being made, and how it is given up.
    still: Mutex<Option<(u64, Arc<AtomicBool>)>>,
    /// How many drafts are being made or waited for.
    movers: AtomicUsize,
    /// Whether the next draft is halved.
    halved: AtomicBool,
}

fn too_many(threads: usize, error: &dyn std::fmt::Display) -> Error {
    Error::value("threads", threads, format!("fewer: {error}"))
}

/// What is wanted and what there is.
#[derive(Debug)]
struct Mind {
    /// The config that is wanted, and the number of the change that made it.
    wanted: Config,
    revision: u64,
    /// The number of the newest change, which may have been given up.
    last: u64,
    /// Where somebody looks from; none until the start of the robot's path is known.
    place_m: Option<DVec2>,
    /// Whether they hold still there.
    rests: bool,
    shown: Option<Arc<Shown>>,
    growing: Option<Growing>,
    error: Option<String>,
    /// The revision that failed to grow.
    failed: Option<u64>,
    stopping: bool,
}

/// How far growing is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Growing {
    /// What grows: first the plants, then the land with them.
    pub what: Stage,
    /// Pieces of land that are grown.
    pub done: usize,
    /// Pieces of land that will be.
    pub total: usize,
}

/// What grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// One plant of each kind.
    Plants,
    /// The land around, where copies of them stand.
    Land,
}

/// What the page is told.
#[derive(Clone, Debug, Serialize)]
pub struct State {
    /// The number of the newest change.
    pub revision: u64,
    /// The number of the change that pictures show; none before the first.
    pub shown: Option<u64>,
    /// How far growing is, if something grows.
    pub growing: Option<Growing>,
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
        let painters = pool.thread_name(|i| format!("painter {i}")).build();
        let shared = Arc::new(Shared {
            inputs: sequence.inputs,
            backend,
            threads,
            store: Store::unlimited().with_cache(cache),
            painters: painters.map_err(|e| too_many(threads, &e))?,
            easel: Mutex::new(()),
            mind: Mutex::new(Mind {
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
            movers: AtomicUsize::new(0),
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
    pub fn state(&self) -> State {
        let mind = lock(&self.shared.mind);
        let ontology = world::ontology(&mind.wanted);
        let classes = ontology.classes().iter();
        State {
            revision: mind.revision,
            shown: mind.shown.as_ref().map(|s| s.world.revision),
            growing: mind.growing,
            error: mind.error.clone(),
            start: mind.shown.as_ref().map(|s| s.world.start),
            eye_m: mind.wanted.camera.mount_z_m,
            size_px: (mind.wanted.camera.width_px, mind.wanted.camera.height_px),
            values: values(&mind.wanted),
            controls: CONTROLS,
            stands: stands().map(|p| (p.name, p.doc)).collect(),
            maps: Map::ALL.map(|(_, name)| name).into(),
            classes: classes.map(|c| (c.name.to_string(), c.colour)).collect(),
            backend: self.shared.backend.name(),
        }
    }

    /// Changes values. What this needs is grown while the forest before is still seen.
    ///
    /// # Errors
    /// If a value is not allowed, or not with the others; then nothing changes. What can only be
    /// refused while it grows is in [`State::error`] later, and the values are as before.
    pub fn change(&self, asked: &BTreeMap<String, controls::Value>) -> Result<(), Error> {
        let mut mind = lock(&self.shared.mind);
        let config = changed(&mind.wanted, asked)?;
        config.check(&self.shared.inputs)?;
        mind.error = None;
        if config != mind.wanted {
            mind.wanted = config;
            mind.last += 1;
            mind.revision = mind.last;
            self.shared.changed.notify_all();
        }
        Ok(())
    }

    /// The picture of a glance; `None` if there is nothing to see yet, or something newer was asked
    /// for meanwhile.
    ///
    /// # Errors
    /// If the glance is impossible, or the renderer fails.
    pub fn picture(&self, glance: &Glance) -> Result<Option<Picture>, Error> {
        glance.check()?;
        let shared = &*self.shared;
        let given_up = Arc::new(AtomicBool::new(false));
        let _waiting = (!glance.still).then(|| Waiting::new(&shared.movers));
        if let Some((viewer, before)) = &*lock(&shared.still) {
            // Who moves comes before who rests, and a viewer needs one picture only.
            if !glance.still || *viewer == glance.viewer {
                before.store(true, Ordering::SeqCst);
            }
        }
        let _easel = lock(&shared.easel);
        if glance.still {
            *lock(&shared.still) = Some((glance.viewer, Arc::clone(&given_up)));
            if shared.movers.load(Ordering::SeqCst) > 0 {
                given_up.store(true, Ordering::SeqCst);
            }
        }
        let picture = self.paint(glance, &given_up);
        if glance.still {
            *lock(&shared.still) = None;
        }
        Ok(picture?.filter(|_| !given_up.load(Ordering::SeqCst)))
    }

    fn paint(&self, glance: &Glance, given_up: &AtomicBool) -> Result<Option<Picture>, Error> {
        let shared = &*self.shared;
        let Some(shown) = lock(&shared.mind).shown.clone() else {
            return Ok(None);
        };
        let mut place = glance.place;
        place.position_m = shown.world.clear_of_stems(shared, place.position_m)?;
        let newest = {
            let mut mind = lock(&shared.mind);
            mind.place_m = Some(place.position_m);
            mind.rests = glance.still;
            mind.revision
        };
        shared.changed.notify_all();
        let caster = Interruptible {
            caster: &*shown.scene.caster,
            stop: given_up,
        };
        let seen = this_view(&shown.world.config, &place, glance.size_px);
        let paint = || paint::paint(shared, &shown, &seen, glance, &caster);
        let Some(painted) = caster::unless_given_up(|| shared.painters.install(paint)) else {
            return Ok(None);
        };
        let painted = painted?;
        Ok(Some(Picture {
            painted,
            place,
            revision: shown.world.revision,
            is_final: shown.complete
                && shown.centre_m == place.position_m
                && shown.world.revision == newest
                && glance.still,
        }))
    }

    /// The config of what is seen as TOML, which `generate` takes: a single frame, the picture of
    /// this place and size, or a drive that begins here.
    ///
    /// # Errors
    /// If the place is impossible.
    pub fn config(&self, glance: &Glance, drive: bool) -> Result<String, Error> {
        glance.check()?;
        let mind = lock(&self.shared.mind);
        // What is seen, not what may come.
        let config = mind
            .shown
            .as_ref()
            .map_or(&mind.wanted, |s| &s.world.config);
        let config = if drive {
            drive_from(config, &glance.place)
        } else {
            this_view(config, &glance.place, glance.size_px)
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
        lock(&self.shared.mind).stopping = true;
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
        let mut mind = lock(&shared.mind);
        mind.growing = None;
        if let Some(error) = error {
            mind.error = Some(error);
            mind.failed = Some(task.revision);
            // The values are again those of what is seen.
            if let Some(shown) = mind
                .shown
                .clone()
                .filter(|_| mind.revision == task.revision)
            {
                mind.wanted = shown.world.config.clone();
                mind.revision = shown.world.revision;
            }
        }
    }
}
