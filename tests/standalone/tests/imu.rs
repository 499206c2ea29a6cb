//! A stranger's inertial unit on a pendulum.

use std::convert::Infallible;

use nemoral_imu::{GRAVITY_M_S2, ImuErrors, ImuNoise, ImuParams, euroc, motions};
use nemoral_scene::RigidTransform;
use nemoral_scene::glam::DVec3;
use nemoral_seed::Key;

#[test]
fn a_pendulum_is_measured_and_written() {
    let params = ImuParams {
        rate_hz: 100.0,
        errors: ImuErrors::ADIS16448,
    };
    // It swings by 0.1 rad at the end of a rope of 5 m.
    let swing = |t: f64| 0.1 * (t * (GRAVITY_M_S2 / 5.0).sqrt()).sin();
    let pose = |t: f64| {
        let hang = RigidTransform::from_xyz_rpy(DVec3::ZERO, swing(t), 0.0, 0.0);
        let below = RigidTransform::from_xyz_rpy(DVec3::Z * -5.0, 0.0, 0.0, 0.0);
        Ok::<_, Infallible>(hang * below)
    };
    let mut noise = ImuNoise::new(&params, Key::world(1)).expect("in their ranges");
    let mut text = euroc::SAMPLES_HEADER.to_owned();
    for motion in motions(params.rate_hz, 300, pose) {
        let Ok(motion) = motion;
        // Along the rope it is pulled, across it hardly.
        let force = motion.specific_force_m_s2;
        assert!(
            (force.z - GRAVITY_M_S2).abs() < 0.2 && force.y.abs() < 0.02,
            "{force}"
        );
        euroc::push_sample(&mut text, &noise.measure(&motion));
    }
    assert_eq!(text.lines().count(), 301);
}
