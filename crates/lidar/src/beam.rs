//! The width of a laser beam.

use nemoral_scene::glam::DVec3;

use crate::ParamError;

/// A laser beam: its width, the length of its pulse, and how finely it is cast.
///
/// The beam has an elliptical Gaussian section and is cast as sub-rays: one in the middle, and 6 k
/// on the k-th of [`rings`](Self::rings) rings, each standing for the light of its part of the
/// ellipse out to 1/e² (the arrangement of HELIOS++, with exact weights).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Divergence, full width at half maximum, at right angles to the scanner's z axis
    /// ([`ScanPattern::up`](crate::ScanPattern::up)), radians, 0..=0.1.
    pub horizontal_fwhm_rad: f64,
    /// Divergence, full width at half maximum, along the scanner's z axis, radians, 0..=0.1.
    pub vertical_fwhm_rad: f64,
    /// Rings of sub-rays around the middle, 0..=8: 1, 7, 19, 37 … rays a pulse. With 0 the beam is
    /// a line without width.
    pub rings: u8,
    /// Half the length of the pulse, metres, at least 0 (0.6 m for 4 ns): echoes of surfaces no
    /// farther behind each other are merged into one between them. One surface that slants through
    /// more than that is one echo, too, as its light comes back without a break.
    pub resolution_m: f64,
    /// Diameter of the beam where it leaves the scanner, out to 1/e² of the middle's intensity,
    /// metres, 0..=0.1. The beam widens from there; with 0 it begins as a point.
    pub exit_m: f64,
}

impl Default for Beam {
    /// A line: one ray for each pulse.
    fn default() -> Self {
        Self {
            horizontal_fwhm_rad: 0.0,
            vertical_fwhm_rad: 0.0,
            rings: 0,
            resolution_m: 0.6,
            exit_m: 0.0,
        }
    }
}

/// A part of the beam's section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SubRay {
    /// Tangents of the angles to the beam's middle.
    left: f64,
    up: f64,
    /// The factor that gives its direction unit length.
    scale: f64,
    /// Where it leaves the scanner, to the left of the beam's middle and above it, metres.
    exit_m: [f64; 2],
    /// Its share of the beam's light.
    pub(crate) weight: f64,
}

impl SubRay {
    fn new(left_rad: f64, up_rad: f64, weight: f64) -> Self {
        let (left, up) = (libm::tan(left_rad), libm::tan(up_rad));
        Self {
            left,
            up,
            scale: 1.0 / (1.0 + left * left + up * up).sqrt(),
            exit_m: [0.0; 2],
            weight,
        }
    }
}

/// Standard deviations in a full width at half maximum, 2 √(2 ln 2).
const FWHM: f64 = 2.354_820_045_030_949;

/// Rings cover the section out to this many standard deviations: 1/e² of the middle's intensity.
const REACH: f64 = 2.0;

impl Beam {
    /// The solid angle of a beam that is everywhere as bright as this in its middle, and has as
    /// much light, steradians.
    pub(crate) fn solid_angle_sr(&self) -> f64 {
        let reach = REACH / FWHM;
        let (along, up) = (self.horizontal_fwhm_rad, self.vertical_fwhm_rad);
        std::f64::consts::FRAC_PI_2 * (reach * along) * (reach * up)
    }

    /// The variance of the directions of one sub-ray's part of the beam, across and up together,
    /// radians².
    pub(crate) fn part_variance(&self) -> f64 {
        let step = REACH / (f64::from(self.rings) + 0.5);
        // Gaussians of this width around the sub-rays of rings sum up to that of the beam within a
        // quarter; a ray alone stands for the whole beam.
        let share = (step * step / 4.0).min(1.0);
        let across = self.horizontal_fwhm_rad / FWHM;
        let up = self.vertical_fwhm_rad / FWHM;
        share * (across * across + up * up)
    }

