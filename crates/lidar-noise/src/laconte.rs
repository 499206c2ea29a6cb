//! The incidence bias of Laconte et al. 2019 (\[20\] in the paper).

use nemoral_scene::EchoObservation;

use crate::model::MeanError;

/// Beyond this incidence, 85°, the bias stays constant. The authors' filter drops points from 88°
/// on; in the last degrees before, the expansion grows to metres, far beyond the 20 cm that they
/// measured.
const MIN_INCIDENCE_COS: f64 = 0.087_155_742_747_658_18;

/// The sensors that Laconte et al. measured and published coefficients for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LaconteDevice {
    /// Sick LMS1xx: wide beam, bias of decimetres at high incidence.
    SickLms1xx,
    /// Velodyne HDL-32E: narrow beam, bias of centimetres.
    #[default]
    VelodyneHdl32e,
}

impl LaconteDevice {
    /// The waveform model of the device: the published one.
    #[must_use]
    pub const fn waveform(self) -> LaconteWaveform {
        let (half_aperture_rad, k_distance, k_curvature_m) = match self {
            Self::SickLms1xx => (0.007_504_9, 6.080_409_51, 3.179_217_89e-3),
            Self::VelodyneHdl32e => (0.001_483_5, 10.321_156_9, 7.078_933_71e-3),
        };
        LaconteWaveform {
            half_aperture_rad,
            k_distance,
            k_curvature_m,
        }
    }

    /// The closed form of the device.
    #[must_use]
    pub const fn closed_form(self) -> LaconteClosedForm {
        let (per_metre, curvature_m) = match self {
            Self::SickLms1xx => (1.986e-4, 3.179e-3),
            Self::VelodyneHdl32e => (1.317e-5, 7.079e-3),
        };
        LaconteClosedForm {
            per_metre,
            curvature_m,
        }
    }
}

/// Bias from the return waveform: a Gaussian beam and a Gaussian pulse on a tilted plane, with the
/// waveform expanded to third order around the echo of the centre ray, and the position of its
/// peak.
///
/// The range is measured too short; the bias is 0 head-on and grows with distance and incidence
/// (up to 20 cm in the authors' experiments). Incidence is taken as at most 85°.
///
/// Source: J. Laconte, S.-P. Deschênes, M. Labussière, F. Pomerleau, "Lidar measurement bias
/// estimation via return waveform modelling in a context of 3D mapping", ICRA 2019, in the form and
/// with the coefficients of the authors' filter (libpointmatcher, `RemoveSensorBias`). Their peak
/// power, wavelength and spherical spreading multiply all terms alike and cancel, so they are not
/// here; the root is taken in the form that does not cancel at small angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaconteWaveform {
    /// Half of the beam's aperture angle, radians.
    half_aperture_rad: f64,
    /// Weight of the displacement of the waveform's peak.
    k_distance: f64,
    /// Weight of the change of the waveform's curvature at the peak, metres.
    k_curvature_m: f64,
}

impl MeanError for LaconteWaveform {
    /// The published coefficients a₁, a₂ and a₃, divided by what they share: with incidence θ, half
    /// aperture a, the pulse's length P and the depth of the footprint D = d tan θ / P in pulse
    /// lengths, `x = (a D)²`, `q = 1 + x` and `h = 3 a² D sin θ`, they are as `−h (1 − g(x))` to
    /// `−cos θ` to `h / (2 q)`, where g is the share of the beam's edge.
    fn mean_error_m(&self, o: &EchoObservation) -> f64 {
        let cos = clamped(o.incidence_cos);
        let sin = (1.0 - cos * cos).sqrt();
        let depth = o.range_m * sin / (cos * PULSE_M);
        let a = self.half_aperture_rad;
        let x = (a * depth) * (a * depth);
        let (edge, flatness) = edge_and_flatness(x);
        let per_q = 1.0 / (1.0 + x);
        let lean = 3.0 * a * a * depth * sin;
        let push = lean * (1.0 - edge);
        // The waveform's peak, in pulse lengths behind the echo of the centre ray.
        let peak = -push / (cos + (cos * cos + 1.5 * push * lean * per_q).sqrt());
        let curvature = 1.0 - flatness / (cos - 1.5 * peak * lean * per_q);
        self.k_distance * (0.5 * PULSE_M * peak) + self.k_curvature_m * curvature
    }
}

/// √(2 / π).
const ROOT_2_BY_PI: f64 = 0.797_884_560_802_865_4;

