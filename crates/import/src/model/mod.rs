//! Models that a user brings: trees, shrubs, rocks and logs as glTF or OBJ.
//!
//! Files become a [`RawModel`](raw::RawModel), whatever their format (`gltf`, `obj`); the sidecar
//! and names say what each part of it is (`semantics`); `bake` makes our materials and one mesh of
//! it; `measure` looks at the mesh as a forester would.

mod bake;
mod buffers;
mod gather;
mod gltf;
mod gltf_material;
mod json;
mod log;
mod measure;
mod model_files;
mod mtl;
mod obj;
mod optics;
mod picture;
mod raw;
mod semantics;
mod sidecar;

use nemoral_scene::glam::Vec3;
use nemoral_scene::{
    Card, Material, MaterialId, MaterialLibrary, Mesh, Prototype, PrototypeError, Triangle,
};

pub use gather::FindFile;
pub use log::LogMeasures;
pub use measure::{Extent, TreeMeasures};
pub use model_files::{MAX_MODEL_BYTES, ModelFiles};
pub use sidecar::{ModelSidecar, UpAxis};

use crate::ImportError;

/// The most triangles of a model.
pub const MAX_TRIANGLES: usize = 2_000_000;
/// The most nodes of a scene.
pub const MAX_NODES: usize = 100_000;
/// The most nodes above each other.
pub const MAX_DEPTH: usize = 64;
/// The most parts of a model: pieces of a mesh with one material and one name.
const MAX_PARTS: usize = 100_000;
/// The most materials of a model.
pub const MAX_MATERIALS: usize = 256;
/// The most pictures of a model.
pub const MAX_PICTURES: usize = 256;
/// The longest side of a picture, pixels.
pub const MAX_PICTURE_SIDE: u32 = 8192;
/// The most pixels of a model's pictures together: one of the largest.
pub const MAX_PICTURE_PIXELS: u64 = 1 << 26;

/// Farther from a file's origin, positions in 32 bits are off by millimetres.
const FARTHEST_M: f32 = 1e4;
/// The greatest height of a model, metres: that of the highest trees.
const MOST_HEIGHT_M: f64 = 130.0;
/// Half the greatest width of a model, metres.
const MOST_RADIUS_M: f64 = 60.0;

/// What a model is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelKind {
    /// A tree, alive or dead. Each of its materials needs a meaning of its own.
    Tree,
    /// A shrub, which is [`Semantic::Shrub`](nemoral_scene::Semantic::Shrub) unless its sidecar
    /// says other.
    Shrub,
    /// A rock, likewise.
    Rock,
    /// A log, likewise. It may stand or lie in its file.
    Log,
}

/// A model in our units and axes: metres, z up, its foot at the origin. A log lies along x, its
/// thick end at negative x and the middle of its axis at the origin.
#[derive(Clone, Debug)]
pub struct Model {
    /// The triangles, whose materials are numbered as below.
    pub mesh: Mesh,
    /// The materials.
    pub materials: Vec<Material>,
    /// Height and width.
    pub extent: Extent,
    /// What a forester would measure; of a tree alone.
    pub tree: Option<TreeMeasures>,
    /// The same of a log.
    pub log: Option<LogMeasures>,
    /// What was guessed, and what was left out, for the user to read.
    pub notes: Vec<String>,
}

impl Model {
    /// Reads a model of this kind.
    ///
    /// # Errors
    /// If the files are malformed or too large, have no triangles, their units or axes are not
    /// known, or it is not known what some materials are; of a tree, if its diameter can neither
    /// be measured nor is told; of a log, if it is not longer than wide.
    pub fn read(files: &ModelFiles, kind: ModelKind) -> Result<Self, ImportError> {
        let sidecar = match files.sidecar() {
            Some(bytes) => ModelSidecar::read(bytes)?,
            None => ModelSidecar::default(),
        };
        let mut raw = if files.is_obj() {
            obj::read(files)?
        } else {
            gltf::read(files)?
        };
        semantics::leave_out(&mut raw, &sidecar);
        let semantics = semantics::find(&mut raw, &sidecar, kind)?;
        let mut baked = bake::bake(&raw, &semantics)?;
        let mut notes = std::mem::take(&mut raw.notes);
        drop(raw);
        sidecar.to_our_axes(&mut baked.mesh, files.is_obj(), &mut notes);
        let is_near = |p: &Vec3| p.is_finite() && p.length() < FARTHEST_M;
        if !baked.mesh.positions.iter().all(is_near) {
            return Err(ImportError::file(format!(
                "has points that are not within {FARTHEST_M} m of its origin"
            )));
        }
        let log = match kind {
            ModelKind::Log => Some(log::lay(&mut baked, &mut notes)?),
            _ => {
                measure::put_on_origin(&mut baked, kind, &mut notes);
                None
            }
        };
        let extent = Extent::of(&baked.mesh);
        if extent.height_m > MOST_HEIGHT_M || extent.radius_m > MOST_RADIUS_M {
            let Extent { height_m, radius_m } = extent;
            return Err(ImportError::file(format!(
                "is {height_m:.1} m high and {:.1} m wide: at most {MOST_HEIGHT_M} m and {} m are \
                 read; say metres_per_unit in its sidecar",
                2.0 * radius_m,
                2.0 * MOST_RADIUS_M
            )));
        }
        let tree = match kind {
            ModelKind::Tree => Some(measure::of_tree(&baked, &sidecar, &extent)?),
            _ => None,
        };
        Ok(Self {
            mesh: baked.mesh,
            materials: baked.materials,
            extent,
            tree,
            log,
            notes,
        })
    }

    /// Its shape, and its materials in a library: leaves of two triangles become cards.
    ///
    /// # Errors
    /// Never for a model that [`Self::read`] made.
    ///
    /// # Panics
    /// If the library has no room for its materials.
    pub fn prototype(
        &self,
        name: &str,
        library: &mut MaterialLibrary,
    ) -> Result<Prototype, PrototypeError> {
        let ids: Vec<MaterialId> = (self.materials.iter())
            .map(|material| library.add(material.clone()))
            .collect();
        let mut mesh = self.mesh.clone();
        for Triangle { material, .. } in &mut mesh.triangles {
            *material = ids[usize::from(material.0)];
        }
        Prototype::new(name, mesh, Vec::<Card>::new(), library)
    }
}

/// Checks the size of a model while it is read.
fn check_size(triangles: usize, vertices: usize) -> Result<(), ImportError> {
    if triangles > MAX_TRIANGLES || vertices > 3 * MAX_TRIANGLES {
        return Err(ImportError::file(format!(
            "has {triangles} triangles and {vertices} vertices: at most {MAX_TRIANGLES} triangles \
             and three times as many vertices are read"
        )));
    }
    Ok(())
}
