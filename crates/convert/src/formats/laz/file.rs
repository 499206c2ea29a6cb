//! A LAZ file: LAS 1.4 with point format 6 and extra bytes, compressed.
//!
//! Source: LAS specification 1.4 R15 (ASPRS): header, table 3; point format 6, table 13; the
//! reference system as WKT, section 2.6.3. Extra bytes are in [`extra`](super::extra). Points are
//! compressed by the crate `laz`.

use std::io::{self, Seek, SeekFrom, Write};

use laz::{LasZipCompressor, LazItemRecordBuilder, LazVlr, LazVlrBuilder};
use nemoral_dataset::{PlyPoint, SiteSpec};
use nemoral_scene::glam::{DVec2, DVec3};

use super::bytes::Bytes;
use super::extra;
use crate::Crs;

/// Metres for a step of a coordinate.
pub(crate) const STEP_M: f64 = 1e-4;
const HEADER_BYTES: u16 = 375;
const VLR_HEADER_BYTES: usize = 54;
/// Point format 6 without extra bytes.
const POINT_BYTES: u16 = 30;
/// The bytes of a header up to which it says which system and software made the file.
pub(crate) const START_BYTES: usize = 90;
const MADE_BY: [&str; 2] = ["nemoral", "nemoral-convert"];
/// Nanoseconds between pulses that two LiDARs fire together: more than between those of one, as a
/// ring is at most 255.
const LIDAR_NS: i64 = 256;

/// A point as it is written.
pub(crate) struct LazPoint<'a> {
    pub(crate) recorded: &'a PlyPoint,
    pub(crate) world_m: DVec3,
    /// The vector to it from where the scanner was at the frame's time, in the world.
    pub(crate) from_scanner_m: DVec3,
    /// How far it is to the left of the scanner, level and across the body's heading, metres.
    pub(crate) left_m: f64,
    /// `point_source_id`.
    pub(crate) source: u16,
    /// The frame's time, seconds after the start of the sequence.
    pub(crate) time_s: f64,
    /// What is added to it, so that no time is negative:
    /// [`SequenceSpec::las_time_shift_s`](nemoral_dataset::SequenceSpec::las_time_shift_s).
    pub(crate) time_shift_s: f64,
    /// The number of the LiDAR, from 0.
    pub(crate) lidar: u8,
    /// `classification`.
    pub(crate) class: u8,
    /// The row of its tree in the sequence's `trees.csv`, from 1; 0 for what is no tree.
    pub(crate) tree: u32,
}

/// A place of the world in the coordinates of files: those of the site, or the world's own if it is
/// invented.
pub(crate) fn place_m(site: Option<&SiteSpec>, world_m: DVec3) -> DVec3 {
    site.map_or(world_m, |site| site.from_world(world_m))
}

/// Writes a file point by point. Its header, which says how many there are, is written last.
pub(crate) struct LazWriter<W: Write + Seek + Send + Sync + 'static> {
    compressor: LasZipCompressor<'static, W>,
    header: Header,
    site: Option<SiteSpec>,
}

impl<W: Write + Seek + Send + Sync + 'static> LazWriter<W> {
    /// Begins a file of a site, or of an invented world. Its coordinates are relative to a whole
    /// metre at `near_m` in the world.
    pub(crate) fn new(mut to: W, site: Option<&SiteSpec>, near_m: DVec3) -> io::Result<Self> {
        let extra_bytes = extra::bytes_per_point();
        let items = LazItemRecordBuilder::default_for_point_format_id(6, extra_bytes);
        let items = items.map_err(io::Error::other)?;
        let vlr = LazVlrBuilder::new(items).build();
        let mut laszip = Vec::new();
        vlr.write_to(&mut laszip)?;
        let mut records = vec![
            (LazVlr::USER_ID, LazVlr::RECORD_ID, "", laszip),
            ("LASF_Spec", 4, "extra dimensions", extra::record()),
        ];
        let code = site.and_then(|site| site.epsg);
        if let Some(wkt) = code.and_then(Crs::of_epsg).and_then(|crs| crs.wkt) {
            let text = [wkt.as_bytes(), b"\0"].concat();
            records.push(("LASF_Projection", 2112, "reference system", text));
        }
        let mut bytes = Bytes::default();
        let count = records.len() as u32;
        for (user, id, description, data) in records {
            bytes.u16(0).text(user, 16).u16(id).u16(data.len() as u16);
            bytes.text(description, 32).bytes(&data);
        }
        debug_assert!(bytes.0.len() > count as usize * VLR_HEADER_BYTES);
        let header = Header {
            origin_m: place_m(site, near_m).round(),
            stride: POINT_BYTES + extra_bytes,
            records: count,
            record_bytes: bytes.0.len() as u32,
            points: 0,
            by_return: [0; 15],
            low_m: DVec3::INFINITY,
            high_m: DVec3::NEG_INFINITY,
        };
        to.write_all(&header.encode())?;
        to.write_all(&bytes.0)?;
        Ok(Self {
            compressor: LasZipCompressor::new(to, vlr).map_err(io::Error::other)?,
            header,
            site: site.copied(),
        })
    }

    /// Adds a point.
    pub(crate) fn put(&mut self, point: &LazPoint<'_>) -> io::Result<()> {
        let at = place_m(self.site.as_ref(), point.world_m);
        let steps = ((at - self.header.origin_m) / STEP_M).round();
        let reach = f64::from(i32::MAX);
        if !steps.is_finite() || steps.abs().max_element() > reach {
            let from = self.header.origin_m;
            let message = format!("a point at {at} is beyond 214 km from {from}");
            return Err(io::Error::other(message));
        }
        self.header.count(point, steps);
        self.compressor.compress_one(&record(point, steps))
    }

    /// Ends the file.
    pub(crate) fn finish(mut self) -> io::Result<W> {
        self.compressor.done()?;
        let mut to = self.compressor.into_inner();
        to.seek(SeekFrom::Start(0))?;
        to.write_all(&self.header.encode())?;
        to.seek(SeekFrom::End(0))?;
        Ok(to)
    }
}

