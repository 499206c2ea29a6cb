//! White balance: which light a camera takes for white.

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use crate::colour::LUMINANCE;
use crate::error::{ParamError, check};

/// How a camera finds the colour of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WhiteReference {
    /// It takes light of this colour temperature for white, kelvin, 2500..=12,000. 6504 is D65, for
    /// which pictures keep their colours.
    Fixed {
        /// Kelvin.
        kelvin: f64,
    },
    /// By the picture: the Minkowski mean of its pixels that do not clip (Finlayson and Trezzi
    /// 2004, "Shades of gray and colour constancy", with their norm of 6) is taken to be grey under
    /// the nearest light between 2500 and 12,000 K. Its tint is not followed, so that green forests
    /// stay green.
    Automatic,
}

/// The white balance of a camera, with the errors that it makes. It is done by gains of red, green
/// and blue that keep the luminance of what becomes white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WhiteBalance {
    /// How the colour of the light is found.
    pub reference: WhiteReference,
    /// Error of the temperature, kelvin, −10,000..=10,000: above 0 pictures are warmer. The sum is
    /// kept within 2500..=12,000 K.
    pub error_k: f64,
    /// Error across the line of temperatures, −150..=150: above 0 pictures are more magenta, below
    /// greener. 3000 units are 1 in CIE 1960 (u, v), as in Adobe's DNG SDK.
    pub tint: f64,
}

impl Default for WhiteBalance {
    /// D65, without errors: pictures keep the colours of the light.
    fn default() -> Self {
        Self {
            reference: WhiteReference::Fixed { kelvin: D65_K },
            error_k: 0.0,
            tint: 0.0,
        }
    }
}

/// The temperature of D65.
const D65_K: f64 = 6504.0;
const COLDEST_K: f64 = 2500.0;
const HOTTEST_K: f64 = 12_000.0;

/// The exponent of the mean that automatic balance takes.
const NORM: i32 = 6;

impl WhiteBalance {
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        if let WhiteReference::Fixed { kelvin } = self.reference {
            let allowed = "2500..=12,000 K";
            check(
                "white_balance.kelvin",
                kelvin,
                COLDEST_K,
                HOTTEST_K,
                allowed,
            )?;
        }
        let allowed = "-10,000..=10,000 K";
        check("white_balance.error_k", self.error_k, -1e4, 1e4, allowed)?;
        check("white_balance.tint", self.tint, -150.0, 150.0, "-150..=150")
    }

    /// The factors of red, green and blue for a picture. Its pixels clip at the light `clips_at`.
    pub(crate) fn gains(&self, linear: &[Vec3], clips_at: f32) -> Vec3 {
        let found_k = match self.reference {
            WhiteReference::Fixed { kelvin } => kelvin,
            WhiteReference::Automatic => match shade_of_grey(linear, clips_at) {
                Some(mean) => nearest_temperature_k(uv_of(mean)),
                None => D65_K,
            },
        };
        let kelvin = (found_k + self.error_k).clamp(COLDEST_K, HOTTEST_K);
        if kelvin == D65_K && self.tint == 0.0 {
            return Vec3::ONE;
        }
        let white = rgb_of(white_uv(kelvin, self.tint));
        // Far from all lights that there are, a primary may be missing.
        (1.0 / white.max(DVec3::splat(0.05))).as_vec3()
    }
}

/// The Minkowski mean of the pixels whose channels are below `clips_at`; `None` if all clip or are
/// black.
fn shade_of_grey(linear: &[Vec3], clips_at: f32) -> Option<DVec3> {
    let part = |part: &[Vec3]| {
        let whole = part.iter().filter(|c| c.max_element() < clips_at);
        // In units of the limit, so that powers neither overflow nor vanish.
        whole
            .map(|c| (c.max(Vec3::ZERO) / clips_at).as_dvec3())
            .map(|c| DVec3::new(c.x.powi(NORM), c.y.powi(NORM), c.z.powi(NORM)))
            .sum::<DVec3>()
    };
    let parts: Vec<DVec3> = linear.par_chunks(1 << 14).map(part).collect();
    let sum: DVec3 = parts.into_iter().sum();
    let root = 1.0 / f64::from(NORM);
    let mean = DVec3::new(
        libm::pow(sum.x, root),
        libm::pow(sum.y, root),
        libm::pow(sum.z, root),
    );
    (mean.min_element() > 0.0).then_some(mean)
}

