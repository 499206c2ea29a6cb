//! All materials of a world, baked and registered.

mod climbers;
mod communities;
mod deadwood;
mod foliage;
mod ground;
mod lianas;
mod litter;
pub(crate) mod optics;
mod plant_phenology;
mod seasons;
mod seedling;
mod solid;
mod trees;
mod wet;

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{Material, TrailSurfaceKind};
use nemoral_scene::{MaterialId, MaterialLibrary, Optics, PlantCommunity, Semantic, Texture};
use nemoral_seed::{Domain, Key};
use rayon::prelude::*;

use self::deadwood::DeadwoodTextures;
use self::foliage::{
    FALLEN_LEAF, KINDS, KindImages, LeafImage, fallen_leaf_images, leaf_images, register_cards,
};
use self::ground::{bake_floors, bake_trails, register_ground};
use self::seasons::SpeciesLeaves;
use self::solid::{SolidTextures, register_stump, solid};
use self::trees::{register_foliage, register_tree};
use crate::plant::rock::StoneMaterials;
use crate::plant::wayside::StepMaterials;
use crate::textures::fallen::FallenFoliage;
use crate::textures::mineral;
use crate::textures::tile::Tile;
use crate::tree::{FoliageCard, Season, SeasonalLeaves, Species, TreeMaterials};

pub(crate) use self::climbers::ClimberMaterials;
pub(crate) use self::communities::{CommunityMaterials, Hue};
pub(crate) use self::deadwood::{DeadwoodMaterials, LogMaterials, RootPlateMaterials};
pub use self::ground::{GroundMaterials, TrailMaterials};
pub(crate) use self::lianas::LianaMaterials;
pub(crate) use self::litter::LitterMaterials;
pub(crate) use self::seasons::{FullLeafMasks, LeafingGroup};
pub(crate) use self::seedling::SeedlingMaterials;
pub(crate) use self::solid::StumpMaterials;
pub(crate) use self::wet::wet;

const TEXTURES: Domain = Domain::new("assets.textures");
const CARDS: Domain = Domain::new("assets.cards");

/// Names of the leaves of a species after its first ones.
const LATER: [&str; 3] = ["b", "c", "d"];

/// Bakes textures, or spares their baking.
#[derive(Clone, Debug)]
struct TextureBaker {
    /// What every tile has if textures are not wanted.
    plain: Option<Arc<Texture>>,
}

impl TextureBaker {
    fn new(textures: bool) -> Self {
        let plain = (!textures).then(|| Arc::new(Texture::plain(Vec3::splat(0.2))));
        Self { plain }
    }

    /// The texture of a tile, which is only made if textures are wanted.
    fn bake(&self, tile: impl FnOnce() -> Tile) -> Arc<Texture> {
        let plain = self.plain.clone();
        plain.unwrap_or_else(|| Arc::new(tile().texture()))
    }
}

