//! The materials of lianas and of resin on bark.

use glam::Vec3;
use nemoral_scene::{Material, MaterialId, MaterialLibrary, Optics, Semantic};
use nemoral_seed::Key;

use super::foliage::{CardKind, KindImages, register_flat};
use super::optics::{self, LeafOptics};
use super::plant_phenology;
use super::seasons::FullLeafMasks;
use crate::cards::lianas::{self, Bears};
use crate::tree::{FoliageCard, Season};

/// Images of lianas, and what their stems are made of.
#[derive(Clone, Debug)]
pub(crate) struct LianaMaterials {
    /// Clematis, which branches hold.
    pub(crate) clematis: Vec<FoliageCard>,
    /// Its stems, which hang free.
    pub(crate) rope: MaterialId,
    /// Honeysuckle, which the stem holds.
    pub(crate) honeysuckle: Vec<FoliageCard>,
    pub(crate) twiner: MaterialId,
}

const CLEMATIS: LeafOptics = LeafOptics {
    albedo: lianas::CLEMATIS,
    transmittance: Vec3::new(0.070, 0.132, 0.0),
    laser: optics::HERB.laser,
};
const HONEYSUCKLE: LeafOptics = LeafOptics {
    albedo: lianas::HONEYSUCKLE,
    transmittance: Vec3::new(0.058, 0.112, 0.0),
    laser: optics::HERB.laser,
};
const RESIN: LeafOptics = LeafOptics {
    albedo: lianas::RESIN,
    transmittance: Vec3::ZERO,
    laser: Optics::CUT_WOOD,
};

const LIANAS: [CardKind; 2] = [
    CardKind::new(
        "clematis.foliage",
        6,
        Semantic::Climber,
        CLEMATIS,
        |r, v| {
            let bears = match v {
                4 => Bears::Flowers,
                5 => Bears::Silk,
                _ => Bears::Leaves,
            };
            lianas::clematis(r, bears)
        },
    )
    .through(plant_phenology::LIANA)
    .on(Semantic::Branch),
    CardKind::new(
        "honeysuckle.foliage",
        5,
        Semantic::Climber,
        HONEYSUCKLE,
        |r, v| lianas::honeysuckle(r, v == 4),
    )
    .through(plant_phenology::LIANA)
    .on(Semantic::Stem),
];
const RUNS: [CardKind; 1] = [CardKind::new(
    "stem.resin",
    5,
    Semantic::Stem,
    RESIN,
    |r, _| lianas::resin(r),
)];

/// Draws the images of lianas.
pub(super) fn liana_images(key: Key, season: Option<&Season>) -> Vec<KindImages> {
    let kinds = LIANAS.iter();
    kinds.map(|kind| kind.images(key, season)).collect()
}

/// Draws runs of resin and registers them.
pub(super) fn resin(library: &mut MaterialLibrary, key: Key) -> Vec<FoliageCard> {
    let images = RUNS.iter().map(|kind| kind.images(key, None)).collect();
    register_flat(library, &RUNS, images, &mut FullLeafMasks::new())
        .next()
        .unwrap_or_default()
}

impl LianaMaterials {
    /// `wood` is what their stems look like.
    pub(super) fn register(
        library: &mut MaterialLibrary,
        images: Vec<KindImages>,
        wood: MaterialId,
        full_leaf: &mut FullLeafMasks,
    ) -> Self {
        let mut cards = register_flat(library, &LIANAS, images, full_leaf);
        let clematis = cards.next().unwrap_or_default();
        let honeysuckle = cards.next().unwrap_or_default();
        let wood = library.get(wood).clone();
        let mut stem = |name: &str, support| {
            library.add(Material {
                name: name.to_owned(),
                semantic: Semantic::Climber,
                support,
                ..wood.clone()
            })
        };
        Self {
            clematis,
            rope: stem("clematis.rope", None),
            honeysuckle,
            twiner: stem("honeysuckle.stem", Some(Semantic::Stem)),
        }
    }
}
