//! Foliage: images of leaves on cards, drawn and registered as materials.

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{Material, MaterialLibrary, Semantic};
use nemoral_seed::{Domain, Key, PhiloxRng};
use rayon::prelude::*;

use super::optics::{self, LeafOptics};
use super::plant_phenology::{self, PlantPhenology};
use super::seasons::FullLeafMasks;
use super::solid::{laser, solid};
use crate::cards::card_raster::{CardDrawing, CardImage, TWIG_TEXELS};
use crate::cards::{foliage, understory};
use crate::textures::fallen::{FallenFoliage, FallenLeaf};
use crate::tree::{FoliageCard, LeafLook, Season, SeasonalLeaves, linear};

/// A kind of card: what to draw, how often, and what it is.
pub(super) struct CardKind {
    name: &'static str,
    variants: u32,
    slices: usize,
    semantic: Semantic,
    support: Option<Semantic>,
    optics: LeafOptics,
    /// Evergreen without one.
    phenology: Option<PlantPhenology>,
    draw: fn(&mut PhiloxRng, u32) -> CardDrawing,
}

impl CardKind {
    pub(super) const fn new(
        name: &'static str,
        variants: u32,
        semantic: Semantic,
        optics: LeafOptics,
        draw: fn(&mut PhiloxRng, u32) -> CardDrawing,
    ) -> Self {
        Self {
            name,
            variants,
            slices: 1,
            semantic,
            support: None,
            optics,
            phenology: None,
            draw,
        }
    }

    /// What grows on such a surface.
    pub(super) const fn on(mut self, support: Semantic) -> Self {
        self.support = Some(support);
        self
    }

    /// What turns and dies in the course of a year.
    pub(super) const fn through(mut self, phenology: PlantPhenology) -> Self {
        self.phenology = Some(phenology);
        self
    }

    /// The variants' images, each in its slices; those of high summer without a season.
    pub(super) fn images(&self, key: Key, season: Option<&Season>) -> KindImages {
        self.images_of(&self.draw, key, season)
    }

    /// The same of other drawings.
    fn images_of(
        &self,
        draw: &(dyn Fn(&mut PhiloxRng, u32) -> CardDrawing + Sync),
        key: Key,
        season: Option<&Season>,
    ) -> KindImages {
        let mean = self.optics.albedo * LEAVES_IN_SHADE;
        let now = (self.phenology.zip(season))
            .and_then(|(phenology, season)| Some((phenology, phenology.phase(season)?)));
        let image = |variant: u32| {
            let key = key.domain(Domain::new(self.name)).item(u64::from(variant));
            let drawing = draw(&mut key.rng(), variant);
            let Some((phenology, phase)) = now else {
                return drawing.slices(self.slices, TWIG_TEXELS, mean);
            };
            let now = phenology.drawing(&drawing, phase, &self.optics, key.domain(SEASON));
            now.slices_within(&drawing, self.slices, TWIG_TEXELS, mean)
        };
        KindImages {
            optics: now.map_or(self.optics, |(phenology, phase)| {
                phenology.optics(phase, &self.optics)
            }),
            variants: (0..self.variants).into_par_iter().map(image).collect(),
        }
    }
}

/// The images of a kind, each in its slices, and the optics of its leaves.
#[derive(Clone, Debug)]
pub(super) struct KindImages {
    optics: LeafOptics,
    variants: Vec<Vec<CardImage>>,
}

impl KindImages {
    /// No images.
    pub(super) const NONE: Self = Self {
        optics: optics::HERB,
        variants: Vec::new(),
    };
}

/// The standard deviation of the slopes within an image of leaves: about 15 degrees of its leaves
/// against the image, and as much of a leaf's parts, as it is folded along its veins and curved,
/// against the leaf (our choice).
const LEAF_SPREAD: f32 = 0.37;

/// The roughness of the leaves of low plants: that of trees without a thick wax.
const HERB_ROUGHNESS: f32 = 0.5;

/// The roughness of an image of leaves of this roughness: as they do not face the same way, they
/// do not gleam at the same time. Variances of slopes add (Toksvig 2005, "Mipmapping normal maps");
/// that of a microfacet distribution of roughness r is r⁴ / 2.
fn of_spray(leaf: f32) -> f32 {
    let fourth = leaf.powi(4) + 2.0 * LEAF_SPREAD * LEAF_SPREAD;
    fourth.sqrt().sqrt().min(1.0)
}

