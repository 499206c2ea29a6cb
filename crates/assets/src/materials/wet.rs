//! Wet surfaces.

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{
    LaserBand, Material, MaterialId, MaterialLibrary, Optics, Semantic, Texture,
    specular_reflectance,
};

/// How much of a wet surface is darker than a dry one: stone is smooth here and there.
const SHARE: f32 = 0.85;
const ROUGHNESS: f32 = 0.35;

/// The albedo of a surface under a film of water, by channel (Lekner and Dorf 1988, "Why some
/// things are darker when wet", Applied Optics 27, 1278, doi 10.1364/AO.27.001278, equations 5, 10
/// and 14 for a refractive index of 1.33): light that the surface throws back is thrown back again
/// by the water.
pub(crate) fn wet_albedo(dry: Vec3) -> Vec3 {
    const FROM_AIR: f32 = 0.020;
    const FROM_WATER: f32 = 0.474;
    // Absorption under water relative to that in air, of surfaces that absorb little.
    const COUPLING: f32 = 1.067;
    let absorbed = Vec3::ONE - dry;
    let absorbed = absorbed * (dry * COUPLING + absorbed);
    let left = Vec3::ONE - absorbed;
    (1.0 - FROM_AIR) * (1.0 - FROM_WATER) * left / (Vec3::ONE - FROM_WATER * left)
}

/// What the interface adds to the albedo of a surface, a share of which is under a film: that of
/// `wet_albedo` is light from below the film alone, and the dry part's albedo has its own gleam.
/// The renderer takes the whole of it away again, where it adds what the interface reflects.
fn gleam_of_wet(share: f32, dry_roughness: f32, wet_roughness: f32) -> f32 {
    specular_reflectance(wet_roughness) - (1.0 - share) * specular_reflectance(dry_roughness)
}

/// A material of stone as it is when it is wet.
pub(super) fn wet_stone(dry: &Material) -> Material {
    let gleam = gleam_of_wet(SHARE, dry.roughness, ROUGHNESS);
    let texels: Vec<Vec3> = (dry.albedo.linear())
        .map(|dry| dry.lerp(wet_albedo(dry), SHARE) + gleam)
        .collect();
    let albedo = Texture::from_linear(dry.albedo.width(), dry.albedo.height(), &texels);
    Material {
        name: format!("{}.wet", dry.name),
        albedo: Arc::new(albedo.expect("it has the size of a texture")),
        roughness: ROUGHNESS,
        optics: Optics::WET_ROCK,
        ..dry.clone()
    }
}

/// How rain wets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wetting {
    /// The share of it that takes a film of water.
    share: f32,
    /// How rough what is soaked is at most, for the ways that a pixel of it faces.
    roughness: f32,
    /// Depth of the water that light of 1550 nm crosses twice, mm.
    water_mm: f32,
}

/// The absorption of light of 1550 nm by water (Hale and Querry 1973); at 905 nm it is a hundredth,
/// which a film does not show.
const ABSORPTION_1550_PER_MM: f32 = 0.811;

/// Shares, roughnesses and depths in the ranges that games (Lagarde 2013) and fields have, and our
/// choice.
const fn wetting(of: Semantic) -> Option<Wetting> {
    let (share, roughness, water_mm) = match of {
        Semantic::Sky
        | Semantic::Water
        | Semantic::Ice
        | Semantic::Snow
        | Semantic::AirborneEcho => return None,
        Semantic::Rock | Semantic::Stone => (SHARE, ROUGHNESS, 0.1),
        Semantic::TrailRut => (1.0, 0.45, 0.3),
        Semantic::Soil | Semantic::CutSlope | Semantic::TrailSurface | Semantic::TrailStrip => {
            (1.0, 0.65, 0.2)
        }
        // Waxy leaves shed water: some drops and a thin film stay.
        Semantic::Leaf
        | Semantic::Climber
        | Semantic::Shrub
        | Semantic::Bramble
        | Semantic::Grass
        | Semantic::Herb
        | Semantic::Fern
        | Semantic::Seedling => (0.3, 0.5, 0.05),
        // What faces all ways does not gleam as one surface.
        Semantic::Needle => (0.3, 1.0, 0.05),
        Semantic::GroundMoss | Semantic::StemGrowth => (0.8, 1.0, 0.3),
        // Bark, wood and litter.
        _ => (1.0, 0.75, 0.2),
    };
    Some(Wetting {
        share,
        roughness,
        water_mm,
    })
}

