//! `.ply`: everything that is known of each point, through `ply-rs`, which no other file names.

use std::io::{BufReader, Read};
use std::path::Path;

use nemoral_scene::glam::Vec3;
use nemoral_scene::{ChunkCoord, LidarPoint, ObjectId, PointFlags, Semantic};
use ply_rs::parser::Parser;
use ply_rs::ply::{
    Addable, ElementDef, Encoding, Header, Property, PropertyAccess, PropertyDef, PropertyType,
    ScalarType,
};
use ply_rs::writer::Writer;

use crate::Error;

/// A vertex of the `.ply` file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlyPoint {
    /// All that is known of the point, the true id included.
    pub point: LidarPoint,
    /// The ontology's class id, as in the `.label` file.
    pub class: u8,
    /// The instance id of the `.label` file.
    pub label: u16,
}

use ScalarType::{Double, Float, Int, UChar, UInt, UShort};

/// The vertex's properties, in the file's order.
const FIELDS: [(&str, ScalarType); 23] = [
    ("x", Float),
    ("y", Float),
    ("z", Float),
    ("range", Float),
    ("range_true", Float),
    ("intensity", Float),
    ("reflectivity", UChar),
    ("class", UChar),
    ("semantic", UChar),
    ("chunk_x", Int),
    ("chunk_y", Int),
    ("item", UShort),
    ("label_instance", UShort),
    ("ring", UChar),
    ("return_no", UChar),
    ("n_returns", UChar),
    ("time_offset_ns", UInt),
    ("pulse", UInt),
    ("incidence_cos", Float),
    ("nx", Float),
    ("ny", Float),
    ("nz", Float),
    ("flags", UChar),
];

/// The properties of a registered cloud's vertex, in the file's order.
const CLOUD_FIELDS: [(&str, ScalarType); 23] = [
    ("x", Double),
    ("y", Double),
    ("z", Double),
    ("intensity", Float),
    ("range_true", Float),
    ("range", Float),
    ("incidence_cos", Float),
    ("nx", Float),
    ("ny", Float),
    ("nz", Float),
    ("chunk_x", Int),
    ("chunk_y", Int),
    ("frame", UInt),
    ("item", UShort),
    ("class", UChar),
    ("semantic", UChar),
    ("lidar", UChar),
    ("return_no", UChar),
    ("n_returns", UChar),
    ("flags", UChar),
    ("red", UChar),
    ("green", UChar),
    ("blue", UChar),
];

/// The header of a registered cloud; its vertices follow, binary, little-endian, packed.
pub(crate) fn cloud_header(vertices: usize) -> Vec<u8> {
    let comment =
        "nemoral cloud: metres, world frame (x east, y north, z up); flags 1 mixed, 2 false alarm";
    let header = header(&CLOUD_FIELDS, comment, vertices);
    let mut out = Vec::new();
    Writer::<PlyVertex>::new()
        .write_header(&mut out, &header)
        .expect("memory takes it");
    out
}

fn scan_header(vertices: usize) -> Header {
    let comment = "nemoral LiDAR scan: metres, sensor frame (x forward, y left, z up); flags 1 mixed, 2 false alarm";
    header(&FIELDS, comment, vertices)
}

fn header(fields: &[(&str, ScalarType)], comment: &str, vertices: usize) -> Header {
    let mut element = ElementDef::new("vertex".to_owned());
    element.count = vertices;
    for (name, kind) in fields {
        let kind = PropertyType::Scalar(kind.clone());
        element
            .properties
            .add(PropertyDef::new((*name).to_owned(), kind));
    }
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.comments.push(comment.to_owned());
    header.elements.add(element);
    header
}

/// A binary little-endian file.
pub(crate) fn encode(points: &[PlyPoint]) -> Vec<u8> {
    let header = scan_header(points.len());
    let element = &header.elements["vertex"];
    let writer = Writer::<PlyVertex>::new();
    let mut out = Vec::with_capacity(1024 + 67 * points.len());
    writer
        .write_header(&mut out, &header)
        .expect("memory takes it");
    for &point in points {
        writer
            .write_little_endian_element(&mut out, &PlyVertex::of(point), element)
            .expect("every field of the header has a getter");
    }
    out
}

/// The way back; the file must have exactly the fields that [`encode`] writes.
pub(crate) fn decode(path: &Path, bytes: &[u8]) -> Result<Vec<PlyPoint>, Error> {
    let parser = Parser::<PlyVertex>::new();
    let mut source = BufReader::new(bytes);
    let found = parser
        .read_header(&mut source)
        .map_err(|e| Error::malformed(path, e))?;
    let count = found.elements.get("vertex").map_or(0, |e| e.count);
    let expected = scan_header(count);
    if found.encoding != expected.encoding || found.elements != expected.elements {
        return Err(Error::malformed(path, "has other fields than a scan's"));
    }
    let payload = parser
        .read_payload(&mut source, &found)
        .map_err(|e| Error::malformed(path, e))?;
    if source.read(&mut [0]).map_err(Error::io(path))? != 0 {
        return Err(Error::malformed(path, "has bytes after the last vertex"));
    }
    payload["vertex"]
        .iter()
        .enumerate()
        .map(|(i, v)| {
            v.point()
                .map_err(|what| Error::malformed(path, format!("vertex {i}: {what}")))
        })
        .collect()
}

