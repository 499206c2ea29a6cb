//! The mount of a sensor on the body.

use nemoral_scene::RigidTransform;
use nemoral_scene::glam::DVec3;

/// The transform to the body's frame from that of a sensor with a position, and with a roll, a
/// pitch and a yaw, which comes first.
pub(super) fn mount(position_m: [f64; 3], roll_pitch_yaw_deg: [f64; 3]) -> RigidTransform {
    let position = DVec3::from_array(position_m);
    let [roll, pitch, yaw] = roll_pitch_yaw_deg.map(f64::to_radians);
    RigidTransform::from_xyz_rpy(position, roll, pitch, yaw)
}
