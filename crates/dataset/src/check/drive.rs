//! Checks `poses.txt`, `times.txt` and `calib.txt` against `dataset.json`.

use nemoral_scene::{Distortion, RigidTransform};

use super::Checker;
use crate::formats::kitti;
use crate::{Calibration, CameraCalibration, TrackRecord, layout};

/// The content of a sequence's poses, times and calibration.
pub(super) struct Drive {
    pub(super) poses: Vec<RigidTransform>,
    pub(super) times: Vec<f64>,
    pub(super) camera_from_lidar: RigidTransform,
}

impl Checker<'_> {
    /// Compares `poses.txt`, `calib.txt` and `times.txt` of a sequence with `dataset.json`.
    pub(super) fn drive(&mut self, track: &TrackRecord) -> Option<Drive> {
        let number = track.sequence;
        let path = |name| layout::sequence_file(number, name);
        let (poses, times, calib) = (
            path(layout::POSES),
            path(layout::TIMES),
            path(layout::CALIB),
        );
        let read = (
            self.read(&poses, self.dataset.poses(number)),
            self.read(&times, self.dataset.times(number)),
            self.read(&calib, self.dataset.calibration(number)),
        );
        let (Some(pose_list), Some(time_list), Some(calibration)) = read else {
            let name = layout::sequence_folder(number);
            self.problem(name, "its frames cannot be checked without these files");
            return None;
        };
        for (path, lines) in [(&poses, pose_list.len()), (&times, time_list.len())] {
            if lines as u64 != track.length {
                let message = format!("has {lines} lines, the sequence {} frames", track.length);
                self.problem(path, message);
            }
        }
        let estimated = path(layout::ESTIMATED_POSES);
        self.read(&estimated, self.dataset.estimated_poses(number));
        let copy = layout::kitti_poses(number);
        if let Some(text) = self.read(&copy, self.dataset.read_text(&copy))
            && Some(text) != self.dataset.read_text(&poses).ok()
        {
            self.problem(copy, format!("differs from {poses}"));
        }
        let camera_from_lidar = kitti::from_rows(&calibration.camera_from_lidar);
        if let Some(sequence) = self.dataset.manifest().header.sequence(number) {
            self.calibration(&calib, &Calibration::of(sequence), &calibration);
        }
        Some(Drive {
            poses: pose_list,
            times: time_list,
            camera_from_lidar,
        })
    }

    /// Compares `calib.txt` with the intrinsics and mounts of `dataset.json`.
    fn calibration(&mut self, path: &str, asked: &Calibration, found: &Calibration) {
        let mut mount = |name: &str, asked: &kitti::Rows, found: &kitti::Rows| {
            if let Some(distance) = differs(&kitti::from_rows(asked), &kitti::from_rows(found)) {
                let message = format!("{name} is {distance} off the mounts in dataset.json");
                self.problem(path, message);
            }
        };
        mount("Tr", &asked.camera_from_lidar, &found.camera_from_lidar);
        for (asked, found) in asked.further.iter().zip(&found.further) {
            let name = format!("Tr_{}", asked.name);
            mount(&name, &asked.camera_from_lidar, &found.camera_from_lidar);
        }
        for (asked, found) in asked.further_lidars.iter().zip(&found.further_lidars) {
            let name = format!("Tr_{}", asked.name);
            mount(&name, &asked.camera_from_lidar, &found.camera_from_lidar);
        }
        let lidars = |c: &Calibration| -> Vec<String> {
            c.further_lidars.iter().map(|l| l.name.clone()).collect()
        };
        if lidars(asked) != lidars(found) {
            let message = "the lines Tr_NAME differ from the further LiDARs in dataset.json";
            self.problem(path, message);
        }
        let lenses = |c: &Calibration| -> Vec<Distortion> {
            let of_further = c.further.iter().map(|c| c.distortion);
            std::iter::once(c.distortion).chain(of_further).collect()
        };
        if lenses(asked) != lenses(found) {
            self.problem(
                path,
                "the lines D or F differ from the lenses in dataset.json",
            );
        }
        if asked.projections != found.projections {
            self.problem(path, "P0 to P3 differ from the cameras in dataset.json");
        }
        let lines = |c: &Calibration| -> Vec<(String, kitti::Rows)> {
            let line = |c: &CameraCalibration| (c.name.clone(), c.projection);
            c.further.iter().map(line).collect()
        };
        if lines(asked) != lines(found) {
            let message = "the lines P_NAME differ from the further cameras in dataset.json";
            self.problem(path, message);
        }
    }
}

/// The difference of two transforms, in words, if it is more than rounding can explain.
pub(super) fn differs(a: &RigidTransform, b: &RigidTransform) -> Option<String> {
    let distance = a.translation_m.distance(b.translation_m);
    let angle = a.rotation.angle_between(b.rotation).to_degrees();
    // An angle near 0 comes from an arc cosine near 1, which loses half of the digits.
    (distance > 1e-5 || angle > 1e-5).then(|| format!("{distance:.4} m and {angle:.4}°"))
}
