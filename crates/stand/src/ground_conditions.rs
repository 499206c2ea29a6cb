//! How wet, sunny and deep the ground of a place is, from its relief.

use nemoral_scene::Surface;
use nemoral_scene::glam::DVec2;

/// The radii of the rings on which the ground around a place is looked at, metres.
const RINGS_M: [f64; 2] = [10.0, 26.0];

/// How much the ground around rises on average, over the ring's radius, where a hollow's
/// wetness is 0.7. These are standard deviations over hills like those of the default terrain.
const HOLLOW: [f64; 2] = [0.022, 0.036];
/// The slope at which water runs off as readily as it gathers in such a hollow.
const RUN_OFF: f64 = 0.45;

/// Depth of soil over which its production falls by e: 1 / 0.023 cm (Heimsath et al. 1997, "The
/// soil production function and landscape equilibrium", Nature 388, doi 10.1038/41056).
const PRODUCTION_M: f64 = 0.435;
/// Production of bare rock over the diffusivity of soil, 1/m: 77 m in a million years over 50 cm² a
/// year (same source). Where the ground is more convex than that, rock is bare.
const BARE_CONVEXITY: f64 = 0.0154;
/// The slope on which no soil stays (Roering, Kirchner and Dietrich 1999, doi
/// 10.1029/1998WR900090).
const CRITICAL_SLOPE: f64 = 1.25;
/// The deepest soil that roots tell from deeper, metres.
const DEEPEST_M: f64 = 1.6;

/// The side of the equator on which a place is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hemisphere {
    /// The sun stands in the south at noon.
    #[default]
    Northern,
    /// The sun stands in the north at noon.
    Southern,
}

impl Hemisphere {
    /// That of a latitude, degrees north; the equator counts to the north.
    #[must_use]
    pub fn of_latitude(latitude_deg: f64) -> Self {
        if latitude_deg < 0.0 {
            Self::Southern
        } else {
            Self::Northern
        }
    }

    /// The direction on the map in which those slopes fall that the sun warms most, as it shines on
    /// them in the afternoon; √2 long.
    const fn warmest(self) -> DVec2 {
        match self {
            Self::Northern => DVec2::NEG_ONE,
            Self::Southern => DVec2::new(-1.0, 1.0),
        }
    }
}

/// The ground of a place, as plants find it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundConditions {
    /// From −1, a dry crest, over 0, as most of the ground, to 1, a soaked hollow.
    pub wetness: f64,
    /// Heat load by the sun, −1..=1: the sine of the slope's steepness, times the cosine of its
    /// direction to the south-west, or south of the equator to the north-west. 0 on level ground
    /// and on slopes across that.
    pub heat_load: f64,
    /// Depth of the soil over rock, metres, 0..=1.6.
    pub soil_m: f64,
}

impl GroundConditions {
    /// Moderately moist, level, with half a metre of soil: ground without any effect.
    pub const NEUTRAL: Self = Self {
        wetness: 0.0,
        heat_load: 0.0,
        soil_m: 0.5,
    };

    /// The conditions at a world position, from the ground within 26 m of it.
    ///
    /// Wetness is what a topographic wetness index measures, ln(catchment / slope) (Beven and
    /// Kirkby 1979), without a catchment, which reaches any distance: water gathers where the
    /// ground around is higher, at two scales, and runs off slopes. Heat load is the term of a
    /// slope's direction in the heat load of McCune and Keon (2002), which is greatest to the
    /// south-west; south of the equator it is mirrored to the north-west. Soil is as deep as where
    /// its production, which falls with depth, equals what creeps away: h = h₀ ln(P₀ / (−K ∇²z)),
    /// with a K that grows towards a critical slope.
    pub fn at(ground: &dyn Surface, world_m: DVec2, hemisphere: Hemisphere) -> Self {
        let here = ground.sample(world_m).height_m;
        let [near, far] = RINGS_M.map(|radius_m| ring(ground, world_m, here, radius_m));
        let (rises_m, slope) = ([near.0, far.0], near.1);
        let steepness = slope.length();
        let gathers: f64 = (0..2)
            .map(|i| rises_m[i] / (RINGS_M[i] * HOLLOW[i]))
            .sum::<f64>()
            / 2.0;
        let wet = gathers - steepness * steepness / (RUN_OFF * RUN_OFF);
        let to_the_sun = -slope.dot(hemisphere.warmest()) * std::f64::consts::FRAC_1_SQRT_2;
        // On a ring, the mean rise is a quarter of the Laplacian times the radius squared.
        let convexity = -4.0 * rises_m[0] / (RINGS_M[0] * RINGS_M[0]);
        Self {
            wetness: wet / libm::sqrt(1.0 + wet * wet),
            heat_load: to_the_sun / libm::sqrt(1.0 + steepness * steepness),
            soil_m: soil_m(convexity, steepness),
        }
    }

    /// A mean of four, such as those at the corners of a cell; the weights add up to 1.
    #[must_use]
    pub fn mean(of: [Self; 4], weights: [f64; 4]) -> Self {
        let sum = |value: fn(&Self) -> f64| {
            of.iter()
                .zip(weights)
                .map(|(one, weight)| weight * value(one))
                .sum()
        };
        Self {
            wetness: sum(|c| c.wetness),
            heat_load: sum(|c| c.heat_load),
            soil_m: sum(|c| c.soil_m),
        }
    }
}

/// The directions on a ring.
const WAYS: [DVec2; 8] = {
    const D: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [
        DVec2::new(1.0, 0.0),
        DVec2::new(D, D),
        DVec2::new(0.0, 1.0),
        DVec2::new(-D, D),
        DVec2::new(-1.0, 0.0),
        DVec2::new(-D, -D),
        DVec2::new(0.0, -1.0),
        DVec2::new(D, -D),
    ]
};

