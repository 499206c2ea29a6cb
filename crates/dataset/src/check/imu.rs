//! Checks the files of a sequence's inertial measurement unit.

use super::Checker;
use super::drive::Drive;
use crate::formats::kitti;
use crate::{ImuReading, TrackRecord, layout};

/// How far the unit may be from where `poses.txt` has it, metres and degrees, besides what it moves
/// between two readings.
const OFF_M: f64 = 0.01;
const OFF_DEG: f64 = 0.5;

/// How strongly it may be accelerated and turned between two readings, m/s² and degrees a second.
const MOST_M_S2: f64 = 50.0;
const MOST_DEG_S: f64 = 180.0;

impl Checker<'_> {
    /// Compares the true states of a sequence's unit with `poses.txt`, and the number of its
    /// readings with its rate.
    pub(super) fn imu(&mut self, track: &TrackRecord, drive: &Drive) {
        let spec = self.dataset.manifest().header.sequence(track.sequence);
        let Some((spec, imu)) = spec.and_then(|spec| Some((spec, spec.imu.as_ref()?))) else {
            return;
        };
        let [samples, _, states] = layout::IMU_FILES;
        let path = |name| layout::sequence_file(track.sequence, name);
        let read = self.dataset.imu(track.sequence);
        let Some(readings) = self.read(&path(samples), read) else {
            return;
        };
        let Some(last_s) = drive.times.last() else {
            return;
        };
        let wanted = (last_s * imu.rate_hz + 1e-6).floor() as usize + 1;
        if readings.len() != wanted {
            let message = format!(
                "has {} samples: {wanted} are made in {last_s} s at {} Hz",
                readings.len(),
                imu.rate_hz
            );
            self.problem(path(samples), message);
            return;
        }
        let world_from_frame0 = kitti::from_rows(&track.world_from_frame0);
        let reference_from_imu = spec.body_from_reference().inverse() * imu.body_from_imu;
        for (k, (pose, time_s)) in drive.poses.iter().zip(&drive.times).enumerate() {
            let asked = world_from_frame0 * *pose * reference_from_imu;
            let Some(before) = before(&readings, *time_s) else {
                continue;
            };
            let gap_s = time_s - before.time_ns as f64 * 1e-9;
            let at_m = before.world_from_imu.translation_m + before.velocity_m_s * gap_s;
            let off_m = at_m.distance(asked.translation_m);
            let turned = before.world_from_imu.rotation;
            let off_deg = turned.angle_between(asked.rotation).to_degrees();
            let interval_s = 1.0 / imu.rate_hz;
            let is_off = off_m > OFF_M + MOST_M_S2 * interval_s * interval_s
                || off_deg > OFF_DEG + MOST_DEG_S * interval_s;
            if is_off {
                let message = format!(
                    "at frame {k} the unit is {off_m:.3} m and {off_deg:.2}° off where poses.txt \
                     has it"
                );
                self.problem(path(states), message);
                return;
            }
        }
    }
}

/// The last reading at or before a time.
fn before(readings: &[ImuReading], time_s: f64) -> Option<&ImuReading> {
    let time_ns = (time_s * 1e9).round() as i64;
    let after = readings.partition_point(|reading| reading.time_ns <= time_ns);
    readings[..after].last()
}
