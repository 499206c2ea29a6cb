//! How much of a pulse's light surfaces send back.

use nemoral_scene::{
    Liquid, Material, MaterialId, MaterialLibrary, ObjectId, Semantic, SurfaceHit,
};
use nemoral_seed::{Domain, Draw, Key};

use crate::params::{ScannerParams, Wavelength};

/// Of an object all scanners of all worlds see the same, whatever their seeds: nothing is learnt
/// from the number of an object, which alone decides.
const OBJECTS: Key = Key::world(0).domain(Domain::new("lidar.reflectance"));

/// Of how many objects the factors are kept.
const KEPT: usize = 64;

/// The least variance of slopes that a glint has, of a mirror in a beam that does not widen: such a
/// pulse comes back whole, but only from a mirror that faces the scanner within a tenth of a
/// milliradian.
const LEAST_VARIANCE: f64 = 1e-8;

/// What surfaces send back, in the unit of a white matt plate that faces the sensor.
pub(crate) struct Reflection<'a> {
    materials: &'a MaterialLibrary,
    wavelength: Wavelength,
    /// Standard deviation of the logarithm of objects' reflectances.
    spread: f64,
    /// The variance of the directions of a sub-ray's light, radians².
    beam_variance: f64,
    /// Factors of objects that were met lately, each in the place of its number.
    kept: [(MaterialId, ObjectId, f64); KEPT],
}

impl<'a> Reflection<'a> {
    /// That of the light of a scanner.
    pub(crate) fn new(materials: &'a MaterialLibrary, params: &ScannerParams) -> Self {
        Self {
            materials,
            wavelength: params.wavelength,
            spread: params.errors.reflectance_spread,
            beam_variance: params.beam.part_variance(),
            kept: [(MaterialId(0), ObjectId::NONE, 1.0); KEPT],
        }
    }

    /// The share of a sub-ray's light that a surface sends back, by the cosine of the angle of
    /// incidence.
    pub(crate) fn sent_back(&mut self, hit: &SurfaceHit, cos: f64) -> f64 {
        let materials = self.materials;
        let material = materials.get(hit.material);
        let diffuse = self.of_material(hit, material) * cos;
        match &material.liquid {
            None => diffuse,
            Some(liquid) => diffuse + glint(liquid, cos, self.beam_variance),
        }
    }

    /// The diffuse reflectance of a surface.
    pub(crate) fn diffuse(&mut self, hit: &SurfaceHit) -> f64 {
        let materials = self.materials;
        self.of_material(hit, materials.get(hit.material))
    }

    fn of_material(&mut self, hit: &SurfaceHit, material: &Material) -> f64 {
        let reflectance = f64::from(self.wavelength.band(material).reflectance);
        if self.spread == 0.0 || hit.object.is_none() || !varies(material) {
            return reflectance;
        }
        (reflectance * self.factor(hit, &material.name)).min(1.0)
    }

    /// The factor of the reflectance of an object's parts of a material: log-normal, with mean 1.
    fn factor(&mut self, hit: &SurfaceHit, material: &str) -> f64 {
        let place = (hit.object.to_u64() ^ u64::from(hit.material.0) << 3) as usize % KEPT;
        let (of_material, of_object, factor) = self.kept[place];
        if (of_material, of_object) == (hit.material, hit.object) {
            return factor;
        }
        let key = OBJECTS.domain(Domain::new(material));
        let normal = key.item(hit.object.to_u64()).rng().normal();
        let factor = libm::exp(self.spread * (normal - 0.5 * self.spread));
        self.kept[place] = (hit.material, hit.object, factor);
        factor
    }
}

/// Whether reflectance differs between objects of a material: between plants, dead wood and rocks.
/// The ground is no object, and cells of it must not be told apart.
fn varies(material: &Material) -> bool {
    use Semantic as S;
    !material.ground
        && !matches!(
            material.semantic,
            S::Sky
                | S::Soil
                | S::Litter
                | S::GroundMoss
                | S::CutSlope
                | S::TrailSurface
                | S::TrailRut
                | S::TrailStrip
                | S::Water
                | S::Ice
                | S::Snow
                | S::AirborneEcho
        )
}

