//! A small tree in the formats of models, written by hand.

#![allow(dead_code, reason = "each test uses some of it")]

use std::f32::consts::{PI, TAU};

use base64::Engine;
use nemoral_import::{ImportError, ModelFiles};
use serde_json::{Value, json};

/// Diameter of the prism that the stem is, metres: that of the circle of its section's area.
pub(crate) const DBH_M: f32 = 0.4;
pub(crate) const HEIGHT_M: f32 = 8.0;
/// How many leaves there are, each a square of half a metre.
pub(crate) const LEAVES: usize = 12;
const SIDES: usize = 12;

/// Vertices and triangles of a part, y up.
#[derive(Default)]
pub(crate) struct Part {
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) uvs: Vec<[f32; 2]>,
    pub(crate) indices: Vec<u32>,
}

/// A prism about the vertical, open at its ends, from 20 cm below the ground to 6 m.
pub(crate) fn stem() -> Part {
    let n = SIDES as f32;
    // The area of a polygon of n sides is n/2 r² sin(2 π / n).
    let radius = (PI * DBH_M * DBH_M / 4.0 / (n / 2.0 * (TAU / n).sin())).sqrt();
    let mut part = Part::default();
    for i in 0..=SIDES {
        let angle = TAU * i as f32 / n;
        for (j, y) in [-0.2, 6.0].into_iter().enumerate() {
            // Counter-clockwise seen from above, where +z is to the south.
            part.positions
                .push([radius * angle.cos(), y, -radius * angle.sin()]);
            part.uvs.push([i as f32 / n, j as f32 * 3.0]);
        }
    }
    for i in 0..SIDES as u32 {
        let [a, b, c, d] = [2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1];
        part.indices.extend([a, b, c, a, c, d]);
    }
    part
}

/// Squares from 4 m up to the top, in a spiral, 1.5 m from the stem.
pub(crate) fn leaves() -> Part {
    let mut part = Part::default();
    for i in 0..LEAVES {
        let angle = i as f32;
        let (x, z) = (1.5 * angle.cos(), 1.5 * angle.sin());
        let y = 4.0 + (HEIGHT_M - 4.5) * i as f32 / (LEAVES - 1) as f32;
        let first = part.positions.len() as u32;
        for (u, v) in [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)] {
            part.positions.push([x + u / 2.0, y + (1.0 - v) / 2.0, z]);
            part.uvs.push([u, v]);
        }
        part.indices.extend([0, 1, 2, 0, 2, 3].map(|c| first + c));
    }
    part
}

/// A picture of a green leaf that is opaque in its upper half, of 6 x 4 pixels.
pub(crate) fn leaf_png() -> Vec<u8> {
    let pixel = |i: usize| [30, 120, 20, if i < 12 { 255 } else { 0 }];
    png(6, 4, &(0..24).flat_map(pixel).collect::<Vec<u8>>())
}

pub(crate) fn png(width: u32, height: u32, rgba: &[u8]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().expect("header");
    writer.write_image_data(rgba).expect("pixels");
    writer.finish().expect("end");
    file
}