/// The materials that plants are made of, with the library that holds them.
#[derive(Clone, Debug)]
pub(crate) struct WorldMaterials {
    pub(crate) library: MaterialLibrary,
    /// The materials of each species.
    trees: Vec<TreeMaterials>,
    /// The leaves of each species, and the images of all that are different.
    leaves: Vec<(SpeciesLeaves, Vec<Vec<FoliageCard>>)>,
    /// What tells in full leaf how much light is left under leaves that the season has taken.
    pub(crate) full_leaf: FullLeafMasks,
    /// Bark and face of stumps, of each species.
    pub(crate) stumps: Vec<StumpMaterials>,
    /// The materials of the seedlings of each species; empty without seedlings.
    pub(crate) seedlings: Vec<SeedlingMaterials>,
    /// The materials of deadwood, if there is any.
    pub(crate) deadwood: Option<DeadwoodMaterials>,
    /// The materials of what grows on stems, if anything does.
    pub(crate) climbers: Option<ClimberMaterials>,
    /// The materials of clematis and honeysuckle, if there are any.
    pub(crate) lianas: Option<LianaMaterials>,
    /// Runs of resin on bark; none if they were not asked for.
    pub(crate) resin: Vec<FoliageCard>,
    /// The materials of closed vegetation.
    pub(crate) communities: CommunityMaterials,
    pub(crate) ground: GroundMaterials,
    pub(crate) rock: MaterialId,
    pub(crate) stones: StoneMaterials,
    pub(crate) shrub_wood: MaterialId,
    pub(crate) cane: MaterialId,
    pub(crate) frond_stalk: MaterialId,
    pub(crate) herb_stalk: MaterialId,
    pub(crate) fallen_twig: MaterialId,
    /// Bark of roots across trails, if they were asked for.
    pub(crate) surface_root: Option<MaterialId>,
    /// Bark of roots at the surface, by species; none if they were not asked for.
    pub(crate) surface_roots: Vec<MaterialId>,
    /// The concrete of culverts and the dark in them, if roots across trails were asked for.
    pub(crate) culvert: Option<[MaterialId; 2]>,
    /// Steps on trails, by [`TrailSurfaceKind::index`]; none if roots across trails were not
    /// asked for.
    pub(crate) steps: Vec<StepMaterials>,
    /// Lumps of the earth that trails are cut through, if roots across trails were asked for.
    pub(crate) bank_soil: Option<MaterialId>,
    pub(crate) cone: MaterialId,
    /// The materials of what each species sheds; empty if that was not asked for.
    pub(crate) litter: Vec<LitterMaterials>,
    /// Cones, nuts and capsules, if they were asked for.
    pub(crate) fruit: Option<MaterialId>,
    /// Rock and stone in streams; `None` where they are not wanted.
    pub(crate) wet_rock: Option<MaterialId>,
    pub(crate) wet_stones: Option<StoneMaterials>,
    /// What is wet in any weather.
    pub(crate) always_wet: Vec<MaterialId>,
    /// Bare faces of cliffs; `None` where there are none.
    pub(crate) rock_face: Option<MaterialId>,
    pub(crate) gorse: Vec<FoliageCard>,
    pub(crate) heather: Vec<FoliageCard>,
    pub(crate) bramble: Vec<FoliageCard>,
    pub(crate) bracken: Vec<FoliageCard>,
    pub(crate) bracken_dead: Vec<FoliageCard>,
    /// The height of fronds over that of standing ones.
    pub(crate) frond_height: f32,
    /// Fronds; each is its slices, foot first.
    pub(crate) fronds: Vec<Vec<FoliageCard>>,
    /// The last one bears flowering stalks.
    pub(crate) grass: Vec<FoliageCard>,
    pub(crate) broad_leaf: Vec<FoliageCard>,
    pub(crate) leafy_stem: Vec<FoliageCard>,
    pub(crate) trefoil: Vec<FoliageCard>,
    pub(crate) fallen_leaf: Vec<FoliageCard>,
}

/// The materials that only some worlds have, and what the others depend on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MaterialSelection<'a> {
    /// How many trees of each species there are, relative to each other.
    pub(crate) trees_per_ha: &'a [f64],
    pub(crate) seedlings: bool,
    pub(crate) deadwood: bool,
    pub(crate) climbers: bool,
    pub(crate) lianas: bool,
    pub(crate) resin: bool,
    pub(crate) communities: &'a [PlantCommunity],
    pub(crate) trail_surfaces: &'a [TrailSurfaceKind],
    pub(crate) wayside: bool,
    pub(crate) stream_stones: bool,
    pub(crate) rock_faces: bool,
    pub(crate) surface_roots: bool,
    pub(crate) litter: bool,
    /// High summer without one.
    pub(crate) season: Option<Season>,
    /// Whether bark, wood, stone and ground have textures.
    pub(crate) textures: bool,
}

/// Images of seedlings, textures of deadwood, images of climbers and of closed vegetation.
type Rare = (
    Vec<Vec<LeafImage>>,
    Option<DeadwoodTextures>,
    Option<Vec<KindImages>>,
    Vec<KindImages>,
);

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

    /// What the trees of a species in this group are made of.
    pub(crate) fn tree(&self, species: usize, group: LeafingGroup) -> TreeMaterials {
        let (leaves, foliage) = &self.leaves[species];
        TreeMaterials {
            foliage: foliage[leaves.number(group)].clone(),
            ..self.trees[species].clone()
        }
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

    fn register(
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