/// The light that the facets of a liquid's ripples send straight back, by the cosine of the angle
/// of incidence on its level surface, for light whose directions have this variance.
///
/// Slopes are Gaussian and the same in all directions (Cox and Munk 1954); of those that face the
/// sensor, `F₀ e^(−tan²α / s²) / (4 s² cos⁵α)` comes back, where s is the root mean square of all
/// slopes (Bufton et al. 1983, "Airborne lidar measurements of surface reflectance"). The beam's
/// width acts as slopes do.
fn glint(liquid: &Liquid, cos: f64, beam_variance: f64) -> f64 {
    let slope = f64::from(liquid.ripple_slope);
    let variance = (slope * slope + beam_variance).max(LEAST_VARIANCE);
    let cos_squared = cos * cos;
    let steepness = (1.0 - cos_squared) / (cos_squared * variance);
    // Infinite for light along the surface.
    if steepness > 80.0 {
        return 0.0;
    }
    let facing = f64::from(liquid.mirrored(1.0)) * libm::exp(-steepness);
    facing / (4.0 * variance * cos_squared * cos_squared * cos)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Beam, PulseErrors};
    use nemoral_scene::glam::{DVec3, Vec3};
    use nemoral_scene::{ChunkCoord, Hit};
    use std::f64::consts::{PI, TAU};

    fn water(ripple_slope: f32) -> Liquid {
        Liquid {
            refractive_index: 1.33,
            absorption_per_m: Vec3::ONE,
            ripple_slope,
            ripple_m: 0.5,
        }
    }

    /// Facets whose slopes are drawn evenly from their distribution mirror a beam each, and the
    /// light within a small cone about the way back is counted.
    #[test]
    fn a_glint_is_what_facets_mirror_straight_back() {
        let slope = 0.1;
        for incidence_deg in [0.0_f64, 4.0, 8.0, 12.0] {
            let (sin, cos) = incidence_deg.to_radians().sin_cos();
            let to_sensor = DVec3::new(sin, 0.0, cos);
            let (rings, turns) = (2000, 720);
            let cone_rad = 0.02_f64;
            let mut within = 0.0;
            for ring in 0..rings {
                // The squared slope is exponential with the mean slope².
                let share = (f64::from(ring) + 0.5) / f64::from(rings);
                let steep = slope * (-(1.0 - share).ln()).sqrt();
                for turn in 0..turns {
                    let azimuth = TAU * (f64::from(turn) + 0.5) / f64::from(turns);
                    let up = DVec3::new(-steep * azimuth.cos(), -steep * azimuth.sin(), 1.0);
                    let normal = up.normalize();
                    let facing = normal.dot(to_sensor);
                    if facing <= 0.0 {
                        continue;
                    }
                    let mirrored = normal * (2.0 * facing) - to_sensor;
                    if mirrored.angle_between(to_sensor) < cone_rad {
                        // A facet is larger than the level area below it, and takes the light of
                        // its own face.
                        within += facing / normal.z;
                    }
                }
            }
            // Light per level area that the beam lights, and per solid angle; a white plate that
            // faces the sensor sends back 1 / π of what it gets.
            let per_beam = within / f64::from(rings * turns) / cos;
            let solid_angle_sr = TAU * (1.0 - cone_rad.cos());
            let fresnel = (0.33_f64 / 2.33).powi(2);
            let expected = PI * fresnel * per_beam / solid_angle_sr;
            let found = glint(&water(slope as f32), cos, 0.0);
            assert!(
                (found / expected - 1.0).abs() < 0.03,
                "{incidence_deg}: {found} {expected}"
            );
        }
    }

    /// Still water is a mirror: it returns the whole beam, which spreads over four times the area
    /// that it would light on a plate at the same range.
    #[test]
    fn still_water_mirrors_the_beam_however_finely_it_is_cast() {
        let sigma = 0.002;
        let expected = (0.33_f64 / 2.33).powi(2) / (8.0 * sigma * sigma);
        for rings in [0, 2, 3, 5, 8] {
            let beam = Beam {
                horizontal_fwhm_rad: sigma * 2.354_820_045,
                vertical_fwhm_rad: sigma * 2.354_820_045,
                rings,
                ..Beam::default()
            };
            let axes = crate::beam::BeamAxes::along(DVec3::NEG_Z, DVec3::X);
            let part = |ray: &crate::beam::SubRay| {
                let cos = -axes.towards(ray).z;
                ray.weight * glint(&water(0.0), cos, beam.part_variance())
            };
            let found: f64 = beam.sub_rays().iter().map(part).sum();
            // The light of the beam's skirt is given to its middle.
            assert!(
                (0.95..1.25).contains(&(found / expected)),
                "{rings}: {found}"
            );
        }
        // Nothing comes back from where the mirror faces elsewhere.
        assert_eq!(glint(&water(0.0), 0.999, 0.0), 0.0);
        assert_eq!(glint(&water(0.1), 0.0, 0.0), 0.0);
        assert!(glint(&water(0.0), 1.0, 0.0).is_finite());
    }

    fn hit(object: u16, material: MaterialId) -> SurfaceHit {
        let object = ObjectId::new(ChunkCoord::new(3, -4), object).unwrap_or(ObjectId::NONE);
        let hit = Hit::new(5.0, Vec3::Z, material).with_object(object);
        hit.surface
    }

    #[test]
    fn objects_differ_and_the_ground_does_not() {
        let mut materials = MaterialLibrary::new();
        let mut add = |name: &str, semantic| {
            let mut material = Material::plain(name, semantic, Vec3::splat(0.2));
            material.optics.nm905.reflectance = 0.3;
            materials.add(material)
        };
        let bark = add("bark", Semantic::Stem);
        let leaf = add("leaf", Semantic::Leaf);
        let soil = add("soil", Semantic::Soil);
        let params = |reflectance_spread| ScannerParams {
            errors: PulseErrors {
                reflectance_spread,
                ..PulseErrors::default()
            },
            ..ScannerParams::default()
        };
        let mut all = Reflection::new(&materials, &params(0.1));
        let mut factor = |object, of| all.diffuse(&hit(object, of)) / f64::from(0.3_f32);
        let n = 40_000;
        let logs: Vec<f64> = (1..=n).map(|i| factor(i, bark).ln()).collect();
        let mean = logs.iter().sum::<f64>() / f64::from(n);
        let variance = logs.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / f64::from(n);
        let standard_error = 0.1 / f64::from(n).sqrt();
        assert!((mean + 0.005).abs() < 4.0 * standard_error, "{mean}");
        assert!((variance.sqrt() / 0.1 - 1.0).abs() < 0.02, "{variance}");
        // Leaves of a tree differ from its bark, and each keeps its own, whatever was asked before.
        let (once, leaves) = (factor(7, bark), factor(7, leaf));
        assert!(once != leaves && once != factor(8, bark));
        assert_eq!((factor(7, bark), factor(7, leaf)), (once, leaves));
        assert_eq!((factor(7, soil), factor(0, bark)), (1.0, 1.0));
        let mut none = Reflection::new(&materials, &params(0.0));
        assert_eq!(none.diffuse(&hit(7, bark)), f64::from(0.3_f32));
    }
}
