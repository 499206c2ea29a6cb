//! The materials of what a species sheds.

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{Material, MaterialId, MaterialLibrary, Semantic};
use nemoral_seed::{Domain, Key};
use rayon::prelude::*;

use super::optics;
use super::solid::solid;
use crate::cards::card_raster::CardImage;
use crate::cards::litter;
use crate::tree::{FoliageCard, Season, Species, TreeMaterials, linear};

const IMAGES: Domain = Domain::new("assets.cards.shed");

/// What the litter of a species is made of.
#[derive(Clone, Debug)]
pub(crate) struct LitterMaterials {
    /// Dead leaves, each as its half at the stalk and its half at the tip; of conifers mats of
    /// needles, which are one piece each.
    pub(crate) leaves: Vec<Vec<FoliageCard>>,
    pub(crate) twig: MaterialId,
    /// Bark of the upper stem, and of its foot.
    pub(crate) barks: [MaterialId; 2],
}

/// The most that is left of the colour of an autumn leaf once it has lain for some days, linear
/// RGB: its yellow goes within weeks, and brown pigments form (PROSPECT-D).
const LAIN: Vec3 = Vec3::new(0.238, 0.145, 0.096);

/// How much of its own colour a leaf that has just fallen keeps, and how much of the images of
/// each tint are such leaves right after the fall (our choice).
const FRESH_COLOUR: f32 = 0.7;
const FRESH: [f32; litter::VARIANTS] = [1.0, 0.8, 0.9, 0.6, 0.3];

/// The mean colour of each image of a species' litter.
fn colours(species: &Species, season: Option<&Season>) -> [Vec3; litter::VARIANTS] {
    let albedo = linear(species.litter_look().albedo);
    let usual = litter::TINTS.map(|tint| albedo * tint);
    let Some((season, phenology)) = season.zip(species.phenology) else {
        return usual;
    };
    let fallen = linear(phenology.withered.albedo).min(LAIN);
    let fresh = albedo.lerp(fallen, FRESH_COLOUR);
    let share = phenology.fresh_litter(season) as f32;
    std::array::from_fn(|i| usual[i].lerp(fresh, share * FRESH[i]))
}

/// The images of a species' litter, each in its pieces.
pub(super) fn images(
    species: &Species,
    season: Option<&Season>,
    cards: Key,
) -> Vec<Vec<CardImage>> {
    let (look, litter_look) = (&species.leaves, species.litter_look());
    let colours = colours(species, season);
    let key = cards.domain(Domain::new(&species.name)).domain(IMAGES);
    let image = |variant: usize| {
        let mut rng = key.item(variant as u64).rng();
        let mut drawing = litter::draw(look, &litter_look, &mut rng);
        drawing.tint(colours[variant] / linear(litter_look.albedo));
        drawing.slices(litter::slices(look), litter::texels(look), colours[variant])
    };
    (0..litter::VARIANTS).into_par_iter().map(image).collect()
}

impl LitterMaterials {
    /// `tree` are the materials of the species' trees, whose bark lies on the ground, too.
    pub(super) fn register(
        library: &mut MaterialLibrary,
        species: &Species,
        tree: &TreeMaterials,
        images: Vec<Vec<CardImage>>,
    ) -> Self {
        let name = |part: &str| format!("{}.shed.{part}", species.name);
        let mut number = 0;
        let mut leaf = |picture: CardImage| {
            let opaque_fraction = picture.mask.opaque_fraction() as f32;
            let of_leaf = optics::LITTER_LEAF;
            let plain = solid(
                &name(&format!("leaf.{number}")),
                Semantic::Litter,
                Arc::new(picture.texture),
                0.8,
                of_leaf.laser,
            );
            number += 1;
            FoliageCard {
                material: library.add(Material {
                    transmittance: of_leaf.transmittance,
                    mask: Some(Arc::new(picture.mask)),
                    ..plain
                }),
                width_m: picture.width_m,
                height_m: picture.height_m,
                opaque_fraction,
            }
        };
        let leaves = images
            .into_iter()
            .map(|pieces| pieces.into_iter().map(&mut leaf).collect())
            .collect();
        let mut of_wood = |part: &str, wood, semantic| {
            let wood = library.get(wood).clone();
            library.add(Material {
                name: name(part),
                semantic,
                ..wood
            })
        };
        Self {
            leaves,
            twig: of_wood("twig", tree.branch, Semantic::FallenTwig),
            barks: [
                of_wood("bark.upper", tree.upper, Semantic::FallenBark),
                of_wood("bark.lower", tree.stem, Semantic::FallenBark),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lightest image of a species' litter on a day at 60 degrees north.
    fn lightest(species: &Species, day_of_year: f64) -> Vec3 {
        let season = Season {
            day_of_year,
            latitude_deg: 60.0,
        };
        let all = colours(species, Some(&season)).into_iter();
        all.max_by(|a, b| a.x.total_cmp(&b.x)).expect("five images")
    }

    #[test]
    fn fallen_birch_leaves_do_not_stay_yellow() {
        // Half of the leaves have fallen on day 275.
        for day in [275.0, 300.0, 354.0] {
            let birch = lightest(&Species::silver_birch(), day);
            assert!(birch.x < 0.26 && birch.x < 2.2 * birch.y, "{day}: {birch}");
            assert!(birch.x < 6.0 * birch.z, "{day}: {birch}");
        }
    }

    /// Leaves that are brown when they fall keep their colour.
    #[test]
    fn fresh_oak_litter_is_russet() {
        let oak = Species::english_oak();
        let withered = linear(oak.phenology.expect("it is deciduous").withered.albedo);
        assert_eq!(withered.min(LAIN), withered);
    }
}
