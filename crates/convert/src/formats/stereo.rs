//! The stereo pair of a sequence: its first camera, and a further one called `right`.

use nemoral_dataset::{CameraSpec, Manifest};
use nemoral_scene::glam::DQuat;

use crate::geometry::relative;

/// The name of the right camera of a pair.
const RIGHT: &str = "right";

/// How far a rectified pair may be from one, radians and metres.
const TOLERANCE: f64 = 1e-6;

/// Where the right camera of a pair stands among the cameras, if there is one.
pub(super) fn right(cameras: &[CameraSpec]) -> Option<usize> {
    let mut further = cameras.iter().enumerate().skip(1);
    further.find(|(_, c)| c.name == RIGHT).map(|(i, _)| i)
}

/// How far the right camera is to the right of the left one, metres, if the pair is rectified: the
/// axes of both are parallel, one is neither higher nor further back than the other, and rows and
/// focal lengths are the same.
pub(super) fn baseline_m(left: &CameraSpec, right: &CameraSpec) -> Option<f64> {
    let Apart { turn_rad, at_m } = Apart::of(left, right);
    let [x_m, y_m, z_m] = at_m;
    let is_beside = x_m > TOLERANCE && y_m.abs() < TOLERANCE && z_m.abs() < TOLERANCE;
    let rows = |camera: &CameraSpec| {
        let k = &camera.intrinsics;
        (k.width, k.height, k.fx, k.fy, k.cy)
    };
    let is_rectified = turn_rad < TOLERANCE && is_beside && rows(left) == rows(right);
    is_rectified.then_some(x_m)
}

/// A note if a data set has pairs that are not rectified; `consequence` says what that means to
/// the format's readers.
pub(super) fn notes(manifest: &Manifest, consequence: &str) -> Vec<String> {
    let sequences = &manifest.header.sequences;
    let skewed: Vec<_> = (sequences.iter())
        .filter_map(|s| {
            let (left, right) = (&s.cameras[..], right(&s.cameras)?);
            let pair = (&left[0], &left[right]);
            baseline_m(pair.0, pair.1).is_none().then_some((s, pair))
        })
        .collect();
    let Some((sequence, (left, right))) = skewed.first() else {
        return Vec::new();
    };
    let Apart { turn_rad, at_m } = Apart::of(left, right);
    let [x_m, y_m, z_m] = at_m;
    let others = match skewed.len() {
        1 => String::new(),
        n => format!(" (and those of {} further sequences)", n - 1),
    };
    vec![format!(
        "cameras '{left}' and '{right}' of sequence {:02}{others} are not a rectified pair: \
         '{right}' is turned by {:.4}° and lies {x_m:.4} m to the right, {y_m:.4} m down and \
         {z_m:.4} m forward in the frame of '{left}', where a rectified pair has 0°, 0 m down, 0 \
         m forward and the same size, fx, fy and cy; {consequence}",
        sequence.number,
        turn_rad.to_degrees(),
        left = left.name,
        right = right.name,
    )]
}

/// How a right camera is mounted, in the left one's frame.
struct Apart {
    turn_rad: f64,
    /// To the right, down, and forward.
    at_m: [f64; 3],
}

impl Apart {
    fn of(left: &CameraSpec, right: &CameraSpec) -> Self {
        let left_from_right = relative(&left.body_from_camera, &right.body_from_camera);
        Self {
            turn_rad: left_from_right.rotation.angle_between(DQuat::IDENTITY),
            // Adding zero turns -0 into 0.
            at_m: left_from_right.translation_m.to_array().map(|v| v + 0.0),
        }
    }
}
