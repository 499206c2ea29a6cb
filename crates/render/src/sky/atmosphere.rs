//! Light through air: extinction and scattering in a spherical atmosphere.
//!
//! Single scattering by molecules and aerosols is integrated along each view ray; all higher orders
//! are one isotropic term (Hillaire 2020, "A scalable and production ready sky and atmosphere
//! rendering technique", section 5.5). Red, green and blue are 615, 535 and 445 nm, the dominant
//! wavelengths of the sRGB primaries: with the customary 680, 550 and 440 nm, ozone takes more
//! green than red and every dusk turns magenta. Molecules and ozone are scaled there from his
//! values; aerosols follow the turbidity with Ångström's exponent 1.3. Columns of air towards the
//! sun are Chapman functions in Fitzmaurice's closed form (1964, "Simplification of the Chapman
//! function for atmospheric attenuation"), which also hold for a sun below the horizon, where
//! Preetham's fit does not.

use std::f64::consts::PI;

use glam::DVec3;

const GROUND_M: f64 = 6_360_000.0;
const TOP_M: f64 = 90_000.0;
const RAYLEIGH_SCALE_M: f64 = 8_000.0;
const MIE_SCALE_M: f64 = 1_200.0;
/// Ozone is a tent around this height.
const OZONE_M: f64 = 25_000.0;
const OZONE_HALF_WIDTH_M: f64 = 15_000.0;
/// Half of the sun's angular diameter, radians, which gives the penumbra of the earth's shadow.
const SUN_RADIUS_RAD: f64 = crate::Sun::ANGULAR_RADIUS_RAD;
/// The greatest angle by which the local vertical turns along a view ray before it leaves the air.
const MAX_TURN_RAD: f64 = 0.175;

/// The share of extinct light that aerosols scatter rather than absorb (rural aerosol).
const MIE_ALBEDO: f64 = 0.93;

/// The coefficients of the air at red, green, blue, per metre at sea level.
#[derive(Clone, Debug)]
pub(crate) struct Atmosphere {
    rayleigh: DVec3,
    mie_scattering: DVec3,
    mie_extinction: DVec3,
    ozone: DVec3,
    ground_albedo: DVec3,
}

/// The light from one direction of the sky for a sun of illuminance 1, without phase functions,
/// which are too sharp for the resolution of the table.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Scattered {
    /// The part to multiply with the molecules' phase function.
    pub(crate) rayleigh: DVec3,
    /// The part to multiply with the aerosols' phase function.
    pub(crate) mie: DVec3,
    /// Multiply scattered light, from all sides.
    pub(crate) multiple: DVec3,
}

/// Metres of sea-level air: molecules, aerosols, ozone (peak density).
#[derive(Clone, Copy)]
struct Column {
    rayleigh: f64,
    mie: f64,
    ozone: f64,
}

/// The multiply scattered light as a function of height and local sun elevation.
pub(crate) struct MultipleScattering {
    sun_elevation_rad: f64,
    /// `HEIGHTS` rows of `ELEVATIONS`.
    table: Vec<DVec3>,
}

const HEIGHTS: usize = 10;
const ELEVATIONS: usize = 7;
const TABLE_TOP_M: f64 = 50_000.0;

impl Atmosphere {
    /// Air of a turbidity (1 is clean air): the aerosols' optical thickness is turbidity − 1 times
    /// the molecules'.
    pub(crate) fn new(turbidity: f64, ground_albedo: DVec3) -> Self {
        let rayleigh = DVec3::new(8.60e-6, 15.2e-6, 31.6e-6);
        let at_550 = (turbidity - 1.0) * 13.558e-6 * RAYLEIGH_SCALE_M / MIE_SCALE_M;
        let angstrom = |nm: f64| libm::pow(nm / 550.0, -1.3);
        let mie_extinction = at_550 * DVec3::new(angstrom(615.0), angstrom(535.0), angstrom(445.0));
        Self {
            rayleigh,
            mie_scattering: mie_extinction * MIE_ALBEDO,
            mie_extinction,
            ozone: DVec3::new(2.40e-6, 1.40e-6, 0.09e-6),
            ground_albedo,
        }
    }

    /// The share of a beam above the air that reaches an observer on the ground.
    pub(crate) fn sun_transmittance(&self, elevation_rad: f64) -> DVec3 {
        self.lit(0.0, elevation_rad)
    }

    fn transmittance(&self, c: Column) -> DVec3 {
        let depth = self.rayleigh * c.rayleigh + self.mie_extinction * c.mie + self.ozone * c.ozone;
        depth.map(|d| libm::exp(-d))
    }

