//! All materials of a world, baked and registered.

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{Material, MaterialId, MaterialLibrary, Optics, Semantic, Texture};
use nemoral_seed::{Key, PhiloxRng, Stage};
use rayon::prelude::*;

use crate::card::sketch::{Picture, Sketch};
use crate::card::{trees, understory};
use crate::library::{GroundMaterials, TrailMaterials};
use crate::optics::{self, LeafOptics};
use crate::texture::trail::{TRAIL_M, TrailKind};
use crate::texture::{bark, ground, mineral, tile::Tile};
use crate::tree::{FoliageCard, TreeMaterials};

const TEXTURES: Stage = Stage::new("assets.textures");
const CARDS: Stage = Stage::new("assets.cards");

/// The materials that plants are made of, with the library that holds them.
#[derive(Clone, Debug)]
pub(crate) struct Palette {
    pub(crate) library: MaterialLibrary,
    /// Maritime pine, eucalypt, oak.
    pub(crate) trees: [TreeMaterials; 3],
    /// Bark and face of stumps, for the three species.
    pub(crate) stumps: [StumpMaterials; 3],
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
        // Leaves in a picture shade each other, which the mean of single leaves does not know.
        let mean = self.optics.albedo * 0.92;
        (0..self.variants)
            .into_par_iter()
            .map(|variant| {
                let mut rng = key
                    .stage(Stage::new(self.name))
                    .item(u64::from(variant))
                    .rng();
                (self.draw)(&mut rng, variant).slices(self.slices, mean)
            })
            .collect()
    }
}

/// Dead fronds of bracken.
const DEAD_FROND: LeafOptics = LeafOptics {
    albedo: Vec3::new(0.215, 0.125, 0.058),
    transmittance: Vec3::new(0.09, 0.04, 0.005),
    laser: optics::CURED.laser,
};
/// Grass tufts: mostly green.
const GRASS: LeafOptics = LeafOptics {
    albedo: Vec3::new(0.100, 0.150, 0.038),
    transmittance: Vec3::new(0.11, 0.16, 0.0),
    laser: optics::HERB.laser,
};

const KINDS: [CardKind; 14] = [
    CardKind::new(
        "maritime_pine.foliage",
        4,
        Semantic::Needle,
        optics::PINE,
        |r, _| trees::pine(r),
    ),
    CardKind {
        roughness: 0.35,
        ..CardKind::new(
            "eucalyptus.foliage",
            4,
            Semantic::Leaf,
            optics::EUCALYPT,
            |r, _| trees::eucalypt(r),
        )
    },
    CardKind::new(
        "english_oak.foliage",
        4,
        Semantic::Leaf,
        optics::OAK,
        |r, _| trees::oak(r),
    ),
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
    barks: [Arc<Texture>; 3],
    /// The same barks with moss at their foot.
    feet: [Arc<Texture>; 3],
    branches: [Arc<Texture>; 3],
    dead: Arc<Texture>,
    shrub_wood: Arc<Texture>,
    cane: Arc<Texture>,
    cone: Arc<Texture>,
    /// Faces of stumps: for each species a fresh and a grey one.
    faces: [Arc<Texture>; 6],
    rock: Arc<Texture>,
    stone: Arc<Texture>,
}

impl Solids {
    fn bake(key: Key) -> Self {
        let seed = |item: u64| key.item(item).to_u64() as u32;
        let recipes: [fn(u32) -> Tile; 3] = [bark::pine, bark::eucalypt, bark::oak];
        let whole: Vec<[Arc<Texture>; 2]> = (0..3_usize)
            .into_par_iter()
            .map(|s| {
                let tile = recipes[s](seed(s as u64));
                let foot = bark::with_foot(&tile, [0.6, 0.25, 1.0][s], seed(10 + s as u64));
                [Arc::new(tile.texture()), Arc::new(foot.texture())]
            })
            .collect();
        let branches = [
            Vec3::new(0.125, 0.088, 0.062),
            Vec3::new(0.235, 0.170, 0.125),
            Vec3::new(0.118, 0.100, 0.078),
        ];
        let twigs = [
            branches[0],
            branches[1],
            branches[2],
            Vec3::new(0.098, 0.078, 0.058),
            Vec3::new(0.092, 0.082, 0.040),
            Vec3::new(0.105, 0.072, 0.048),
        ];
        let small: Vec<Arc<Texture>> = (0..14_usize)
            .into_par_iter()
            .map(|i| {
                let tile = match i {
                    0..6 => bark::twig(seed(20 + i as u64), twigs[i]),
                    6 => bark::dead(seed(26)),
                    7 => mineral::stone(seed(27)),
                    // Sawn last winter, and some winters ago.
                    _ => {
                        mineral::cut_wood(seed(20 + i as u64), if i % 2 == 0 { 0.25 } else { 0.95 })
                    }
                };
                Arc::new(tile.texture())
            })
            .collect();
        let rock = Arc::new(mineral::rock(seed(40)).texture());
        let at = |i: usize| small[i].clone();
        Self {
            barks: std::array::from_fn(|s| whole[s][0].clone()),
            feet: std::array::from_fn(|s| whole[s][1].clone()),
            branches: std::array::from_fn(at),
            shrub_wood: at(3),
            cane: at(4),
            cone: at(5),
            dead: at(6),
            stone: at(7),
            faces: std::array::from_fn(|i| at(8 + i)),
            rock,
        }
    }
}

