//! glTF 2.0, in one binary file.
//!
//! The scene lies below a node that turns our axes (z up) to those of glTF (y up), so that all
//! positions in the file are ours.

mod binary;
mod extras;
mod materials;
mod nodes;

use std::path::Path;

use serde_json::{Value, json};

use crate::scene::{ExportScene, Inventory};
use crate::{Error, check_name};
use binary::Binary;
use extras::about_scene;
use materials::Materials;
use nodes::Nodes;

/// How instances of a shape are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Instancing {
    /// By the extension `EXT_mesh_gpu_instancing`: one node for all copies of a shape.
    #[default]
    Extension,
    /// A node for each copy, which every reader understands.
    Nodes,
}

/// How a glTF file is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GltfParams {
    /// How instances are written.
    pub instancing: Instancing,
    /// Leaves out the turn from our axes to those of glTF. Gazebo, whose axes are ours, reads files
    /// so, and nobody else.
    pub z_up: bool,
}

/// The extension of instanced shapes.
pub(crate) const GPU_INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// Writes a scene as a binary glTF file, which appears when it is whole. The result is its size in
/// bytes.
///
/// # Errors
/// If the name does not end in `.glb`, the scene is empty or needs more than 4 GiB, an instance
/// cannot be placed, or the file cannot be written.
pub fn write_glb(scene: &ExportScene, path: &Path, params: GltfParams) -> Result<u64, Error> {
    check_name(path, "glb")?;
    let (document, binary) = document(scene, params)?;
    binary::write(path, &document, binary.bytes())
}

/// The same as bytes in memory.
///
/// # Errors
/// As [`write_glb`], but for files.
pub fn to_glb(scene: &ExportScene, params: GltfParams) -> Result<Vec<u8>, Error> {
    let (document, binary) = document(scene, params)?;
    let [header, json, head] = binary::chunks(&document, binary.bytes())?;
    Ok([&header, &json, &head, binary.bytes()].concat())
}

fn document(scene: &ExportScene, params: GltfParams) -> Result<(Value, Binary), Error> {
    let shapes = scene.shapes()?;
    let inventory = Inventory::new(scene);
    let mut binary = Binary::default();
    let mut materials = Materials::new(scene);
    let mut nodes = Nodes::default();
    let mut meshes = Vec::new();
    for shape in &shapes {
        meshes.push(materials.mesh(shape.shape, &mut binary));
        let mesh = meshes.len() - 1;
        nodes.place(scene, &inventory, (shape, mesh), params, &mut binary)?;
    }
    for camera in &scene.cameras {
        nodes.add_camera(camera);
    }
    let (materials, textures, images) = materials.finish(&mut binary);
    binary.pad();
    let (uses_instancing, cameras) = (nodes.uses_instancing, std::mem::take(&mut nodes.cameras));
    let (nodes, root) = nodes.finish(&scene.name, params.z_up);
    let mut document = json!({
        "asset": {
            "version": "2.0",
            "generator": concat!("nemoral ", env!("CARGO_PKG_VERSION")),
        },
        "scene": 0,
        "scenes": [{
            "name": scene.name,
            "nodes": [root],
        }],
        "buffers": [{ "byteLength": binary.bytes().len() }],
    });
    // What may be long is moved, where `json!` would copy it.
    document["scenes"][0]["extras"] = about_scene(scene, &inventory);
    document["nodes"] = Value::Array(nodes);
    document["meshes"] = Value::Array(meshes);
    document["materials"] = Value::Array(materials);
    let (views, accessors) = binary.take_tables();
    document["bufferViews"] = Value::Array(views);
    document["accessors"] = Value::Array(accessors);
    if !images.is_empty() {
        document["textures"] = Value::Array(textures);
        document["images"] = Value::Array(images);
        document["samplers"] = materials::samplers();
    }
    if !cameras.is_empty() {
        document["cameras"] = Value::Array(cameras);
    }
    if uses_instancing {
        document["extensionsUsed"] = json!([GPU_INSTANCING]);
        document["extensionsRequired"] = json!([GPU_INSTANCING]);
    }
    Ok((document, binary))
}