    /// Sunlight at a height where the sun has this elevation; 0 in the earth's shadow.
    fn lit(&self, height_m: f64, elevation_rad: f64) -> DVec3 {
        let dip = libm::acos((GROUND_M / (GROUND_M + height_m)).min(1.0));
        let visible = smoothstep((elevation_rad + dip) / SUN_RADIUS_RAD * 0.5 + 0.5);
        if visible == 0.0 {
            return DVec3::ZERO;
        }
        self.transmittance(column_to_sun(height_m, elevation_rad)) * visible
    }

    /// Marches along a view ray from a height with this upward cosine and passes the height, the
    /// position and the transmitted share of each step to `step`; returns the transmittance and
    /// whether the ground was hit.
    fn march(
        &self,
        height_m: f64,
        direction: DVec3,
        steps: u32,
        mut step: impl FnMut(f64, DVec3, DVec3),
    ) -> (DVec3, Option<DVec3>) {
        let origin = DVec3::new(0.0, 0.0, GROUND_M + height_m);
        let (r, mu) = (origin.z, direction.z);
        let top = GROUND_M + TOP_M;
        let below = r * r * (mu * mu - 1.0) + GROUND_M * GROUND_M;
        let hits_ground = mu < 0.0 && below > 0.0 && height_m > 0.0;
        let length = if hits_ground {
            -r * mu - libm::sqrt(below)
        } else {
            -r * mu + libm::sqrt(r * r * (mu * mu - 1.0) + top * top)
        };
        let mut passed = DVec3::ONE;
        for i in 0..steps {
            // Short steps near the observer, where the air is dense.
            let at = |i: f64| length * (i / f64::from(steps)) * (i / f64::from(steps));
            let (t0, t1) = (at(f64::from(i)), at(f64::from(i + 1)));
            let p = origin + direction * (0.5 * (t0 + t1));
            let h = (p.length() - GROUND_M).max(0.0);
            let (rayleigh, mie, ozone) = densities(h);
            let depth = (self.rayleigh * rayleigh + self.mie_extinction * mie + self.ozone * ozone)
                * (t1 - t0);
            let through = depth.map(|d| libm::exp(-d));
            // The step's own extinction, integrated: (1 − e^−d) / d.
            let mean = DVec3::from_array(std::array::from_fn(|k| {
                if depth[k] > 1e-6 {
                    (1.0 - through[k]) / depth[k]
                } else {
                    1.0
                }
            }));
            step(h, p, passed * mean * (t1 - t0));
            passed *= through;
        }
        (passed, hits_ground.then(|| origin + direction * length))
    }

    /// The multiply scattered light around a sun elevation.
    pub(crate) fn multiple_scattering(&self, sun_elevation_rad: f64) -> MultipleScattering {
        let table = (0..HEIGHTS * ELEVATIONS)
            .map(|i| {
                let u = (i / ELEVATIONS) as f64 / (HEIGHTS - 1) as f64;
                let v = (i % ELEVATIONS) as f64 / (ELEVATIONS - 1) as f64;
                self.all_orders(
                    // A hair above the ground, so that downward rays hit it.
                    1.0 + TABLE_TOP_M * u * u,
                    sun_elevation_rad + (2.0 * v - 1.0) * MAX_TURN_RAD,
                )
            })
            .collect();
        MultipleScattering {
            sun_elevation_rad,
            table,
        }
    }

    /// The geometric series of all orders: the second order over 1 minus the share that one more
    /// scattering keeps.
    fn all_orders(&self, height_m: f64, sun_elevation_rad: f64) -> DVec3 {
        const COSINES: u32 = 8;
        const AZIMUTHS: u32 = 4;
        let (sin, cos) = libm::sincos(sun_elevation_rad);
        let sun = DVec3::new(cos, 0.0, sin);
        let (mut second, mut kept) = (DVec3::ZERO, DVec3::ZERO);
        for i in 0..COSINES * AZIMUTHS {
            let mu = (f64::from(i / AZIMUTHS) + 0.5) / f64::from(COSINES) * 2.0 - 1.0;
            // The other half-turn mirrors this one.
            let (sa, ca) = libm::sincos((f64::from(i % AZIMUTHS) + 0.5) / f64::from(AZIMUTHS) * PI);
            let flat = libm::sqrt(1.0 - mu * mu);
            let d = DVec3::new(flat * ca, flat * sa, mu);
            let (passed, ground) = self.march(height_m, d, 12, |h, p, weight| {
                let (rayleigh, mie, _) = densities(h);
                let scattering = (self.rayleigh * rayleigh + self.mie_scattering * mie) * weight;
                second += scattering * self.lit(h, elevation(sun, p)) / (4.0 * PI);
                kept += scattering;
            });
            if let Some(p) = ground {
                let e = elevation(sun, p);
                let irradiance = self.lit(0.0, e) * libm::sin(e).max(0.0);
                second += passed * irradiance * self.ground_albedo / PI;
            }
        }
        let n = f64::from(COSINES * AZIMUTHS);
        (second / n) / (DVec3::ONE - (kept / n).min(DVec3::splat(0.98)))
    }

