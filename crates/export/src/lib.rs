//! This crate writes scenes of instanced shapes for other programs.
//!
//! Every writer takes an [`ExportScene`], which is plain data: shapes of `nemoral_scene` in their
//! places, with ids, materials and classes. Where it comes from, the crate does not know.
//!
//! - [`write_glb`]: glTF 2.0 in one binary file, for Blender, engines and viewers.
//! - [`write_usd`]: OpenUSD as text, with the labels of Isaac Sim.
//! - [`write_sdf`]: a world for Gazebo, with visuals and collisions.
//! - [`write_height_map`]: 16-bit PNG, with a file that says what its levels are.
//! - [`write_geotiff`]: maps of measures and of ids, for geographic information systems.
//!
//! # Promises
//! - Positions are ours: triangles are those that rays are cast at, in their order, cards two
//!   triangles each, and what is placed is off by less than 0.1 mm.
//! - What is opaque is what rays meet: each texel of a mask is whole pixels of alpha 0 or 255.
//! - Ids and semantics are kept: of every object its 64-bit id, of every surface its fine semantic
//!   and its class.
//! - Equal scenes give equal bytes. A file appears under its name when it is whole.
//!
//! ```
//! use std::sync::Arc;
//!
//! use nemoral_export::{ExportScene, GltfParams, to_glb};
//! use nemoral_scene::glam::{DVec3, Vec3};
//! use nemoral_scene::*;
//!
//! let mut materials = MaterialLibrary::new();
//! let material = materials.add(Material::plain("leaf", Semantic::Leaf, Vec3::splat(0.2)));
//! let card = Card { corner: Vec3::ZERO, edge_u: Vec3::X, edge_v: Vec3::Y, material };
//! let leaf = Arc::new(Prototype::new("leaf", Mesh::default(), vec![card], &materials)?);
//! let object = ObjectId::new(ChunkCoord::new(0, 0), 1).expect("in range");
//! let place = InstancePlace::at(Vec3::Z).with_object(object);
//! let scene = ExportScene {
//!     name: "one leaf".into(),
//!     origin_m: DVec3::ZERO,
//!     seed: 1,
//!     materials,
//!     ontology: Ontology::paper(),
//!     instances: vec![Instance::new(leaf, place)],
//!     objects: vec![],
//!     trees: vec![],
//!     cameras: vec![],
//! };
//! let file = to_glb(&scene, GltfParams::default())?;
//! assert_eq!(&file[..4], b"glTF");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod clip;
mod decomposition;
mod error;
mod geotiff;
mod gltf;
mod height_map;
mod name;
mod parts;
mod picture;
mod scene;
mod sdf;
mod usd;

use std::path::Path;

use nemoral_files::Folder;

pub use clip::clipped;
pub use decomposition::{Decomposition, RotationScale};
pub use error::Error;
pub use geotiff::{RasterMap, RasterValues, to_geotiff, write_geotiff};
pub use gltf::{GltfParams, Instancing, to_glb, write_glb};
pub use height_map::{HeightGrid, HeightScale, check_height_map, write_height_map};
pub use parts::{Submesh, is_ground, parts};
pub use scene::{ExportCamera, ExportScene};
pub use sdf::{Cylinder, stem_cylinders, write_sdf};
pub use usd::{UsdParams, write_usd};

/// Refuses a name that does not end in a format's ending, in any case.
///
/// # Errors
/// [`Error::Name`].
pub fn check_name(path: &Path, ending: &'static str) -> Result<(), Error> {
    let found = path.extension();
    if found.is_some_and(|found| found.eq_ignore_ascii_case(ending)) {
        return Ok(());
    }
    Err(Error::Name {
        path: path.to_owned(),
        allowed: ending,
    })
}

/// Refuses a name that is one of `inputs`, the files that a scene is made from, whatever the ways
/// to them are called.
///
/// # Errors
/// [`Error::Input`].
pub fn check_apart(path: &Path, inputs: &[&Path]) -> Result<(), Error> {
    if inputs
        .iter()
        .any(|input| nemoral_files::is_same(input, path))
    {
        return Err(Error::Input {
            path: path.to_owned(),
        });
    }
    Ok(())
}

/// Refuses a folder that has something in it; it need not exist.
///
/// # Errors
/// [`Error::NotEmpty`], and if it cannot be read.
pub fn check_folder(path: &Path) -> Result<(), Error> {
    if Folder::new(path).entries()?.is_empty() {
        return Ok(());
    }
    Err(Error::NotEmpty {
        path: path.to_owned(),
    })
}

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