/// CIE 1960 (u, v) of black bodies, 1000..=15,000 K (Krystek 1985, "An algorithm to calculate
/// correlated colour temperature").
fn black_body_uv(kelvin: f64) -> DVec2 {
    let t = kelvin;
    let u = (0.860_117_757 + 1.541_182_54e-4 * t + 1.286_412_12e-7 * t * t)
        / (1.0 + 8.424_202_35e-4 * t + 7.081_451_63e-7 * t * t);
    let v = (0.317_398_726 + 4.228_062_45e-5 * t + 4.204_816_91e-8 * t * t)
        / (1.0 - 2.897_418_16e-5 * t + 1.614_560_53e-7 * t * t);
    DVec2::new(u, v)
}

/// CIE 1960 (u, v) of phases of daylight, 4000..=25,000 K (CIE 15:2004).
fn daylight_uv(kelvin: f64) -> DVec2 {
    let t = 1000.0 / kelvin;
    let x = if kelvin <= 7000.0 {
        ((-4.6070 * t + 2.9678) * t + 0.09911) * t + 0.244_063
    } else {
        ((-2.0064 * t + 1.9018) * t + 0.24748) * t + 0.237_040
    };
    let y = (-3.0 * x + 2.870) * x - 0.275;
    DVec2::new(4.0 * x, 6.0 * y) / (-2.0 * x + 12.0 * y + 3.0)
}

/// The line of lights: lamps are black bodies, daylight begins between 4000 and 5000 K.
fn locus_uv(kelvin: f64) -> DVec2 {
    let day = ((kelvin - 4000.0) / 1000.0).clamp(0.0, 1.0);
    let lamp = black_body_uv(kelvin);
    if day == 0.0 {
        return lamp;
    }
    lamp.lerp(daylight_uv(kelvin), day)
}

/// The colour of a light of a temperature, 2000..=12,000 K: linear sRGB, luminance 1.
pub(crate) fn colour_of(kelvin: f64) -> DVec3 {
    let rgb = rgb_of(white_uv(kelvin, 0.0)).max(DVec3::ZERO);
    rgb / rgb.dot(LUMINANCE.as_dvec3())
}

/// The light of a temperature, moved across the line by a tint.
fn white_uv(kelvin: f64, tint: f64) -> DVec2 {
    let along = (locus_uv(kelvin - 10.0) - locus_uv(kelvin + 10.0)).normalize();
    // Towards green, of which less is left after balancing.
    let mut green = along.perp();
    if green.y < 0.0 {
        green = -green;
    }
    locus_uv(kelvin) + green * (tint / 3000.0)
}

