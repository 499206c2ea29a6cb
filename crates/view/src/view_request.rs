//! What is asked of the view, and the config whose first frame that is.

use std::str::FromStr;

use nemoral_pipeline::config::{
    Camera, CameraFov, CameraLens, CameraOptics, Config, PathStations, PathWander, RobotPath,
};
use nemoral_scene::glam::DVec2;

use crate::Error;

/// Where somebody stands and looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Position on the map, metres: east, north.
    pub position_m: DVec2,
    /// Direction, clockwise from north.
    pub heading_deg: f64,
    /// Downwards.
    pub pitch_deg: f64,
    /// Height of the eye above the ground.
    pub eye_m: f64,
}

/// What is shown of the forest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageKind {
    /// The picture of the camera.
    Colour,
    /// Classes at the centres of pixels.
    Classes,
    /// Instances.
    Instances,
    /// Depth.
    Depth,
    /// Normals.
    Normals,
    /// A scan of the first LiDAR, from behind and above.
    Lidar,
}

impl ImageKind {
    /// All of them with their names.
    pub const ALL: [(Self, &'static str); 6] = [
        (Self::Colour, "colour"),
        (Self::Classes, "classes"),
        (Self::Instances, "instances"),
        (Self::Depth, "depth"),
        (Self::Normals, "normals"),
        (Self::Lidar, "lidar"),
    ];
}

impl FromStr for ImageKind {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let found = Self::ALL.iter().find(|(_, name)| *name == text);
        let names = Self::ALL.map(|(_, name)| name).join(", ");
        let refused = || Error::value("map", text, format!("one of {names}"));
        found.map(|(kind, _)| *kind).ok_or_else(refused)
    }
}

/// An image that is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewRequest {
    /// From where.
    pub viewpoint: Viewpoint,
    /// Of what.
    pub kind: ImageKind,
    /// Columns and rows.
    pub size_px: (u32, u32),
    /// Whether whoever asks holds still, so that there is time for a whole picture. A draft is made
    /// while they move.
    pub still: bool,
    /// Who asks: a page has a number of its own.
    pub viewer: u64,
}

/// The smallest and the largest side of a picture, pixels.
pub const SIDES_PX: (u32, u32) = (16, 2560);

impl ViewRequest {
    /// # Errors
    /// [`Error::Value`], if a number is not in its range.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let p = &self.viewpoint;
        let numbers = [
            ("x", p.position_m.x, 1e7),
            ("y", p.position_m.y, 1e7),
            ("heading", p.heading_deg, 360.0),
            ("pitch", p.pitch_deg, 90.0),
        ];
        for (name, value, most) in numbers {
            if !(-most..=most).contains(&value) {
                return Err(Error::value(name, value, format!("-{most} to {most}")));
            }
        }
        if !(0.05..=50.0).contains(&p.eye_m) {
            return Err(Error::value("eye", p.eye_m, "0.05 to 50 m"));
        }
        let (least, most) = SIDES_PX;
        for (name, side) in [("width", self.size_px.0), ("height", self.size_px.1)] {
            if !(least..=most).contains(&side) {
                return Err(Error::value(name, side, format!("{least} to {most}")));
            }
        }
        Ok(())
    }
}

/// The config whose frame 0 is what is seen: one level station with the camera at the eye, where
/// nothing moves: no walker sways and no inertial unit measures. All else is as it was.
pub(crate) fn this_view(config: &Config, viewpoint: &Viewpoint, size_px: (u32, u32)) -> Config {
    let mut seen = stand_at(config, viewpoint);
    seen.frames = 1;
    seen.robot.clearance_m = 0.0;
    let mut station = PathStations::default();
    (station.columns, station.rows) = (1, 1);
    // A station is moved by up to a third of this to keep clear, which is not at all.
    station.distance_m = 0.1;
    seen.robot.path = RobotPath::Stations(station);
    seen.robot.gait.step_m = 0.0;
    seen.imu.enabled = false;
    seen.balance.targets.clear();
    let camera = &mut seen.camera;
    camera.enabled = true;
    (camera.mount_x_m, camera.mount_y_m, camera.mount_yaw_deg) = (0.0, 0.0, 0.0);
    camera.mount_z_m = viewpoint.eye_m;
    (camera.mount_pitch_deg, camera.mount_roll_deg) = (viewpoint.pitch_deg, 0.0);
    resize(camera, size_px);
    seen
}

/// The config of a drive that begins there, with the sensors as they are on the robot.
pub(crate) fn drive_from(config: &Config, viewpoint: &Viewpoint) -> Config {
    let mut drive = stand_at(config, viewpoint);
    if matches!(
        drive.robot.path,
        RobotPath::File(_) | RobotPath::Stations(_) | RobotPath::Lanes(_) | RobotPath::Flight(_)
    ) {
        drive.robot.path = RobotPath::Wander(PathWander::default());
    }
    drive
}

fn stand_at(config: &Config, viewpoint: &Viewpoint) -> Config {
    let mut there = config.clone();
    there.sequences = 1;
    there.robot.start_x_m = viewpoint.position_m.x;
    there.robot.start_y_m = viewpoint.position_m.y;
    there.robot.heading_deg = viewpoint.heading_deg;
    there
}

