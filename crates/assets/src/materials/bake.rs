//! Bakes the textures of a world's materials and draws their images.

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{Material, MaterialId, Semantic, Texture};
use nemoral_seed::{Domain, Key};
use rayon::prelude::*;

use super::deadwood::DeadwoodTextures;
use super::foliage::{KINDS, LeafImage, fallen_leaf_images, leaf_images};
use super::ground::{bake_floors, bake_trails};
use super::lianas::{self, LianaMaterials};
use super::litter::{self, LitterMaterials};
use super::seasons::SpeciesLeaves;
use super::solid::{self, SolidTextures};
use super::{
    MaterialSelection, TextureBaker, WorldMaterials, climbers, communities, plant_phenology,
    seedling, wet,
};
use crate::plant::rock::StoneMaterials;
use crate::plant::wayside::StepMaterials;
use crate::textures::fallen::FallenFoliage;
use crate::textures::mineral;
use crate::tree::{Season, SeasonalLeaves, Species, TreeMaterials};

const TEXTURES: Domain = Domain::new("assets.textures");
const CARDS: Domain = Domain::new("assets.cards");

impl WorldMaterials {
    /// Bakes every texture and draws every card; tasks are independent and land in a fixed order.
    /// What `wanted` leaves out is not made.
    pub(crate) fn bake(species: &[Species], wanted: MaterialSelection<'_>, key: Key) -> Self {
        let MaterialSelection {
            trees_per_ha,
            seedlings,
            deadwood,
            climbers,
            lianas,
            resin,
            communities,
            trail_surfaces,
            wayside,
            stream_stones,
            rock_faces,
            surface_roots,
            litter,
            season,
            textures: is_textured,
        } = wanted;
        let baker = &TextureBaker::new(is_textured);
        let textures = key.domain(TEXTURES);
        let cards = key.domain(CARDS);
        let fallen = &FallenFoliage::of(species, trees_per_ha);
        let ground = || {
            rayon::join(
                || bake_trails(baker, trail_surfaces, fallen, textures.item(100)),
                || bake_floors(baker, fallen, textures.item(200)),
            )
        };
        let of_species: Vec<SpeciesLeaves> = (species.iter())
            .map(|s| SpeciesLeaves::new(s, season.as_ref()))
            .collect();
        let solids = || SolidTextures::bake(baker, species, deadwood, textures.item(300));
        let foliage = || -> (Vec<_>, Vec<_>) {
            let kinds = KINDS
                .par_iter()
                .map(|kind| kind.images(cards, season.as_ref()));
            let trees = species.par_iter().zip(&of_species).map(|(s, leaves)| {
                let key = cards.domain(Domain::new(&s.name));
                let images = |season: Option<&SeasonalLeaves>| -> Vec<LeafImage> {
                    leaf_images(&leaves.summer, season, key)
                };
                match leaves.seasonal.is_empty() {
                    true => vec![images(None)],
                    false => leaves.seasonal.iter().map(|of| images(Some(of))).collect(),
                }
            });
            let kinds = || {
                let mut images: Vec<_> = kinds.collect();
                images.push(fallen_leaf_images(fallen, cards));
                images
            };
            rayon::join(kinds, || trees.collect())
        };
        let rare = || {
            let young = species.par_iter().zip(&of_species).filter(|_| seedlings);
            let young = young.map(|(s, leaves)| {
                let key = cards.domain(Domain::new(&s.name));
                seedling::images(&s.leaves, leaves.of_seedlings().as_ref(), key)
            });
            let dead = || deadwood.then(|| DeadwoodTextures::bake(baker, textures.item(400)));
            let climbing = || climbers.then(|| self::climbers::images(cards));
            let closed = || self::communities::images(communities, cards, season.as_ref());
            let ((young, dead), (climbing, closed)) = rayon::join(
                || rayon::join(|| young.collect(), dead),
                || rayon::join(climbing, closed),
            );
            (young, dead, climbing, closed)
        };
        let ((ground, solids), ((images, leaves), rare)) = rayon::join(
            || rayon::join(ground, solids),
            || rayon::join(foliage, rare),
        );
        let leaves = of_species.into_iter().zip(leaves).collect();
        let mut all = Self::register(species, ground, solids, images, leaves, rare);
        if wayside {
            all.wayside();
        }
        if stream_stones {
            let mut wet = |dry: MaterialId| {
                let wet = wet::wet_stone(all.library.get(dry));
                Some(all.library.add(wet))
            };
            all.wet_rock = wet(all.rock);
            let stone = wet(all.stones.stone);
            all.wet_stones = stone
                .zip(wet(all.stones.pebble))
                .map(|(stone, pebble)| StoneMaterials { stone, pebble });
            let stones = all.wet_stones.iter().flat_map(|of| [of.stone, of.pebble]);
            all.always_wet = all.wet_rock.into_iter().chain(stones).collect();
        }
        if rock_faces {
            let rock = all.library.get(all.rock).clone();
            let seed = textures.item(60).to_u64() as u32;
            all.rock_face = Some(all.library.add(Material {
                name: "ground.rock_face".to_owned(),
                albedo: baker.bake(|| mineral::cliff(seed)),
                ground: true,
                tile_m: mineral::CLIFF_M,
                ..rock
            }));
        }
        if litter {
            all.add_litter(species, season.as_ref(), cards);
        }
        if surface_roots {
            let root = |tree: &TreeMaterials| solid::surface_root(all.library.get(tree.stem));
            let roots: Vec<Material> = all.trees.par_iter().map(root).collect();
            all.surface_roots = roots.into_iter().map(|of| all.library.add(of)).collect();
        }
        if lianas {
            let images = self::lianas::liana_images(cards, season.as_ref());
            let (wood, full_leaf) = (all.shrub_wood, &mut all.full_leaf);
            let lianas = LianaMaterials::register(&mut all.library, images, wood, full_leaf);
            all.lianas = Some(lianas);
        }
        if resin {
            all.resin = self::lianas::resin(&mut all.library, cards);
        }
        all.frond_height = plant_phenology::frond_height(season.as_ref());
        all.full_leaf
            .sort_unstable_by_key(|(material, _)| material.0);
        all
    }

