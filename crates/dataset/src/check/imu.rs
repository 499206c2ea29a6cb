//! Checks the files of a sequence's inertial measurement unit.

use nemoral_scene::RigidTransform;

use super::Checker;
use super::drive::Drive;
use crate::formats::kitti;
use crate::{ImuReading, TrackRecord, layout};

/// How far the unit may be from where `poses.txt` has it, metres and degrees, besides half of what
/// it moves more between two readings.
const OFF_M: f64 = 0.01;
const OFF_DEG: f64 = 0.1;
const OF_STEP: f64 = 1.5;

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
        let [Some(first_s), Some(last_s)] = [drive.times.first(), drive.times.last()] else {
            return;
        };
        let [first_ns, last_ns] = [first_s, last_s].map(|time_s| (time_s * 1e9).round() as i64);
        let last_s = last_s - first_s;
        let intervals = (last_s * imu.rate_hz + 1e-6).floor() as usize;
        let wanted = intervals.saturating_add(1);
        // It goes on until the last scan has ended.
        let found = readings.partition_point(|reading| reading.time_ns <= last_ns);
        let begins = readings
            .first()
            .is_some_and(|reading| reading.time_ns == first_ns);
        if found != wanted || !begins {
            let message = format!(
                "has {found} samples from the first frame to the last: {wanted} are made in \
                 {last_s} s at {} Hz, the first with the first frame",
                imu.rate_hz
            );
            self.problem(path(samples), message);
            return;
        }
        let world_from_frame0 = kitti::from_rows(&track.world_from_frame0);
        let reference_from_imu = spec.body_from_reference().inverse() * imu.body_from_imu;
        for (k, (pose, time_s)) in drive.poses.iter().zip(&drive.times).enumerate() {
            let asked = world_from_frame0 * *pose * reference_from_imu;
            if let Some((off_m, off_deg)) = deviation(&readings, *time_s, &asked) {
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

/// How far a unit is from where it should be at a time, metres and degrees, if it is farther than
/// it moves between two readings.
fn deviation(readings: &[ImuReading], time_s: f64, asked: &RigidTransform) -> Option<(f64, f64)> {
    let [before, after] = around(readings, time_s)?;
    let apart = |a: &RigidTransform, b: &RigidTransform| {
        let degrees = a.rotation.angle_between(b.rotation).to_degrees();
        (a.translation_m.distance(b.translation_m), degrees)
    };
    let (step_m, step_deg) = apart(&before, &after);
    let (off_m, off_deg) = apart(&before, asked);
    let is_off = off_m > OFF_M + OF_STEP * step_m || off_deg > OFF_DEG + OF_STEP * step_deg;
    is_off.then_some((off_m, off_deg))
}

/// The poses of the last reading at or before a time, and of the next one; after the last reading,
/// of the one before that.
fn around(readings: &[ImuReading], time_s: f64) -> Option<[RigidTransform; 2]> {
    let time_ns = (time_s * 1e9).round() as i64;
    let next = readings.partition_point(|reading| reading.time_ns <= time_ns);
    let before = next.checked_sub(1)?;
    let other = readings.get(next).or(readings.get(before.wrapping_sub(1)));
    let other = other.unwrap_or(&readings[before]);
    Some([readings[before].world_from_imu, other.world_from_imu])
}

#[cfg(test)]
mod tests {
    use nemoral_scene::glam::DVec3;

    use super::*;

    /// Two hundred readings a second of a robot that turns on the spot while it drives.
    fn drive(speed_m_s: f64, turn_deg_s: f64) -> impl Fn(f64) -> RigidTransform {
        move |time_s| {
            let at_m = DVec3::new(speed_m_s * time_s, 3.0, 0.5);
            RigidTransform::from_xyz_rpy(at_m, 0.0, 0.0, (turn_deg_s * time_s).to_radians())
        }
    }

    fn readings(pose: impl Fn(f64) -> RigidTransform) -> Vec<ImuReading> {
        let reading = |i: i64| ImuReading {
            time_ns: 5_000_000 * i,
            angular_rate_rad_s: DVec3::ZERO,
            specific_force_m_s2: DVec3::ZERO,
            world_from_imu: pose(0.005 * i as f64),
            velocity_m_s: DVec3::ZERO,
            gyroscope_bias_rad_s: DVec3::ZERO,
            accelerometer_bias_m_s2: DVec3::ZERO,
        };
        (0..20).map(reading).collect()
    }

    #[test]
    fn fast_turns_between_readings_are_no_fault_and_offsets_are() {
        for (speed_m_s, turn_deg_s) in [(0.0, 0.0), (1.0, 20.0), (6.0, 540.0), (30.0, 2700.0)] {
            let pose = drive(speed_m_s, turn_deg_s);
            let readings = readings(&pose);
            // Also a little after the last reading.
            for time_s in [0.0, 0.0033, 0.05, 0.0499, 0.0983] {
                assert_eq!(
                    deviation(&readings, time_s, &pose(time_s)),
                    None,
                    "{speed_m_s}"
                );
                let step_m = 0.005 * speed_m_s;
                let mut aside = pose(time_s);
                aside.translation_m.y += 0.02 + 2.0 * step_m;
                assert!(
                    deviation(&readings, time_s, &aside).is_some(),
                    "{speed_m_s}"
                );
            }
        }
        let one = &readings(drive(1.0, 0.0))[..1];
        assert_eq!(deviation(one, 0.0, &one[0].world_from_imu), None);
        assert_eq!(deviation(&[], 0.0, &RigidTransform::IDENTITY), None);
    }
}
