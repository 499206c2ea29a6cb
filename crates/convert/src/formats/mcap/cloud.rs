//! The messages of a LiDAR, with the times that its readers deskew by.

use nemoral_dataset::{LidarSpec, Manifest, PlyPoint};

use super::cdr::Cdr;
use super::time_ns;
use crate::labels::Labels;
use crate::{Error, FrameRef, Sequence, Source};

/// How the scans of a LiDAR tell when their points were fired.
#[derive(Clone, Copy, Debug)]
pub(super) enum Timing {
    /// All points are where they were at the frame's time, which is the stamp, and have no times of
    /// their own. They are left out rather than 0, because KISS-ICP divides by the span of equal
    /// times, and ends.
    Deskewed,
    /// Each point is where it was when it was fired.
    Raw {
        /// The stamp, which is the scan's start, before the frame's time, nanoseconds.
        lead_ns: u64,
        /// Whether 32 bits hold the nanoseconds from the stamp to each point.
        holds_t: bool,
    },
}

impl Timing {
    /// The timing of a sequence's LiDAR.
    ///
    /// A data set does not say how long a scan takes, but all scans of a LiDAR begin equally long
    /// before their frame's time. So the earliest point of all of them tells where they begin, and
    /// the stamps of a drive are as evenly spaced as its frames.
    pub(super) fn of(
        source: &Source,
        sequence: &Sequence<'_>,
        lidar: usize,
    ) -> Result<Self, Error> {
        let spec = &sequence.lidars[lidar];
        if spec.deskewed {
            return Ok(Self::Deskewed);
        }
        let (first_ns, last_ns) = source.firing_span_ns(sequence.number, lidar)?;
        let lead_ns = first_ns.unsigned_abs();
        let mut frames = source.frames(sequence.number);
        if let Some(frame) = frames.find(|frame| time_ns(frame) < lead_ns) {
            return Err(Error::Unsuitable {
                format: "mcap",
                reason: format!(
                    "the scan of '{}' at frame {} begins {:.3} s before the frame's time, but \
                     stamps begin at 0, a second before the sequence's start; make the data set \
                     with lidar.deskew = true",
                    spec.name,
                    frame.name(),
                    lead_ns as f64 * 1e-9
                ),
            });
        }
        Ok(Self::raw(lead_ns, last_ns))
    }

    /// The timing of scans that begin `lead_ns` before the frame's time, and whose last point is
    /// fired `last_ns` after it.
    fn raw(lead_ns: u64, last_ns: i64) -> Self {
        let farthest_ns = lead_ns.saturating_add_signed(last_ns);
        Self::Raw {
            lead_ns,
            holds_t: u32::try_from(farthest_ns).is_ok(),
        }
    }

    /// The stamp of a frame's scan.
    fn stamp_ns(self, frame: &FrameRef<'_>) -> u64 {
        match self {
            Self::Deskewed => time_ns(frame),
            Self::Raw { lead_ns, .. } => time_ns(frame).saturating_sub(lead_ns),
        }
    }

    /// When a point was fired, nanoseconds after the stamp.
    fn after_stamp_ns(self, point: &PlyPoint) -> u64 {
        match self {
            Self::Deskewed => 0,
            Self::Raw { lead_ns, .. } => lead_ns.saturating_add_signed(point.point.time_ns),
        }
    }

    /// Whether points have a field.
    fn has(self, field: &str) -> bool {
        match field {
            "time" => matches!(self, Self::Raw { .. }),
            "t" => matches!(self, Self::Raw { holds_t: true, .. }),
            _ => true,
        }
    }
}

/// A note if there are deskewed scans, which programs that deskew have nothing to do with.
pub(super) fn notes(manifest: &Manifest) -> Vec<String> {
    let lidars = manifest.header.sequences.iter().flat_map(|s| &s.lidars);
    let mut names: Vec<String> = lidars
        .filter(|lidar| lidar.deskewed)
        .map(|LidarSpec { name, .. }| format!("'{name}'"))
        .collect();
    names.sort_unstable();
    names.dedup();
    if names.is_empty() {
        return names;
    }
    vec![format!(
        "the scans of {} are deskewed, so their points have no `time` and no `t`; programs that \
         deskew by themselves (LiDAR-inertial odometry) need a data set that is made with \
         lidar.deskew = false",
        names.join(", ")
    )]
}

