//! What carries a scanner and hides what is behind it.

use nemoral_scene::glam::DVec3;
use nemoral_scene::{ParamError, RigidTransform};

/// A box that moves with the scanner and hides what is behind it: the body of a robot, or the
/// person who carries a handheld mapper. It gives no points itself, as if they were cut out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carrier {
    /// The corner with the least coordinates, in the carrier's frame, metres.
    pub low_m: DVec3,
    /// The corner with the greatest coordinates, each at least that of the other corner, metres.
    pub high_m: DVec3,
    /// The place of the scanner on the carrier, outside of the box.
    pub carrier_from_lidar: RigidTransform,
}

impl Carrier {
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        for (field, corner) in [
            ("carrier.low_m", self.low_m),
            ("carrier.high_m", self.high_m),
        ] {
            ParamError::check(corner.is_finite(), field, corner, "finite")?;
        }
        ParamError::check(
            self.low_m.cmple(self.high_m).all(),
            "carrier.high_m",
            self.high_m,
            "at least carrier.low_m along each axis",
        )?;
        let place_m = self.carrier_from_lidar.translation_m;
        let is_inside = self.low_m.cmple(place_m).all() && place_m.cmple(self.high_m).all();
        ParamError::check(
            place_m.is_finite() && !is_inside,
            "carrier.carrier_from_lidar",
            place_m,
            "a place outside of the box, or no pulse would leave it",
        )
    }

    /// How far the box is from a point in a direction, both in the LiDAR's frame, metres; `None` if
    /// it is not there. It is 0 inside of the box.
    pub(crate) fn distance_m(&self, from: DVec3, direction: DVec3) -> Option<f64> {
        let from = self.carrier_from_lidar.transform_point(from).to_array();
        let direction = self.carrier_from_lidar.transform_vector(direction);
        let (low, high) = (self.low_m.to_array(), self.high_m.to_array());
        let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
        for (axis, per_m) in direction.to_array().into_iter().enumerate() {
            let (below, above) = (low[axis] - from[axis], high[axis] - from[axis]);
            if per_m == 0.0 {
                if below > 0.0 || above < 0.0 {
                    return None;
                }
                continue;
            }
            let (one, other) = (below / per_m, above / per_m);
            enters = enters.max(one.min(other));
            leaves = leaves.min(one.max(other));
        }
        (enters <= leaves).then_some(enters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A robot's body under a LiDAR that looks to its left.
    fn body() -> Carrier {
        Carrier {
            low_m: DVec3::new(-0.4, -0.3, 0.0),
            high_m: DVec3::new(0.4, 0.3, 0.5),
            carrier_from_lidar: RigidTransform::from_xyz_rpy(
                DVec3::new(0.1, 0.0, 0.9),
                0.0,
                0.0,
                std::f64::consts::FRAC_PI_2,
            ),
        }
    }

    #[test]
    fn the_distance_is_that_of_the_nearest_face() {
        let at = |direction: DVec3| body().distance_m(DVec3::ZERO, direction.normalize());
        assert!((at(DVec3::NEG_Z).expect("below") - 0.4).abs() < 1e-12);
        assert_eq!((at(DVec3::Z), at(DVec3::X)), (None, None));
        // Ahead of the LiDAR is to the left of the body, whose edge is 0.3 m away there.
        let over_edge = |beyond: f64| at(DVec3::new(0.3 + beyond, 0.0, -0.4));
        assert!((over_edge(-1e-9).expect("hits") - 0.5).abs() < 1e-8);
        assert_eq!(over_edge(1e-9), None);
        // To the LiDAR's left is behind the body's middle: 0.5 m to the edge there.
        assert!(at(DVec3::new(0.0, 0.499, -0.4)).is_some());
        assert_eq!(at(DVec3::new(0.0, 0.501, -0.4)), None);
        assert_eq!(body().distance_m(DVec3::NEG_Z * 0.6, DVec3::X), Some(0.0));
    }

    #[test]
    fn bad_boxes_are_refused_by_name() {
        let refused = |change: fn(&mut Carrier)| {
            let mut carrier = body();
            change(&mut carrier);
            carrier.check().expect_err("bad").field
        };
        assert!(body().check().is_ok());
        assert_eq!(refused(|c| c.low_m.x = f64::NAN), "carrier.low_m");
        assert_eq!(refused(|c| c.high_m.y = f64::INFINITY), "carrier.high_m");
        assert_eq!(refused(|c| c.high_m.z = -0.1), "carrier.high_m");
        let inside = refused(|c| c.carrier_from_lidar.translation_m.z = 0.3);
        assert_eq!(inside, "carrier.carrier_from_lidar");
    }

    proptest! {
        /// Steps along the ray find the same.
        #[test]
        fn the_box_is_where_steps_along_the_ray_meet_it(
            azimuth in -3.2_f64..3.2,
            elevation in -1.5_f64..1.5,
        ) {
            let (sin, cos) = libm::sincos(azimuth);
            let (up, along) = libm::sincos(elevation);
            let direction = DVec3::new(along * cos, along * sin, up);
            let carrier = body();
            let grown = |by: f64| {
                let inside = |metres: f64| {
                    let at = carrier.carrier_from_lidar.transform_point(direction * metres);
                    let (low, high) = (carrier.low_m - by, carrier.high_m + by);
                    low.cmple(at).all() && at.cmple(high).all()
                };
                (0..2000).map(|i| 0.001 * f64::from(i)).find(|m| inside(*m))
            };
            match carrier.distance_m(DVec3::ZERO, direction) {
                Some(found) => {
                    let near = grown(0.002).expect("it is there");
                    prop_assert!(near <= found + 1e-9);
                    prop_assert!(grown(-0.002).is_none_or(|inner| found <= inner));
                }
                None => prop_assert_eq!(grown(-0.002), None),
            }
        }
    }
}
