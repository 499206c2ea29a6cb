//! `calib_cam_to_cam`, as KITTI's raw data have it.

use nemoral_dataset::CameraSpec;

use super::Rig;
use crate::geometry::line;

/// The calibration of rectified cameras: 00 and 02 are the left one, 01 and 03 the right one. The
/// first pixel's centre is at (0, 0).
pub(super) fn text(left: &CameraSpec, rig: Option<&Rig>) -> String {
    let k = &left.intrinsics;
    let (cx, cy) = (k.cx - 0.5, k.cy - 0.5);
    let mut text = String::new();
    for number in 0..4 {
        let at_m = match (number % 2, rig) {
            (0, _) => 0.0,
            (_, Some(rig)) => rig.baseline_m,
            (_, None) => continue,
        };
        let size = line([f64::from(k.width), f64::from(k.height)]);
        let matrix = line([k.fx, 0.0, cx, 0.0, k.fy, cy, 0.0, 0.0, 1.0]);
        let one = line([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        let shift = -k.fx * at_m;
        let projection = line([k.fx, 0.0, cx, shift, 0.0, k.fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]);
        for (name, numbers) in [
            ("S", &size),
            ("K", &matrix),
            ("D", &line([0.0; 5])),
            ("R", &one),
            ("T", &line([-at_m, 0.0, 0.0])),
            ("S_rect", &size),
            ("R_rect", &one),
            ("P_rect", &projection),
        ] {
            text += &format!("{name}_{number:02}: {numbers}");
        }
    }
    text
}