impl Palette {
    /// Bakes every texture and draws every card; tasks are independent and land in a fixed order.
    pub(crate) fn bake(key: Key) -> Self {
        let textures = key.stage(TEXTURES);
        let cards = key.stage(CARDS);
        let (trails, (floors, (solids, pictures))) = rayon::join(
            || bake_trails(textures.item(100)),
            || {
                rayon::join(
                    || bake_floors(textures.item(200)),
                    || {
                        rayon::join(
                            || Solids::bake(textures.item(300)),
                            || {
                                KINDS
                                    .par_iter()
                                    .map(|kind| kind.pictures(cards))
                                    .collect::<Vec<_>>()
                            },
                        )
                    },
                )
            },
        );
        Self::register(trails, floors, solids, pictures)
    }

    fn register(
        trails: Vec<[Texture; 3]>,
        floors: Vec<Texture>,
        solids: Solids,
        pictures: Vec<Vec<Vec<Picture>>>,
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
        let leaves = [flat(0), flat(1), flat(2)];
        let gorse = flat(3);
        let heather = flat(4);
        let bramble = flat(5);
        let bracken = flat(6);
        let bracken_dead = flat(7);
        let grass = flat(9);
        let broad_leaf = flat(10);
        let leafy_stem = flat(11);
        let trefoil = flat(12);
        let fallen_leaf = flat(13);
        let fronds = std::mem::take(&mut foliage[8]);

        let mut add = |name: &str, semantic, albedo: &Arc<Texture>, roughness, optics| {
            library.add(solid(name, semantic, albedo.clone(), roughness, optics))
        };
        let species = ["maritime_pine", "eucalyptus", "english_oak"];
        let bark_optics = [optics::BARK, optics::PALE_BARK, optics::BARK];
        let roughness = [0.9, 0.55, 0.95];
        let mut leaves = leaves.into_iter();
        let trees = std::array::from_fn(|s| {
            let mut part = |part: &str, semantic, albedo| {
                let name = format!("{}.{part}", species[s]);
                add(&name, semantic, albedo, roughness[s], bark_optics[s])
            };
            TreeMaterials {
                stem: part("stem", Semantic::Stem, &solids.barks[s]),
                flare: part("flare", Semantic::RootFlare, &solids.feet[s]),
                limb: part("limb", Semantic::Limb, &solids.barks[s]),
                branch: part("branch", Semantic::Branch, &solids.branches[s]),
                dead: part("dead", Semantic::Twig, &solids.dead),
                foliage: leaves.next().unwrap_or_default(),
            }
        });
        let stumps = std::array::from_fn(|s| {
            let bark = add(
                &format!("{}.stump_bark", species[s]),
                Semantic::Stump,
                &solids.feet[s],
                roughness[s],
                bark_optics[s],
            );
            let faces = std::array::from_fn(|age| {
                let name = format!("{}.stump_face.{age}", species[s]);
                add(
                    &name,
                    Semantic::Stump,
                    &solids.faces[2 * s + age],
                    0.8,
                    optics::CUT_WOOD,
                )
            });
            StumpMaterials { bark, faces }
        });
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
        Self {
            library,
            trees,
            stumps,
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
                        leaf_layers: picture.leaf_layers,
                    }
                })
                .collect()
        })
        .collect()
}