/// The authors' pulse of 50 ns: its spread, `50 ns / √(2 π)`, in metres of light.
const PULSE_M: f64 = 50e-9 * 0.398_942_280_401_432_7 * 299_792_458.0;

/// erf(√2).
const ERF_ROOT_2: f64 = 0.954_499_736_103_641_6;

/// The effect of the beam's width, for the square `x` of the footprint's depth in pulse lengths and
/// beam widths: g, the share of the beam's edge, and the factor by which the waveform's curvature
/// is less than head-on. With `q = 1 + x` and `E = erf √(2 q)`: `g = √(2/π) · 2 √q e^(−2 q) / E`
/// and `q √q · erf √2 / E`.
fn edge_and_flatness(x: f64) -> (f64, f64) {
    // This is the case of nearly all returns: narrow beams and footprints that are not deep. The
    // next terms of the series are below 1e-9.
    if x < 1.0 / 64.0 {
        let edge = series(EDGE, x);
        return (edge, series(FLATNESS, x));
    }
    let q = 1.0 + x;
    let root = q.sqrt();
    let e = libm::erf(std::f64::consts::SQRT_2 * root);
    let edge = ROOT_2_BY_PI * 2.0 * root * libm::exp(-2.0 * q) / e;
    (edge, q * root * ERF_ROOT_2 / e)
}

/// Coefficients of the powers of x, around 0.
const EDGE: [f64; 5] = [
    0.226_258_696_450_076_75,
    -0.364_984_543_534_759_2,
    0.271_262_446_490_672_6,
    -0.115_810_607_232_104_1,
    0.025_958_149_200_267_8,
];
const FLATNESS: [f64; 5] = [
    1.0,
    1.386_870_651_774_961_6,
    0.359_515_912_373_562_4,
    -0.034_322_601_461_849_84,
    -0.002_305_497_014_031_92,
];

fn series([c0, c1, c2, c3, c4]: [f64; 5], x: f64) -> f64 {
    c0 + x * (c1 + x * (c2 + x * (c3 + x * c4)))
}

/// `−(per_metre · d · tan²θ + curvature_m · (sec θ − 1))`: what [`LaconteWaveform`] reduces to.
///
/// Within 2 % of the waveform up to 85° and 50 m for the narrow beam of the HDL-32E; for the wide
/// beam of the LMS1xx within 15 % there, and much closer at smaller angles. Incidence is taken as
/// at most 85°.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaconteClosedForm {
    /// Bias per metre of range at 45°, metres per metre.
    per_metre: f64,
    /// Bias per unit of `sec θ − 1`, metres.
    curvature_m: f64,
}

impl MeanError for LaconteClosedForm {
    fn mean_error_m(&self, o: &EchoObservation) -> f64 {
        let sec = 1.0 / clamped(o.incidence_cos);
        let tan_squared = sec * sec - 1.0;
        -(self.per_metre * o.range_m * tan_squared + self.curvature_m * (sec - 1.0))
    }
}