/// The document of the tree, without its buffer, and the bytes of that.
pub(crate) fn document() -> (Value, Vec<u8>) {
    let mut bytes: Vec<u8> = Vec::new();
    let (mut views, mut accessors) = (Vec::new(), Vec::new());
    let mut add = |content: &[u8]| {
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        views.push(json!({
            "buffer": 0, "byteOffset": bytes.len(), "byteLength": content.len(),
        }));
        bytes.extend(content);
        views.len() - 1
    };
    let floats = |numbers: &mut dyn Iterator<Item = f32>| -> Vec<u8> {
        numbers.flat_map(f32::to_le_bytes).collect()
    };
    let mut primitives = Vec::new();
    for (material, part) in [stem(), leaves()].into_iter().enumerate() {
        let n = part.positions.len();
        let positions = add(&floats(&mut part.positions.iter().flatten().copied()));
        let uvs = add(&floats(&mut part.uvs.iter().flatten().copied()));
        let small: Vec<u8> = part.indices.iter().map(|&i| i as u8).collect();
        let indices = add(&small);
        let first = accessors.len();
        for (view, component, kind, count) in [
            (positions, 5126, "VEC3", n),
            (uvs, 5126, "VEC2", n),
            (indices, 5121, "SCALAR", part.indices.len()),
        ] {
            accessors.push(json!({
                "bufferView": view, "componentType": component, "type": kind, "count": count,
            }));
        }
        primitives.push(json!({
            "attributes": { "POSITION": first, "TEXCOORD_0": first + 1 },
            "indices": first + 2,
            "material": material,
        }));
    }
    let picture = add(&leaf_png());
    let size = bytes.len();
    let document = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [
            { "name": "tree", "children": [1] },
            { "name": "all of it", "mesh": 0 },
        ],
        "meshes": [{ "name": "mesh", "primitives": primitives }],
        "materials": [
            {
                "name": "Oak_Bark",
                "pbrMetallicRoughness": { "baseColorFactor": [0.2, 0.15, 0.1, 1.0] },
            },
            {
                "name": "OakLeaves",
                "alphaMode": "MASK",
                "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } },
            },
        ],
        "textures": [{ "source": 0 }],
        "images": [{ "bufferView": picture, "mimeType": "image/png" }],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "byteLength": size }],
    });
    (document, bytes)
}

/// The binary form of a document.
pub(crate) fn glb(document: &Value, bytes: &[u8]) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bytes = bytes.to_vec();
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let mut file = b"glTF".to_vec();
    let size = 12 + 8 + text.len() + 8 + bytes.len();
    for word in [2, size as u32, text.len() as u32] {
        file.extend(word.to_le_bytes());
    }
    file.extend(b"JSON");
    file.extend(text);
    file.extend((bytes.len() as u32).to_le_bytes());
    file.extend(b"BIN\0");
    file.extend(bytes);
    file
}

pub(crate) fn tree_glb() -> Vec<u8> {
    let (document, bytes) = document();
    glb(&document, &bytes)
}

/// The tree as text, with its buffer in a data URI.
pub(crate) fn tree_gltf() -> Vec<u8> {
    let (mut document, bytes) = document();
    let coded = base64::engine::general_purpose::STANDARD.encode(bytes);
    document["buffers"][0]["uri"] = json!(format!("data:application/octet-stream;base64,{coded}"));
    document.to_string().into_bytes()
}

/// The tree as OBJ.
pub(crate) fn tree_obj() -> Vec<u8> {
    let mut text = "mtllib materials/tree.mtl\no tree\n".to_owned();
    let mut first = 1;
    for (name, part) in [("Oak_Bark", stem()), ("OakLeaves", leaves())] {
        for [x, y, z] in &part.positions {
            text += &format!("v {x} {y} {z}\n");
        }
        for [u, v] in &part.uvs {
            text += &format!("vt {u} {}\n", 1.0 - v);
        }
        text += &format!("usemtl {name}\n");
        for t in part.indices.chunks(3) {
            let [a, b, c] = [t[0] + first, t[1] + first, t[2] + first];
            text += &format!("f {a}/{a} {b}/{b} {c}/{c}\n");
        }
        first += part.positions.len() as u32;
    }
    text.into_bytes()
}

pub(crate) const TREE_MTL: &str = "newmtl Oak_Bark\nKd 0.2 0.15 0.1\n\nnewmtl OakLeaves\nKd 0 0 0\n\
                            map_Kd leaf.png\n";

/// The files beside the tree as OBJ.
pub(crate) fn beside_obj(name: &str) -> Option<Vec<u8>> {
    match name {
        "materials/tree.mtl" => Some(TREE_MTL.as_bytes().to_vec()),
        "materials/leaf.png" => Some(leaf_png()),
        _ => None,
    }
}

/// A model with a sidecar, and with files beside it.
pub(crate) fn gathered(
    name: &str,
    bytes: Vec<u8>,
    sidecar: &str,
    beside: impl Fn(&str) -> Option<Vec<u8>>,
) -> Result<ModelFiles, ImportError> {
    ModelFiles::gather(name, bytes, &mut |asked, _| {
        Ok(match asked.ends_with(".toml") {
            true if sidecar.is_empty() => None,
            true => Some(sidecar.as_bytes().to_vec()),
            false => beside(asked),
        })
    })
}