/// Leaves in an image shade each other, which the colour and the transmittance of single leaves do
/// not include.
pub(super) const LEAVES_IN_SHADE: f32 = 0.92;

/// Dead fronds of bracken.
pub(super) const DEAD_FROND: LeafOptics = LeafOptics {
    albedo: Vec3::new(0.215, 0.125, 0.058),
    transmittance: Vec3::new(0.09, 0.04, 0.005),
    laser: optics::CURED.laser,
};
/// Grass tufts under trees: between a herb's leaves and those of a beech in the shade, and some
/// dead blades.
const GRASS: LeafOptics = LeafOptics {
    albedo: Vec3::new(0.080, 0.120, 0.036),
    transmittance: Vec3::new(0.078, 0.125, 0.0),
    laser: optics::HERB.laser,
};

pub(super) const KINDS: [CardKind; 10] = [
    CardKind::new(
        "gorse.foliage",
        4,
        Semantic::Shrub,
        optics::EVERGREEN,
        |r, v| understory::gorse(r, v == 3),
    )
    .through(plant_phenology::GORSE),
    CardKind::new(
        "heather.foliage",
        4,
        Semantic::Shrub,
        optics::EVERGREEN,
        |r, v| understory::heather(r, v >= 2),
    )
    .through(plant_phenology::HEATHER),
    CardKind::new(
        "bramble.foliage",
        6,
        Semantic::Bramble,
        optics::BRAMBLE,
        |r, v| understory::bramble(r, v == 5),
    )
    .through(plant_phenology::BRAMBLE),
    CardKind::new("bracken.pinna", 3, Semantic::Fern, optics::HERB, |r, _| {
        understory::bracken_pinna(r, false)
    })
    .through(plant_phenology::BRACKEN),
    CardKind::new(
        "bracken.dead_pinna",
        3,
        Semantic::Fern,
        DEAD_FROND,
        |r, _| understory::bracken_pinna(r, true),
    ),
    CardKind {
        slices: 3,
        ..CardKind::new(
            "male_fern.frond",
            3,
            Semantic::Fern,
            optics::HERB,
            |r, _| understory::fern_frond(r),
        )
        .through(plant_phenology::MALE_FERN)
    },
    CardKind::new("grass.blades", 6, Semantic::Grass, GRASS, |r, v| {
        understory::grass(
            r,
            [0.05, 0.10, 0.16, 0.30, 0.55, 0.2][v as usize % 6],
            v == 5,
        )
    })
    .through(plant_phenology::GRASS),
    CardKind::new(
        "herb.broad_leaf",
        4,
        Semantic::Herb,
        optics::HERB,
        |r, _| understory::broad_leaf(r),
    )
    .through(plant_phenology::ROSETTE),
    CardKind::new(
        "herb.leafy_stem",
        4,
        Semantic::Herb,
        optics::HERB,
        |r, v| understory::leafy_stem(r, v >= 2),
    )
    .through(plant_phenology::TALL_HERB),
    CardKind::new("herb.trefoil", 3, Semantic::Herb, optics::HERB, |r, _| {
        understory::trefoil(r)
    })
    .through(plant_phenology::TREFOIL),
];

/// Leaves on the ground, single and in relief. They are the undergrowth's here, and a stand's by
/// [`fallen_leaf_images`].
pub(super) const FALLEN_LEAF: CardKind = CardKind::new(
    "fallen.leaf",
    6,
    Semantic::FallenTwig,
    optics::LITTER_LEAF,
    |r, _| understory::fallen_leaf(r, &FallenLeaf::of_undergrowth()),
);

/// The images of [`FALLEN_LEAF`] of a stand's own leaves: of each species as many as its share in
/// the stand says.
pub(super) fn fallen_leaf_images(fallen: &FallenFoliage, key: Key) -> KindImages {
    let draw = |rng: &mut PhiloxRng, variant: u32| {
        let rank = (f64::from(variant) + 0.5) / f64::from(FALLEN_LEAF.variants);
        understory::fallen_leaf(rng, fallen.leaf_at_rank(rank))
    };
    FALLEN_LEAF.images_of(&draw, key, None)
}

/// Variants of each species' leafy twig.
const LEAF_VARIANTS: u64 = 5;

const SEASON: Domain = Domain::new("assets.cards.season");

/// An image of leaves, which may be those of a season.
pub(super) struct LeafImage {
    pub(super) image: CardImage,
    /// What its leaves are like; `None` if there are none.
    pub(super) leaves: Option<LeafLook>,
}

