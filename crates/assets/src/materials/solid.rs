//! Bark, wood and stone: textures without a mask, baked and registered as materials.

use std::cell::LazyCell;
use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{LaserBand, Material, MaterialId, MaterialLibrary, Optics, Semantic, Texture};
use nemoral_seed::{Domain, Key};
use rayon::prelude::*;

use super::TextureBaker;
use crate::textures::{bark, mineral};
use crate::tree::{BarkKind, Species, linear};

/// What a stump is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StumpMaterials {
    pub(crate) bark: MaterialId,
    /// The cut face: sawn lately, and years ago.
    pub(crate) faces: [MaterialId; 2],
}

/// Textures of wood and stone, baked side by side.
pub(super) struct SolidTextures {
    /// The textures of each species.
    pub(super) barks: Vec<BarkTextures>,
    pub(super) dead: Arc<Texture>,
    pub(super) snag: Arc<Texture>,
    pub(super) shrub_wood: Arc<Texture>,
    pub(super) cane: Arc<Texture>,
    pub(super) cone: Arc<Texture>,
    pub(super) rock: Arc<Texture>,
    pub(super) stone: Arc<Texture>,
}

/// Textures of one species' wood.
pub(super) struct BarkTextures {
    pub(super) lower: Arc<Texture>,
    /// The lower bark with moss at its foot.
    pub(super) foot: Arc<Texture>,
    /// The transition from the lower to the upper bark.
    pub(super) change: Arc<Texture>,
    pub(super) upper: Arc<Texture>,
    pub(super) branch: Arc<Texture>,
    /// The lower bark as it comes off a log; `None` without deadwood.
    pub(super) loosening: Option<Arc<Texture>>,
    /// Cut faces: sawn last winter, and some winters ago.
    pub(super) faces: [Arc<Texture>; 2],
}

impl BarkTextures {
    fn bake(baker: &TextureBaker, species: &Species, deadwood: bool, key: Key) -> Self {
        let seed = |item: u64| key.item(item).to_u64() as u32;
        let look = &species.bark;
        let lower = LazyCell::new(|| bark::bake(&look.lower, seed(0)));
        let stem = baker.bake(|| lower.clone());
        let foot = baker.bake(|| bark::with_foot(&lower, look.moss as f32, seed(1)));
        let (change, upper) = look.upper.map_or_else(
            || (stem.clone(), stem.clone()),
            |layer| {
                let upper = LazyCell::new(|| bark::bake(&layer, seed(2)));
                // Paper thins out slowly; rough bark and cork end at an edge.
                let soft = if layer.kind == BarkKind::Flakes {
                    0.26
                } else {
                    0.06
                };
                let change = baker.bake(|| bark::between(&lower, &upper, soft, seed(3)));
                (change, baker.bake(|| upper.clone()))
            },
        );
        let loosening = deadwood.then(|| baker.bake(|| bark::loosening(&lower.halved(), seed(7))));
        Self {
            loosening,
            lower: stem,
            foot,
            change,
            upper,
            branch: baker.bake(|| bark::twig(seed(4), linear(look.branch))),
            faces: [(5, 0.25), (6, 0.95)]
                .map(|(item, age)| baker.bake(|| mineral::cut_wood(seed(item), age))),
        }
    }
}

impl SolidTextures {
    pub(super) fn bake(
        baker: &TextureBaker,
        species: &[Species],
        deadwood: bool,
        key: Key,
    ) -> Self {
        let seed = |item: u64| key.item(item).to_u64() as u32;
        let barks = species
            .par_iter()
            .map(|s| BarkTextures::bake(baker, s, deadwood, key.domain(Domain::new(&s.name))))
            .collect();
        let twigs = [
            Vec3::new(0.098, 0.078, 0.058),
            Vec3::new(0.092, 0.082, 0.040),
            Vec3::new(0.105, 0.072, 0.048),
        ];
        let small: Vec<Arc<Texture>> = (0..7_u64)
            .into_par_iter()
            .map(|i| {
                baker.bake(|| match i {
                    0..3 => bark::twig(seed(23 + i), twigs[i as usize]),
                    3 => bark::dead(seed(26)),
                    4 => mineral::stone(seed(27)),
                    5 => mineral::rock(seed(40)),
                    // A dead stem: the same wood, greyer, most of its bark lost.
                    _ => bark::dead(seed(41)).with_mean(Vec3::new(0.140, 0.126, 0.110)),
                })
            })
            .collect();
        let at = |i: usize| small[i].clone();
        Self {
            barks,
            shrub_wood: at(0),
            cane: at(1),
            cone: at(2),
            dead: at(3),
            stone: at(4),
            rock: at(5),
            snag: at(6),
        }
    }
}

pub(super) fn laser(nm905: [f64; 2], nm1550: [f64; 2]) -> Optics {
    let band = |[reflectance, transmittance]: [f64; 2]| LaserBand {
        reflectance: reflectance as f32,
        transmittance: transmittance as f32,
    };
    Optics {
        nm905: band(nm905),
        nm1550: band(nm1550),
    }
}

pub(super) fn register_stump(
    library: &mut MaterialLibrary,
    species: &Species,
    barks: &BarkTextures,
) -> StumpMaterials {
    let look = &species.bark;
    let optics = laser([look.nm905, 0.0], [look.nm1550, 0.0]);
    let name = |part: &str| format!("{}.{part}", species.name);
    let bark = library.add(solid(
        &name("stump_bark"),
        Semantic::Stump,
        barks.foot.clone(),
        look.roughness as f32,
        optics,
    ));
    let faces = std::array::from_fn(|age| {
        library.add(solid(
            &name(&format!("stump_face.{age}")),
            Semantic::Stump,
            barks.faces[age].clone(),
            0.8,
            Optics::CUT_WOOD,
        ))
    });
    StumpMaterials { bark, faces }
}

/// A surface without a mask.
pub(super) fn solid(
    name: &str,
    semantic: Semantic,
    albedo: Arc<Texture>,
    roughness: f32,
    optics: Optics,
) -> Material {
    Material {
        name: name.to_owned(),
        semantic,
        support: None,
        albedo,
        transmittance: Vec3::ZERO,
        roughness,
        mask: None,
        ground: false,
        tile_m: 1.0,
        optics,
        liquid: None,
    }
}

/// The bark of a stem as it is on roots at the surface: trodden, splashed with soil.
pub(super) fn surface_root(stem: &Material) -> Material {
    const SOIL: Vec3 = Vec3::new(0.075, 0.052, 0.034);
    const SHARE: f32 = 0.45;
    let bark = &stem.albedo;
    let texels: Vec<Vec3> = bark.linear().map(|of| of.lerp(SOIL, SHARE)).collect();
    let albedo = Texture::from_linear(bark.width(), bark.height(), &texels);
    Material {
        name: format!("{}.surface_root", stem.name),
        semantic: Semantic::SurfaceRoot,
        albedo: Arc::new(albedo.expect("it has the size of a texture")),
        ..stem.clone()
    }
}
