//! All materials of a world, baked and registered.

mod seedling;

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{LaserBand, Material, MaterialId, MaterialLibrary, Optics, Semantic, Texture};
use nemoral_seed::{Domain, Key, PhiloxRng};
use rayon::prelude::*;

use crate::card::sketch::{Picture, Sketch};
use crate::card::{trees, understory};
use crate::library::{GroundMaterials, TrailMaterials};
use crate::optics::{self, LeafOptics};
use crate::texture::trail::{TRAIL_M, TrailKind};
use crate::texture::{bark, ground, mineral, tile::Tile};
use crate::tree::{BarkKind, FoliageCard, LeafKind, LeafLook, Species, TreeMaterials, linear};

pub(crate) use seedling::SeedlingMaterials;

const TEXTURES: Domain = Domain::new("assets.textures");
const CARDS: Domain = Domain::new("assets.cards");

/// The materials that plants are made of, with the library that holds them.
#[derive(Clone, Debug)]
pub(crate) struct Palette {
    pub(crate) library: MaterialLibrary,
    /// Of each species.
    pub(crate) trees: Vec<TreeMaterials>,
    /// Bark and face of stumps, of each species.
    pub(crate) stumps: Vec<StumpMaterials>,
    /// Of seedlings, of each species; none if none are wanted.
    pub(crate) seedlings: Vec<SeedlingMaterials>,
    pub(crate) ground: GroundMaterials,
    pub(crate) rock: MaterialId,
    pub(crate) stone: MaterialId,
    pub(crate) shrub_wood: MaterialId,
    pub(crate) cane: MaterialId,
    pub(crate) frond_stalk: MaterialId,
    pub(crate) herb_stalk: MaterialId,
    pub(crate) fallen_twig: MaterialId,
    pub(crate) cone: MaterialId,
    pub(crate) gorse: Vec<FoliageCard>,
    pub(crate) heather: Vec<FoliageCard>,
    pub(crate) bramble: Vec<FoliageCard>,
    pub(crate) bracken: Vec<FoliageCard>,
    pub(crate) bracken_dead: Vec<FoliageCard>,
    /// Fronds; each is its slices, foot first.
    pub(crate) fronds: Vec<Vec<FoliageCard>>,
    /// The last one bears flowering stalks.
    pub(crate) grass: Vec<FoliageCard>,
    pub(crate) broad_leaf: Vec<FoliageCard>,
    pub(crate) leafy_stem: Vec<FoliageCard>,
    pub(crate) trefoil: Vec<FoliageCard>,
    pub(crate) fallen_leaf: Vec<FoliageCard>,
}

/// What a stump is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StumpMaterials {
    pub(crate) bark: MaterialId,
    /// The cut face: sawn lately, and years ago.
    pub(crate) faces: [MaterialId; 2],
}

/// A kind of card: what to draw, how often, and what it is.
struct CardKind {
    name: &'static str,
    variants: u32,
    slices: usize,
    semantic: Semantic,
    optics: LeafOptics,
    roughness: f32,
    draw: fn(&mut PhiloxRng, u32) -> Sketch,
}

impl CardKind {
    const fn new(
        name: &'static str,
        variants: u32,
        semantic: Semantic,
        optics: LeafOptics,
        draw: fn(&mut PhiloxRng, u32) -> Sketch,
    ) -> Self {
        Self {
            name,
            variants,
            slices: 1,
            semantic,
            optics,
            roughness: 0.6,
            draw,
        }
    }

    /// The variants' pictures, each in its slices.
    fn pictures(&self, key: Key) -> Vec<Vec<Picture>> {
        let mean = self.optics.albedo * LEAVES_IN_SHADE;
        (0..self.variants)
            .into_par_iter()
            .map(|variant| {
                let mut rng = key
                    .domain(Domain::new(self.name))
                    .item(u64::from(variant))
                    .rng();
                (self.draw)(&mut rng, variant).slices(self.slices, mean)
            })
            .collect()
    }
}

/// Leaves in a picture shade each other, which the mean of single leaves does not know.
const LEAVES_IN_SHADE: f32 = 0.92;