/// The temperature whose light is nearest, by bisection of the mired scale.
fn nearest_temperature_k(uv: DVec2) -> f64 {
    let distance = |mired: f64| locus_uv(1e6 / mired).distance_squared(uv);
    let (mut low, mut high) = (1e6 / HOTTEST_K, 1e6 / COLDEST_K);
    for _ in 0..60 {
        let third = (high - low) / 3.0;
        if distance(low + third) < distance(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    2e6 / (low + high)
}

/// Linear sRGB of a colour with luminance 1 (IEC 61966-2-1).
fn rgb_of(uv: DVec2) -> DVec3 {
    let xy = DVec2::new(3.0 * uv.x, 2.0 * uv.y) / (2.0 * uv.x - 8.0 * uv.y + 4.0);
    let (x, z) = (xy.x / xy.y, (1.0 - xy.x - xy.y) / xy.y);
    DVec3::new(
        3.240_970 * x - 1.537_383 - 0.498_611 * z,
        -0.969_244 * x + 1.875_968 + 0.041_555 * z,
        0.055_630 * x - 0.203_977 + 1.056_972 * z,
    )
}

fn uv_of(rgb: DVec3) -> DVec2 {
    let x = rgb.dot(DVec3::new(0.412_391, 0.357_584, 0.180_481));
    let y = rgb.dot(DVec3::new(0.212_639, 0.715_169, 0.072_192));
    let z = rgb.dot(DVec3::new(0.019_331, 0.119_195, 0.950_532));
    DVec2::new(4.0 * x, 6.0 * y) / (x + 15.0 * y + 3.0 * z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Linear sRGB, luminance 1, of a grey card under a black body: Planck's law over the CIE 1931
    /// observer in the closed form of Wyman, Sloan and Shirley 2013 ("Simple analytic
    /// approximations to the CIE XYZ color matching functions").
    fn card_under_black_body(kelvin: f64) -> Vec3 {
        let lobe = |nm: f64, at: f64, below: f64, above: f64| {
            let t = (nm - at) * if nm < at { below } else { above };
            (-0.5 * t * t).exp()
        };
        let mut xyz = DVec3::ZERO;
        for nm in 360..=830 {
            let nm = f64::from(nm);
            let x = 0.362 * lobe(nm, 442.0, 0.0624, 0.0374)
                + 1.056 * lobe(nm, 599.8, 0.0264, 0.0323)
                - 0.065 * lobe(nm, 501.1, 0.0490, 0.0382);
            let y =
                0.821 * lobe(nm, 568.8, 0.0213, 0.0247) + 0.286 * lobe(nm, 530.9, 0.0613, 0.0322);
            let z =
                1.217 * lobe(nm, 437.0, 0.0845, 0.0278) + 0.681 * lobe(nm, 459.0, 0.0385, 0.0725);
            let radiance = nm.powi(-5) / ((1.438_777e7 / (nm * kelvin)).exp() - 1.0);
            xyz += radiance * DVec3::new(x, y, z);
        }
        let xyz = xyz / xyz.y;
        let sum = xyz.x + 1.0 + xyz.z;
        let xy = DVec2::new(xyz.x / sum, 1.0 / sum);
        let uv = DVec2::new(4.0 * xy.x, 6.0 * xy.y) / (-2.0 * xy.x + 12.0 * xy.y + 3.0);
        rgb_of(uv).as_vec3()
    }

    fn fixed(kelvin: f64) -> WhiteBalance {
        WhiteBalance {
            reference: WhiteReference::Fixed { kelvin },
            ..WhiteBalance::default()
        }
    }

    /// The largest difference of a channel from grey of the same luminance.
    fn cast(balance: WhiteBalance, light: Vec3) -> f32 {
        let gains = balance.gains(&[light; 9], 100.0);
        (light * gains - Vec3::ONE).abs().max_element()
    }

    #[test]
    fn a_grey_card_under_a_black_body_is_grey() {
        for kelvin in [2700.0, 2856.0, 3200.0, 4000.0] {
            let card = card_under_black_body(kelvin);
            assert!(
                cast(WhiteBalance::default(), card) > 0.2,
                "a lamp is orange by day"
            );
            // The observer's closed form is true to some percent in the blue of lamps.
            assert!(
                cast(fixed(kelvin), card) < 0.05,
                "{kelvin}: {}",
                cast(fixed(kelvin), card)
            );
            let auto = WhiteBalance {
                reference: WhiteReference::Automatic,
                ..WhiteBalance::default()
            };
            assert!(cast(auto, card) < 0.05, "{kelvin}: {}", cast(auto, card));
        }
    }

    #[test]
    fn published_whites_are_met() {
        // CIE 15:2004, the 2 degree observer.
        for (kelvin, x, y) in [(2856.0, 0.44758, 0.40745), (5003.0, 0.34567, 0.35850)] {
            let uv = DVec2::new(4.0 * x, 6.0 * y) / (-2.0 * x + 12.0 * y + 3.0);
            assert!(locus_uv(kelvin).distance(uv) < 2e-4, "{kelvin}");
            assert!((nearest_temperature_k(uv) / kelvin - 1.0).abs() < 3e-3);
        }
        assert_eq!(WhiteBalance::default().gains(&[], 1.0), Vec3::ONE);
        let d65 = rgb_of(locus_uv(D65_K));
        assert!((d65 - DVec3::ONE).abs().max_element() < 2e-3, "{d65}");
    }

    #[test]
    fn errors_have_their_direction() {
        let gains = |error_k, tint| {
            let balance = WhiteBalance {
                error_k,
                tint,
                ..WhiteBalance::default()
            };
            balance.gains(&[], 1.0)
        };
        let (warm, cold) = (gains(1500.0, 0.0), gains(-1500.0, 0.0));
        assert!(warm.x > 1.0 && warm.z < 1.0 && cold.x < 1.0 && cold.z > 1.0);
        let (magenta, green) = (gains(0.0, 30.0), gains(0.0, -30.0));
        assert!(magenta.y < magenta.x.min(magenta.z) && green.y > green.x.max(green.z));
    }

    proptest! {
        #[test]
        fn what_becomes_white_keeps_its_luminance(kelvin in 2500.0..12_000.0, tint in -20.0..20.0) {
            let balance = WhiteBalance { tint, ..fixed(kelvin) };
            let light = rgb_of(white_uv(kelvin, tint)).as_vec3();
            let balanced = light * balance.gains(&[], 1.0);
            prop_assert!((balanced - Vec3::ONE).abs().max_element() < 1e-3, "{balanced}");
        }

        #[test]
        fn automatic_balance_does_not_depend_on_brightness(scale in 0.01_f32..0.9) {
            let auto = WhiteBalance {
                reference: WhiteReference::Automatic,
                ..WhiteBalance::default()
            };
            let picture = [Vec3::new(1.0, 0.8, 0.4), Vec3::new(0.3, 0.5, 0.2)];
            let dim = picture.map(|c| c * scale);
            let (a, b) = (auto.gains(&picture, 1.1), auto.gains(&dim, 1.1));
            prop_assert!((a - b).abs().max_element() < 1e-4, "{a} {b}");
        }
    }
}
