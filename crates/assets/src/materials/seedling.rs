//! What seedlings are made of: leaves and thin bark of their species, under a semantic of their
//! own.

use nemoral_scene::{MaterialId, MaterialLibrary, Semantic};
use nemoral_seed::{Domain, Key};

use super::foliage::{LEAVES_IN_SHADE, LeafImage, register_leaves};
use super::solid::{BarkTextures, laser, solid};
use crate::cards::seedlings;
use crate::tree::{FoliageCard, LeafLook, SeasonalLeaves, Species};

const IMAGES: Domain = Domain::new("assets.cards.seedling");

/// The materials of a species' seedlings.
#[derive(Clone, Debug)]
pub(crate) struct SeedlingMaterials {
    /// Single leaves; of conifers shoots, short ones first.
    pub(crate) leaves: Vec<FoliageCard>,
    pub(crate) stem: MaterialId,
}

pub(super) fn images(look: &LeafLook, season: Option<&SeasonalLeaves>, key: Key) -> Vec<LeafImage> {
    let mean = look.reflectance() * LEAVES_IN_SHADE;
    let image = |variant: usize| {
        let key = key.domain(IMAGES).item(variant as u64);
        let drawing = seedlings::draw(look, variant, &mut key.rng());
        LeafImage::new(&drawing, (look, mean), season, key)
    };
    (0..seedlings::VARIANTS).map(image).collect()
}

pub(super) fn register(
    library: &mut MaterialLibrary,
    species: &Species,
    barks: &BarkTextures,
    images: Vec<LeafImage>,
) -> SeedlingMaterials {
    let (name, bark) = (&species.name, &species.bark);
    let leaves = images.into_iter().enumerate().map(|(number, of)| {
        let name = format!("{name}.seedling.{number}");
        let single = of.leaves.unwrap_or_else(|| species.leaves.clone());
        let shade = f64::from(LEAVES_IN_SHADE);
        let look = LeafLook {
            transmittance: single.transmittance.map(|t| shade * t),
            ..single
        };
        register_leaves(library, &name, Semantic::Seedling, &look, of.image)
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
