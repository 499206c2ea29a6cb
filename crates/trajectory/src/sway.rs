//! How the attitude of what flies sways about its course.

use std::f64::consts::TAU;

use nemoral_seed::{Domain, Draw, Key};

const SWAY: Domain = Domain::new("trajectory.sway");

/// Sines of an angle.
const SINES: usize = 8;
/// The slowest and the fastest sway, Hz: a multirotor's gusts and its controller.
const SLOWEST_HZ: f64 = 0.1;
const FASTEST_HZ: f64 = 2.0;

/// Roll, pitch and heading as sums of sines, so that they are known at any time in any order.
#[derive(Clone, Debug)]
pub(crate) struct Sway(Box<[[Sine; SINES]; 3]>);

#[derive(Clone, Copy, Debug)]
struct Sine {
    amplitude_rad: f64,
    rate_rad_s: f64,
    phase_rad: f64,
}

impl Sway {
    /// With this standard deviation of roll and pitch, and twice that of the heading.
    pub(crate) fn new(sigma_rad: f64, key: Key) -> Self {
        let mut rng = key.domain(SWAY).rng();
        let octaves = libm::log(FASTEST_HZ / SLOWEST_HZ) / SINES as f64;
        Self(Box::new([1.0, 1.0, 2.0].map(|times| {
            let mut sines = std::array::from_fn(|i| {
                // One in each part of the band, so that no beat lasts.
                let part = i as f64 + rng.unit_f64();
                let rate_rad_s = TAU * SLOWEST_HZ * libm::exp(octaves * part);
                Sine {
                    // All parts turn the body equally fast, so that the slow ones turn it furthest.
                    amplitude_rad: 1.0 / rate_rad_s,
                    rate_rad_s,
                    phase_rad: rng.range_f64(0.0, TAU),
                }
            });
            let square = |sine: &Sine| 0.5 * sine.amplitude_rad * sine.amplitude_rad;
            let sigma = libm::sqrt(sines.iter().map(square).sum());
            for sine in &mut sines {
                sine.amplitude_rad *= times * sigma_rad / sigma;
            }
            sines
        })))
    }

    /// Roll, pitch and the deviation of the heading, radians.
    pub(crate) fn at(&self, time_s: f64) -> [f64; 3] {
        let value = |s: &Sine| s.amplitude_rad * libm::sin(s.rate_rad_s * time_s + s.phase_rad);
        self.0.each_ref().map(|sines| sines.iter().map(value).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_have_their_deviation_and_band() {
        let sway = Sway::new(0.02, Key::world(3));
        let count = 200_000;
        let mut squares = [0.0; 3];
        let mut crossings = [0_u32; 3];
        let mut last = sway.at(0.0);
        for i in 1..=count {
            let now = sway.at(0.01 * f64::from(i));
            for axis in 0..3 {
                squares[axis] += now[axis] * now[axis] / f64::from(count);
                crossings[axis] += u32::from(now[axis] * last[axis] < 0.0);
            }
            last = now;
        }
        for (axis, sigma) in [0.02, 0.02, 0.04].into_iter().enumerate() {
            let found = squares[axis].sqrt();
            assert!((found / sigma - 1.0).abs() < 0.03, "{axis}: {found}");
            let hz = f64::from(crossings[axis]) / 2.0 / 2000.0;
            assert!((SLOWEST_HZ..FASTEST_HZ).contains(&hz), "{axis}: {hz}");
        }
        assert_ne!(sway.at(5.0), Sway::new(0.02, Key::world(4)).at(5.0));
        assert_eq!(Sway::new(0.0, Key::world(3)).at(5.0), [0.0; 3]);
    }
}
