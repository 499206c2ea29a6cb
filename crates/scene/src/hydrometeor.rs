//! Water that falls: sizes, speeds and optical density of rain and snowfall.

use std::f64::consts::PI;

/// What falls.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Hydrometeor {
    /// Drops of rain.
    Raindrop,
    /// Aggregates of snow crystals, of a tenth of the density of water.
    Snowflake,
}

/// How many particles of which size there are: N0 e^(−Λ D) of the diameter D in a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeDistribution {
    /// The intercept N0: particles in a cubic metre for each metre of diameter, of the smallest
    /// ones, at least 0.
    pub intercept_per_m4: f64,
    /// The slope Λ: how fast they become fewer with their diameter, per metre, greater than 0.
    pub slope_per_m: f64,
}

impl Hydrometeor {
    /// The sizes at a rate of water, which is at least 0.
    ///
    /// Rain is that of Marshall and Palmer (1948, "The distribution of raindrops with size"), snow
    /// that of Gunn and Marshall (1958, "The distribution with size of aggregate snowflakes"),
    /// whose diameters are those of the melted flakes.
    #[must_use]
    pub fn sizes(self, mm_per_h: f64) -> SizeDistribution {
        if mm_per_h <= 0.0 {
            return SizeDistribution {
                intercept_per_m4: 0.0,
                slope_per_m: 1000.0,
            };
        }
        let melted_by = match self {
            Self::Raindrop => 1.0,
            Self::Snowflake => libm::cbrt(10.0),
        };
        let (intercept_per_m4, slope_per_m) = match self {
            Self::Raindrop => (8e6, 4100.0 * libm::pow(mm_per_h, -0.21)),
            Self::Snowflake => (
                3.8e6 * libm::pow(mm_per_h, -0.87),
                2550.0 * libm::pow(mm_per_h, -0.48),
            ),
        };
        SizeDistribution {
            intercept_per_m4: intercept_per_m4 / melted_by,
            slope_per_m: slope_per_m / melted_by,
        }
    }

    /// How fast one of this diameter falls in still air, m/s: Atlas, Srivastava and Sekhon (1973)
    /// for rain; aggregates fall at about 1 m/s, whatever their size.
    #[must_use]
    pub fn speed_m_s(self, diameter_m: f64) -> f64 {
        match self {
            Self::Raindrop => (9.65 - 10.3 * libm::exp(-600.0 * diameter_m)).max(0.1),
            Self::Snowflake => 1.0,
        }
    }
}

impl SizeDistribution {
    /// Particles in a cubic metre that are wider than this.
    #[must_use]
    pub fn per_m3_wider_than(&self, diameter_m: f64) -> f64 {
        self.intercept_per_m4 / self.slope_per_m * libm::exp(-self.slope_per_m * diameter_m)
    }

    /// The extinction, per metre, of all wavelengths alike: twice the particles' sections, as what
    /// is bent around them is lost, too.
    #[must_use]
    pub fn extinction_per_m(&self) -> f64 {
        PI * self.intercept_per_m4 / libm::pow(self.slope_per_m, 3.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the integrals of the distributions, computed apart from this program.
    #[test]
    fn rain_and_snow_have_their_sizes_and_their_extinction() {
        for (mm_per_h, extinction, drops, coarse) in [
            (1.0, 3.65e-4, 1951.0, 32.0),
            (10.0, 1.556e-3, 3165.0, 253.0),
            (25.0, 2.77e-3, 3836.0, 477.0),
        ] {
            let rain = Hydrometeor::Raindrop.sizes(mm_per_h);
            assert!((rain.extinction_per_m() / extinction - 1.0).abs() < 0.005);
            assert!((rain.per_m3_wider_than(0.0) / drops - 1.0).abs() < 0.005);
            assert!((rain.per_m3_wider_than(1e-3) / coarse - 1.0).abs() < 0.02);
        }
        for (mm_per_h, extinction) in [(0.5, 2.3e-3), (1.0, 3.3e-3), (2.0, 5.0e-3)] {
            let snow = Hydrometeor::Snowflake.sizes(mm_per_h);
            assert!((snow.extinction_per_m() / extinction - 1.0).abs() < 0.03);
        }
        assert_eq!(Hydrometeor::Snowflake.sizes(0.0).extinction_per_m(), 0.0);
    }

    #[test]
    fn drops_fall_as_fast_as_measured() {
        for (diameter_m, speed_m_s) in [(1e-3, 4.0), (2e-3, 6.55), (3e-3, 7.95), (4e-3, 8.72)] {
            let got = Hydrometeor::Raindrop.speed_m_s(diameter_m);
            assert!((got - speed_m_s).abs() < 0.02, "{got}");
        }
    }
}