/// The bytes of a point: a multiple of the widest field's size. Nothing reads the places of fields
/// that are left out.
const STEP: u32 = 40;

/// The number of a scan's points, if a message holds them, whose sizes have 32 bits.
fn count(points: usize, name: &str, [sequence, frame]: [u64; 2]) -> Result<u32, Error> {
    let most = u32::MAX / STEP;
    match u32::try_from(points) {
        Ok(count) if count <= most => Ok(count),
        _ => Err(Error::Unsuitable {
            format: "mcap",
            reason: format!(
                "LiDAR '{name}' has {points} points in frame {frame} of sequence {sequence:02}: \
                 must be at most {most}, as messages are at most 4 GiB"
            ),
        }),
    }
}

/// `PointCloud2`.
///
/// # Errors
/// If the scan has too many points for one.
pub(super) fn message(
    scan: &[PlyPoint],
    labels: &Labels,
    frame: &FrameRef<'_>,
    (name, timing): (&str, Timing),
) -> Result<Vec<u8>, Error> {
    const U16: u8 = 4;
    const U32: u8 = 6;
    const F32: u8 = 7;
    const FIELDS: [(&str, u32, u8); 11] = [
        ("x", 0, F32),
        ("y", 4, F32),
        ("z", 8, F32),
        ("intensity", 12, F32),
        ("time", 16, F32),
        ("instance", 20, U32),
        ("ring", 24, U16),
        ("label", 26, U16),
        ("t", 28, U32),
        ("range", 32, U32),
        ("reflectivity", 36, U16),
    ];
    let count = count(scan.len(), name, [frame.sequence.into(), frame.index])?;
    let mut data = Vec::with_capacity(scan.len() * STEP as usize);
    for p in scan {
        let point = &p.point;
        let [x, y, z] = point.position_m.to_array();
        let after_ns = timing.after_stamp_ns(p);
        let time_s = (after_ns as f64 * 1e-9) as f32;
        for value in [x, y, z, point.intensity, time_s] {
            data.extend_from_slice(&value.to_le_bytes());
        }
        data.extend_from_slice(&point.object.to_image_id().to_le_bytes());
        data.extend_from_slice(&u16::from(point.ring).to_le_bytes());
        data.extend_from_slice(&labels.id(p.class).to_le_bytes());
        let range_mm = (f64::from(point.range_m) * 1e3).round() as u32;
        let percent = (100.0 * point.intensity).round() as u16;
        let after_ns = u32::try_from(after_ns).unwrap_or(0);
        for value in [after_ns, range_mm] {
            data.extend_from_slice(&value.to_le_bytes());
        }
        data.extend_from_slice(&percent.to_le_bytes());
        data.extend_from_slice(&[0; 2]);
    }
    let fields = || {
        let all = FIELDS.into_iter();
        all.filter(|(field, ..)| timing.has(field))
    };
    let mut out = Cdr::new();
    out.header(timing.stamp_ns(frame), name).u32(1).u32(count);
    out.u32(fields().count() as u32);
    for (field, offset, data_type) in fields() {
        out.text(field).u32(offset).u8(data_type).u32(1);
    }
    out.u8(0).u32(STEP).u32(STEP * count).bytes(&data).u8(1);
    Ok(out.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_has_as_many_points_as_its_sizes_hold() {
        let counted = |points| count(points, "top", [2, 7]).map_err(|e| e.to_string());
        assert_eq!(counted(107_374_182), Ok(107_374_182));
        let refused = counted(107_374_183).expect_err("refused");
        let told = "LiDAR 'top' has 107374183 points in frame 7 of sequence 02: must be at most \
                    107374182";
        assert!(refused.contains(told), "{refused}");
    }

    #[test]
    fn nanoseconds_are_left_out_where_32_bits_do_not_hold_them() {
        for (timing, fields) in [
            (Timing::Deskewed, [false, false, true]),
            (Timing::raw(50_000_000, 49_999_000), [true; 3]),
            (Timing::raw(2_100_000_000, 2_100_000_000), [true; 3]),
            (
                Timing::raw(2_200_000_000, 2_200_000_000),
                [true, false, true],
            ),
        ] {
            assert_eq!(["time", "t", "ring"].map(|f| timing.has(f)), fields);
        }
    }
}