/// Dead fronds of bracken.
const DEAD_FROND: LeafOptics = LeafOptics {
    albedo: Vec3::new(0.215, 0.125, 0.058),
    transmittance: Vec3::new(0.09, 0.04, 0.005),
    laser: optics::CURED.laser,
};
/// Grass tufts under trees: between a herb's leaves and those of a beech in the shade, and some dead blades.
const GRASS: LeafOptics = LeafOptics {
    albedo: Vec3::new(0.080, 0.120, 0.036),
    transmittance: Vec3::new(0.078, 0.125, 0.0),
    laser: optics::HERB.laser,
};

const KINDS: [CardKind; 11] = [
    CardKind::new(
        "gorse.foliage",
        4,
        Semantic::Shrub,
        optics::EVERGREEN,
        |r, v| understory::gorse(r, v == 3),
    ),
    CardKind::new(
        "heather.foliage",
        4,
        Semantic::Shrub,
        optics::EVERGREEN,
        |r, v| understory::heather(r, v >= 2),
    ),
    CardKind::new(
        "bramble.foliage",
        6,
        Semantic::Bramble,
        optics::BRAMBLE,
        |r, v| understory::bramble(r, v == 5),
    ),
    CardKind::new("bracken.pinna", 3, Semantic::Fern, optics::HERB, |r, _| {
        understory::bracken_pinna(r, false)
    }),
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
    },
    CardKind::new("grass.blades", 6, Semantic::Grass, GRASS, |r, v| {
        understory::grass(
            r,
            [0.05, 0.10, 0.16, 0.30, 0.55, 0.2][v as usize % 6],
            v == 5,
        )
    }),
    CardKind::new(
        "herb.broad_leaf",
        4,
        Semantic::Herb,
        optics::HERB,
        |r, _| understory::broad_leaf(r),
    ),
    CardKind::new(
        "herb.leafy_stem",
        4,
        Semantic::Herb,
        optics::HERB,
        |r, v| understory::leafy_stem(r, v >= 2),
    ),
    CardKind::new("herb.trefoil", 3, Semantic::Herb, optics::HERB, |r, _| {
        understory::trefoil(r)
    }),
    CardKind::new(
        "fallen.leaf",
        6,
        Semantic::FallenTwig,
        optics::LITTER_LEAF,
        understory::fallen_leaf,
    ),
];

/// Textures of wood and stone, baked side by side.
struct Solids {
    /// Of each species.
    barks: Vec<Barks>,
    dead: Arc<Texture>,
    snag: Arc<Texture>,
    shrub_wood: Arc<Texture>,
    cane: Arc<Texture>,
    cone: Arc<Texture>,
    rock: Arc<Texture>,
    stone: Arc<Texture>,
}

/// Textures of one species' wood.
struct Barks {
    lower: Arc<Texture>,
    /// The lower bark with moss at its foot.
    foot: Arc<Texture>,
    /// From the lower to the upper bark.
    change: Arc<Texture>,
    upper: Arc<Texture>,
    branch: Arc<Texture>,
    /// Faces of stumps: sawn last winter, and some winters ago.
    faces: [Arc<Texture>; 2],
}

impl Barks {
    fn bake(species: &Species, key: Key) -> Self {
        let seed = |item: u64| key.item(item).to_u64() as u32;
        let look = &species.bark;
        let lower = bark::bake(&look.lower, seed(0));
        let foot = bark::with_foot(&lower, look.moss as f32, seed(1));
        let texture = |tile: &Tile| Arc::new(tile.texture());
        let stem = texture(&lower);
        let (change, upper) = look.upper.map_or_else(
            || (stem.clone(), stem.clone()),
            |layer| {
                let upper = bark::bake(&layer, seed(2));
                // Paper thins out slowly; rough bark and cork end at an edge.
                let soft = if layer.kind == BarkKind::Flakes {
                    0.26
                } else {
                    0.06
                };
                let change = bark::between(&lower, &upper, soft, seed(3));
                (texture(&change), texture(&upper))
            },
        );
        let branch = bark::twig(seed(4), linear(look.branch));
        Self {
            lower: stem,
            foot: texture(&foot),
            change,
            upper,
            branch: texture(&branch),
            faces: [(5, 0.25), (6, 0.95)]
                .map(|(item, age)| texture(&mineral::cut_wood(seed(item), age))),
        }
    }
}

