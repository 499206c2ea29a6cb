//! The pair of cameras that disparities are about.

use nemoral_dataset::CameraSpec;
use nemoral_scene::Distortion;

use super::unsuitable;
use crate::Error;
use crate::formats::stereo;

/// A rectified pair.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rig {
    /// Where the right camera stands among the cameras; the left one is the first.
    pub(super) right: usize,
    fx: f64,
    /// How far it is to the right, metres.
    pub(super) baseline_m: f64,
}

impl Rig {
    /// The pair of a sequence's cameras, or why it has none.
    pub(super) fn of(sequence: u32, cameras: &[CameraSpec]) -> Result<Self, String> {
        let Some(right) = stereo::right(cameras) else {
            return Err(format!(
                "sequence {sequence:02} has no second camera called 'right' ([cameras.right] with \
                 a mount_y_m of its own)"
            ));
        };
        let [l, r] = [&cameras[0], &cameras[right]];
        if r.intrinsics.distortion != Distortion::None {
            return Err(format!(
                "camera 'right' of sequence {sequence:02} has a lens (cameras.right without \
                 brown_conrady and fisheye)"
            ));
        }
        if r.shutter.readout_s != 0.0 {
            return Err(format!(
                "camera 'right' of sequence {sequence:02} has a rolling shutter \
                 (cameras.right.shutter.readout_ms = 0)"
            ));
        }
        // Disparity is inverse to depth only if both have the same centre, too.
        let has_one_centre = (l.intrinsics.cx - r.intrinsics.cx).abs() < 1e-9;
        match stereo::baseline_m(l, r).filter(|_| has_one_centre) {
            Some(baseline_m) => Ok(Self {
                right,
                fx: l.intrinsics.fx,
                baseline_m,
            }),
            None => Err(format!(
                "cameras '{}' and 'right' of sequence {sequence:02} are not a rectified pair \
                 (parallel axes, beside one another along the first camera's x; the same size, \
                 fx, fy, cx and cy)",
                l.name
            )),
        }
    }

    /// The disparity of a depth, pixels.
    pub(super) fn disparity_px(&self, depth_m: f64) -> f64 {
        self.fx * self.baseline_m / depth_m
    }
}

/// Refuses a first camera whose pictures the benchmark has no place for.
pub(super) fn refuse_distorted(sequence: u32, camera: &CameraSpec) -> Result<(), Error> {
    let name = &camera.name;
    if camera.intrinsics.distortion != Distortion::None {
        return Err(unsuitable(format!(
            "camera '{name}' of sequence {sequence:02} has a lens, and the benchmark's pictures \
             are rectified; make the data set without brown_conrady and fisheye"
        )));
    }
    if camera.shutter.readout_s != 0.0 {
        return Err(unsuitable(format!(
            "camera '{name}' of sequence {sequence:02} has a rolling shutter, whose rows have \
             poses of their own; make the data set with camera.shutter.readout_ms = 0"
        )));
    }
    Ok(())
}
