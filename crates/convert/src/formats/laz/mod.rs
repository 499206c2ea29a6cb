//! LAZ: each scan as a compressed LAS 1.4 file with point format 6, in world coordinates:
//! ```text
//! SS/LIDAR/FFFFFF.laz
//! ```
//! x, y and z are the world's, at the frame's pose, in steps of 0.1 mm. `gps_time` is seconds after
//! the start of the sequence, `intensity` that of the scan times 65535, `point_source_id` the
//! number of the LiDAR, from 1. `classification` is by the table `asprs` unless another is given;
//! what the data set knows besides is in extra dimensions: `class` and `semantic`, the object's
//! `instance` (as in instance maps), `ring`, `pulse`, `range`, `range_true`, `incidence_cos`,
//! `flags`.
//!
//! Source: LAS specification 1.4 R15 (ASPRS): header, table 3; point format 6, table 13; extra
//! bytes, table 24. Points are compressed by the crate `laz`.

use std::io::Cursor;

use laz::{LasZipCompressor, LazItemRecordBuilder, LazVlr, LazVlrBuilder};
use nemoral_dataset::PlyPoint;
use nemoral_scene::RigidTransform;
use nemoral_scene::glam::DVec3;

use crate::labels::Labels;
use crate::{Error, Format, Sink, Source, Table};

/// Metres for a step of a coordinate.
const STEP_M: f64 = 1e-4;
const HEADER_BYTES: u16 = 375;
const VLR_HEADER_BYTES: usize = 54;
/// Point format 6 without extra bytes.
const POINT_BYTES: u16 = 30;
/// The extra dimensions: name, the specification's number of the type, and bytes.
const EXTRA: [(&str, u8, u16); 9] = [
    ("class", 1, 1),
    ("semantic", 1, 1),
    ("instance", 5, 4),
    ("ring", 1, 1),
    ("pulse", 5, 4),
    ("range", 9, 4),
    ("range_true", 9, 4),
    ("incidence_cos", 9, 4),
    ("flags", 1, 1),
];

/// The format.
#[derive(Debug)]
pub(crate) struct Laz {
    pub(crate) ontology: Option<Table>,
}

impl Laz {
    fn labels(&self, source: &Source) -> Result<Labels, Error> {
        let asprs = match &self.ontology {
            Some(table) => table.clone(),
            None => Table::load("asprs")?,
        };
        let labels = Labels::of(source, Some(&asprs))?;
        if let Some(class) = labels.classes.iter().find(|c| c.id > 255) {
            let reason = format!("class {} has id {}, LAS has 0 to 255", class.name, class.id);
            let table = asprs.name;
            return Err(Error::Ontology { table, reason });
        }
        Ok(labels)
    }
}

impl Format for Laz {
    fn check(&self, source: &Source) -> Result<(), Error> {
        let mut lidars = source.sequences().flat_map(|s| s.lidars.iter());
        let unsuitable = |reason: &str| Error::Unsuitable {
            format: "laz",
            reason: reason.to_owned(),
        };
        if source.sequences().all(|s| s.lidars.is_empty()) {
            return Err(unsuitable("the data set has no LiDAR"));
        }
        if !lidars.all(|l| l.ply) {
            let reason = "points/*.ply are missing, which alone have times and returns; make the \
                          data set with output.ply = true";
            return Err(unsuitable(reason));
        }
        self.labels(source).map(drop)
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        let labels = self.labels(source)?;
        for sequence in source.sequences() {
            for frame in source.frames(sequence.number) {
                sink.step(&format!("frame-{}", frame.name()), |files| {
                    for (i, lidar) in sequence.lidars.iter().enumerate() {
                        let scan = Scan {
                            world_from_lidar: frame.world_from_body() * lidar.body_from_lidar,
                            time_s: frame.time_s,
                            number: i as u16 + 1,
                            labels: &labels,
                        };
                        let bytes = scan.encode(&source.scan(&frame, i)?.ply);
                        let (number, name) = (sequence.number, &lidar.name);
                        let path = format!("{number:02}/{name}/{:06}.laz", frame.index);
                        files.put(path, bytes);
                    }
                    Ok(String::new())
                })?;
            }
        }
        Ok(())
    }
}

/// What the points of a scan have in common.
struct Scan<'a> {
    world_from_lidar: RigidTransform,
    time_s: f64,
    number: u16,
    labels: &'a Labels,
}

