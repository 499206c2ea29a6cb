//! What the integration tests share: small worlds, and the bytes of recordings in them.

pub mod foliage;
pub mod gpu;

pub use nemoral_realism::{STANDS, World, config, grown, store};

use nemoral_pipeline::plan::Runner;
use nemoral_pipeline::{Error, ForestPlan};
use nemoral_render::CameraImages;
use nemoral_scene::LidarPoint;

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
        bytes.extend(p.time_ns.to_le_bytes());
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
/// Settings with which all trails of a stand are machine tracks that run and look as in the paper's
/// presets, for tests of single views.
pub const TRACKS_ALONE: [&str; 6] = [
    "trails.kinds.forest_road=0",
    "trails.kinds.skid_trail=0",
    "trails.kinds.firebreak=0",
    "trails.kinds.footpath=0",
    "trails.kinds.deer_path=0",
    "trails.change=0",
];
