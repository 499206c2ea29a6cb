//! The binary part: buffer views, accessors, chunks.

use std::io::Write;
use std::path::Path;

use nemoral_files::PendingFile;
use nemoral_scene::Bounds;
use nemoral_scene::glam::{Quat, Vec2, Vec3};
use serde_json::{Value, json};

use crate::Error;

/// What a buffer view is for, by the numbers of glTF.
const VERTICES: u32 = 34_962;
const INDICES: u32 = 34_963;

/// Components, by the numbers of glTF.
const U16: u32 = 5_123;
const U32: u32 = 5_125;
const F32: u32 = 5_126;

/// The buffer of a file, with the views and accessors that say what is where.
#[derive(Debug, Default)]
pub(super) struct Binary {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Binary {
    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Takes the views and the accessors out, when all of them are there.
    pub(super) fn take_tables(&mut self) -> (Vec<Value>, Vec<Value>) {
        (
            std::mem::take(&mut self.views),
            std::mem::take(&mut self.accessors),
        )
    }

    /// Fills the buffer to a multiple of four bytes, as chunks and accessors need it.
    pub(super) fn pad(&mut self) {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
    }

    /// A buffer view of some bytes, and its number.
    pub(super) fn view(&mut self, bytes: impl IntoIterator<Item = u8>) -> usize {
        self.pad();
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - start;
        let view = json!({ "buffer": 0, "byteOffset": start, "byteLength": length });
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, view: usize, kind: &str, component: u32, count: usize) -> usize {
        self.accessors.push(json!({
            "bufferView": view,
            "componentType": component,
            "count": count,
            "type": kind,
        }));
        self.accessors.len() - 1
    }

    fn floats(&mut self, kind: &str, count: usize, values: impl Iterator<Item = f32>) -> usize {
        let view = self.view(values.flat_map(f32::to_le_bytes));
        self.accessor(view, kind, F32, count)
    }

    /// An attribute of vertices.
    fn of_vertices(&mut self, accessor: usize) -> usize {
        let view = self.accessors[accessor]["bufferView"].as_u64();
        self.views[view.unwrap_or(0) as usize]["target"] = json!(VERTICES);
        accessor
    }

    /// Positions, with their bounds.
    pub(super) fn positions(&mut self, values: &[Vec3]) -> usize {
        let accessor = self.vectors(values);
        let accessor = self.of_vertices(accessor);
        let Bounds { min, max } = Bounds::of_points(values.iter().copied());
        self.accessors[accessor]["min"] = json!(min.to_array());
        self.accessors[accessor]["max"] = json!(max.to_array());
        accessor
    }

    pub(super) fn normals(&mut self, values: &[Vec3]) -> usize {
        let accessor = self.vectors(values);
        self.of_vertices(accessor)
    }

    pub(super) fn uvs(&mut self, values: &[Vec2]) -> usize {
        let numbers = values.iter().flat_map(|v| v.to_array());
        let accessor = self.floats("VEC2", values.len(), numbers);
        self.of_vertices(accessor)
    }

    pub(super) fn indices(&mut self, values: &[u32]) -> usize {
        let view = self.view(values.iter().flat_map(|i| i.to_le_bytes()));
        self.views[view]["target"] = json!(INDICES);
        self.accessor(view, "SCALAR", U32, values.len())
    }

    /// Vectors of instances.
    pub(super) fn vectors(&mut self, values: &[Vec3]) -> usize {
        let numbers = values.iter().flat_map(|v| v.to_array());
        self.floats("VEC3", values.len(), numbers)
    }

    pub(super) fn rotations(&mut self, values: &[Quat]) -> usize {
        let numbers = values.iter().flat_map(|q| q.to_array());
        self.floats("VEC4", values.len(), numbers)
    }

    pub(super) fn scalars(&mut self, values: &[f32]) -> usize {
        self.floats("SCALAR", values.len(), values.iter().copied())
    }

    /// Numbers of 64 bits, each as four of 16, the lowest first: glTF has no larger integers that
    /// attributes may be made of.
    pub(super) fn quadruples(&mut self, values: &[u64]) -> usize {
        let view = self.view(values.iter().flat_map(|n| n.to_le_bytes()));
        self.accessor(view, "VEC4", U16, values.len())
    }
}

/// The header of a file, its JSON chunk, and the head of its binary chunk, which `binary` follows.
pub(super) fn chunks(document: &Value, binary: &[u8]) -> Result<[Vec<u8>; 3], Error> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let all = 12 + 8 + text.len() + 8 + binary.len();
    let length = |bytes: usize| {
        u32::try_from(bytes).map_err(|_| Error::TooLarge {
            what: "the glTF file",
            bytes: all as u64,
            most: u64::from(u32::MAX),
        })
    };
    let words = |words: &[u32]| words.iter().flat_map(|w| w.to_le_bytes()).collect();
    let header: Vec<u8> = words(&[u32::from_le_bytes(*b"glTF"), 2, length(all)?]);
    let mut json: Vec<u8> = words(&[length(text.len())?, u32::from_le_bytes(*b"JSON")]);
    json.append(&mut text);
    let head = words(&[length(binary.len())?, u32::from_le_bytes(*b"BIN\0")]);
    Ok([header, json, head])
}

/// Writes a file, whole or not at all, and says how many bytes it has.
pub(super) fn write(path: &Path, document: &Value, binary: &[u8]) -> Result<u64, Error> {
    let chunks = chunks(document, binary)?;
    let mut file = PendingFile::create(path)?;
    let mut size = 0;
    for part in chunks.iter().map(Vec::as_slice).chain([binary]) {
        file.write_all(part)
            .map_err(nemoral_files::Error::io(path))?;
        size += part.len() as u64;
    }
    file.commit()?;
    Ok(size)
}
