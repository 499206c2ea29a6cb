//! How a body that is carried on foot sways.

use std::f64::consts::TAU;

use nemoral_scene::glam::DVec3;
use nemoral_scene::{ParamError, RigidTransform};

/// The sway of a walker's body, by the way: it goes up and down and pitches once a step, goes from
/// side to side and rolls once in two steps, about a body that is upright on any slope. A walker
/// at the start does not sway.
///
/// Sines for each are a simplification; walkers' bodies move by 2 to 3 cm and some degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gait {
    /// Length of a step, metres, at least 0.1.
    pub step_m: f64,
    /// Amplitude of up and down, metres.
    pub bob_m: f64,
    /// Amplitude of side to side, metres.
    pub sway_m: f64,
    /// Amplitude of the pitch, radians.
    pub pitch_rad: f64,
    /// Amplitude of the roll, radians.
    pub roll_rad: f64,
    /// Height above the ground of the point about which the body pitches and rolls, metres.
    pub hip_m: f64,
}

impl Gait {
    /// Checks the values.
    ///
    /// # Errors
    /// If the step is shorter than 0.1 m, or another value is negative or not finite.
    pub fn check(&self) -> Result<(), ParamError> {
        let is_step = self.step_m.is_finite() && self.step_m >= 0.1;
        ParamError::check(
            is_step,
            "gait.step_m",
            self.step_m,
            "finite and at least 0.1",
        )?;
        for (field, value) in [
            ("gait.bob_m", self.bob_m),
            ("gait.sway_m", self.sway_m),
            ("gait.pitch_rad", self.pitch_rad),
            ("gait.roll_rad", self.roll_rad),
            ("gait.hip_m", self.hip_m),
        ] {
            ParamError::check_at_least_zero(field, value)?;
        }
        Ok(())
    }

    /// How the body has moved, in its own axes, from where it would be without a sway, after some
    /// metres of way.
    #[must_use]
    pub fn after(&self, travelled_m: f64) -> RigidTransform {
        let strides = 0.5 * travelled_m / self.step_m;
        // Whole strides are removed before they are radians.
        let phase = TAU * (strides - strides.floor());
        let (once, twice) = (libm::sin(phase), libm::sin(2.0 * phase));
        let (roll, pitch) = (self.roll_rad * once, self.pitch_rad * twice);
        let turned = RigidTransform::from_xyz_rpy(DVec3::ZERO, roll, pitch, 0.0);
        let hip = DVec3::Z * self.hip_m;
        let off = DVec3::new(0.0, self.sway_m * once, self.bob_m * twice);
        RigidTransform {
            translation_m: hip + off - turned.transform_vector(hip),
            ..turned
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WALK: Gait = Gait {
        step_m: 0.65,
        bob_m: 0.025,
        sway_m: 0.02,
        pitch_rad: 0.04,
        roll_rad: 0.03,
        hip_m: 1.0,
    };

    /// Over whole strides: the hip moves by the amplitudes, once a step and once in two.
    #[test]
    fn a_step_has_one_bob_and_half_a_sway() {
        let hip = DVec3::Z * WALK.hip_m;
        let moved = |m: f64| WALK.after(m).transform_point(hip) - hip;
        let count = 1300;
        let samples: Vec<DVec3> = (0..count).map(|i| moved(0.01 * f64::from(i))).collect();
        let most = |axis: usize| samples.iter().map(|s| s[axis].abs()).fold(0.0, f64::max);
        assert!(most(0) < 1e-12);
        assert!((most(1) - 0.02).abs() < 1e-4 && (most(2) - 0.025).abs() < 1e-4);
        let rises = |axis: usize| {
            let pairs = samples.windows(2);
            pairs
                .filter(|p| p[0][axis] < 0.0 && p[1][axis] >= 0.0)
                .count()
        };
        // 13 m are 20 steps.
        assert_eq!((rises(1), rises(2)), (9, 19));
        let up = |m: f64| WALK.after(m).transform_vector(DVec3::Z);
        let leans = (0..count).map(|i| up(0.01 * f64::from(i)));
        let most = leans
            .map(|up| up.x.abs().max(up.y.abs()))
            .fold(0.0, f64::max);
        assert!((most - 0.04_f64.sin()).abs() < 1e-4, "{most}");
    }

    #[test]
    fn who_stands_is_upright_and_strides_are_alike() {
        assert_eq!(WALK.after(0.0).translation_m, DVec3::ZERO);
        let (a, b) = (WALK.after(0.3), WALK.after(0.3 + 1.3e6));
        assert!(a.translation_m.distance(b.translation_m) < 1e-9);
    }

    #[test]
    fn wrong_values_are_refused_by_name() {
        let refused = |gait: Gait| gait.check().expect_err("out of range").field;
        assert_eq!(
            refused(Gait {
                step_m: 0.0,
                ..WALK
            }),
            "gait.step_m"
        );
        assert_eq!(
            refused(Gait {
                bob_m: f64::NAN,
                ..WALK
            }),
            "gait.bob_m"
        );
        assert_eq!(
            refused(Gait {
                hip_m: -1.0,
                ..WALK
            }),
            "gait.hip_m"
        );
        assert_eq!(WALK.check(), Ok(()));
    }
}
