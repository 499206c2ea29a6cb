//! Rain and snowfall: single drops and flakes in the beam send light back.
//!
//! # Model
//! Sizes are exponential: there are `N0 e^(−Λ D)` particles of the diameter `D` per volume and
//! diameter. A beam has the section `c r²` at the range `r`, of which a particle covers a part, so
//! that it sends back `ρ π D² / (4 c r²)` of what a white wall would. It is seen from the diameter
//! on at which that is as strong as the reference target, so those that are seen are a Poisson
//! process along the beam with the rate
//! ```text
//! c r² N0 / Λ e^(−Λ K r max(r, r_near)),   K = √(4 t c / (π ρ)),
//! ```
//! where `c` is the beam's solid angle, `t` the power of the reference target, and `r_near` the
//! range below which the receiver is less sensitive. Each pulse draws its particles by itself (as
//! Hahner et al. 2022, "LiDAR Snowfall Simulation for Robust 3D Object Detection", do for each line
//! of a scanner), whatever is behind them.

use std::f64::consts::PI;

use nemoral_scene::SizeDistribution;
use nemoral_seed::{Draw, PhiloxRng};

use crate::echo::AirEcho;

/// Knots of the table of rates.
const KNOTS: usize = 256;
/// Steps of the integral between two knots.
const STEPS: u32 = 8;

/// The particles that a scanner sees.
#[derive(Clone, Debug)]
pub(crate) struct Precipitation {
    sizes: SizeDistribution,
    reflectance: f64,
    /// The beam's section over the square of the range: its solid angle.
    solid_angle_sr: f64,
    /// The diameter from which on particles are seen over `range · max(range, near)`.
    seen_per_m: f64,
    near_m: f64,
    /// The range of the first knot, and the distance between knots.
    first_m: f64,
    step_m: f64,
    /// The mean numbers of particles that are seen before the knots.
    expected: Vec<f64>,
}

impl Precipitation {
    /// What a scanner sees whose blind zone and range are these, whose beam has this solid angle,
    /// and whose weakest echo this power; `None` if it is nothing. A particle sends back as much
    /// light as a disc of its diameter with this reflectance.
    pub(crate) fn new(
        sizes: SizeDistribution,
        reflectance: f64,
        solid_angle_sr: f64,
        weakest: f64,
        near_m: f64,
        (first_m, last_m): (f64, f64),
    ) -> Option<Self> {
        let SizeDistribution {
            intercept_per_m4,
            slope_per_m,
        } = sizes;
        if intercept_per_m4 <= 0.0 || solid_angle_sr <= 0.0 || reflectance <= 0.0 {
            return None;
        }
        let seen_per_m = (4.0 * weakest * solid_angle_sr / (PI * reflectance)).sqrt();
        // Farther than this, not one in e^40 is large enough.
        let end_m = last_m.min((40.0 / (slope_per_m * seen_per_m)).sqrt());
        let step_m = (end_m - first_m).max(0.0) / (KNOTS - 1) as f64;
        let rate = |r: f64| {
            let least_m = seen_per_m * r * r.max(near_m);
            solid_angle_sr * r * r * intercept_per_m4 / slope_per_m
                * libm::exp(-slope_per_m * least_m)
        };
        let mut sum = 0.0;
        let expected = (0..KNOTS).map(|knot| {
            let here = sum;
            for step in 0..STEPS {
                let at = knot as f64 + (f64::from(step) + 0.5) / f64::from(STEPS);
                sum += rate(first_m + at * step_m) * step_m / f64::from(STEPS);
            }
            here
        });
        let expected: Vec<f64> = expected.collect();
        // Of the strangest numbers nothing is seen.
        let is_seen = sum > 0.0 && sum.is_finite();
        is_seen.then_some(Self {
            sizes,
            reflectance,
            solid_angle_sr,
            seen_per_m,
            near_m,
            first_m,
            step_m,
            expected,
        })
    }

    /// The mean number of particles that a pulse into the open sees.
    fn total(&self) -> f64 {
        self.expected[KNOTS - 1]
    }

    /// The range before which there are so many particles on average.
    fn range_m(&self, count: f64) -> f64 {
        let knot = self.expected.partition_point(|expected| *expected <= count) - 1;
        let (here, next) = (self.expected[knot], self.expected[knot + 1]);
        self.first_m + self.step_m * (knot as f64 + (count - here) / (next - here))
    }

