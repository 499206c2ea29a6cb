//! Irradiance by normal, as spherical harmonics of nine coefficients a channel.

use glam::{DVec3, Vec3};

/// Irradiance as a function of the surface's normal: spherical harmonics up to degree 2
/// (Ramamoorthi and Hanrahan 2001, "An efficient representation for irradiance environment maps").
///
/// Exact for a uniform hemisphere, within a few percent for a clear sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Irradiance {
    /// Polynomial coefficients of 1, x, y, z, xy, yz, 3z² − 1, xz, x² − y².
    c: [Vec3; 9],
}

/// Y normalisations squared times the cosine lobe's factors (pi, 2 pi / 3, pi / 4): the polynomial
/// basis that projects and evaluates with the same terms.
const WEIGHT: [f64; 9] = {
    const PI: f64 = std::f64::consts::PI;
    const L0: f64 = 1.0 / (4.0 * PI) * PI;
    const L1: f64 = 3.0 / (4.0 * PI) * (2.0 * PI / 3.0);
    const L2: f64 = 15.0 / (4.0 * PI) * (PI / 4.0);
    [L0, L1, L1, L1, L2, L2, L2 / 12.0, L2, L2 / 4.0]
};

fn basis(d: DVec3) -> [f64; 9] {
    let DVec3 { x, y, z } = d;
    [
        1.0,
        x,
        y,
        z,
        x * y,
        y * z,
        3.0 * z * z - 1.0,
        x * z,
        x * x - y * y,
    ]
}

impl Irradiance {
    /// The irradiance of a sky of given radiance over the upper hemisphere, with none below.
    pub(crate) fn of_sky(radiance: impl Fn(Vec3) -> Vec3) -> Self {
        const N: u32 = 4096;
        let mut c = [DVec3::ZERO; 9];
        for i in 0..N {
            // A Fibonacci lattice, whose points have equal areas on the hemisphere.
            let z = (f64::from(i) + 0.5) / f64::from(N);
            let r = libm::sqrt(1.0 - z * z);
            let (sin, cos) = libm::sincos(f64::from(i) * 2.399_963_229_728_653);
            let d = DVec3::new(r * cos, r * sin, z);
            let l = radiance(d.as_vec3()).as_dvec3();
            for (c, b) in c.iter_mut().zip(basis(d)) {
                *c += l * b;
            }
        }
        let solid_angle = std::f64::consts::TAU / f64::from(N);
        Self {
            c: std::array::from_fn(|i| (c[i] * (WEIGHT[i] * solid_angle)).as_vec3()),
        }
    }

    /// Irradiance on a surface with this unit normal.
    #[inline]
    pub(crate) fn at(&self, n: Vec3) -> Vec3 {
        let c = &self.c;
        let e = c[0]
            + c[1] * n.x
            + c[2] * n.y
            + c[3] * n.z
            + c[4] * (n.x * n.y)
            + c[5] * (n.y * n.z)
            + c[6] * (3.0 * n.z * n.z - 1.0)
            + c[7] * (n.x * n.z)
            + c[8] * (n.x * n.x - n.y * n.y);
        e.max(Vec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniform_sky_gives_pi_times_its_radiance() {
        let e = Irradiance::of_sky(|_| Vec3::ONE);
        for n in [
            Vec3::Z,
            Vec3::X,
            -Vec3::Y,
            -Vec3::Z,
            Vec3::new(0.6, 0.0, 0.8),
        ] {
            let exact = std::f32::consts::PI * (1.0 + n.z) / 2.0;
            assert!(
                (e.at(n).x - exact).abs() < 2e-3,
                "{n}: {} for {exact}",
                e.at(n).x
            );
        }
    }

    #[test]
    fn a_smooth_sky_gives_its_integral() {
        let sky = |d: Vec3| Vec3::splat((1.0 + 0.8 * d.x) * (0.3 + d.z));
        let e = Irradiance::of_sky(sky);
        for n in [
            Vec3::Z,
            Vec3::X,
            Vec3::new(-0.6, 0.0, 0.8),
            Vec3::new(0.0, 0.8, 0.6),
        ] {
            // Brute force over a latitude-longitude grid.
            let mut sum = 0.0_f64;
            let (rows, columns) = (200, 400);
            for i in 0..rows {
                let el = (f64::from(i) + 0.5) / f64::from(rows) * std::f64::consts::FRAC_PI_2;
                for j in 0..columns {
                    let az = (f64::from(j) + 0.5) / f64::from(columns) * std::f64::consts::TAU;
                    let d = DVec3::new(el.cos() * az.cos(), el.cos() * az.sin(), el.sin());
                    let cos = d.dot(n.as_dvec3()).max(0.0);
                    sum += f64::from(sky(d.as_vec3()).x) * cos * el.cos();
                }
            }
            sum *= std::f64::consts::FRAC_PI_2 / f64::from(rows) * std::f64::consts::TAU
                / f64::from(columns);
            let got = f64::from(e.at(n).x);
            assert!((got / sum - 1.0).abs() < 0.03, "{n}: {got} for {sum}");
        }
    }
}
