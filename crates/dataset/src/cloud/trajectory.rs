//! Where the scanners were: a table beside a cloud.

use std::path::Path;

use nemoral_scene::RigidTransform;
use nemoral_scene::glam::{DVec2, DVec3};

use super::point::source_id;
use super::{Cloud, CloudFormat};
use crate::Error;
use crate::formats::tables::rounded;

const COLUMNS: &str = "gps_time,x_m,y_m,z_m,roll_deg,pitch_deg,heading_deg,point_source_id,lidar";

impl Cloud {
    /// Writes where each scanner was at each frame as a CSV, by the poses of the cloud, and returns
    /// how many rows there are: those of the whole sequence, in the order of frames and LiDARs,
    /// whatever is cropped.
    ///
    /// Times, which are the middles of scans, and places are those of a cloud of this format:
    /// `gps_time` is on the clock of LAZ's or of PLY's `time`, in steps of a nanosecond, and `x_m`,
    /// `y_m`, `z_m` are in steps of 0.1 mm. `point_source_id` is
    /// [`CloudPoint::source_id`](crate::CloudPoint::source_id), `lidar` the scanner's number: LAZ's
    /// `user_data`, from 1, or PLY's `lidar`, from 0.
    ///
    /// Angles are those of the body, which carries the scanners, in steps of a millionth of a
    /// degree: `heading_deg` is that of its forward axis, clockwise from north, 0 to 360;
    /// `pitch_deg` is positive if that axis points down; `roll_deg` if the right side is the lower
    /// one. The body turns by the heading first and by the roll last (REP-103, but for the
    /// heading). The file appears when it is whole.
    ///
    /// # Errors
    /// As [`check_name`](Self::check_name), and if it cannot be written.
    pub fn write_trajectory(&self, out: &Path, format: CloudFormat) -> Result<usize, Error> {
        self.check_name(out, "csv")?;
        let (shift_s, first) = match format {
            CloudFormat::Ply => (0.0, 0),
            CloudFormat::Laz => (self.las_time_shift_s(), 1),
        };
        let mut text = format!("{COLUMNS}\n");
        let mut count = 0;
        for frame in self.frames() {
            let world_from_body = self.world_from_body(frame);
            let time_s = rounded(frame.time_s + shift_s, 1e9);
            let [roll, pitch, heading] = attitude_deg(&world_from_body);
            let line = self.line_of(frame);
            for (i, lidar) in self.spec().lidars.iter().enumerate() {
                let world_m = world_from_body.transform_point(lidar.body_from_lidar.translation_m);
                let place_m = self.place_m(format, world_m).to_array();
                let [x, y, z] = place_m.map(|m| rounded(m, 1e4));
                let source = source_id(line, self.scan_number(frame, i));
                let number = first + i;
                let angles = format!("{roll},{pitch},{heading}");
                text += &format!("{time_s},{x},{y},{z},{angles},{source},{number}\n");
                count += 1;
            }
        }
        nemoral_files::write(out, text.as_bytes())?;
        Ok(count)
    }
}

/// Roll, pitch and heading of a body, degrees.
fn attitude_deg(world_from_body: &RigidTransform) -> [f64; 3] {
    /// A forward axis that is this near to the vertical has no heading.
    const LEAST_LEVEL: f64 = 1e-9;
    let [forward, left, up] =
        [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| world_from_body.transform_vector(axis));
    let level = forward.truncate();
    let pitch = DVec2::new(level.length(), -forward.z).to_angle();
    // The angle from north to east.
    let clockwise = |direction: DVec2| DVec2::new(direction.y, direction.x).to_angle();
    let (roll, heading) = if level.length() < LEAST_LEVEL {
        // As if it did not roll.
        (0.0, clockwise(DVec2::new(left.y, -left.x)))
    } else {
        (DVec2::new(up.z, left.z).to_angle(), clockwise(level))
    };
    let degrees = |radians: f64| rounded(radians.to_degrees(), 1e6);
    [
        degrees(roll),
        degrees(pitch),
        degrees(heading).rem_euclid(360.0),
    ]
}

#[cfg(test)]
mod tests {
    use nemoral_scene::glam::{DMat3, DQuat};

    use super::*;

    #[test]
    fn angles_are_those_by_which_a_body_was_turned() {
        for (roll, pitch, heading) in [
            (0.0, 0.0, 0.0),
            (0.0, 0.0, 90.0),
            (5.0, -3.0, 10.0),
            (-170.0, 60.0, 350.0),
            (20.0, 2.0, 180.0),
        ] {
            let [r, p, h]: [f64; 3] = [roll, pitch, heading].map(f64::to_radians);
            let yaw = std::f64::consts::FRAC_PI_2 - h;
            let pose = RigidTransform::from_xyz_rpy(DVec3::ONE, r, p, yaw);
            let found = attitude_deg(&pose);
            let near = |a: f64, b: f64| (a - b).abs() < 2e-6 || (a - b).abs() > 360.0 - 2e-6;
            assert!(
                near(found[0], roll) && near(found[1], pitch) && near(found[2], heading),
                "{found:?}, not {roll} {pitch} {heading}"
            );
        }
    }

    #[test]
    fn a_body_that_looks_straight_down_does_not_roll() {
        // Its left side is in the west.
        let axes = DMat3::from_cols(-DVec3::Z, -DVec3::X, DVec3::Y);
        let pose = RigidTransform {
            rotation: DQuat::from_mat3(&axes),
            translation_m: DVec3::ZERO,
        };
        assert_eq!(attitude_deg(&pose), [0.0, 90.0, 0.0]);
    }
}