    /// The light of the sky from a direction (z up), for a sun of illuminance 1 with the unit
    /// direction `sun`.
    pub(crate) fn scattered(
        &self,
        direction: DVec3,
        sun: DVec3,
        multiple: &MultipleScattering,
    ) -> Scattered {
        let mut sum = Scattered::default();
        self.march(0.0, direction, 32, |h, p, weight| {
            let (rayleigh, mie, _) = densities(h);
            let e = elevation(sun, p);
            let lit = self.lit(h, e) * weight;
            let (rayleigh, mie) = (self.rayleigh * rayleigh, self.mie_scattering * mie);
            sum.rayleigh += lit * rayleigh;
            sum.mie += lit * mie;
            sum.multiple += (rayleigh + mie) * multiple.at(h, e) * weight;
        });
        sum
    }
}

impl MultipleScattering {
    fn at(&self, height_m: f64, elevation_rad: f64) -> DVec3 {
        let u = libm::sqrt((height_m / TABLE_TOP_M).clamp(0.0, 1.0)) * (HEIGHTS - 1) as f64;
        let v = ((elevation_rad - self.sun_elevation_rad) / MAX_TURN_RAD * 0.5 + 0.5)
            .clamp(0.0, 1.0)
            * (ELEVATIONS - 1) as f64;
        let (i, j) = (
            (u as usize).min(HEIGHTS - 2),
            (v as usize).min(ELEVATIONS - 2),
        );
        let at = |di: usize, dj: usize| self.table[(i + di) * ELEVATIONS + j + dj];
        let (fu, fv) = (u - i as f64, v - j as f64);
        at(0, 0)
            .lerp(at(0, 1), fv)
            .lerp(at(1, 0).lerp(at(1, 1), fv), fu)
    }
}

/// The molecules' phase function (Rayleigh).
#[inline]
pub(crate) fn rayleigh_phase(cos: f32) -> f32 {
    3.0 / (16.0 * std::f32::consts::PI) * (1.0 + cos * cos)
}

/// The aerosols' phase function.
#[inline]
pub(crate) fn mie_phase(cos: f32) -> f32 {
    henyey_greenstein(0.76, cos)
}

/// The phase function of Henyey and Greenstein (1941) with the mean cosine `g`.
#[inline]
pub(crate) fn henyey_greenstein(g: f32, cos: f32) -> f32 {
    let d = 1.0 + g * g - 2.0 * g * cos;
    (1.0 - g * g) / (4.0 * std::f32::consts::PI * d * d.sqrt())
}