fn clamped(incidence_cos: f64) -> f64 {
    incidence_cos.clamp(MIN_INCIDENCE_COS, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use LaconteDevice::{SickLms1xx, VelodyneHdl32e};

    fn at(range_m: f64, incidence_deg: f64) -> EchoObservation {
        EchoObservation::at_angle(range_m, incidence_deg.to_radians(), 0.5)
    }

    /// The published filter as it is published, except for its constant factors.
    fn published(w: &LaconteWaveform, d: f64, theta: f64) -> f64 {
        let a = w.half_aperture_rad;
        let light = 299_792_458.0;
        let sigma = 50e-9 / std::f64::consts::TAU.sqrt();
        let expansion = |theta: f64| {
            let (sin, cos) = theta.sin_cos();
            let depth = d * theta.tan() / (sigma * light);
            let big_a = 2.0 * depth * depth + 2.0 / (a * a);
            let (k1, k2) = (cos.powi(3), 3.0 * cos * cos * sin);
            let spread = 1.0 / (cos * cos);
            let root_pi = std::f64::consts::PI.sqrt();
            let l1 = spread * root_pi * libm::erf(a * big_a.sqrt()) / (2.0 * big_a.powf(1.5));
            let l2 = spread * k2 / (2.0 * big_a);
            let tilt = l1 * k2 - 2.0 * l2 * a * (-big_a * a * a).exp();
            let pulse = sigma * light;
            let narrowing = (pulse * cos).powi(2) * big_a + 2.0 * d * d * (cos * cos - 1.0);
            let leaning = pulse * pulse * big_a - 2.0 * (d * theta.tan()).powi(2);
            [
                -2.0 * theta.tan() * d * tilt / (sigma * pulse),
                -l1 * k1 * narrowing * spread / (pulse * sigma).powi(2),
                l1 * k2 * d * theta.tan() * leaning / (big_a * (pulse * sigma).powi(3)),
            ]
        };
        let [a1, a2, a3] = expansion(theta);
        let peak = 2.0 * a1 / (-2.0 * a2 + (4.0 * a2 * a2 - 12.0 * a1 * a3).sqrt());
        let curvature = 1.0 - 2.0 * expansion(0.0)[1] / (2.0 * a2 + 6.0 * peak * a3);
        w.k_distance * peak * light / 2.0 + w.k_curvature_m * curvature
    }

    #[test]
    fn what_is_divided_out_changes_nothing() {
        for waveform in [SickLms1xx.waveform(), VelodyneHdl32e.waveform()] {
            // Far and steep cases are computed by the functions rather than by their series.
            for d in [0.5, 2.0, 10.0, 30.0, 80.0, 200.0] {
                for deg in [0.0, 1.0, 20.0, 45.0, 60.0, 75.0, 84.9] {
                    let got = waveform.mean_error_m(&at(d, deg));
                    let expected = published(&waveform, d, deg.to_radians());
                    assert!((got - expected).abs() < 1e-9, "{d} {deg}: {got} {expected}");
                }
            }
        }
    }

    #[test]
    fn the_series_meet_the_functions() {
        let (below, above) = (1.0_f64 / 64.0 - 1e-12, 1.0 / 64.0);
        let (a, b) = (edge_and_flatness(below), edge_and_flatness(above));
        assert!(
            (a.0 - b.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-9,
            "{a:?} {b:?}"
        );
    }

    /// Values of the authors' implementation, run outside of this project.
    #[test]
    fn golden_values_of_the_published_filter() {
        for (device, range_m, incidence_deg, bias_m) in [
            (SickLms1xx, 10.0, 60.0, -0.009_146_833),
            (SickLms1xx, 10.0, 80.0, -0.079_328_518),
            (SickLms1xx, 20.0, 75.0, -0.064_841_498),
            (VelodyneHdl32e, 10.0, 60.0, -0.007_474_741),
            (VelodyneHdl32e, 10.0, 80.0, -0.037_938_187),
        ] {
            let got = device.waveform().mean_error_m(&at(range_m, incidence_deg));
            assert!((got - bias_m).abs() < 1e-6, "{device:?}: {got} {bias_m}");
        }
    }

    /// The table of millimetres derived from the published filter.
    #[test]
    fn both_forms_follow_the_published_table() {
        let incidences_deg = [45.0, 60.0, 70.0, 75.0, 80.0, 85.0];
        for (device, range_m, bias_mm) in [
            (SickLms1xx, 2.0, [1.7, 4.4, 9.1, 15.0, 28.0, 85.0]),
            (SickLms1xx, 10.0, [3.3, 9.1, 21.0, 37.0, 79.0, 296.0]),
            (SickLms1xx, 30.0, [7.3, 21.0, 52.0, 93.0, 212.0, 878.0]),
            (VelodyneHdl32e, 2.0, [3.0, 7.2, 14.0, 21.0, 35.0, 78.0]),
            (VelodyneHdl32e, 10.0, [3.1, 7.5, 15.0, 22.0, 38.0, 92.0]),
            (VelodyneHdl32e, 30.0, [3.3, 8.3, 17.0, 26.0, 47.0, 127.0]),
        ] {
            for (incidence_deg, bias_mm) in incidences_deg.into_iter().zip(bias_mm) {
                let o = at(range_m, incidence_deg);
                let waveform_mm = -1e3 * device.waveform().mean_error_m(&o);
                let rounding = if bias_mm < 10.0 { 0.06 } else { 0.6 };
                assert!(
                    (waveform_mm - bias_mm).abs() < rounding,
                    "{device:?} {o:?}: {waveform_mm} {bias_mm}"
                );
                let closed_mm = -1e3 * device.closed_form().mean_error_m(&o);
                assert!(
                    (closed_mm / waveform_mm - 1.0).abs() < 0.15,
                    "{device:?} {o:?}: {closed_mm} {waveform_mm}"
                );
            }
        }
    }
}