/// Whether this program wrote a file that begins so.
pub(crate) fn is_own(start: &[u8]) -> bool {
    let start = start.get(..START_BYTES).unwrap_or_default();
    start.starts_with(b"LASF") && start.ends_with(&made_by())
}

fn made_by() -> Vec<u8> {
    let mut out = Bytes::default();
    for name in MADE_BY {
        out.text(name, 32);
    }
    out.0
}

/// What the header says.
struct Header {
    origin_m: DVec3,
    stride: u16,
    records: u32,
    record_bytes: u32,
    points: u64,
    by_return: [u64; 15],
    low_m: DVec3,
    high_m: DVec3,
}

impl Header {
    fn count(&mut self, point: &LazPoint<'_>, steps: DVec3) {
        self.points += 1;
        let number = point.recorded.point.return_number.clamp(1, 15);
        self.by_return[usize::from(number) - 1] += 1;
        let stored_m = steps * STEP_M + self.origin_m;
        self.low_m = self.low_m.min(stored_m);
        self.high_m = self.high_m.max(stored_m);
    }

    fn encode(&self) -> Vec<u8> {
        let (low_m, high_m) = match self.points {
            0 => (DVec3::ZERO, DVec3::ZERO),
            _ => (self.low_m, self.high_m),
        };
        let mut out = Bytes::default();
        out.bytes(b"LASF").u16(0);
        // The reference system, if there is one, is WKT, as point format 6 demands; times are of no
        // week.
        out.u16(1 << 4).bytes(&[0; 16]).bytes(&[1, 4]);
        out.bytes(&made_by());
        // The day on which it was made is not known, so that equal data sets give equal bytes.
        out.u16(0).u16(0).u16(HEADER_BYTES);
        out.u32(u32::from(HEADER_BYTES) + self.record_bytes);
        out.u32(self.records);
        // Bit 7 says that points are compressed.
        out.bytes(&[6 | 1 << 7]).u16(self.stride);
        // Numbers of points for older readers, which do not know this format.
        out.bytes(&[0; 24]);
        for value in [STEP_M; 3].into_iter().chain(self.origin_m.to_array()) {
            out.f64(value);
        }
        for axis in 0..3 {
            out.f64(high_m[axis]).f64(low_m[axis]);
        }
        // Neither waveforms nor extended records.
        out.u64(0).u64(0).u32(0);
        out.u64(self.points);
        for count in self.by_return {
            out.u64(count);
        }
        debug_assert_eq!(out.0.len(), usize::from(HEADER_BYTES));
        out.0
    }
}

/// A point in format 6 with its extra bytes.
fn record(p: &LazPoint<'_>, steps: DVec3) -> Vec<u8> {
    let point = &p.recorded.point;
    let mut out = Bytes::default();
    for step in steps.as_ivec3().to_array() {
        out.bytes(&step.to_le_bytes());
    }
    out.u16((point.intensity.clamp(0.0, 1.0) * 65535.0).round() as u16);
    let (number, returns) = (point.return_number.clamp(1, 15), point.returns.clamp(1, 15));
    // Each LiDAR has a channel of the scanner, as far as there are four.
    let channel = (p.lidar & 3) << 4;
    out.bytes(&[number | returns << 4, channel, p.class])
        .bytes(&[p.lidar.saturating_add(1)])
        .bytes(&scan_angle(p.from_scanner_m, p.left_m).to_le_bytes());
    out.u16(p.source);
    // Readers know a pulse by its time alone, and some lasers fire together.
    let fired_ns = point.time_ns + i64::from(point.ring) + LIDAR_NS * i64::from(p.lidar);
    out.f64(p.time_s + p.time_shift_s + fired_ns as f64 * 1e-9);
    extra::put(&mut out, p);
    out.0
}

/// The angle at which a point was seen, from straight down, in steps of 0.006°, negative to the
/// left of where the body heads, as of an aeroplane, however the scanner is mounted and the body
/// rolls (LAS 1.4 R15: it is against the vertical, so that a roll is in it).
fn scan_angle(from_scanner_m: DVec3, left_m: f64) -> i16 {
    const STEP_DEG: f64 = 0.006;
    let level_m = from_scanner_m.truncate().length();
    let from_nadir_deg = DVec2::new(-from_scanner_m.z, level_m)
        .to_angle()
        .to_degrees();
    let steps = (from_nadir_deg / STEP_DEG).round() as i16;
    if left_m > 0.0 { -steps } else { steps }
}

#[cfg(test)]
mod tests {
    use nemoral_scene::RigidTransform;

    use super::*;

    #[test]
    fn angles_are_against_the_vertical_however_the_body_rolls() {
        // 60 m above the ground, heading east; 2 m to the left or right of straight down.
        for roll_rad in [0.0, 0.05, -0.05, 0.35] {
            let pose = RigidTransform::from_xyz_rpy(DVec3::ZERO, roll_rad, 0.1, 0.0);
            for (north_m, steps) in [(2.0, -318), (-2.0, 318)] {
                let from_scanner_m = DVec3::new(0.0, north_m, -60.0);
                let left_m = pose.level_left().dot(from_scanner_m);
                assert_eq!(scan_angle(from_scanner_m, left_m), steps, "{roll_rad}");
            }
        }
    }
}