impl Solids {
    fn bake(species: &[Species], key: Key) -> Self {
        let seed = |item: u64| key.item(item).to_u64() as u32;
        let barks = species
            .par_iter()
            .map(|s| Barks::bake(s, key.domain(Domain::new(&s.name))))
            .collect();
        let twigs = [
            Vec3::new(0.098, 0.078, 0.058),
            Vec3::new(0.092, 0.082, 0.040),
            Vec3::new(0.105, 0.072, 0.048),
        ];
        let small: Vec<Arc<Texture>> = (0..7_u64)
            .into_par_iter()
            .map(|i| {
                let tile = match i {
                    0..3 => bark::twig(seed(23 + i), twigs[i as usize]),
                    3 => bark::dead(seed(26)),
                    4 => mineral::stone(seed(27)),
                    5 => mineral::rock(seed(40)),
                    // A dead stem: the same wood, greyer, most of its bark lost.
                    _ => bark::dead(seed(41)).with_mean(Vec3::new(0.140, 0.126, 0.110)),
                };
                Arc::new(tile.texture())
            })
            .collect();
        let at = |i: usize| small[i].clone();
        Self {
            barks,
            shrub_wood: at(0),
            cane: at(1),
            cone: at(2),
            dead: at(3),
            stone: at(4),
            rock: at(5),
            snag: at(6),
        }
    }
}

impl Palette {
    /// Bakes every texture and draws every card; tasks are independent and land in a fixed order.
    /// With what seedlings are made of, if they are wanted.
    pub(crate) fn bake(species: &[Species], seedlings: bool, key: Key) -> Self {
        let textures = key.domain(TEXTURES);
        let cards = key.domain(CARDS);
        let (trails, (floors, (solids, (pictures, leaves)))) = rayon::join(
            || bake_trails(textures.item(100)),
            || {
                rayon::join(
                    || bake_floors(textures.item(200)),
                    || {
                        rayon::join(
                            || Solids::bake(species, textures.item(300)),
                            || {
                                let kinds = KINDS.par_iter().map(|kind| kind.pictures(cards));
                                let trees = species.par_iter().map(|s| {
                                    let key = cards.domain(Domain::new(&s.name));
                                    leaf_pictures(&s.shoot(), key)
                                });
                                (kinds.collect::<Vec<_>>(), trees.collect::<Vec<_>>())
                            },
                        )
                    },
                )
            },
        );
        let young: Vec<_> = species
            .par_iter()
            .filter(|_| seedlings)
            .map(|s| seedling::pictures(&s.leaves, cards.domain(Domain::new(&s.name))))
            .collect();
        Self::register(species, trails, floors, solids, pictures, leaves, young)
    }

    fn register(
        species: &[Species],
        trails: Vec<[Texture; 3]>,
        floors: Vec<Texture>,
        solids: Solids,
        pictures: Vec<Vec<Vec<Picture>>>,
        leaves: Vec<Vec<Picture>>,
        young: Vec<Vec<Picture>>,
    ) -> Self {
        let mut library = MaterialLibrary::new();
        let ground = register_ground(&mut library, floors, trails);
        let mut foliage: Vec<Vec<Vec<FoliageCard>>> = KINDS
            .iter()
            .zip(pictures)
            .map(|(kind, variants)| register_cards(&mut library, kind, variants))
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
        let mut stumps = Vec::new();
        for ((species, barks), pictures) in species.iter().zip(&solids.barks).zip(leaves) {
            trees.push(register_tree(
                &mut library,
                species,
                barks,
                &solids,
                pictures,
            ));
            stumps.push(register_stump(&mut library, species, barks));
        }
        let mut add = |name: &str, semantic, albedo: &Arc<Texture>, roughness, optics| {
            library.add(solid(name, semantic, albedo.clone(), roughness, optics))
        };
        let rock = add("rock", Semantic::Rock, &solids.rock, 0.8, optics::ROCK);
        let shrub_wood = add(
            "shrub.wood",
            Semantic::Shrub,
            &solids.shrub_wood,
            0.9,
            optics::BARK,
        );
        let cane = add(
            "bramble.cane",
            Semantic::Bramble,
            &solids.cane,
            0.7,
            optics::BARK,
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
            optics::BARK,
        );
        let cone = add(
            "fallen.cone",
            Semantic::FallenTwig,
            &solids.cone,
            0.9,
            optics::BARK,
        );
        let mut stone = solid(
            "trail.stone",
            Semantic::Stone,
            solids.stone.clone(),
            0.85,
            optics::ROCK,
        );
        stone.tile_m = 0.5;
        let stone = library.add(stone);
        // Last, so that with seedlings or without everything else has the same number.
        let of_species = species.iter().zip(&solids.barks).zip(young);
        let seedlings = of_species
            .map(|((s, barks), young)| seedling::register(&mut library, s, barks, young))
            .collect();
        Self {
            library,
            trees,
            stumps,
            seedlings,
            ground,
            rock,
            stone,
            shrub_wood,
            cane,
            frond_stalk,
            herb_stalk,
            fallen_twig,
            cone,
            gorse,
            heather,
            bramble,
            bracken,
            bracken_dead,
            fronds,
            grass,
            broad_leaf,
            leafy_stem,
            trefoil,
            fallen_leaf,
        }
    }
}

