//! How the body moves at each frame.

use nemoral_dataset::{ImuReading, ImuSpec, TrackRecord};
use nemoral_scene::glam::DVec3;
use nemoral_scene::{RigidTransform, Twist, rotation_vector};

use super::cdr::Cdr;
use super::{BODY, MAP, time_ns};
use crate::FrameRef;

/// The variance of a velocity that is not known.
const UNKNOWN: f64 = 1e6;

/// `Odometry`: the true pose, and the motion in the body's own axes, if it is known.
pub(super) fn message(frame: &FrameRef<'_>, twist: Option<&Twist>) -> Vec<u8> {
    let mut variances = [0.0; 36];
    if twist.is_none() {
        for axis in 0..6 {
            variances[7 * axis] = UNKNOWN;
        }
    }
    let twist = twist.unwrap_or(&Twist::STILL);
    let mut out = Cdr::new();
    out.header(time_ns(frame), MAP)
        .text(BODY)
        .pose(&frame.world_from_body());
    // Poses are the truth.
    out.f64s(&[0.0; 36]);
    out.f64s(&twist.linear_m_s.to_array());
    out.f64s(&twist.angular_rad_s.to_array());
    out.f64s(&variances);
    out.finish()
}

/// What tells how the body moves.
pub(in crate::formats) struct Motion<'a> {
    /// The frames that exist.
    pub(in crate::formats) frames: &'a [FrameRef<'a>],
    /// What is known of the poses of their sequence.
    pub(in crate::formats) track: Option<&'a TrackRecord>,
    /// The inertial measurement unit with its readings, if there is one.
    pub(in crate::formats) unit: Option<(&'a ImuSpec, &'a [ImuReading])>,
}

impl Motion<'_> {
    /// The motion at a frame, in the body's own axes then: that of the inertial unit's true states,
    /// or the mean motion from the frame before to the next one.
    pub(in crate::formats) fn at(&self, i: usize) -> Option<Twist> {
        self.of_states(i).or_else(|| self.of_neighbours(i))
    }

    /// The mean motion between the neighbours of a frame, if these exist. At the ends of a drive,
    /// and of a flight line, the frame itself stands for the missing one.
    fn of_neighbours(&self, i: usize) -> Option<Twist> {
        let track = self.track?;
        let here = &self.frames[i];
        let frame = |k: usize, index: u64| self.frames.get(k).filter(|f| f.index == index);
        let before = match here.index.checked_sub(1) {
            Some(index) if track.goes_on_after(index) => frame(i.checked_sub(1)?, index)?,
            _ => here,
        };
        let after = if track.goes_on_after(here.index) {
            frame(i + 1, here.index + 1)?
        } else {
            here
        };
        let duration_s = after.time_s - before.time_s;
        if duration_s <= 0.0 {
            return None;
        }
        let (first, last) = (before.world_from_body(), after.world_from_body());
        let back = here.world_from_body().rotation.inverse();
        Some(Twist {
            linear_m_s: back * (last.translation_m - first.translation_m) / duration_s,
            angular_rad_s: back * turn(&first, &last) / duration_s,
        })
    }

    /// The motion by the true states of the unit around a frame.
    fn of_states(&self, i: usize) -> Option<Twist> {
        let (unit, readings) = self.unit?;
        let frame = &self.frames[i];
        let time_ns = (frame.time_s * 1e9).round() as i64;
        let last = readings.len().checked_sub(2)?;
        let after = readings.partition_point(|reading| reading.time_ns <= time_ns);
        // A unit may end a little before the drive.
        let k = after.saturating_sub(1).min(last);
        let (a, b) = (&readings[k], &readings[k + 1]);
        let share = (time_ns - a.time_ns) as f64 / (b.time_ns - a.time_ns) as f64;
        if !(0.0..=2.0).contains(&share) {
            return None;
        }
        let rate = rate(readings, k).lerp(rate(readings, k + 1), share);
        let velocity = a.velocity_m_s.lerp(b.velocity_m_s, share);
        let back = frame.world_from_body().rotation.inverse();
        let angular_rad_s = back * rate;
        // The unit swings about the body's origin.
        let swing = angular_rad_s.cross(unit.body_from_imu.translation_m);
        Some(Twist {
            linear_m_s: back * velocity - swing,
            angular_rad_s,
        })
    }
}

/// The true angular rate at a reading, in the world's axes, by the readings around it.
fn rate(readings: &[ImuReading], k: usize) -> DVec3 {
    let first = &readings[k.saturating_sub(1)];
    let last = &readings[(k + 1).min(readings.len() - 1)];
    let duration_s = (last.time_ns - first.time_ns) as f64 * 1e-9;
    turn(&first.world_from_imu, &last.world_from_imu) / duration_s
}

/// The rotation from one pose to another, less than half a turn, as an axis in the world times an
/// angle.
fn turn(first: &RigidTransform, last: &RigidTransform) -> DVec3 {
    rotation_vector(last.rotation * first.rotation.inverse())
}
