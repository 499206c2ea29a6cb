//! What the integration tests share: small worlds, and the bytes of recordings in them.

pub mod foliage;
pub mod gpu;
pub mod leaf_area;
pub mod realism;

use nemoral_pipeline::config::{Config, Layers};
use nemoral_pipeline::plan::{At, Runner, Store};
use nemoral_pipeline::{Error, ForestPlan};
use nemoral_render::CameraImages;
use nemoral_scene::LidarPoint;

/// The presets that are recipes of stands.
pub const STANDS: [&str; 7] = [
    "maritime-pine",
    "eucalyptus-plantation",
    "oak-mixed",
    "beech",
    "spruce",
    "boreal-birch-pine",
    "montado",
];

/// A world with its own store.
#[derive(Debug)]
pub struct World {
    /// The config of the world.
    pub config: Config,
    /// The world's plans.
    pub forest: ForestPlan,
    /// The values computed so far.
    pub store: Store,
}

/// The config of a preset overridden by settings, each `key=value`.
///
/// # Panics
/// If it is refused.
#[must_use]
pub fn config(preset: &str, settings: &[&str]) -> Config {
    let layers = Layers {
        preset: Some(preset.to_owned()),
        file: None,
        settings: settings.iter().map(|s| (*s).to_owned()).collect(),
    };
    layers.load().unwrap_or_else(|e| panic!("{e}"))
}

impl World {
    /// The world of a preset overridden by settings.
    ///
    /// # Panics
    /// If the config is refused.
    #[must_use]
    pub fn new(preset: &str, settings: &[&str]) -> Self {
        let config = config(preset, settings);
        let forest = ForestPlan::new(&config).unwrap_or_else(|e| panic!("{e}"));
        Self {
            config,
            forest,
            store: Store::unlimited(),
        }
    }

    /// A runner that computes this many nodes at once.
    #[must_use]
    pub fn runner(&self, threads: usize) -> Runner<'_> {
        Runner::new(self.forest.plan(), &self.store, threads)
    }

    /// Drops the values of chunks and frames. Those of the whole world are costly and stay.
    pub fn forget(&self) {
        self.store.retain(|_, at| at == At::World);
    }
}

/// All that the sensors record in a frame, to the bit.
///
/// # Errors
/// If the frame cannot be made.
pub fn record(forest: &ForestPlan, runner: &Runner<'_>, frame: u64) -> Result<Vec<u8>, Error> {
    let images = runner.get(forest.images, frame)?;
    let scans = runner.get(forest.scans, frame)?;
    Ok([
        images.iter().flat_map(image_bytes).collect::<Vec<_>>(),
        scans.iter().flat_map(|s| scan_bytes(s)).collect(),
    ]
    .concat())
}

fn image_bytes(images: &CameraImages) -> Vec<u8> {
    let truth = &images.truth;
    let mut bytes: Vec<u8> = images.rgb.pixels().as_flattened().to_vec();
    bytes.extend(truth.semantic.pixels().iter().map(|s| *s as u8));
    for object in truth.object.pixels() {
        bytes.extend(object.to_u64().to_le_bytes());
    }
    for depth_m in truth.depth_m.pixels() {
        bytes.extend(depth_m.to_le_bytes());
    }
    for normal in truth.normal.pixels() {
        bytes.extend(normal.to_array().iter().flat_map(|c| c.to_le_bytes()));
    }
    bytes
}

fn scan_bytes(scan: &[LidarPoint]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for p in scan {
        let metres = [p.true_range_m, p.range_m, p.intensity, p.incidence_cos];
        let vectors = [p.position_m.to_array(), p.normal.to_array()].concat();
        bytes.extend(metres.iter().chain(&vectors).flat_map(|f| f.to_le_bytes()));
        bytes.extend(p.object.to_u64().to_le_bytes());
        bytes.extend(p.time_offset_ns.to_le_bytes());
        bytes.extend(p.pulse.to_le_bytes());
        let small = [p.reflectivity, p.semantic as u8, p.ring, p.flags.0];
        bytes.extend(small);
        bytes.extend([p.return_number, p.returns]);
    }
    bytes
}

/// Compiles the snippet of the guide's page on user meshes.
#[cfg(doctest)]
#[doc = include_str!("../../docs/guide/own-mesh.md")]
pub struct OwnMesh;
