//! `.ply`: everything that is known about each point.
//!
//! There is one layout for scans and one for registered clouds: binary little-endian, packed, with
//! a header that describes it to every reader. Only the layout of scans is read, so that a file's
//! size follows from the number of points that its header declares before memory is allocated.
//! Tests read both layouts by another implementation of the format.
//!
//! Whole numbers are bytes or signed 32-bit integers, as Open3D's reader of tensors skips others.

mod decode;

use nemoral_scene::{ChunkCoord, LidarPoint, Ontology};

pub(crate) use decode::decode;

/// A vertex of the `.ply` file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlyPoint {
    /// All that is known about the point, including the true id.
    pub point: LidarPoint,
    /// The ontology's class id, as in the `.label` file.
    pub class: u8,
    /// The instance id of the `.label` file.
    pub label: u16,
}

/// Bytes of a scan's vertex.
const STRIDE: usize = 75;

impl PlyPoint {
    /// The vertex's properties in the file's order: name and PLY type. They are packed without gaps
    /// and little-endian, [`PlyPoint::BYTES`] in all.
    pub const FIELDS: [(&'static str, &'static str); 23] = [
        ("x", "float"),
        ("y", "float"),
        ("z", "float"),
        ("range", "float"),
        ("range_true", "float"),
        ("intensity", "float"),
        ("reflectivity", "uchar"),
        ("class", "uchar"),
        ("semantic", "uchar"),
        ("chunk_x", "int"),
        ("chunk_y", "int"),
        ("item", "int"),
        ("label_instance", "int"),
        ("ring", "uchar"),
        ("return_no", "uchar"),
        ("n_returns", "uchar"),
        ("t", "double"),
        ("pulse", "int"),
        ("incidence_cos", "float"),
        ("nx", "float"),
        ("ny", "float"),
        ("nz", "float"),
        ("flags", "uchar"),
    ];

    /// Bytes of a vertex.
    pub const BYTES: usize = STRIDE;

    /// A point as a file has it, whose classes are the ontology's. The sensor is in the chunk
    /// `sensor_chunk`.
    #[inline]
    #[must_use]
    pub fn new(point: LidarPoint, ontology: &Ontology, sensor_chunk: ChunkCoord) -> Self {
        Self {
            point,
            class: ontology.class(point.semantic).id,
            label: point.object.to_label_id(sensor_chunk),
        }
    }

    /// Appends the vertex's bytes.
    pub fn write_to(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&self.to_bytes());
    }

    /// The vertex's bytes.
    #[inline]
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let Self {
            point: p,
            class,
            label,
        } = self;
        let mut bytes = [0; STRIDE];
        let mut at = 0;
        let mut put = |field: &[u8]| {
            bytes[at..at + field.len()].copy_from_slice(field);
            at += field.len();
        };
        for value in p.position_m.to_array() {
            put(&value.to_le_bytes());
        }
        for value in [p.range_m, p.true_range_m, p.intensity] {
            put(&value.to_le_bytes());
        }
        put(&[p.reflectivity, *class, p.semantic as u8]);
        let chunk = p.object.chunk();
        put(&chunk.x.to_le_bytes());
        put(&chunk.y.to_le_bytes());
        put(&i32::from(p.object.item()).to_le_bytes());
        put(&i32::from(*label).to_le_bytes());
        put(&[p.ring, p.return_number, p.returns]);
        put(&seconds(p.time_ns).to_le_bytes());
        put(&p.pulse.to_le_bytes());
        let [nx, ny, nz] = p.normal.to_array();
        for value in [p.incidence_cos, nx, ny, nz] {
            put(&value.to_le_bytes());
        }
        put(&[p.flags.0]);
        bytes
    }
}

/// The properties of a registered cloud's vertex, in the file's order.
const CLOUD_FIELDS: [(&str, &str); 25] = [
    ("x", "double"),
    ("y", "double"),
    ("z", "double"),
    ("time", "double"),
    ("intensity", "float"),
    ("range_true", "float"),
    ("range", "float"),
    ("incidence_cos", "float"),
    ("nx", "float"),
    ("ny", "float"),
    ("nz", "float"),
    ("chunk_x", "int"),
    ("chunk_y", "int"),
    ("frame", "int"),
    ("item", "int"),
    ("class", "uchar"),
    ("semantic", "uchar"),
    ("lidar", "uchar"),
    ("ring", "uchar"),
    ("return_no", "uchar"),
    ("n_returns", "uchar"),
    ("flags", "uchar"),
    ("red", "uchar"),
    ("green", "uchar"),
    ("blue", "uchar"),
];

const CLOUD_COMMENT: &str = "nemoral cloud: metres, world frame (x east, y north, z up); time \
    seconds after the start of the sequence; flags 1 mixed, 2 false alarm, 4 mirrored, 8 grows on \
    a stem, 16 on branches";
const SCAN_COMMENT: &str = "nemoral LiDAR scan: metres, sensor frame (x forward, y left, z up); t \
    seconds after the frame's time; flags 1 mixed, 2 false alarm, 4 mirrored, 8 grows on a stem, \
    16 on branches";

/// The header of a registered cloud; its vertices follow.
pub(crate) fn cloud_header(vertices: usize) -> Vec<u8> {
    header(&CLOUD_FIELDS, CLOUD_COMMENT, vertices).into_bytes()
}

fn scan_header(vertices: usize) -> String {
    header(&PlyPoint::FIELDS, SCAN_COMMENT, vertices)
}