/// How much the ground rises on average from a place to a ring around it, metres, and the slope of
/// the plane of least squares through the ring.
fn ring(ground: &dyn Surface, middle_m: DVec2, here_m: f64, radius_m: f64) -> (f64, DVec2) {
    let (mut rise_m, mut around) = (0.0, DVec2::ZERO);
    for way in WAYS {
        let above_m = ground.height_m(middle_m + radius_m * way) - here_m;
        rise_m += above_m;
        around += above_m * way;
    }
    let count = WAYS.len() as f64;
    (rise_m / count, around * (2.0 / (count * radius_m)))
}

/// Depth of the soil where production and creep are in balance.
fn soil_m(convexity: f64, slope: f64) -> f64 {
    let steep = slope / CRITICAL_SLOPE;
    let stays = (1.0 - steep * steep).max(0.0);
    // In hollows soil only gathers; there it is as deep as it gets, but on steep slopes.
    let least = BARE_CONVEXITY * libm::exp(-DEEPEST_M / PRODUCTION_M);
    let ratio = BARE_CONVEXITY * stays / convexity.max(least);
    if ratio <= 1.0 {
        0.0
    } else {
        PRODUCTION_M * libm::log(ratio)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::{FlatSurface, SurfaceSample};

    /// A paraboloid of this curvature along both axes.
    struct Bowl(f64);

    impl Surface for Bowl {
        fn sample(&self, p: DVec2) -> SurfaceSample {
            SurfaceSample {
                height_m: 0.5 * self.0 * p.length_squared(),
                gradient: self.0 * p,
            }
        }
    }

    fn plane(x: f64, y: f64) -> GroundConditions {
        plane_in(Hemisphere::Northern, x, y)
    }

    fn plane_in(hemisphere: Hemisphere, x: f64, y: f64) -> GroundConditions {
        let ground = FlatSurface {
            height_m: 3.0,
            gradient: DVec2::new(x, y),
        };
        GroundConditions::at(&ground, DVec2::new(40.0, -7.0), hemisphere)
    }

    fn in_bowl(bend: f64) -> GroundConditions {
        GroundConditions::at(&Bowl(bend), DVec2::ZERO, Hemisphere::Northern)
    }

    #[test]
    fn hollows_are_wet_and_crests_are_dry() {
        let at = |bend| in_bowl(bend).wetness;
        assert!(at(0.01) > 0.7, "{}", at(0.01));
        assert!(at(-0.01) < -0.7);
        assert!((-1e-9..1e-9).contains(&at(0.0)));
        let mut before = -1.0;
        for i in -20..=20 {
            let wetness = at(f64::from(i) * 1e-3);
            assert!(wetness > before && wetness < 1.0);
            before = wetness;
        }
        // Water runs off slopes.
        assert!(plane(0.3, 0.0).wetness < -0.3);
        assert!(plane(0.6, 0.0).wetness < plane(0.3, 0.0).wetness);
    }

    #[test]
    fn the_sun_is_in_the_south_west() {
        // Slopes that fall to the south-west, north-east and south-east.
        let south_west = plane(0.4, 0.4).heat_load;
        assert!((south_west - 0.4 * 2.0_f64.sqrt() / 1.32_f64.sqrt()).abs() < 1e-12);
        assert!((plane(-0.4, -0.4).heat_load + south_west).abs() < 1e-12);
        assert!(plane(-0.4, 0.4).heat_load.abs() < 1e-12);
        assert_eq!(plane(0.0, 0.0).heat_load, 0.0);
    }

    #[test]
    fn south_of_the_equator_it_is_in_the_north_west() {
        let southern = Hemisphere::of_latitude(-38.0);
        assert_eq!(southern, Hemisphere::Southern);
        assert_eq!(Hemisphere::of_latitude(0.0), Hemisphere::Northern);
        // Slopes that fall to the north-west, south-east and south-west.
        let north_west = plane_in(southern, 0.4, -0.4).heat_load;
        assert!((north_west - plane(0.4, 0.4).heat_load).abs() < 1e-12 && north_west > 0.3);
        assert!((plane_in(southern, -0.4, 0.4).heat_load + north_west).abs() < 1e-12);
        assert!(plane_in(southern, 0.4, 0.4).heat_load.abs() < 1e-12);
        // Nothing else knows of it.
        let [here, there] = [plane(0.3, 0.1), plane_in(southern, 0.3, 0.1)];
        assert_eq!((here.wetness, here.soil_m), (there.wetness, there.soil_m));
    }

    #[test]
    fn soil_is_what_the_balance_leaves() {
        let soil = |bend| in_bowl(bend).soil_m;
        // A bowl of curvature c has a Laplacian of 2c.
        for convexity in [0.002_f64, 0.006, 0.012] {
            let expected = PRODUCTION_M * (BARE_CONVEXITY / convexity).ln();
            assert!((soil(-0.5 * convexity) - expected).abs() < 1e-9);
        }
        assert_eq!(soil(-0.01), 0.0);
        assert!((soil(0.01) - DEEPEST_M).abs() < 1e-9);
        assert!(plane(0.9, 0.0).soil_m < plane(0.3, 0.0).soil_m);
        assert_eq!(plane(1.3, 0.0).soil_m, 0.0);
    }

    #[test]
    fn the_mean_of_corners_is_between_them() {
        let [a, b] = [plane(0.1, 0.0), plane(0.5, 0.4)];
        let mean = GroundConditions::mean([a, b, a, b], [0.25; 4]);
        assert!((mean.wetness - 0.5 * (a.wetness + b.wetness)).abs() < 1e-12);
        assert!((mean.soil_m - 0.5 * (a.soil_m + b.soil_m)).abs() < 1e-12);
    }
}
