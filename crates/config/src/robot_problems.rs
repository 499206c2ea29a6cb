//! Combinations of the robot's keys that are impossible, though each value alone is allowed.

use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, ObjectId};

use super::validate::Problems;
use super::{Config, InputFiles, PathFlight, PathLanes, RobotPath};

/// The most frames of a sequence.
const FRAMES_MAX: u64 = 10_000_000;

/// The most steps of a gait in a second, as runners take; `PoseTrack` has 160 poses in it.
const STEPS_HZ: f64 = 5.0;

impl Config {
    pub(super) fn robot_problems(&self, inputs: &InputFiles, out: &mut Problems) {
        let r = &self.robot;
        if r.spacing_m == 0.0 && r.spacing_s == 0.0 {
            out.add(
                "robot.spacing_m",
                " = 0 and robot.spacing_s = 0: one must be above 0",
            );
        }
        self.frame_number_problems(inputs, out);
        match &r.path {
            RobotPath::Flight(flight) => self.flight_problems(flight, out),
            RobotPath::Lanes(lanes) => self.lane_problems(lanes, inputs, out),
            _ => {}
        }
        self.gait_problems(out);
        let start_m = DVec2::new(r.start_x_m, r.start_y_m);
        let start = ChunkCoord::containing(start_m, self.chunks.size_m);
        let has_ids = |dx, dy| ObjectId::new(start.offset(dx, dy), 1).is_some();
        if !has_ids(20_000, 20_000) || !has_ids(-20_000, -20_000) {
            let message = format!(
                " = {}, robot.start_y_m = {}: ids reach chunk ±2,097,151, and that is chunk \
                 {start}",
                r.start_x_m, r.start_y_m
            );
            out.add("robot.start_x_m", &message);
        }
    }

    fn frame_number_problems(&self, inputs: &InputFiles, out: &mut Problems) {
        let path = &self.robot.path;
        if let RobotPath::File(file) = path
            && file.path.is_empty()
        {
            out.refuse("robot.file.path", "\"\"", "name a file of poses");
        } else if self.frames == 0 {
            match self.robot.places(inputs) {
                Ok(_) => {
                    let must = "be at least 1, but with [robot.stations], [robot.lanes], \
                                [robot.flight] or the poses of [robot.file], of which 0 is all";
                    out.refuse("frames", 0, must);
                }
                Err(e) => out.add("robot.file.path", &format!(": {e}")),
            }
        } else if self.frames > FRAMES_MAX && matches!(path, RobotPath::File(_)) {
            let must = format!("be at most {FRAMES_MAX}: 0 is all places of the path");
            out.refuse("frames", self.frames, &must);
        }
    }

    fn flight_problems(&self, flight: &PathFlight, out: &mut Problems) {
        let r = &self.robot;
        let visible_m = self.chunks.visible_radius_m;
        if flight.height_m >= visible_m {
            let must = format!("be less than chunks.visible_radius_m = {visible_m}");
            out.refuse("robot.flight.height_m", flight.height_m, &must);
        }
        let lines = r.flight_lines(flight);
        if lines.frames() > FRAMES_MAX {
            too_many_frames("robot.flight", lines.frames(), out);
        } else if let Err(e) = lines.check() {
            let must = format!("be {}", e.allowed);
            out.refuse(&format!("robot.flight.{}", e.field), e.value, &must);
        }
        if r.rest_s > 0.0 {
            let must = "be 0 with [robot.flight]: a drone is in motion on its lines";
            out.refuse("robot.rest_s", r.rest_s, must);
        }
    }

    fn lane_problems(&self, path: &PathLanes, inputs: &InputFiles, out: &mut Problems) {
        match self.robot.lanes(path) {
            Ok(lanes) => {
                let most_m = lanes.most_amplitude_m();
                if path.amplitude_m > most_m {
                    let must = format!("be at most {most_m}: a fifth of robot.lanes.spacing_m");
                    out.refuse("robot.lanes.amplitude_m", path.amplitude_m, &must);
                }
            }
            Err(e) => out.add("robot.lanes", &format!(": {e}")),
        }
        let frames = self.robot.places(inputs).ok().flatten();
        too_many_frames("robot.lanes", frames.unwrap_or(0), out);
    }

    fn gait_problems(&self, out: &mut Problems) {
        let step_m = self.robot.gait.step_m;
        if step_m == 0.0 {
            return;
        }
        let unwalked = match &self.robot.path {
            RobotPath::Stations(_) => Some("robot.stations"),
            RobotPath::Flight(_) => Some("robot.flight"),
            RobotPath::File(_) => Some("robot.file"),
            _ if self.balance.is_on() => Some("balance.targets"),
            _ => None,
        };
        if let Some(key) = unwalked {
            let must = format!("be 0 with [{key}], along which nobody walks");
            out.refuse("robot.gait.step_m", step_m, &must);
        } else if step_m < 0.1 {
            out.refuse("robot.gait.step_m", step_m, "be 0 or at least 0.1");
        } else if self.robot.speed_m_s > STEPS_HZ * step_m {
            let must = format!(
                "be so long that there are at most {STEPS_HZ} steps a second with \
                 robot.speed_m_s = {}",
                self.robot.speed_m_s
            );
            out.refuse("robot.gait.step_m", step_m, &must);
        }
    }
}

/// Refuses a path with more frames than a sequence may have.
fn too_many_frames(path: &str, frames: u64, out: &mut Problems) {
    if frames > FRAMES_MAX {
        let message = format!(
            ": it has more than {FRAMES_MAX} frames: must have fewer, by a larger \
             robot.spacing_s or robot.spacing_m"
        );
        out.add(path, &message);
    }
}
