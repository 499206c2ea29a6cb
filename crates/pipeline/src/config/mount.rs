//! The mount of a sensor on the body.

use nemoral_scene::RigidTransform;
use nemoral_scene::glam::DVec3;

/// The transform to the body's frame from that of a sensor with a position, a yaw and a pitch.
pub(super) fn mount(position_m: [f64; 3], pitch_deg: f64, yaw_deg: f64) -> RigidTransform {
    let position = DVec3::from_array(position_m);
    RigidTransform::from_xyz_rpy(position, 0.0, pitch_deg.to_radians(), yaw_deg.to_radians())
}
