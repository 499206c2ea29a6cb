//! The materials of what grows on stems.

use glam::Vec3;
use nemoral_scene::{MaterialLibrary, Optics, Semantic};
use nemoral_seed::Key;

use super::foliage::{CardKind, KindImages, register_flat};
use super::optics::{self, LeafOptics};
use super::seasons::FullLeafMasks;
use crate::cards::climbers;
use crate::tree::FoliageCard;

/// Images of ivy and of moss on stems. Their surface is a climber or a growth, and what holds them
/// is the stem.
#[derive(Clone, Debug)]
pub(crate) struct ClimberMaterials {
    pub(crate) ivy: Vec<FoliageCard>,
    /// Ivy on the ground, which is a herb.
    pub(crate) carpet: Vec<FoliageCard>,
    pub(crate) moss: Vec<FoliageCard>,
}

const IVY: LeafOptics = LeafOptics {
    albedo: climbers::IVY,
    transmittance: Vec3::new(0.018, 0.045, 0.0),
    laser: optics::EVERGREEN.laser,
};
const MOSS: LeafOptics = LeafOptics {
    albedo: climbers::MOSS,
    transmittance: Vec3::ZERO,
    laser: Optics::MOSS,
};

const KINDS: [CardKind; 2] = [
    CardKind::new("ivy.foliage", 4, Semantic::Climber, IVY, |r, _| {
        climbers::ivy(r)
    })
    .on(Semantic::Stem),
    CardKind::new("stem.moss", 4, Semantic::StemGrowth, MOSS, |r, _| {
        climbers::moss(r)
    })
    .on(Semantic::Stem),
];

/// Draws the images.
pub(super) fn images(key: Key) -> Vec<KindImages> {
    // All of them are evergreen.
    KINDS.iter().map(|kind| kind.images(key, None)).collect()
}

impl ClimberMaterials {
    pub(super) fn register(library: &mut MaterialLibrary, images: Vec<KindImages>) -> Self {
        let mut cards = register_flat(library, &KINDS, images, &mut FullLeafMasks::new());
        let ivy = cards.next().unwrap_or_default();
        let moss = cards.next().unwrap_or_default();
        let carpet = ivy.iter().map(|card| {
            let mut material = library.get(card.material).clone();
            material.name = material.name.replace("ivy.", "ivy.carpet.");
            material.semantic = Semantic::Herb;
            material.support = None;
            FoliageCard {
                material: library.add(material),
                ..*card
            }
        });
        let carpet = carpet.collect();
        Self { ivy, carpet, moss }
    }
}