/// Gives a camera another number of pixels.
///
/// One that is described by its field of view alone may have any shape: that field is what the
/// longer side sees. Other cameras keep their shape, and the width decides.
fn resize(camera: &mut Camera, (width, height): (u32, u32)) {
    let (old_width, old_height) = (f64::from(camera.width_px), f64::from(camera.height_px));
    let angle = match (&camera.optics, &camera.lens) {
        (CameraOptics::Fov(fov), CameraLens::Pinhole(_)) => Some(fov.horizontal_deg.to_radians()),
        (CameraOptics::Sensor(s), CameraLens::Pinhole(_)) => {
            Some(2.0 * libm::atan(s.width_mm / 2.0 / s.focal_length_mm))
        }
        _ => None,
    };
    camera.width_px = width;
    if let Some(angle) = angle {
        camera.height_px = height;
        let of_width = f64::from(width) / f64::from(width.max(height));
        let horizontal = 2.0 * libm::atan(libm::tan(angle / 2.0) * of_width);
        let mut fov = CameraFov::default();
        fov.horizontal_deg = horizontal.to_degrees().clamp(1.0, 179.0);
        camera.optics = CameraOptics::Fov(fov);
        return;
    }
    let scale = f64::from(width) / old_width;
    camera.height_px = ((old_height * scale).round() as u32).clamp(SIDES_PX.0, 8192);
    if let CameraOptics::Calibration(c) = &mut camera.optics {
        for length_px in [&mut c.fx_px, &mut c.fy_px, &mut c.cx_px, &mut c.cy_px] {
            *length_px *= scale;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_pipeline::config::{CameraBrownConrady, CameraCalibration, CameraSensor};

    const VIEWPOINT: Viewpoint = Viewpoint {
        position_m: DVec2::new(12.25, -7.5),
        heading_deg: 30.0,
        pitch_deg: -4.0,
        eye_m: 1.7,
    };

    #[test]
    fn the_longer_side_has_the_field_of_view() {
        let mut camera = Camera::default();
        resize(&mut camera, (1280, 720));
        assert_eq!(
            camera,
            Camera::default(),
            "nothing changes for its own size"
        );
        resize(&mut camera, (360, 720));
        let fov = camera.intrinsics().unwrap().horizontal_fov_rad();
        assert!(((fov / 2.0).tan() - 40_f64.to_radians().tan() / 2.0).abs() < 1e-9);
        camera.optics = CameraOptics::Sensor(CameraSensor::default());
        let before = camera.intrinsics().unwrap().horizontal_fov_rad();
        resize(&mut camera, (640, 360));
        let after = camera.intrinsics().unwrap().horizontal_fov_rad();
        assert!((before - after).abs() < 1e-9);
    }

    #[test]
    fn calibrated_and_distorted_cameras_keep_their_shape() {
        let mut calibrated = Camera::default();
        calibrated.optics = CameraOptics::Calibration(CameraCalibration::default());
        let mut distorted = Camera::default();
        distorted.lens = CameraLens::BrownConrady(CameraBrownConrady::default());
        for mut camera in [calibrated, distorted] {
            let before = camera.intrinsics().unwrap();
            resize(&mut camera, (320, 999));
            let after = camera.intrinsics().unwrap();
            assert_eq!((after.width, after.height), (320, 180));
            assert!((4.0 * after.fx - before.fx).abs() < 1e-9);
            assert!((4.0 * after.cy - before.cy).abs() < 1e-9);
            assert_eq!(after.distortion, before.distortion);
        }
    }

    #[test]
    fn both_configs_are_allowed() {
        let config = Config::default();
        for made in [
            this_view(&config, &VIEWPOINT, (800, 450)),
            drive_from(&config, &VIEWPOINT),
        ] {
            assert_eq!(Config::from_toml(&made.to_toml()).unwrap(), made);
            assert_eq!(
                (made.robot.start_x_m, made.robot.heading_deg),
                (12.25, 30.0)
            );
        }
        assert_eq!(drive_from(&config, &VIEWPOINT).camera, config.camera);
        // What moves on a path has no place at a station.
        for path in ["wander", "lanes", "straight"] {
            let moving =
                format!("[imu]\nenabled = true\n[robot.gait]\nstep_m = 0.65\n[robot.{path}]\n");
            let moving = Config::from_toml(&moving).unwrap();
            for made in [
                this_view(&moving, &VIEWPOINT, (800, 450)),
                drive_from(&moving, &VIEWPOINT),
            ] {
                assert_eq!(Config::from_toml(&made.to_toml()).unwrap(), made);
            }
        }
    }

    #[test]
    fn impossible_requests_are_refused() {
        let request = ViewRequest {
            viewpoint: VIEWPOINT,
            kind: ImageKind::Colour,
            size_px: (480, 270),
            still: false,
            viewer: 1,
        };
        assert!(request.check().is_ok());
        let with = |change: fn(&mut ViewRequest)| {
            let mut changed = request;
            change(&mut changed);
            changed.check().expect_err("impossible").to_string()
        };
        assert!(with(|r| r.viewpoint.position_m.x = f64::NAN).contains("x = NaN"));
        assert!(with(|r| r.viewpoint.position_m.y = 1e9).contains("-10000000 to"));
        assert!(with(|r| r.viewpoint.heading_deg = 361.0).contains("heading = 361"));
        assert!(with(|r| r.viewpoint.pitch_deg = -91.0).contains("pitch"));
        assert!(with(|r| r.viewpoint.eye_m = 0.0).contains("0.05 to 50"));
        assert!(with(|r| r.size_px.0 = 100_000).contains("width = 100000"));
        assert!(
            "truth"
                .parse::<ImageKind>()
                .unwrap_err()
                .to_string()
                .contains("colour, classes")
        );
    }
}
