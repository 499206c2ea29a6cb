//! Registers what was baked and drawn as the materials of a world.

use std::sync::Arc;

use nemoral_scene::{Material, MaterialLibrary, Optics, Semantic, Texture};

use super::climbers::ClimberMaterials;
use super::communities::CommunityMaterials;
use super::deadwood::{DeadwoodMaterials, DeadwoodTextures};
use super::foliage::{FALLEN_LEAF, KINDS, KindImages, LeafImage, register_cards};
use super::ground::register_ground;
use super::seasons::{FullLeafMasks, SpeciesLeaves};
use super::solid::{SolidTextures, register_stump, solid};
use super::trees::{register_foliage, register_tree};
use super::{WorldMaterials, optics, seedling};
use crate::plant::rock::StoneMaterials;
use crate::tree::{FoliageCard, Species};

/// Names of the leaves of a species after its first ones.
const LATER: [&str; 3] = ["b", "c", "d"];

/// Images of seedlings, textures of deadwood, images of climbers and of closed vegetation.
pub(super) type Rare = (
    Vec<Vec<LeafImage>>,
    Option<DeadwoodTextures>,
    Option<Vec<KindImages>>,
    Vec<KindImages>,
);

impl WorldMaterials {
    pub(super) fn register(
        species: &[Species],
        (trails, floors): (Vec<[Arc<Texture>; 3]>, Vec<Arc<Texture>>),
        solids: SolidTextures,
        images: Vec<KindImages>,
        leaves: Vec<(SpeciesLeaves, Vec<Vec<LeafImage>>)>,
        (young, dead, climbing, closed): Rare,
    ) -> Self {
        let mut library = MaterialLibrary::new();
        let mut full_leaf = FullLeafMasks::new();
        let ground = register_ground(&mut library, floors, trails);
        let mut foliage: Vec<Vec<Vec<FoliageCard>>> = KINDS
            .iter()
            .chain([&FALLEN_LEAF])
            .zip(images)
            .map(|(kind, images)| register_cards(&mut library, kind, images, &mut full_leaf))
            .collect();
        // Kinds with one slice are lists of cards.
        let mut flat = |i: usize| -> Vec<FoliageCard> {
            std::mem::take(&mut foliage[i])
                .into_iter()
                .flatten()
                .collect()
        };
        let gorse = flat(0);
        let heather = flat(1);
        let bramble = flat(2);
        let bracken = flat(3);
        let bracken_dead = flat(4);
        let grass = flat(6);
        let broad_leaf = flat(7);
        let leafy_stem = flat(8);
        let trefoil = flat(9);
        let fallen_leaf = flat(10);
        let fronds = std::mem::take(&mut foliage[5]);

        let mut trees = Vec::new();
        let mut foliage_of_trees = Vec::new();
        let mut stumps = Vec::new();
        for ((species, barks), (leaves, images)) in species.iter().zip(&solids.barks).zip(leaves) {
            let mut images = images.into_iter();
            let first = images.next().unwrap_or_default();
            let tree = register_tree(&mut library, species, barks, &solids, first, &mut full_leaf);
            let mut foliage = vec![tree.foliage.clone()];
            for (number, images) in images.enumerate() {
                let part = format!("foliage.{}", LATER[number]);
                let cards = register_foliage(&mut library, species, &part, images, &mut full_leaf);
                foliage.push(cards);
            }
            trees.push(tree);
            foliage_of_trees.push((leaves, foliage));
            stumps.push(register_stump(&mut library, species, barks));
        }
        let mut add = |name: &str, semantic, albedo: &Arc<Texture>, roughness, optics| {
            library.add(solid(name, semantic, albedo.clone(), roughness, optics))
        };
        let rock = add("rock", Semantic::Rock, &solids.rock, 0.8, Optics::ROCK);
        let shrub_wood = add(
            "shrub.wood",
            Semantic::Shrub,
            &solids.shrub_wood,
            0.9,
            Optics::BARK,
        );
        let cane = add(
            "bramble.cane",
            Semantic::Bramble,
            &solids.cane,
            0.7,
            Optics::BARK,
        );
        let frond_stalk = add(
            "fern.stalk",
            Semantic::Fern,
            &solids.cane,
            0.7,
            optics::HERB.laser,
        );
        let herb_stalk = add(
            "herb.stalk",
            Semantic::Herb,
            &solids.cane,
            0.7,
            optics::HERB.laser,
        );
        let fallen_twig = add(
            "fallen.twig",
            Semantic::FallenTwig,
            &solids.dead,
            0.9,
            Optics::BARK,
        );
        let cone = add(
            "fallen.cone",
            Semantic::FallenTwig,
            &solids.cone,
            0.9,
            Optics::BARK,
        );
        let mut stone = solid(
            "trail.stone",
            Semantic::Stone,
            solids.stone.clone(),
            0.85,
            Optics::ROCK,
        );
        stone.tile_m = 0.5;
        let pebble = Material {
            name: "pebble".to_owned(),
            semantic: Semantic::Soil,
            ..stone.clone()
        };
        let (stone, pebble) = (library.add(stone), library.add(pebble));
        // Seedlings, deadwood, climbers and closed vegetation come last, so that all other
        // materials have the same number with and without them.
        let of_species = species.iter().zip(&solids.barks).zip(young);
        let seedlings = of_species
            .map(|((s, barks), young)| seedling::register(&mut library, s, barks, young))
            .collect();
        let deadwood = dead.map(|textures| {
            DeadwoodMaterials::register(&mut library, species, &solids, &textures, &ground)
        });
        let climbers = climbing.map(|images| ClimberMaterials::register(&mut library, images));
        let communities = CommunityMaterials::register(&mut library, closed, &mut full_leaf);
        Self {
            library,
            deadwood,
            climbers,
            lianas: None,
            resin: Vec::new(),
            surface_roots: Vec::new(),
            steps: Vec::new(),
            culvert: None,
            communities,
            trees,
            leaves: foliage_of_trees,
            full_leaf,
            stumps,
            seedlings,
            ground,
            rock,
            stones: StoneMaterials { stone, pebble },
            wet_rock: None,
            wet_stones: None,
            always_wet: Vec::new(),
            rock_face: None,
            shrub_wood,
            cane,
            frond_stalk,
            herb_stalk,
            fallen_twig,
            surface_root: None,
            bank_soil: None,
            cone,
            litter: Vec::new(),
            fruit: None,
            gorse,
            heather,
            bramble,
            bracken,
            bracken_dead,
            frond_height: 1.0,
            fronds,
            grass,
            broad_leaf,
            leafy_stem,
            trefoil,
            fallen_leaf,
        }
    }
}