/// Variants of each species' leafy twig.
const LEAF_VARIANTS: u64 = 5;

/// The pictures of a species' leafy twigs, as bright as the shoot is.
fn leaf_pictures(look: &LeafLook, key: Key) -> Vec<Picture> {
    let mean = look.reflectance();
    let picture = |variant| {
        let mut rng = key.item(variant).rng();
        trees::draw(look, &mut rng).slices(1, mean).swap_remove(0)
    };
    (0..LEAF_VARIANTS).into_par_iter().map(picture).collect()
}

fn laser(nm905: [f64; 2], nm1550: [f64; 2]) -> Optics {
    let band = |[reflectance, transmittance]: [f64; 2]| LaserBand {
        reflectance: reflectance as f32,
        transmittance: transmittance as f32,
    };
    Optics {
        nm905: band(nm905),
        nm1550: band(nm1550),
    }
}

fn register_tree(
    library: &mut MaterialLibrary,
    species: &Species,
    barks: &Barks,
    solids: &Solids,
    pictures: Vec<Picture>,
) -> TreeMaterials {
    let look = &species.bark;
    let optics = laser([look.nm905, 0.0], [look.nm1550, 0.0]);
    let mut part = |part: &str, semantic, albedo: &Arc<Texture>| {
        let name = format!("{}.{part}", species.name);
        let roughness = look.roughness as f32;
        library.add(solid(&name, semantic, albedo.clone(), roughness, optics))
    };
    let (stem, change, upper) = (
        part("stem", Semantic::Stem, &barks.lower),
        part("stem.change", Semantic::Stem, &barks.change),
        part("stem.upper", Semantic::Stem, &barks.upper),
    );
    let (flare, limb, branch) = (
        part("flare", Semantic::RootFlare, &barks.foot),
        part("limb", Semantic::Limb, &barks.upper),
        part("branch", Semantic::Branch, &barks.branch),
    );
    let (dead, snag) = (
        part("dead", Semantic::Twig, &solids.dead),
        part("snag", Semantic::Snag, &solids.snag),
    );
    let leaves = &species.shoot();
    let semantic = match leaves.kind {
        LeafKind::NeedleTuft | LeafKind::NeedleSpray => Semantic::Needle,
        _ => Semantic::Leaf,
    };
    let foliage = pictures.into_iter().enumerate().map(|(number, picture)| {
        let name = format!("{}.foliage.{number}", species.name);
        register_leaves(library, &name, semantic, leaves, picture)
    });
    TreeMaterials {
        foliage: foliage.collect(),
        stem,
        change,
        upper,
        flare,
        limb,
        branch,
        dead,
        snag,
    }
}