/// Wets the materials of a library, but for some, from 0, dry, to 1, soaked.
pub(crate) fn wet(library: &MaterialLibrary, wetness: f32, but: &[MaterialId]) -> MaterialLibrary {
    let mut known: Vec<(Arc<Texture>, [f32; 2], Arc<Texture>)> = Vec::new();
    let mut textures = |dry: &Arc<Texture>, share: f32, gleam: f32| {
        let by = [share, gleam];
        let is_same =
            |(of, known_by, _): &&(_, [f32; 2], _)| Arc::ptr_eq(of, dry) && *known_by == by;
        if let Some((_, _, wet)) = known.iter().find(is_same) {
            return Arc::clone(wet);
        }
        let film = |dry: f32| dry + (wet_albedo(Vec3::splat(dry)).x - dry) * share + gleam;
        let wet = Arc::new(dry.with_curve(film));
        known.push((Arc::clone(dry), by, Arc::clone(&wet)));
        wet
    };
    let mut wetted = MaterialLibrary::new();
    for (i, dry) in library.materials().iter().enumerate() {
        let takes_water = !but.contains(&MaterialId(i as u16));
        let material = match wetting(dry.semantic).filter(|_| takes_water) {
            None => dry.clone(),
            Some(of) => {
                let share = of.share * wetness;
                let depth = 2.0 * ABSORPTION_1550_PER_MM * of.water_mm * wetness;
                let through = libm::expf(-depth);
                let roughness =
                    dry.roughness + (of.roughness.min(dry.roughness) - dry.roughness) * wetness;
                let gleam = gleam_of_wet(share, dry.roughness, roughness);
                Material {
                    albedo: textures(&dry.albedo, share, gleam),
                    roughness,
                    optics: Optics {
                        nm905: filmed(dry.optics.nm905, share, 1.0),
                        nm1550: filmed(dry.optics.nm1550, share, through),
                    },
                    ..dry.clone()
                }
            }
        };
        wetted.add(material);
    }
    wetted
}

/// A surface under a film that lets this share of the light through on its way in and out.
fn filmed(dry: LaserBand, share: f32, through: f32) -> LaserBand {
    let wet = wet_albedo(Vec3::splat(dry.reflectance)).x * through;
    LaserBand {
        reflectance: dry.reflectance + (wet - dry.reflectance) * share,
        transmittance: dry.transmittance * (1.0 - share * (1.0 - through)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wet_surfaces_are_darker_by_the_published_amount() {
        for (dry, wet) in [(0.05, 0.0248), (0.10, 0.0509), (0.30, 0.171), (0.90, 0.800)] {
            let found = wet_albedo(Vec3::splat(dry)).x;
            assert!((found - wet).abs() < 0.004, "{dry}: {found} for {wet}");
        }
    }

    #[test]
    fn bark_is_darker_when_wet_and_most_of_all_at_1550_nm() {
        let mut library = MaterialLibrary::new();
        let band = |reflectance| LaserBand {
            reflectance,
            transmittance: 0.0,
        };
        let bark = library.add(Material {
            optics: Optics {
                nm905: band(0.36),
                nm1550: band(0.45),
            },
            ..Material::plain("bark", Semantic::Stem, Vec3::splat(0.2))
        });
        let bed = library.add(Material::plain("bed", Semantic::Soil, Vec3::splat(0.2)));
        let soaked = wet(&library, 1.0, &[bed]);
        let of = soaked.get(bark);
        assert!((below_interface(of).x - 0.1075).abs() < 0.004);
        assert!((of.optics.nm905.reflectance - 0.21).abs() < 0.02);
        // A fifth of a millimetre of water, there and back.
        assert!((of.optics.nm1550.reflectance - 0.206).abs() < 0.02);
        assert!(of.roughness < library.get(bark).roughness);
        assert_eq!(
            soaked.get(bed).albedo.mean(),
            library.get(bed).albedo.mean()
        );
        let damp = below_interface(wet(&library, 0.5, &[]).get(bark)).x;
        assert!(damp > 0.1075 && damp < 0.2);
    }

    /// The albedo without what the interface reflects, as the renderer scatters light below it.
    fn below_interface(of: &Material) -> Vec3 {
        of.albedo.mean() - specular_reflectance(of.roughness)
    }

    /// Below the interface there is the film's albedo where it is wet, and the dry one elsewhere.
    #[test]
    fn the_light_that_leaves_a_film_is_lost_no_second_time() {
        let mut library = MaterialLibrary::new();
        let mut add = |semantic, roughness, albedo| {
            library.add(Material {
                roughness,
                ..Material::plain("dry", semantic, Vec3::splat(albedo))
            })
        };
        for id in [
            add(Semantic::Soil, 1.0, 0.15),
            add(Semantic::Stem, 0.9, 0.06),
            add(Semantic::Leaf, 0.4, 0.12),
            add(Semantic::Leaf, 0.9, 0.12),
            add(Semantic::Rock, 0.8, 0.3),
        ] {
            let dry = library.get(id).clone();
            for wetness in [0.4, 1.0] {
                let soaked = wet(&library, wetness, &[]);
                let share = wetting(dry.semantic).expect("takes water").share * wetness;
                let film = wet_albedo(dry.albedo.mean()).x;
                let exact = below_interface(&dry).x * (1.0 - share) + film * share;
                let got = below_interface(soaked.get(id)).x;
                assert!((got - exact).abs() < 0.003, "{dry:?}: {got} for {exact}");
            }
        }
        let dry = Material {
            roughness: 0.9,
            ..Material::plain("stone", Semantic::Stone, Vec3::splat(0.25))
        };
        let film = wet_albedo(Vec3::splat(0.25)).x;
        let exact = below_interface(&dry).x * (1.0 - SHARE) + film * SHARE;
        let got = below_interface(&wet_stone(&dry)).x;
        assert!((got - exact).abs() < 0.003, "{got} for {exact}");
    }
}