fn header(fields: &[(&str, &str)], comment: &str, vertices: usize) -> String {
    let properties: String = fields
        .iter()
        .map(|(name, kind)| format!("property {kind} {name}\n"))
        .collect();
    format!(
        "ply\nformat binary_little_endian 1.0\ncomment {comment}\n\
         element vertex {vertices}\n{properties}end_header\n"
    )
}

/// A binary little-endian file.
pub(crate) fn encode(points: &[PlyPoint]) -> Vec<u8> {
    let header = scan_header(points.len());
    let mut out = Vec::with_capacity(header.len() + STRIDE * points.len());
    out.extend_from_slice(header.as_bytes());
    for point in points {
        point.write_to(&mut out);
    }
    out
}

/// The times that a point may have, in words.
pub(crate) const MOST_TIME: &str = "within 2^50 ns (13 days) of the frame's time";

/// Whether the file's types hold a point's numbers.
pub(crate) fn holds(point: &LidarPoint) -> bool {
    i32::try_from(point.pulse).is_ok() && point.time_ns.unsigned_abs() < 1 << 50
}

/// Whole nanoseconds as seconds.
fn seconds(time_ns: i64) -> f64 {
    time_ns as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use std::io::BufReader;
    use std::path::Path;

    use nemoral_scene::glam::Vec3;
    use nemoral_scene::{ObjectId, PointFlags, Semantic};
    use ply_rs::parser::Parser;
    use ply_rs::ply::{DefaultElement, Property};

    use super::*;

    pub(super) fn sample(i: u32) -> PlyPoint {
        let f = |k: u32| (i * 31 + k) as f32 * 0.37 - 4.0;
        PlyPoint {
            point: LidarPoint {
                position_m: Vec3::new(f(1), f(2), f(3)),
                true_range_m: f(4),
                range_m: f(5),
                intensity: f(6),
                reflectivity: i as u8,
                semantic: Semantic::ALL[i as usize % Semantic::ALL.len()],
                object: ObjectId::new(ChunkCoord::new(-70_000 + i as i32, 5), 1 + i as u16)
                    .expect("in range"),
                ring: 7,
                return_number: 2,
                returns: 3,
                time_ns: 1_000_003 * (i64::from(i) - 2),
                pulse: 77 * i,
                incidence_cos: f(7),
                normal: Vec3::new(f(8), f(9), f(10)),
                flags: PointFlags(PointFlags::MIXED),
            },
            class: 4,
            label: 32_750,
        }
    }

    #[test]
    fn another_implementation_reads_every_field() {
        let points: Vec<PlyPoint> = (0..5).map(sample).collect();
        let bytes = encode(&points);
        let body = points.iter().fold(Vec::new(), |mut body, point| {
            point.write_to(&mut body);
            body
        });
        assert!(bytes.ends_with(&body));
        let parser = Parser::<DefaultElement>::new();
        let ply = parser.read_ply(&mut BufReader::new(&*bytes)).expect("PLY");
        let vertices = &ply.payload["vertex"];
        assert_eq!(vertices.len(), points.len());
        for (
            vertex,
            PlyPoint {
                point: p,
                class,
                label,
            },
        ) in vertices.iter().zip(&points)
        {
            assert_eq!(vertex.len(), PlyPoint::FIELDS.len());
            let chunk = p.object.chunk();
            let expected = [
                ("x", Property::Float(p.position_m.x)),
                ("y", Property::Float(p.position_m.y)),
                ("z", Property::Float(p.position_m.z)),
                ("range", Property::Float(p.range_m)),
                ("range_true", Property::Float(p.true_range_m)),
                ("intensity", Property::Float(p.intensity)),
                ("reflectivity", Property::UChar(p.reflectivity)),
                ("class", Property::UChar(*class)),
                ("semantic", Property::UChar(p.semantic as u8)),
                ("chunk_x", Property::Int(chunk.x)),
                ("chunk_y", Property::Int(chunk.y)),
                ("item", Property::Int(p.object.item().into())),
                ("label_instance", Property::Int((*label).into())),
                ("ring", Property::UChar(p.ring)),
                ("return_no", Property::UChar(p.return_number)),
                ("n_returns", Property::UChar(p.returns)),
                ("t", Property::Double(p.time_ns as f64 / 1e9)),
                ("pulse", Property::Int(p.pulse as i32)),
                ("incidence_cos", Property::Float(p.incidence_cos)),
                ("nx", Property::Float(p.normal.x)),
                ("ny", Property::Float(p.normal.y)),
                ("nz", Property::Float(p.normal.z)),
                ("flags", Property::UChar(p.flags.0)),
            ];
            for (name, value) in expected {
                assert_eq!(vertex[name], value, "{name}");
            }
        }
        assert_eq!(decode(Path::new("x"), &bytes).expect("ours"), points);
    }

    #[test]
    fn headers_name_all_flags() {
        let flags = [
            (PointFlags::MIXED, "mixed"),
            (PointFlags::FALSE_ALARM, "false alarm"),
            (PointFlags::MIRRORED, "mirrored"),
            (PointFlags::ON_STEM, "grows on a stem"),
            (PointFlags::ON_BRANCH, "on branches"),
        ];
        for comment in [SCAN_COMMENT, CLOUD_COMMENT] {
            for (flag, name) in flags {
                assert!(comment.contains(&format!(" {flag} {name}")), "{comment}");
            }
        }
    }
}