fn smoothstep(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// The elevation of a direction over the local horizon of a point (earth's centre at 0).
fn elevation(direction: DVec3, p: DVec3) -> f64 {
    libm::asin((direction.dot(p) / p.length()).clamp(-1.0, 1.0))
}

/// Relative densities: molecules, aerosols, ozone.
fn densities(height_m: f64) -> (f64, f64, f64) {
    (
        libm::exp(-height_m / RAYLEIGH_SCALE_M),
        libm::exp(-height_m / MIE_SCALE_M),
        (1.0 - (height_m - OZONE_M).abs() / OZONE_HALF_WIDTH_M).max(0.0),
    )
}

/// The air between a height and the sun.
fn column_to_sun(height_m: f64, elevation_rad: f64) -> Column {
    let r = GROUND_M + height_m;
    let (cos, sin) = (libm::sin(elevation_rad), libm::cos(elevation_rad));
    let exponential =
        |scale: f64| libm::exp(-height_m / scale) * scale * chapman(r / scale, cos, sin);
    // Ozone is a thin shell, and the slant path is the same at each crossing.
    let shell = GROUND_M + OZONE_M;
    let above = ozone_above(height_m);
    let share = if elevation_rad >= 0.0 || r * sin > shell {
        above
    } else {
        2.0 - above
    };
    let crossing = (r * sin / shell).min(1.0);
    let slant = 1.0 / libm::sqrt((1.0 - crossing * crossing).max(1e-3));
    Column {
        rayleigh: exponential(RAYLEIGH_SCALE_M),
        mie: exponential(MIE_SCALE_M),
        ozone: share * OZONE_HALF_WIDTH_M * slant,
    }
}

/// The share of all ozone that is above a height.
fn ozone_above(height_m: f64) -> f64 {
    let x = ((height_m - OZONE_M) / OZONE_HALF_WIDTH_M).clamp(-1.0, 1.0);
    if x < 0.0 {
        1.0 - 0.5 * (1.0 + x) * (1.0 + x)
    } else {
        0.5 * (1.0 - x) * (1.0 - x)
    }
}

/// Slant over vertical column of an exponential atmosphere; `x` is radius over scale height, then
/// cosine and sine of the zenith angle. Within a few percent.
fn chapman(x: f64, cos: f64, sin: f64) -> f64 {
    let from_horizon_up = |x: f64, cos: f64| {
        // Fitzmaurice: sqrt(pi x / 2) erfcx(y), y = sqrt(x / 2) cos, with the upper bound
        // 2 / sqrt(pi) / (y + sqrt(y² + 4 / pi)) for erfcx, exact at both ends.
        let y = libm::sqrt(0.5 * x) * cos;
        libm::sqrt(2.0 * x) / (y + libm::sqrt(y * y + 4.0 / PI))
    };
    if cos >= 0.0 {
        from_horizon_up(x, cos)
    } else {
        // The column is that down to the lowest point and out again, less the part behind. Beyond
        // 50 scale heights no light comes through, so the exponent is limited there.
        let lowest = x * sin;
        2.0 * libm::exp((x - lowest).min(50.0)) * from_horizon_up(lowest, 0.0)
            - from_horizon_up(x, -cos)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The closed forms against brute-force integration along the ray.
    #[test]
    fn columns_are_integrals() {
        for (height, elevation_deg) in [
            (0.0, 90.0),
            (0.0, 30.0),
            (0.0, 5.0),
            (0.0, 0.5),
            (12_000.0, -2.0),
            (3_000.0, 10.0),
        ] {
            let e = f64::to_radians(elevation_deg);
            let (mut rayleigh, mut mie, mut ozone) = (0.0, 0.0, 0.0);
            let origin = DVec3::new(0.0, 0.0, GROUND_M + height);
            let d = DVec3::new(e.cos(), 0.0, e.sin());
            let step = 50.0;
            for i in 0..40_000 {
                let h = (origin + d * (step * (f64::from(i) + 0.5))).length() - GROUND_M;
                let rho = densities(h);
                rayleigh += rho.0 * step;
                mie += rho.1 * step;
                ozone += rho.2 * step;
            }
            let got = column_to_sun(height, e);
            let close = |a: f64, b: f64, tolerance: f64| (a / b - 1.0).abs() < tolerance;
            assert!(
                close(got.rayleigh, rayleigh, 0.06),
                "{height} {elevation_deg}: {} for {rayleigh}",
                got.rayleigh
            );
            assert!(
                mie < 1.0 || close(got.mie, mie, 0.08),
                "{height} {elevation_deg}: {} for {mie}",
                got.mie
            );
            assert!(
                close(got.ozone, ozone, 0.2),
                "{height} {elevation_deg}: {} for {ozone}",
                got.ozone
            );
        }
    }

    #[test]
    fn phase_functions_are_normalised() {
        for phase in [rayleigh_phase, mie_phase] {
            let n = 100_000;
            let sum: f64 = (0..n)
                .map(|i| f64::from(phase((f64::from(i) + 0.5) as f32 / n as f32 * 2.0 - 1.0)))
                .sum::<f64>()
                * 4.0
                * PI
                / f64::from(n);
            assert!((sum - 1.0).abs() < 1e-3, "{sum}");
        }
    }

    #[test]
    fn a_low_sun_is_red_and_dim() {
        let air = Atmosphere::new(3.0, DVec3::splat(0.1));
        let mut last = air.sun_transmittance(PI / 2.0);
        assert!(last.y > 0.6 && last.y < 0.85, "{last}");
        for deg in [60.0, 30.0, 15.0, 8.0, 4.0, 2.0, 1.0, 0.0] {
            let t = air.sun_transmittance(f64::to_radians(deg));
            assert!(t.max_element() < last.max_element(), "dimmer at {deg}");
            assert!(t.x / t.z > last.x / last.z, "redder at {deg}");
            last = t;
        }
        assert_eq!(air.sun_transmittance(f64::to_radians(-1.0)), DVec3::ZERO);
    }
}