/// What `ply-rs` sees: the fields, still unchecked when read.
struct PlyVertex {
    point: PlyPoint,
    semantic: u8,
    chunk: ChunkCoord,
    item: u16,
}

impl PlyVertex {
    fn of(point: PlyPoint) -> Self {
        Self {
            point,
            semantic: point.point.semantic as u8,
            chunk: point.point.object.chunk(),
            item: point.point.object.item(),
        }
    }

    fn point(&self) -> Result<PlyPoint, String> {
        let mut out = self.point;
        out.point.semantic = Semantic::from_u8(self.semantic)
            .ok_or_else(|| format!("semantic {} is unknown", self.semantic))?;
        out.point.object = match (self.item, self.chunk) {
            (0, ChunkCoord { x: 0, y: 0 }) => ObjectId::NONE,
            (item, chunk) => ObjectId::new(chunk, item)
                .ok_or_else(|| format!("there is no item {item} in a chunk {chunk}"))?,
        };
        Ok(out)
    }
}

impl PropertyAccess for PlyVertex {
    fn new() -> Self {
        Self::of(PlyPoint {
            point: LidarPoint {
                position_m: Vec3::ZERO,
                true_range_m: 0.0,
                range_m: 0.0,
                intensity: 0.0,
                reflectivity: 0,
                semantic: Semantic::Sky,
                object: ObjectId::NONE,
                ring: 0,
                return_number: 0,
                returns: 0,
                time_offset_ns: 0,
                pulse: 0,
                incidence_cos: 0.0,
                normal: Vec3::ZERO,
                flags: PointFlags(0),
            },
            class: 0,
            label: 0,
        })
    }

    fn get_float(&self, name: &String) -> Option<f32> {
        let p = &self.point.point;
        Some(match name.as_str() {
            "x" => p.position_m.x,
            "y" => p.position_m.y,
            "z" => p.position_m.z,
            "nx" => p.normal.x,
            "ny" => p.normal.y,
            "nz" => p.normal.z,
            "range" => p.range_m,
            "range_true" => p.true_range_m,
            "intensity" => p.intensity,
            "incidence_cos" => p.incidence_cos,
            _ => return None,
        })
    }

    fn get_uchar(&self, name: &String) -> Option<u8> {
        let p = &self.point.point;
        Some(match name.as_str() {
            "ring" => p.ring,
            "class" => self.point.class,
            "flags" => p.flags.0,
            "semantic" => self.semantic,
            "return_no" => p.return_number,
            "n_returns" => p.returns,
            "reflectivity" => p.reflectivity,
            _ => return None,
        })
    }

    fn get_ushort(&self, name: &String) -> Option<u16> {
        match name.as_str() {
            "item" => Some(self.item),
            "label_instance" => Some(self.point.label),
            _ => None,
        }
    }

    fn get_int(&self, name: &String) -> Option<i32> {
        match name.as_str() {
            "chunk_x" => Some(self.chunk.x),
            "chunk_y" => Some(self.chunk.y),
            _ => None,
        }
    }

    fn get_uint(&self, name: &String) -> Option<u32> {
        match name.as_str() {
            "pulse" => Some(self.point.point.pulse),
            "time_offset_ns" => Some(self.point.point.time_offset_ns),
            _ => None,
        }
    }

    fn set_property(&mut self, name: String, value: Property) {
        let p = &mut self.point.point;
        match (name.as_str(), value) {
            ("x", Property::Float(v)) => p.position_m.x = v,
            ("y", Property::Float(v)) => p.position_m.y = v,
            ("z", Property::Float(v)) => p.position_m.z = v,
            ("nx", Property::Float(v)) => p.normal.x = v,
            ("ny", Property::Float(v)) => p.normal.y = v,
            ("nz", Property::Float(v)) => p.normal.z = v,
            ("range", Property::Float(v)) => p.range_m = v,
            ("range_true", Property::Float(v)) => p.true_range_m = v,
            ("intensity", Property::Float(v)) => p.intensity = v,
            ("incidence_cos", Property::Float(v)) => p.incidence_cos = v,
            ("ring", Property::UChar(v)) => p.ring = v,
            ("class", Property::UChar(v)) => self.point.class = v,
            ("flags", Property::UChar(v)) => p.flags.0 = v,
            ("semantic", Property::UChar(v)) => self.semantic = v,
            ("return_no", Property::UChar(v)) => p.return_number = v,
            ("n_returns", Property::UChar(v)) => p.returns = v,
            ("reflectivity", Property::UChar(v)) => p.reflectivity = v,
            ("item", Property::UShort(v)) => self.item = v,
            ("label_instance", Property::UShort(v)) => self.point.label = v,
            ("chunk_x", Property::Int(v)) => self.chunk.x = v,
            ("chunk_y", Property::Int(v)) => self.chunk.y = v,
            ("pulse", Property::UInt(v)) => p.pulse = v,
            ("time_offset_ns", Property::UInt(v)) => p.time_offset_ns = v,
            // `decode` has compared the header: there is no other.
            _ => {}
        }
    }
}