impl LeafImage {
    /// The image of a drawing of leaves that look like `look` in summer. Its mean is that of the
    /// leaves of summer.
    pub(super) fn new(
        drawing: &CardDrawing,
        (look, mean): (&LeafLook, Vec3),
        season: Option<&SeasonalLeaves>,
        key: Key,
    ) -> Self {
        let Some(season) = season else {
            return Self {
                image: drawing.slices(1, TWIG_TEXELS, mean).swap_remove(0),
                leaves: Some(look.clone()),
            };
        };
        let now = drawing.in_season(season, look.reflectance(), key.domain(SEASON));
        let mut images = now.slices_within(drawing, 1, TWIG_TEXELS, mean);
        Self {
            image: images.swap_remove(0),
            leaves: now.has_leaves().then(|| season.mean_look()),
        }
    }
}

/// The images of a species' leafy twigs, as bright as a shoot of such leaves.
pub(super) fn leaf_images(
    look: &LeafLook,
    season: Option<&SeasonalLeaves>,
    key: Key,
) -> Vec<LeafImage> {
    let mean = look.reflectance();
    let image = |variant| {
        let key = key.item(variant);
        let drawing = foliage::draw(look, &mut key.rng());
        LeafImage::new(&drawing, (look, mean), season, key)
    };
    (0..LEAF_VARIANTS).into_par_iter().map(image).collect()
}

/// Registers an image of a species' leaves, with the optics of its leaves whatever it is part of.
pub(super) fn register_leaves(
    library: &mut MaterialLibrary,
    name: &str,
    semantic: Semantic,
    leaves: &LeafLook,
    picture: CardImage,
) -> FoliageCard {
    let whole = picture.whole_mask.as_ref().unwrap_or(&picture.mask);
    let opaque_fraction = whole.opaque_fraction() as f32;
    // That of needles includes how they spread.
    let roughness = match leaves.roughness as f32 {
        needles if leaves.kind.is_needle() => needles,
        leaf => of_spray(leaf),
    };
    let optics = laser(leaves.nm905, leaves.nm1550);
    let material = library.add(Material {
        transmittance: linear(leaves.transmittance),
        mask: Some(Arc::new(picture.mask)),
        ..solid(name, semantic, Arc::new(picture.texture), roughness, optics)
    });
    FoliageCard {
        material,
        width_m: picture.width_m,
        height_m: picture.height_m,
        opaque_fraction,
    }
}

/// Registers kinds whose images have one slice each; the cards of each kind come back.
pub(super) fn register_flat(
    library: &mut MaterialLibrary,
    kinds: &[CardKind],
    images: Vec<KindImages>,
    full_leaf: &mut FullLeafMasks,
) -> std::vec::IntoIter<Vec<FoliageCard>> {
    let kinds = kinds.iter().zip(images);
    let cards = kinds.map(|(kind, images)| {
        let cards = register_cards(library, kind, images, full_leaf).into_iter();
        cards.flatten().collect()
    });
    let cards: Vec<Vec<FoliageCard>> = cards.collect();
    cards.into_iter()
}

/// Registers a kind's variants; each comes back as its slices.
pub(super) fn register_cards(
    library: &mut MaterialLibrary,
    kind: &CardKind,
    images: KindImages,
    full_leaf: &mut FullLeafMasks,
) -> Vec<Vec<FoliageCard>> {
    let mut number = 0;
    let optics = images.optics;
    (images.variants)
        .into_iter()
        .map(|slices| {
            slices
                .into_iter()
                .map(|picture| {
                    let whole = picture.whole_mask.as_ref().unwrap_or(&picture.mask);
                    let opaque_fraction = whole.opaque_fraction() as f32;
                    let material = library.add(Material {
                        name: format!("{}.{number}", kind.name),
                        semantic: kind.semantic,
                        support: kind.support,
                        albedo: Arc::new(picture.texture),
                        transmittance: optics.transmittance * LEAVES_IN_SHADE,
                        roughness: of_spray(HERB_ROUGHNESS),
                        mask: Some(Arc::new(picture.mask)),
                        ground: false,
                        tile_m: 1.0,
                        optics: optics.laser,
                        liquid: None,
                    });
                    number += 1;
                    full_leaf.extend(picture.whole_mask.map(|m| (material, Arc::new(m))));
                    FoliageCard {
                        material,
                        width_m: picture.width_m,
                        height_m: picture.height_m,
                        opaque_fraction,
                    }
                })
                .collect()
        })
        .collect()
}