    /// Adds what lies across ways, under them and beside them, after all other materials, so that
    /// these have the same number with and without it.
    fn wayside(&mut self) {
        let bark = self.library.get(self.shrub_wood).clone();
        self.surface_root = Some(self.library.add(Material {
            name: "surface_root".to_owned(),
            semantic: Semantic::SurfaceRoot,
            ..bark
        }));
        let concrete = self.library.get(self.stones.stone).clone();
        let dark = Arc::new(Texture::plain(Vec3::splat(0.012)));
        let parts = [("culvert", concrete.albedo.clone()), ("culvert.dark", dark)];
        self.culvert = Some(parts.map(|(name, albedo)| {
            self.library.add(Material {
                name: name.to_owned(),
                albedo,
                ..concrete.clone()
            })
        }));
        let mut add = |name: &str, of: MaterialId| {
            let of = self.library.get(of).clone();
            self.library.add(Material {
                name: name.to_owned(),
                semantic: Semantic::TrailSurface,
                ground: false,
                ..of
            })
        };
        let log = add("step.log", self.fallen_twig);
        for trail in &self.ground.trails {
            let tread = add("step.tread", trail.surface);
            self.steps.push(StepMaterials { log, tread });
        }
        let soil = self.library.get(self.ground.cut_slope).clone();
        self.bank_soil = Some(self.library.add(Material {
            name: "bank.soil".to_owned(),
            ground: false,
            ..soil
        }));
    }

    /// Adds what each species sheds, after all other materials.
    fn add_litter(&mut self, species: &[Species], season: Option<&Season>, cards: Key) {
        let images: Vec<_> = (species.par_iter())
            .map(|s| litter::images(s, season, cards))
            .collect();
        for ((species, tree), images) in species.iter().zip(&self.trees).zip(images) {
            let of = LitterMaterials::register(&mut self.library, species, tree, images);
            self.litter.push(of);
        }
        let cone = self.library.get(self.cone).clone();
        self.fruit = Some(self.library.add(Material {
            name: "fallen.fruit".to_owned(),
            semantic: Semantic::FallenBark,
            ..cone
        }));
    }
}
