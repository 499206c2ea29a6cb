//! What seedlings are made of: leaves and thin bark of their species, under a semantic of their
//! own.

use nemoral_scene::{MaterialId, MaterialLibrary, Semantic};
use nemoral_seed::{Domain, Key};

use super::foliage::{LEAVES_IN_SHADE, register_leaves};
use super::solid::{BarkTextures, laser, solid};
use crate::cards::card_raster::{CardImage, TWIG_TEXELS};
use crate::cards::seedlings;
use crate::tree::{FoliageCard, LeafLook, Species};

const IMAGES: Domain = Domain::new("assets.cards.seedling");

/// The materials of a species' seedlings.
#[derive(Clone, Debug)]
pub(crate) struct SeedlingMaterials {
    /// Single leaves; of conifers shoots, short ones first.
    pub(crate) leaves: Vec<FoliageCard>,
    pub(crate) stem: MaterialId,
}

pub(super) fn images(look: &LeafLook, key: Key) -> Vec<CardImage> {
    let mean = look.reflectance() * LEAVES_IN_SHADE;
    let image = |variant: usize| {
        let mut rng = key.domain(IMAGES).item(variant as u64).rng();
        let drawing = seedlings::draw(look, variant, &mut rng);
        drawing.slices(1, TWIG_TEXELS, mean).swap_remove(0)
    };
    (0..seedlings::VARIANTS).map(image).collect()
}

pub(super) fn register(
    library: &mut MaterialLibrary,
    species: &Species,
    barks: &BarkTextures,
    images: Vec<CardImage>,
) -> SeedlingMaterials {
    let (name, bark) = (&species.name, &species.bark);
    let leaves = images.into_iter().enumerate().map(|(number, picture)| {
        let name = format!("{name}.seedling.{number}");
        register_leaves(library, &name, Semantic::Seedling, &species.leaves, picture)
    });
    SeedlingMaterials {
        leaves: leaves.collect(),
        stem: library.add(solid(
            &format!("{name}.seedling.stem"),
            Semantic::Seedling,
            barks.branch.clone(),
            bark.roughness as f32,
            laser([bark.nm905, 0.0], [bark.nm1550, 0.0]),
        )),
    }
}