    /// Calls `see` for each particle before a range that a pulse sees, nearest first. What is drawn
    /// does not depend on that range.
    pub(crate) fn each(&self, before_m: f64, rng: &mut PhiloxRng, mut see: impl FnMut(AirEcho)) {
        let mut count = 0.0;
        loop {
            count += rng.exponential();
            if count >= self.total() {
                return;
            }
            let range_m = self.range_m(count);
            if range_m >= before_m {
                return;
            }
            let least_m = self.seen_per_m * range_m * range_m.max(self.near_m);
            let diameter_m = least_m + rng.exponential() / self.sizes.slope_per_m;
            let covered =
                PI * diameter_m * diameter_m / (4.0 * self.solid_angle_sr * range_m * range_m);
            let sensitivity = (range_m / self.near_m.max(range_m)).powi(2);
            see(AirEcho {
                range_m,
                sent_back: self.reflectance * covered.min(1.0) * sensitivity,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use nemoral_scene::Hydrometeor;
    use nemoral_seed::Key;
    use proptest::prelude::*;

    use super::*;

    /// A Mid-40: 0.28° by 0.03°, 90 m at 10 %.
    fn mid40((of, mm_per_h): (Hydrometeor, f64), near_m: f64) -> Precipitation {
        let reflectance = match of {
            Hydrometeor::Raindrop => 0.024,
            Hydrometeor::Snowflake => 0.3,
        };
        let weakest = 0.1 / (90.0 * 90.0);
        let (sizes, reach_m) = (of.sizes(mm_per_h), (1.0, 260.0));
        let seen = Precipitation::new(sizes, reflectance, 2.90e-6, weakest, near_m, reach_m);
        seen.expect("something falls")
    }

    /// The means and medians were computed apart from this program, and one of them by brute force
    /// over 200,000 cones of drops.
    #[test]
    fn pulses_see_as_many_particles_as_the_integral_says() {
        let rain = |mm_per_h| (Hydrometeor::Raindrop, mm_per_h);
        let snow = (Hydrometeor::Snowflake, 1.0);
        for (particles, near_m, expected, median_m) in [
            (rain(10.0), 0.0, 0.1083, Some(3.34)),
            (rain(10.0), 10.0, 0.0123, None),
            (rain(2.0), 0.0, 0.0458, None),
            (rain(2.0), 10.0, 0.0028, None),
            (snow, 0.0, 1.08, Some(9.0)),
            (snow, 10.0, 0.94, None),
        ] {
            let seen = mid40(particles, near_m);
            assert!(
                (seen.total() / expected - 1.0).abs() < 0.02,
                "{} for {expected}",
                seen.total()
            );
            if let Some(median_m) = median_m {
                let got = seen.range_m(seen.total() / 2.0);
                assert!((got - median_m).abs() < 0.05, "{got}");
            }
            let pulses = 40_000_u64;
            let mut count = 0;
            for pulse in 0..pulses {
                let mut rng = Key::world(5).item(pulse).rng();
                seen.each(300.0, &mut rng, |_| count += 1);
            }
            let (got, sigma) = (f64::from(count), (seen.total() * pulses as f64).sqrt());
            assert!(
                (got - seen.total() * pulses as f64).abs() < 4.0 * sigma,
                "{got}"
            );
        }
    }

    #[test]
    fn particles_are_stable() {
        let seen = mid40((Hydrometeor::Snowflake, 2.0), 10.0);
        let mut sum = (0, 0.0, 0.0);
        for pulse in 0..20 {
            let mut rng = Key::world(3).item(pulse).rng();
            seen.each(40.0, &mut rng, |p| {
                sum = (sum.0 + 1, sum.1 + p.range_m, sum.2 + p.sent_back);
            });
        }
        let (count, ranges_m, sent_back) = sum;
        let rounded = ((ranges_m * 1e4).round(), (sent_back * 1e6).round());
        assert_eq!((count, rounded), (31, (3_637_466.0, 178_664.0)));
    }

    proptest! {
        /// What is nearer than a surface does not depend on it, nothing is behind it, and all are
        /// at least as strong as the weakest echo.
        #[test]
        fn a_surface_hides_the_particles_behind_it(
            seed in any::<u64>(),
            before_m in 1.0_f64..40.0,
            mm_per_h in 0.1_f64..5.0,
            near_m in 0.0_f64..20.0,
        ) {
            let seen = mid40((Hydrometeor::Snowflake, mm_per_h), near_m);
            let particles = |before_m: f64| {
                let mut all = Vec::new();
                seen.each(before_m, &mut Key::world(seed).rng(), |p| all.push(p));
                all
            };
            let all = particles(300.0);
            let near: Vec<_> = all.iter().copied().filter(|p| p.range_m < before_m).collect();
            prop_assert_eq!(near, particles(before_m));
            prop_assert!(all.is_sorted_by(|a, b| a.range_m <= b.range_m));
            for p in &all {
                prop_assert!((1.0..260.0).contains(&p.range_m));
                let power = p.sent_back / (p.range_m * p.range_m);
                prop_assert!(power > 0.999_999 * 0.1 / (90.0 * 90.0) || p.sent_back > 0.29);
            }
        }
    }
}