    pub(crate) fn check(&self) -> Result<(), ParamError> {
        for (field, width) in [
            ("beam.horizontal_fwhm_rad", self.horizontal_fwhm_rad),
            ("beam.vertical_fwhm_rad", self.vertical_fwhm_rad),
        ] {
            ParamError::check((0.0..=0.1).contains(&width), field, width, "0..=0.1 rad")?;
        }
        ParamError::check(self.rings <= 8, "beam.rings", self.rings, "at most 8")?;
        ParamError::check_range("beam.exit_m", self.exit_m, 0.0..=0.1, "0..=0.1 m")?;
        ParamError::check(
            self.resolution_m.is_finite() && self.resolution_m >= 0.0,
            "beam.resolution_m",
            self.resolution_m,
            "finite and at least 0",
        )
    }

    /// The sub-rays: the middle first, then ring by ring.
    pub(crate) fn sub_rays(&self) -> Vec<SubRay> {
        let rings = i32::from(self.rings);
        let step = REACH / (f64::from(rings) + 0.5);
        // The share of a round Gaussian that lies outside a radius.
        let outside = |radius: f64| libm::exp(-0.5 * radius * radius);
        let all = 1.0 - outside(REACH);
        let exit_sigma_m = self.exit_m / (2.0 * REACH);
        let mut rays = Vec::new();
        for ring in 0..=rings {
            let radius = f64::from(ring) * step;
            let count = (6 * ring).max(1);
            let inner = (radius - 0.5 * step).max(0.0);
            let share = (outside(inner) - outside(radius + 0.5 * step)) / all;
            for i in 0..count {
                // Rings are turned against each other, so that rays do not line up.
                let turn = (f64::from(i) + 0.5 * f64::from(ring % 2)) / f64::from(count);
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * turn);
                let (left, up) = (radius * cos, radius * sin);
                let part = SubRay::new(
                    left * self.horizontal_fwhm_rad / FWHM,
                    up * self.vertical_fwhm_rad / FWHM,
                    share / f64::from(count),
                );
                rays.push(SubRay {
                    exit_m: [left * exit_sigma_m, up * exit_sigma_m],
                    ..part
                });
            }
        }
        rays
    }
}

/// A beam's direction and the directions to its left and upwards, all of unit length.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BeamAxes {
    forward: DVec3,
    left: DVec3,
    up: DVec3,
}

impl BeamAxes {
    /// The axes of a beam, in the LiDAR frame, of which `up` is as near to the given one as it can
    /// be.
    pub(crate) fn along(forward: DVec3, up: DVec3) -> Self {
        let across = up.cross(forward);
        let left = if across.length_squared() > 1e-20 {
            across.normalize()
        } else {
            // Along `up` any direction is as good.
            let any = if forward.y.abs() < 0.5 {
                DVec3::Y
            } else {
                DVec3::X
            };
            any.reject_from_normalized(forward).normalize()
        };
        Self {
            forward,
            left,
            up: forward.cross(left),
        }
    }

    /// The same beam in another frame.
    pub(crate) fn map(self, turn: impl Fn(DVec3) -> DVec3) -> Self {
        Self {
            forward: turn(self.forward),
            left: turn(self.left),
            up: turn(self.up),
        }
    }

    /// The direction of a part of the beam. That of the middle is the beam's own, to the bit.
    pub(crate) fn towards(&self, part: &SubRay) -> DVec3 {
        let aside = self.left * part.left + self.up * part.up;
        (self.forward + aside) * part.scale
    }

    /// Where a part of the beam leaves the scanner, from where its middle does, metres.
    pub(crate) fn exit_m(&self, part: &SubRay) -> DVec3 {
        let [left_m, up_m] = part.exit_m;
        self.left * left_m + self.up * up_m
    }
}

