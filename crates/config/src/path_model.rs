//! Turns the robot's table into the pace and the parameters of its path.

use nemoral_scene::glam::DVec2;
use nemoral_trajectory::{
    AltitudeMode, FlightLinesParams, Lanes, LanesParams, PoseFormat, RecordedTrajectory,
    SpeedProfile, forward_of_heading, read_poses,
};

use super::{
    Error, FlightFollow, InputFile, InputFiles, PathFile, PathFlight, PathFormat, PathLanes, Robot,
    RobotPath,
};

impl Robot {
    /// Where the path starts on the map, metres.
    #[must_use]
    pub fn start_m(&self) -> DVec2 {
        DVec2::new(self.start_x_m, self.start_y_m)
    }

    /// The direction on the map of the heading, of length 1.
    #[must_use]
    pub fn forward(&self) -> DVec2 {
        forward_of_heading(self.heading_deg)
    }

    /// How far apart in space and time its poses are.
    #[must_use]
    pub fn pace(&self) -> SpeedProfile {
        SpeedProfile {
            spacing_m: self.spacing_m,
            spacing_s: self.spacing_s,
            speed_m_s: self.speed_m_s,
            rest_s: self.rest_s,
        }
    }

    /// The flight that a table asks for.
    #[must_use]
    pub fn flight_lines(&self, flight: &PathFlight) -> FlightLinesParams {
        FlightLinesParams {
            middle_m: self.start_m(),
            forward: self.forward(),
            length_m: flight.length_m,
            width_m: flight.width_m,
            margin_m: flight.margin_m,
            line_spacing_m: flight.line_spacing_m,
            is_crossed: flight.crossed,
            height_m: flight.height_m,
            follow: match flight.follow {
                FlightFollow::Ground => AltitudeMode::Ground,
                FlightFollow::Level => AltitudeMode::Level,
            },
            speed_m_s: self.speed_m_s,
            step_s: self.pace().step_s(),
            turn_s: flight.turn_s,
            sway_rad: flight.sway_deg.to_radians(),
        }
    }

    /// The lanes that a table asks for.
    ///
    /// # Errors
    /// If there are too many of them.
    pub fn lanes(&self, lanes: &PathLanes) -> Result<Lanes, Error> {
        let lanes = Lanes::new(LanesParams {
            middle_m: self.start_m(),
            forward: self.forward(),
            length_m: lanes.length_m,
            width_m: lanes.width_m,
            spacing_m: lanes.spacing_m,
        });
        lanes.map_err(|e| Error::request(format!("robot.lanes.{e}")))
    }

    /// The poses of a file.
    ///
    /// # Errors
    /// If it has no poses.
    pub fn recording(
        &self,
        file: &PathFile,
        inputs: &InputFiles,
    ) -> Result<RecordedTrajectory, Error> {
        let origin = file.path.as_str();
        let text = inputs.get(&file.path).map_or(Ok(""), InputFile::text)?;
        let format = match file.format {
            PathFormat::Tum => PoseFormat::Tum,
            PathFormat::Kitti => PoseFormat::Kitti,
        };
        read_poses(text, origin, format)
            .and_then(|poses| {
                RecordedTrajectory::new(poses, self.pace().step_s(), file.on_ground, origin)
            })
            .map_err(|e| Error::request(e.to_string()))
    }

    /// The number of places of a path that ends; `None` for one that does not.
    ///
    /// # Errors
    /// If a file is not poses, or lanes are too many.
    pub(super) fn places(&self, inputs: &InputFiles) -> Result<Option<u64>, Error> {
        Ok(match &self.path {
            RobotPath::Stations(grid) => Some(u64::from(grid.columns) * u64::from(grid.rows)),
            RobotPath::Flight(flight) => Some(self.flight_lines(flight).frames()),
            RobotPath::Lanes(lanes) => {
                let length_m = self.lanes(lanes)?.length_m();
                Some(self.pace().frames_in_m(length_m))
            }
            RobotPath::File(file) => Some(self.recording(file, inputs)?.count()),
            RobotPath::Trail(_) | RobotPath::Wander(_) | RobotPath::Straight(_) => None,
        })
    }
}