impl Scan<'_> {
    fn encode(&self, points: &[PlyPoint]) -> Vec<u8> {
        let origin = self.world_from_lidar.translation_m.round();
        let steps = |p: &PlyPoint| {
            let at = self
                .world_from_lidar
                .transform_point(p.point.position_m.as_dvec3());
            ((at - origin) / STEP_M).round().as_ivec3()
        };
        let extra_bytes: u16 = EXTRA.iter().map(|(_, _, bytes)| bytes).sum();
        let items = LazItemRecordBuilder::default_for_point_format_id(6, extra_bytes);
        let items = items.expect("point format 6 can be compressed");
        let vlr = LazVlrBuilder::new(items).build();
        let mut out = self.header(points, origin, POINT_BYTES + extra_bytes, &vlr);
        let at = out.len() as u64;
        let mut to = Cursor::new(&mut out);
        to.set_position(at);
        let mut compressor = LasZipCompressor::new(to, vlr).expect("items are known");
        for p in points {
            let record = self.record(p, steps(p).to_array());
            compressor.compress_one(&record).expect("memory takes it");
        }
        compressor.done().expect("memory takes it");
        drop(compressor);
        out
    }

    /// The header and the variable-length records before the points.
    fn header(&self, points: &[PlyPoint], origin: DVec3, stride: u16, vlr: &LazVlr) -> Vec<u8> {
        let mut laszip = Vec::new();
        vlr.write_to(&mut laszip).expect("memory takes it");
        let vlrs = [
            (LazVlr::USER_ID, LazVlr::RECORD_ID, "", laszip),
            ("LASF_Spec", 4, "extra dimensions", extra_dimensions()),
        ];
        let vlr_bytes: usize = vlrs.iter().map(|v| VLR_HEADER_BYTES + v.3.len()).sum();
        let mut by_return = [0_u64; 15];
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p in points {
            let number = usize::from(p.point.return_number.clamp(1, 15));
            by_return[number - 1] += 1;
            let at = self
                .world_from_lidar
                .transform_point(p.point.position_m.as_dvec3());
            let stored = ((at - origin) / STEP_M).round() * STEP_M + origin;
            (low, high) = (low.min(stored), high.max(stored));
        }
        if points.is_empty() {
            (low, high) = (DVec3::ZERO, DVec3::ZERO);
        }
        let mut out = Bytes::default();
        out.bytes(b"LASF").u16(0);
        // The reference system would be WKT, which point format 6 demands; times are of no week.
        out.u16(1 << 4).bytes(&[0; 16]).bytes(&[1, 4]);
        out.text("nemoral", 32).text("nemoral-convert", 32);
        // The day on which it was made is not known, so that equal data sets give equal bytes.
        out.u16(0).u16(0).u16(HEADER_BYTES);
        out.u32(u32::from(HEADER_BYTES) + vlr_bytes as u32);
        out.u32(vlrs.len() as u32);
        // Bit 7 says that points are compressed.
        out.bytes(&[6 | 1 << 7]).u16(stride);
        // Numbers of points for older readers, which do not know this format.
        out.bytes(&[0; 24]);
        for value in [STEP_M; 3].into_iter().chain(origin.to_array()) {
            out.f64(value);
        }
        for axis in 0..3 {
            out.f64(high[axis]).f64(low[axis]);
        }
        // Neither waveforms nor extended records.
        out.u64(0).u64(0).u32(0);
        out.u64(points.len() as u64);
        for count in by_return {
            out.u64(count);
        }
        debug_assert_eq!(out.0.len(), usize::from(HEADER_BYTES));
        for (user, id, description, data) in vlrs {
            out.u16(0).text(user, 16).u16(id).u16(data.len() as u16);
            out.text(description, 32).bytes(&data);
        }
        out.0
    }

    /// A point in format 6 with its extra bytes.
    fn record(&self, p: &PlyPoint, steps: [i32; 3]) -> Vec<u8> {
        let point = &p.point;
        let mut out = Bytes::default();
        for step in steps {
            out.bytes(&step.to_le_bytes());
        }
        out.u16((point.intensity.clamp(0.0, 1.0) * 65535.0).round() as u16);
        let (number, returns) = (point.return_number.clamp(1, 15), point.returns.clamp(1, 15));
        let class = self.labels.id(p.class) as u8;
        out.bytes(&[number | returns << 4, 0, class, 0]);
        out.u16(0).u16(self.number);
        out.f64(self.time_s + point.time_ns as f64 * 1e-9);
        out.bytes(&[p.class, point.semantic as u8]);
        out.u32(point.object.to_image_id())
            .bytes(&[point.ring])
            .u32(point.pulse);
        out.f32(point.range_m)
            .f32(point.true_range_m)
            .f32(point.incidence_cos);
        out.bytes(&[point.flags.0]);
        out.0
    }
}

/// The record that describes the extra bytes.
fn extra_dimensions() -> Vec<u8> {
    let mut out = Bytes::default();
    for (name, data_type, _) in EXTRA {
        out.bytes(&[0, 0, data_type, 0]).text(name, 32);
        // No value stands for nothing; no limits, scale or offset are given.
        out.bytes(&[0; 4 + 5 * 24]).text("", 32);
    }
    out.0
}

/// Little-endian bytes.
#[derive(Default)]
struct Bytes(Vec<u8>);

impl Bytes {
    fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.0.extend_from_slice(bytes);
        self
    }

    fn u16(&mut self, value: u16) -> &mut Self {
        self.bytes(&value.to_le_bytes())
    }

    fn u32(&mut self, value: u32) -> &mut Self {
        self.bytes(&value.to_le_bytes())
    }

    fn u64(&mut self, value: u64) -> &mut Self {
        self.bytes(&value.to_le_bytes())
    }

    fn f32(&mut self, value: f32) -> &mut Self {
        self.bytes(&value.to_le_bytes())
    }

    fn f64(&mut self, value: f64) -> &mut Self {
        self.bytes(&value.to_le_bytes())
    }

    /// A text in a field that is filled up with zeros.
    fn text(&mut self, text: &str, length: usize) -> &mut Self {
        self.bytes(text.as_bytes());
        self.bytes(&vec![0; length - text.len()])
    }
}