/// A unit vector turned by small angles to its left and upwards. Angles of 0 leave its bits as they
/// are.
pub(crate) fn turned(direction: DVec3, left_rad: f64, up_rad: f64) -> DVec3 {
    BeamAxes::along(direction, DVec3::Z).towards(&SubRay::new(left_rad, up_rad, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sub_rays_have_the_beams_width_and_all_its_light() {
        for rings in 0..=8 {
            let beam = Beam {
                horizontal_fwhm_rad: 0.028_f64.to_radians(),
                vertical_fwhm_rad: 0.28_f64.to_radians(),
                rings,
                ..Beam::default()
            };
            let rays = beam.sub_rays();
            let n = usize::from(rings);
            assert_eq!(rays.len(), 1 + 3 * n * (n + 1));
            let total: f64 = rays.iter().map(|r| r.weight).sum();
            assert!((total - 1.0).abs() < 1e-12, "{total}");
            if rings < 2 {
                continue;
            }
            // The variance of a Gaussian that is cut at 2 σ is 0.687 of that of the whole Gaussian.
            for (width, at) in [
                (beam.horizontal_fwhm_rad, [1.0, 0.0]),
                (beam.vertical_fwhm_rad, [0.0, 1.0]),
            ] {
                let variance: f64 = rays
                    .iter()
                    .map(|r| {
                        let x = at[0] * r.left + at[1] * r.up;
                        r.weight * x * x
                    })
                    .sum();
                let ratio = variance / (width / FWHM).powi(2);
                assert!((ratio - 0.687).abs() < 0.04, "{rings} {ratio}");
            }
        }
    }

    /// A beam that leaves the scanner 1 cm wide widens from there: out to 1/e² of its middle, it is
    /// as wide as the exit and the divergence together.
    #[test]
    fn a_beam_is_as_wide_as_its_exit_and_its_divergence() {
        let beam = Beam {
            horizontal_fwhm_rad: 0.002,
            vertical_fwhm_rad: 0.001,
            rings: 8,
            exit_m: 0.01,
            ..Beam::default()
        };
        let axes = BeamAxes::along(DVec3::X, DVec3::Z);
        for (range_m, width_m, height_m) in [
            (0.0, 0.01, 0.01),
            (
                10.0,
                0.01 + 10.0 * 0.002 * 4.0 / FWHM,
                0.01 + 10.0 * 0.001 * 4.0 / FWHM,
            ),
        ] {
            // The outermost ring stands for the light around it, to 1/e².
            let reach = 8.0 / 8.5;
            let ends = beam.sub_rays().iter().fold(DVec3::ZERO, |most, part| {
                let direction = axes.towards(part);
                let at = axes.exit_m(part) + direction * (range_m / direction.x);
                most.max(at.abs())
            });
            assert!((ends.y - 0.5 * reach * width_m).abs() < 1e-6, "{ends}");
            assert!((ends.z - 0.5 * reach * height_m).abs() < 1e-6, "{ends}");
        }
        let point = Beam {
            exit_m: 0.0,
            ..beam
        };
        let rays = point.sub_rays();
        assert!(rays.iter().all(|part| axes.exit_m(part) == DVec3::ZERO));
    }

    #[test]
    fn axes_are_at_right_angles_in_every_direction() {
        let oblique = DVec3::new(0.6, -0.48, 0.64);
        for forward in [DVec3::X, DVec3::Y, DVec3::NEG_Z, oblique, -oblique] {
            for up in [DVec3::Z, DVec3::Y, oblique, oblique + 1e-13 * DVec3::X] {
                let axes = BeamAxes::along(forward, up);
                assert!((axes.left.length() - 1.0).abs() < 1e-12);
                assert!(axes.left.dot(forward).abs() < 1e-12);
                assert!(axes.up.distance(forward.cross(axes.left)) < 1e-12);
                assert!(axes.up.dot(up) > -1e-12, "{forward} {up}");
            }
        }
    }

    #[test]
    fn turning_is_by_the_angle_and_to_the_side_asked_for() {
        let d = DVec3::new(0.6, -0.48, 0.64);
        assert_eq!(turned(d, 0.0, 0.0), d);
        for (left, up) in [(0.01, 0.0), (0.0, -0.02)] {
            let t = turned(d, left, up);
            assert!((t.angle_between(d) - f64::hypot(left, up)).abs() < 1e-9);
        }
        assert!(turned(DVec3::X, 0.01, 0.0).y > 0.0);
        assert!(turned(DVec3::X, 0.0, 0.01).z > 0.0);
        assert!((turned(DVec3::Z, 0.01, 0.0).length() - 1.0).abs() < 1e-12);
    }
}