/// A picture of a species' leaves: they answer light as its leaves do, whatever they are part of.
fn register_leaves(
    library: &mut MaterialLibrary,
    name: &str,
    semantic: Semantic,
    leaves: &LeafLook,
    picture: Picture,
) -> FoliageCard {
    let opaque_fraction = picture.mask.opaque_fraction() as f32;
    let (roughness, optics) = (leaves.roughness as f32, laser(leaves.nm905, leaves.nm1550));
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

fn register_stump(
    library: &mut MaterialLibrary,
    species: &Species,
    barks: &Barks,
) -> StumpMaterials {
    let look = &species.bark;
    let optics = laser([look.nm905, 0.0], [look.nm1550, 0.0]);
    let name = |part: &str| format!("{}.{part}", species.name);
    let bark = library.add(solid(
        &name("stump_bark"),
        Semantic::Stump,
        barks.foot.clone(),
        look.roughness as f32,
        optics,
    ));
    let faces = std::array::from_fn(|age| {
        library.add(solid(
            &name(&format!("stump_face.{age}")),
            Semantic::Stump,
            barks.faces[age].clone(),
            0.8,
            optics::CUT_WOOD,
        ))
    });
    StumpMaterials { bark, faces }
}

/// A surface without a mask.
fn solid(
    name: &str,
    semantic: Semantic,
    albedo: Arc<Texture>,
    roughness: f32,
    optics: Optics,
) -> Material {
    Material {
        name: name.to_owned(),
        semantic,
        support: None,
        albedo,
        transmittance: Vec3::ZERO,
        roughness,
        mask: None,
        ground: false,
        tile_m: 1.0,
        optics,
    }
}

/// Surface, rut and strip of each kind of trail.
fn bake_trails(key: Key) -> Vec<[Texture; 3]> {
    TrailKind::ALL
        .par_iter()
        .enumerate()
        .map(|(i, kind)| {
            let tiles = kind.bake(key.item(i as u64));
            [&tiles.surface, &tiles.rut, &tiles.strip].map(Tile::texture)
        })
        .collect()
}

/// Leaf litter, needle litter, moss and soil, bare soil.
fn bake_floors(key: Key) -> Vec<Texture> {
    let recipes: [fn(Key) -> Tile; 4] = [
        ground::leaf_litter,
        ground::needle_litter,
        ground::moss_and_soil,
        ground::bare_soil,
    ];
    recipes
        .par_iter()
        .enumerate()
        .map(|(i, recipe)| recipe(key.item(i as u64)).texture())
        .collect()
}

fn register_ground(
    library: &mut MaterialLibrary,
    floors: Vec<Texture>,
    trails: Vec<[Texture; 3]>,
) -> GroundMaterials {
    let mut add = |name: String, semantic, albedo, roughness, tile_m, optics| {
        library.add(Material {
            ground: true,
            tile_m,
            ..solid(&name, semantic, Arc::new(albedo), roughness, optics)
        })
    };
    let looks = [
        ("ground.leaf_litter", Semantic::Litter, optics::LITTER),
        ("ground.needle_litter", Semantic::Litter, optics::LITTER),
        ("ground.moss", Semantic::GroundMoss, optics::MOSS),
        ("ground.cut_slope", Semantic::CutSlope, optics::DRY_SOIL),
    ];
    let mut floor: Vec<MaterialId> = floors
        .into_iter()
        .zip(looks)
        .map(|(texture, (name, semantic, optics))| {
            add(
                name.to_owned(),
                semantic,
                texture,
                0.92,
                ground::FLOOR_M,
                optics,
            )
        })
        .collect();
    let cut_slope = floor.pop().expect("there are four floors");
    let trails: Vec<TrailMaterials> = TrailKind::ALL
        .iter()
        .zip(trails)
        .map(|(kind, [surface, rut, strip])| {
            let (roughness, optics) = kind.surface_optics();
            let mut band = |band: &str, semantic, albedo, optics| {
                let name = format!("trail.{}.{band}", kind.name());
                add(name, semantic, albedo, roughness, TRAIL_M, optics)
            };
            TrailMaterials {
                surface: band("surface", Semantic::TrailSurface, surface, optics),
                rut: band("rut", Semantic::TrailRut, rut, optics),
                strip: band("strip", Semantic::TrailStrip, strip, optics),
            }
        })
        .collect();
    GroundMaterials {
        floor,
        cut_slope,
        trails: trails.try_into().expect("there are eight kinds of trail"),
    }
}

/// Registers a kind's variants; each comes back as its slices.
fn register_cards(
    library: &mut MaterialLibrary,
    kind: &CardKind,
    variants: Vec<Vec<Picture>>,
) -> Vec<Vec<FoliageCard>> {
    let mut number = 0;
    variants
        .into_iter()
        .map(|slices| {
            slices
                .into_iter()
                .map(|picture| {
                    let opaque_fraction = picture.mask.opaque_fraction() as f32;
                    let material = library.add(Material {
                        name: format!("{}.{number}", kind.name),
                        semantic: kind.semantic,
                        support: None,
                        albedo: Arc::new(picture.texture),
                        transmittance: kind.optics.transmittance,
                        roughness: kind.roughness,
                        mask: Some(Arc::new(picture.mask)),
                        ground: false,
                        tile_m: 1.0,
                        optics: kind.optics.laser,
                    });
                    number += 1;
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
