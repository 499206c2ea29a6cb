//! The materials of vegetation that closes over the ground.

use glam::Vec3;
use nemoral_scene::{MaterialLibrary, PlantCommunity, Semantic};
use nemoral_seed::{Key, PhiloxRng};
use rayon::prelude::*;

use super::foliage::{CardKind, KindImages, register_flat};
use super::optics::{self, LeafOptics};
use super::plant_phenology;
use super::seasons::FullLeafMasks;
use crate::cards::card_raster::CardDrawing;
use crate::cards::reed;
use crate::cards::sward::{self, Strip, THATCH};
use crate::tree::{FoliageCard, Season};

/// Images of what only closed vegetation has; those of a community that is not wanted are missing.
#[derive(Clone, Debug, Default)]
pub(crate) struct CommunityMaterials {
    /// Tall blades, by [`Hue::index`].
    pub(crate) tall: [Vec<FoliageCard>; 3],
    /// Short blades: green, and dry.
    pub(crate) short: [Vec<FoliageCard>; 2],
    pub(crate) thatch: Vec<FoliageCard>,
    pub(crate) heads: Vec<FoliageCard>,
    pub(crate) bilberry: Vec<FoliageCard>,
    pub(crate) nettle: Vec<FoliageCard>,
    /// Culms of reed: green, and last year's.
    pub(crate) reed: [Vec<FoliageCard>; 2],
    pub(crate) reed_leaves: Vec<FoliageCard>,
}

/// The colours of grass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Hue {
    /// As of most grass in spring.
    Green,
    /// Covered with wax, as of fescues and sedges.
    Glaucous,
    /// Dead on its stalk.
    Straw,
}

impl Hue {
    pub(crate) const fn index(self) -> usize {
        self as usize
    }
}

/// Between a herb's leaves and those of a beech in the shade.
const GREEN: LeafOptics = LeafOptics {
    albedo: Vec3::new(0.070, 0.118, 0.034),
    transmittance: Vec3::new(0.078, 0.130, 0.0),
    laser: optics::HERB.laser,
};
/// A seventh of it is wax, as on young leaves of the eucalypt.
const GLAUCOUS: LeafOptics = LeafOptics {
    albedo: Vec3::new(0.098, 0.140, 0.084),
    transmittance: Vec3::new(0.060, 0.100, 0.012),
    laser: optics::HERB.laser,
};
/// Cured and bleached by sun and rain, with dark bases.
const STRAW: LeafOptics = LeafOptics {
    albedo: sward::STRAW,
    transmittance: Vec3::new(0.105, 0.080, 0.030),
    laser: optics::CURED.laser,
};
const DEAD_BLADES: LeafOptics = LeafOptics {
    albedo: THATCH,
    transmittance: Vec3::new(0.060, 0.042, 0.014),
    laser: optics::CURED.laser,
};

/// Every kind of image.
const KINDS: [CardKind; 12] = [
    CardKind::new("sward.green", 3, Semantic::Grass, GREEN, |r, v| {
        strip(r, TALL, [0.03, 0.12, 0.25][v as usize % 3])
    })
    .through(plant_phenology::GRASS),
    CardKind::new("sward.glaucous", 2, Semantic::Grass, GLAUCOUS, |r, v| {
        let mut drawing = strip(r, WAXY, 0.1 * f64::from(v));
        drawing.tint(Vec3::new(1.05, 1.0, 2.1));
        drawing
    })
    .through(plant_phenology::GRASS),
    CardKind::new("sward.straw", 2, Semantic::Grass, STRAW, |r, v| {
        strip(r, TALL, [0.97, 0.72][v as usize % 2])
    }),
    CardKind::new("sward.short", 2, Semantic::Grass, GREEN, |r, v| {
        strip(r, SHORT, [0.03, 0.15][v as usize % 2])
    })
    .through(plant_phenology::GRASS),
    CardKind::new("sward.short_straw", 1, Semantic::Grass, STRAW, |r, _| {
        strip(r, SHORT, 0.8)
    }),
    CardKind::new("sward.thatch", 1, Semantic::Grass, DEAD_BLADES, |r, _| {
        sward::thatch(r)
    }),
    CardKind::new("sward.heads", 2, Semantic::Grass, STRAW, |r, _| {
        sward::heads(r)
    }),
    CardKind::new(
        "bilberry.foliage",
        3,
        Semantic::Shrub,
        optics::BILBERRY,
        |r, _| sward::bilberry(r),
    )
    .through(plant_phenology::BILBERRY),
    CardKind::new("nettle.stem", 3, Semantic::Herb, optics::BRAMBLE, |r, _| {
        sward::nettle(r)
    })
    .through(plant_phenology::TALL_HERB),
    CardKind::new("reed.culm", 3, Semantic::Grass, GLAUCOUS, |r, v| {
        reed::culm(r, v == 2)
    })
    .through(plant_phenology::REED),
    CardKind::new("reed.dead_culm", 2, Semantic::Grass, STRAW, |r, _| {
        reed::dead_culm(r)
    }),
    CardKind::new("reed.leaves", 2, Semantic::Grass, GLAUCOUS, |r, _| {
        reed::leaves(r)
    })
    .through(plant_phenology::REED),
];

const TALL: Strip = Strip {
    width_m: 0.24,
    height_m: 0.34,
    blades: 40,
    cured: 0.0,
};
const SHORT: Strip = Strip {
    width_m: 0.26,
    height_m: 0.10,
    blades: 64,
    cured: 0.0,
};
const WAXY: Strip = Strip {
    width_m: 0.24,
    height_m: 0.30,
    blades: 44,
    cured: 0.0,
};

/// Draws a strip of which this share is dead.
fn strip(rng: &mut PhiloxRng, of: Strip, cured: f64) -> CardDrawing {
    sward::strip(rng, &Strip { cured, ..of })
}

/// The images of those kinds that the communities need, in the order of all kinds.
pub(super) fn images(
    communities: &[PlantCommunity],
    key: Key,
    season: Option<&Season>,
) -> Vec<KindImages> {
    let has = |community| communities.contains(&community);
    let has_grass = communities.iter().any(|c| c.is_grass());
    let is_wanted = |i: usize| match i {
        7 => has(PlantCommunity::Bilberry),
        8 => has(PlantCommunity::Nettles),
        9..=11 => has(PlantCommunity::Reeds),
        _ => has_grass,
    };
    let kinds = KINDS.par_iter().enumerate();
    kinds
        .map(|(i, kind)| {
            if is_wanted(i) {
                kind.images(key, season)
            } else {
                KindImages::NONE
            }
        })
        .collect()
}

impl CommunityMaterials {
    pub(super) fn register(
        library: &mut MaterialLibrary,
        images: Vec<KindImages>,
        full_leaf: &mut FullLeafMasks,
    ) -> Self {
        let mut cards = register_flat(library, &KINDS, images, full_leaf);
        let mut next = || cards.next().unwrap_or_default();
        Self {
            tall: [next(), next(), next()],
            short: [next(), next()],
            thatch: next(),
            heads: next(),
            bilberry: next(),
            nettle: next(),
            reed: [next(), next()],
            reed_leaves: next(),
        }
    }
}
