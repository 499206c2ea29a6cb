//! The library: everything a world is made of, grown from one key.

mod climbers;
mod communities;
mod deadwood;
mod litter;
mod plants;
mod single_tree;
mod snow;

use std::sync::Arc;

use nemoral_scene::{
    AlphaMask, MaterialId, MaterialLibrary, PlantCommunity, Prototype, TrailSurfaceKind,
};
use nemoral_seed::{Domain, Key};
use rayon::prelude::*;

pub use self::climbers::{ClimberParams, Climbers, StemMoss, TreeClimbers};
pub use self::communities::CommunityTiles;
pub use self::deadwood::{Deadwood, LogAsset};
pub use self::litter::{LitterParams, LitterPatches};
use self::plants::PlantGrower;
pub use self::single_tree::SingleTree;
pub use self::snow::{SnowMaterials, SnowParams};
use crate::ambient_occlusion::{self, MaskCoverage, OcclusionParams, Thickness};
use crate::materials::{self, GroundMaterials, Timing, Wanted, WorldMaterials};
use crate::plant::shape::Shape;
use crate::plant::surface_root::LOBE_M;
use crate::tree::{
    Competitors, FlareLobe, GrownTree, GrowthParams, Season, SizeClass, Species, StemProfile,
    TreeMaterials, TreeSize, WoodVolume, grow, grow_snag, individual_rank,
};
use nemoral_scene::ParamError;

/// What to grow.
#[derive(Clone, Debug, PartialEq)]
pub struct AssetParams {
    /// The trees' species, 1 to 32, each with a name of its own.
    pub species: Vec<StandSpecies>,
    /// Different living trees of each species, 1..=64. The stand's distribution of diameters is
    /// divided into as many equal parts, and each tree stands for one, so that even a few trees
    /// show its spread and its basal area.
    pub individuals_per_species: u32,
    /// Different saplings of each species, 0..=64, 2 to 4.5 m high.
    pub saplings_per_species: u32,
    /// Different seedlings of each species, 0..=64, under 0.3 m high.
    pub seedlings_per_species: u32,
    /// Different standing dead trees of each species, 0..=64, as thick as the stand's.
    pub snags_per_species: u32,
    /// Whether logs, root plates, branches and brash are made.
    pub deadwood: bool,
    /// What grows on trees; `None` for nothing.
    pub climbers: Option<ClimberParams>,
    /// The communities of low plants of which tiles are made, each once, in any order.
    pub communities: Vec<PlantCommunity>,
    /// The surfaces that trails have, each once, in any order. The others have the textures of the
    /// first one of these; there are none without one.
    pub trail_surfaces: Vec<TrailSurfaceKind>,
    /// Whether roots across trails, beds of stones beside them, and what sticks out of their banks
    /// are made.
    pub wayside: bool,
    /// Whether roots that spread over the ground from old trees are made.
    pub surface_roots: bool,
    /// Stones that lie in streams, wet up to some height.
    pub stream_stones: bool,
    /// The ground of cliffs.
    pub rock_faces: bool,
    /// Whether each of the stand's living trees is also grown as it would be at the wood's edge:
    /// with a crown that reaches down on the side of +x. These follow the stand's trees in
    /// [`Library::trees`], in the same order.
    pub edge_trees: bool,
    /// When; `None` is high summer. Shapes do not depend on it, but for those of ferns, which lie
    /// down in winter.
    pub season: Option<Season>,
    /// What litter is made of what the trees shed; `None` for none.
    pub litter: Option<LitterParams>,
    /// Whether bark, wood, stone and ground have textures. Without, each is of one grey, and
    /// nothing else differs: shapes, masks of leaves, semantics and what lasers meet are the same.
    /// Scans need no more, and much of the time to grow a library goes into textures.
    pub textures: bool,
    /// Wood of at least this radius is a limb, thinner wood a branch; metres, 0.01..=0.2.
    pub trunk_radius_m: f64,
    /// How thick the trees of a stand are.
    pub stand: StandParams,
    /// Trees of given sizes, such as those of a plot, at most 4096. They follow the other trees
    /// in [`Library::trees`] if they are alive, else those in [`Library::snags`].
    pub measured: Vec<MeasuredTree>,
}

/// A tree of a given size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredTree {
    /// The index of its species in [`AssetParams::species`].
    pub species: usize,
    /// Its size; of a dead tree, the size that it had before its top broke.
    pub size: TreeSize,
    /// Is it alive?
    pub alive: bool,
}

/// A species in a stand.
#[derive(Clone, Debug, PartialEq)]
pub struct StandSpecies {
    /// The species.
    pub species: Species,
    /// Mean diameter at breast height before truncation, metres, 0.08..=1.0.
    pub dbh_mean_m: f64,
    /// How many of its trees stand on a hectare of the stand, 0..=20,000.
    pub trees_per_ha: f64,
}

/// The distribution of diameters at breast height: a truncated Weibull distribution (shape 2.5 to 4
/// in even-aged stands, 1 to 1.5 in uneven-aged ones), whose mean is given by species.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandParams {
    /// Weibull shape, 1..=6: about 1.2 in uneven-aged, 3 in even-aged stands.
    pub shape: f64,
    /// Thinnest tree, metres, 0.07..=0.5.
    pub dbh_min_m: f64,
    /// Thickest tree, metres, above the thinnest and at most 1.5.
    pub dbh_max_m: f64,
}

/// A grown tree.
#[derive(Clone, Debug)]
pub struct TreeAsset {
    /// Its shape.
    pub prototype: Arc<Prototype>,
    /// Its species, `snake_case`.
    pub species: String,
    /// Its size as grown.
    pub size: TreeSize,
    /// Its age class; of a dead tree, the class that it had.
    pub class: SizeClass,
    /// Is it alive?
    pub alive: bool,
    /// The diameters of its stem.
    pub stem: StemProfile,
    /// Stem volume over bark, from the ground to the stem's end, m³: where it forks, to the fork.
    pub stem_volume_m3: f64,
    /// Volume of all its wood over bark; `None` if that is not known.
    pub wood: Option<WoodVolume>,
    /// Radius it occupies at the ground, flare included, metres.
    pub radius_m: f64,
    /// The lobes of its root flare; none if they are not known.
    pub flare_lobes: Vec<FlareLobe>,
}

impl TreeAsset {
    /// The size of a copy that is wider and higher by these factors, which are above 0. A copy that
    /// is no higher than breast height has a diameter of 0.
    #[must_use]
    pub fn size_of_copy(&self, [across, along]: [f64; 2]) -> TreeSize {
        let size = &self.size;
        // Leaves point all ways, so their area grows as the mean of all ways does.
        let mean = libm::cbrt(across * across * along);
        TreeSize {
            dbh_m: across * self.stem.breast_diameter_m(along),
            height_m: size.height_m * along,
            crown_base_m: size.crown_base_m * along,
            crown_radius_m: size.crown_radius_m * across,
            leaf_area_m2: size.leaf_area_m2 * mean * mean,
            lean_rad: libm::atan(libm::tan(size.lean_rad) * across / along),
        }
    }
}

/// A shrub, herb, stump or rock, or a patch of such things.
#[derive(Clone, Debug)]
pub struct PlantAsset {
    /// Its shape, upright from z = 0, rooted or sunk below.
    pub prototype: Arc<Prototype>,
    /// What it is, `snake_case`, the same for all individuals of a kind.
    pub name: String,
    /// Radius it occupies at the ground, or a patch's radius, metres.
    pub radius_m: f64,
    /// Height above z = 0, metres.
    pub height_m: f64,
}

/// Stones as those of a [`Library`] that carry their names, wet up to some height, as in a stream.
#[derive(Clone, Debug, Default)]
pub struct StreamStones {
    /// The library's rocks.
    pub rocks: Vec<PlantAsset>,
    /// Its loose stones.
    pub stones: Vec<PlantAsset>,
    /// Its beds of stones.
    pub beds: Vec<PlantAsset>,
}

/// All prototypes and materials of a world.
#[derive(Clone, Debug)]
pub struct Library {
    /// The materials that all prototypes refer to.
    pub materials: MaterialLibrary,
    /// The masks that surfaces have in full leaf, where the season has taken leaves away, by
    /// material in order.
    pub full_leaf_masks: Vec<(MaterialId, Arc<AlphaMask>)>,
    /// Materials that are wet in any weather.
    pub always_wet: Vec<MaterialId>,
    /// Living trees, species by species, thin ones first; then, if they were asked for, each of
    /// them again as a tree of the wood's edge; then those of given sizes.
    pub trees: Vec<TreeAsset>,
    /// Saplings, species by species, small ones first.
    pub saplings: Vec<TreeAsset>,
    /// Standing dead trees, species by species, thin ones first.
    pub snags: Vec<TreeAsset>,
    /// Gorse, heather and bramble.
    pub shrubs: Vec<PlantAsset>,
    /// Stumps, equally many of each species, species by species, thin ones first.
    pub stumps: Vec<PlantAsset>,
    /// Rocks, smallest first.
    pub rocks: Vec<PlantAsset>,
    /// Patches of grass.
    pub grass: Vec<PlantAsset>,
    /// Patches of herbs.
    pub herbs: Vec<PlantAsset>,
    /// Patches of ferns and bracken.
    pub ferns: Vec<PlantAsset>,
    /// Single tree seedlings, species by species, small ones first.
    pub seedlings: Vec<PlantAsset>,
    /// Patches of fallen twigs, cones and leaves.
    pub litter: Vec<PlantAsset>,
    /// Patches of what each species sheds; empty if that was not asked for.
    pub shed: Vec<LitterPatches>,
    /// Tufts for trails: grass, trodden grass, plantain, clover.
    pub trail_tufts: Vec<PlantAsset>,
    /// Mats of short grass, plantain and clover, half a metre wide, for strips between ruts.
    pub strip_mats: Vec<PlantAsset>,
    /// Loose stones for trails.
    pub trail_stones: Vec<PlantAsset>,
    /// Roots that lie across trails, along x; none if they were not asked for.
    pub trail_roots: Vec<PlantAsset>,
    /// Mouths of culverts, which open along x.
    pub culverts: Vec<PlantAsset>,
    /// Steps of logs across a trail a metre wide, which goes down along y: by
    /// [`TrailSurfaceKind::index`], [`Library::TRAIL_STEPS`] for trails of each kind.
    pub trail_steps: Vec<PlantAsset>,
    /// Roots that spread over the ground from old trees, [`Library::SURFACE_ROOTS`] of each
    /// species, if they were asked for. Each lies along +x and goes on from a lobe of a root flare
    /// that ends at x = 0, [`Library::ROOT_LOBE_M`] from the middle of its stem.
    pub surface_roots: Vec<PlantAsset>,
    /// Beds of stones for ditches and edges, a metre wide; none if they were not asked for.
    pub stone_beds: Vec<PlantAsset>,
    /// Stones that lie in streams; none if they were not asked for.
    pub stream_stones: StreamStones,
    /// What sticks out of slopes that trails have cut, downhill along x: the first half without
    /// roots, the second with them; none if they were not asked for.
    pub banks: Vec<PlantAsset>,
    /// What lies of dead trees; nothing if it was not asked for.
    pub deadwood: Deadwood,
    /// What climbs on trees; nothing if it was not asked for.
    pub climbers: Climbers,
    /// Tiles of closed vegetation, by [`PlantCommunity::index`]; empty if they were not asked for.
    pub communities: [CommunityTiles; PlantCommunity::ALL.len()],
    /// The ground.
    pub ground: GroundMaterials,
}

impl Default for AssetParams {
    /// The paper's Portuguese forest: maritime pine, eucalypt, English oak.
    fn default() -> Self {
        let of = |species, dbh_mean_m| StandSpecies {
            species,
            dbh_mean_m,
            trees_per_ha: 150.0,
        };
        Self {
            species: vec![
                of(Species::maritime_pine(), 0.28),
                of(Species::eucalyptus(), 0.22),
                of(Species::english_oak(), 0.30),
            ],
            individuals_per_species: 8,
            saplings_per_species: 0,
            seedlings_per_species: 0,
            snags_per_species: 0,
            deadwood: false,
            climbers: None,
            communities: Vec::new(),
            trail_surfaces: TrailSurfaceKind::ALL.to_vec(),
            wayside: false,
            surface_roots: false,
            stream_stones: false,
            rock_faces: false,
            edge_trees: false,
            season: None,
            litter: None,
            textures: true,
            trunk_radius_m: 0.04,
            stand: StandParams::default(),
            measured: Vec::new(),
        }
    }
}

impl Default for StandParams {
    fn default() -> Self {
        Self {
            shape: 2.5,
            dbh_min_m: 0.10,
            dbh_max_m: 0.60,
        }
    }
}

impl AssetParams {
    /// Checks the parameters.
    ///
    /// # Errors
    /// If one is out of its range.
    pub fn check(&self) -> Result<(), ParamError> {
        if !(1..=32).contains(&self.species.len()) {
            let n = self.species.len();
            return Err(ParamError::new("species", n, "1 to 32 species"));
        }
        for (i, of) in self.species.iter().enumerate() {
            of.species.check()?;
            let name = &of.species.name;
            if self.species[..i].iter().any(|o| o.species.name == *name) {
                let field = format!("species[{i}].name");
                return Err(ParamError::new(
                    field,
                    name,
                    "another name than the others'",
                ));
            }
            let field = format!("species[{i}].dbh_mean_m");
            ParamError::check_within(field, of.dbh_mean_m, 0.08, 1.0)?;
            let field = format!("species[{i}].trees_per_ha");
            ParamError::check_within(field, of.trees_per_ha, 0.0, 20_000.0)?;
        }
        let n = f64::from(self.individuals_per_species);
        ParamError::check_within("individuals_per_species", n, 1.0, 64.0)?;
        let n = f64::from(self.saplings_per_species);
        ParamError::check_within("saplings_per_species", n, 0.0, 64.0)?;
        let n = f64::from(self.seedlings_per_species);
        ParamError::check_within("seedlings_per_species", n, 0.0, 64.0)?;
        let n = f64::from(self.snags_per_species);
        ParamError::check_within("snags_per_species", n, 0.0, 64.0)?;
        ParamError::check_within("trunk_radius_m", self.trunk_radius_m, 0.01, 0.2)?;
        if let Some(ClimberParams { moss, .. }) = self.climbers {
            ParamError::check_within("climbers.moss.amount", moss.amount, 0.0, 3.0)?;
            ParamError::check_within("climbers.moss.height_m", moss.height_m, 0.1, 10.0)?;
        }
        let n = self.measured.len() as f64;
        ParamError::check_within("measured.len()", n, 0.0, 4096.0)?;
        if let Some(i) = self
            .measured
            .iter()
            .position(|m| m.species >= self.species.len())
        {
            let field = format!("measured[{i}].species");
            let allowed = "the index of a species";
            return Err(ParamError::new(field, self.measured[i].species, allowed));
        }
        if let Some(season) = &self.season {
            season.check()?;
        }
        if let Some(litter) = &self.litter {
            litter.check(self.species.len())?;
        }
        let stand = &self.stand;
        ParamError::check_within("stand.shape", stand.shape, 1.0, 6.0)?;
        ParamError::check_within("stand.dbh_min_m", stand.dbh_min_m, 0.07, 0.5)?;
        ParamError::check_within("stand.dbh_max_m", stand.dbh_max_m, stand.dbh_min_m, 1.5)
    }

    /// The stand's trees as competitors of each other.
    #[must_use]
    pub fn competitors(&self) -> Competitors {
        const CLASSES: u32 = 32;
        let StandParams {
            shape,
            dbh_min_m,
            dbh_max_m,
        } = self.stand;
        Competitors::new(self.species.iter().flat_map(|of| {
            let per_ha = of.trees_per_ha / f64::from(CLASSES);
            (0..CLASSES).map(move |class| {
                let rank = (f64::from(class) + 0.5) / f64::from(CLASSES);
                let limits = [dbh_min_m, dbh_max_m];
                let dbh_m = of.species.dbh_of_rank(of.dbh_mean_m, shape, limits, rank);
                (&of.species, dbh_m, per_ha)
            })
        }))
    }
}

impl Library {
    /// The steps for each kind of trail.
    pub const TRAIL_STEPS: usize = 3;
    /// The surface roots of each species.
    pub const SURFACE_ROOTS: usize = 8;
    /// The distance of a lobe's end from the middle of the stem for which surface roots are made,
    /// metres.
    pub const ROOT_LOBE_M: f64 = LOBE_M as f64;

    /// Grows a library, on all threads of the pool it is called in. The same key and parameters
    /// give the same bytes on any number of threads.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn grow(params: &AssetParams, key: Key) -> Result<Self, ParamError> {
        params.check()?;
        let species: Vec<Species> = params.species.iter().map(|s| s.species.clone()).collect();
        let season = params.season.filter(|of| !of.is_high_summer(&species));
        let trees_per_ha: Vec<f64> = params.species.iter().map(|s| s.trees_per_ha).collect();
        let wanted = Wanted {
            trees_per_ha: &trees_per_ha,
            communities: &params.communities,
            trail_surfaces: &params.trail_surfaces,
            wayside: params.wayside,
            stream_stones: params.stream_stones,
            rock_faces: params.rock_faces,
            surface_roots: params.surface_roots,
            litter: params.litter.is_some(),
            season,
            seedlings: params.seedlings_per_species > 0,
            deadwood: params.deadwood,
            climbers: params.climbers.is_some(),
            lianas: params.climbers.is_some_and(|of| of.lianas),
            resin: params.climbers.is_some_and(|of| of.resin),
            textures: params.textures,
        };
        let materials = WorldMaterials::bake(&species, wanted, key);
        let masks = MaskCoverage::of(&materials.library);
        let grower = TreeGrower {
            params,
            materials: &materials,
            masks: &masks,
            competitors: params.competitors(),
            growth: GrowthParams {
                trunk_radius_m: params.trunk_radius_m,
                ..GrowthParams::default()
            },
        };
        let mut trees = grower.all(TreeKind::Living, params.individuals_per_species, key)?;
        if params.edge_trees {
            trees.extend(grower.all(TreeKind::Edge, params.individuals_per_species, key)?);
        }
        let saplings = grower.all(TreeKind::Sapling, params.saplings_per_species, key)?;
        let mut snags = grower.all(TreeKind::Snag, params.snags_per_species, key)?;
        for tree in grower.measured(key)? {
            let to = if tree.alive { &mut trees } else { &mut snags };
            to.push(tree);
        }
        let plants = PlantGrower {
            species: &species,
            materials: &materials,
            masks: &masks,
            season,
            key,
        };
        let climbers = (materials.climbers.as_ref())
            .zip(params.climbers.as_ref())
            .map(|(of, wanted)| plants.climbers([&trees, &snags], wanted, of))
            .unwrap_or_default();
        Ok(Self {
            climbers,
            trees,
            saplings,
            snags,
            shrubs: plants.shrubs(),
            stumps: plants.stumps(&params.species, &params.stand),
            rocks: plants.rocks(),
            grass: plants.grass(),
            herbs: plants.herbs(),
            ferns: plants.ferns(),
            seedlings: plants.seedlings(params.seedlings_per_species),
            litter: plants.litter(),
            shed: (params.litter.as_ref())
                .map(|of| plants.litter_patches(of))
                .unwrap_or_default(),
            trail_tufts: plants.trail_tufts(),
            strip_mats: plants.strip_mats(),
            trail_stones: plants.trail_stones(),
            trail_roots: (materials.surface_root)
                .map(|bark| plants.trail_roots(bark))
                .unwrap_or_default(),
            culverts: plants.culverts(),
            trail_steps: plants.trail_steps(),
            surface_roots: plants.surface_roots(),
            stone_beds: if params.wayside {
                plants.stone_beds()
            } else {
                Vec::new()
            },
            stream_stones: plants.stream_stones(),
            banks: plants.banks(),
            communities: plants.communities(&params.communities),
            deadwood: (materials.deadwood.as_ref())
                .map(|of| plants.deadwood(&params.species, of))
                .unwrap_or_default(),
            ground: GroundMaterials {
                rock_face: materials.rock_face,
                ..materials.ground
            },
            full_leaf_masks: materials.full_leaf,
            always_wet: materials.always_wet,
            materials: materials.library,
        })
    }

    /// The materials as they are when all surfaces are wet but some and those that always are,
    /// from 0, dry, to 1, soaked by rain: a film of water makes what is porous darker, for eyes and
    /// lasers, and smoother. Leaves shed most of it.
    #[must_use]
    pub fn wet_materials(&self, wetness: f64, but: &[MaterialId]) -> MaterialLibrary {
        let but = [&self.always_wet, but].concat();
        materials::wet(&self.materials, wetness.clamp(0.0, 1.0) as f32, &but)
    }

    /// The materials with the masks that they have in full leaf; `None` if they have these. What
    /// grows under leaves goes by them.
    #[must_use]
    pub fn materials_in_full_leaf(&self) -> Option<MaterialLibrary> {
        if self.full_leaf_masks.is_empty() {
            return None;
        }
        let mut masks = self.full_leaf_masks.iter().peekable();
        let mut library = MaterialLibrary::new();
        for (i, material) in self.materials.materials().iter().enumerate() {
            let mut material = material.clone();
            if let Some((_, mask)) = masks.next_if(|(id, _)| usize::from(id.0) == i) {
                material.mask = Some(Arc::clone(mask));
            }
            library.add(material);
        }
        Some(library)
    }
}

const TREES: Domain = Domain::new("assets.trees");
const SAPLINGS: Domain = Domain::new("assets.saplings");
const SNAGS: Domain = Domain::new("assets.snags");
const MEASURED: Domain = Domain::new("assets.measured");

fn prototype(name: &str, number: u32, shape: Shape, library: &MaterialLibrary) -> Prototype {
    Prototype::new(format!("{name}.{number}"), shape.mesh, shape.cards, library)
        .expect("shapes are made of finite points and of this library's materials")
}

/// Adds its ambient occlusion to a shape.
fn with_occlusion(shape: Prototype, masks: &MaskCoverage, near: &OcclusionParams) -> Prototype {
    let occlusion = ambient_occlusion::bake(&shape, masks, near);
    (shape.with_ambient_occlusion(occlusion))
        .expect("one share of each vertex and corner, and no ground")
}

/// Adds what it hides from the ground to a shape.
fn with_occluders(
    shape: Prototype,
    of: (&MaterialLibrary, &MaskCoverage),
    thickness: Thickness,
) -> Prototype {
    let occluders = ambient_occlusion::occluders(&shape, of, thickness, 1.0);
    shape.with_occluders(occluders)
}

#[derive(Clone, Copy)]
enum TreeKind {
    Living,
    Edge,
    Sapling,
    Snag,
}

struct TreeGrower<'a> {
    params: &'a AssetParams,
    materials: &'a WorldMaterials,
    masks: &'a MaskCoverage,
    growth: GrowthParams,
    competitors: Competitors,
}

impl TreeGrower<'_> {
    /// Grows `of` trees of each species, in the order of species and individuals; each has its own
    /// key.
    fn all(&self, kind: TreeKind, of: u32, key: Key) -> Result<Vec<TreeAsset>, ParamError> {
        let key = key.domain(match kind {
            // A tree at the edge is the one of its number inside, in other light.
            TreeKind::Living | TreeKind::Edge => TREES,
            TreeKind::Sapling => SAPLINGS,
            TreeKind::Snag => SNAGS,
        });
        let count = of as usize * self.params.species.len();
        let trees = (0..count).into_par_iter().map(|i| {
            let (species, number) = (i / of as usize, (i % of as usize) as u32);
            let name = &self.params.species[species].species.name;
            self.one(kind, species, [number, of], key.domain(Domain::new(name)))
        });
        trees.collect()
    }

    fn one(
        &self,
        kind: TreeKind,
        index: usize,
        [number, of]: [u32; 2],
        of_all: Key,
    ) -> Result<TreeAsset, ParamError> {
        let key = of_all.item(u64::from(number));
        let StandSpecies {
            species,
            dbh_mean_m,
            ..
        } = &self.params.species[index];
        let stand = &self.params.stand;
        let limits = [stand.dbh_min_m, stand.dbh_max_m];
        let inside = || {
            let number = [number, of];
            let dbh_m = species.dbh_of_individual(*dbh_mean_m, stand.shape, limits, number, of_all);
            species.draw_size_among(dbh_m, &self.competitors.of(dbh_m), key.item(1))
        };
        let (size, part, growth) = match kind {
            TreeKind::Living => (inside(), "", self.growth),
            TreeKind::Snag => (inside(), "snag.", self.growth),
            TreeKind::Sapling => {
                let height_m = 2.0 + 2.5 * individual_rank(number, of, key);
                let size = species.draw_sapling(height_m, key.item(1));
                (size, "sapling.", self.growth)
            }
            TreeKind::Edge => {
                let inside = inside();
                let growth = GrowthParams {
                    // Their crowns are larger, and nothing stands before them.
                    wood_triangles_max: self.growth.wood_triangles_max * 3 / 2,
                    cards_max: self.growth.cards_max * 3 / 2,
                    shaded_base_m: Some(species.shaded_base_m(&inside)),
                    ..self.growth
                };
                (species.size_at_edge(&inside), "edge.", growth)
            }
        };
        let grow: Grow = match kind {
            TreeKind::Snag => grow_snag,
            _ => grow,
        };
        let name = format!("{}.{part}{number}", species.name);
        self.grown((species, index), grow, (&size, &growth), name, key.item(2))
    }

    /// Grows the trees of given sizes.
    fn measured(&self, key: Key) -> Result<Vec<TreeAsset>, ParamError> {
        let key = key.domain(MEASURED);
        let trees = self
            .params
            .measured
            .par_iter()
            .enumerate()
            .map(|(i, tree)| {
                let grow: Grow = if tree.alive { grow } else { grow_snag };
                let species = &self.params.species[tree.species].species;
                let name = format!("{}.measured.{i}", species.name);
                let key = key.item(i as u64);
                let size = (&tree.size, &self.growth);
                self.grown((species, tree.species), grow, size, name, key)
            });
        trees.collect()
    }

    /// Grows a tree of this size as finely as that; the species has this number among those with
    /// materials.
    fn grown(
        &self,
        (species, index): (&Species, usize),
        grow: Grow,
        (size, growth): (&TreeSize, &GrowthParams),
        name: String,
        key: Key,
    ) -> Result<TreeAsset, ParamError> {
        let timing = match species.size_class(size.dbh_m) {
            SizeClass::Sapling => Timing::Young,
            _ => Timing::of_tree(key),
        };
        let materials = self.materials.tree(index, timing);
        let tree = grow(species, size, &materials, growth, key)?;
        let prototype = Prototype::new(name, tree.mesh, tree.cards, &self.materials.library)
            .expect("trees are made of finite points and of this library's materials");
        let prototype = with_occlusion(prototype, self.masks, &OcclusionParams::TREE);
        let thickness = match species.size_class(tree.size.dbh_m) {
            SizeClass::Sapling => Thickness::Thin,
            _ => Thickness::Thick,
        };
        let prototype = with_occluders(prototype, (&self.materials.library, self.masks), thickness);
        Ok(TreeAsset {
            prototype: Arc::new(prototype),
            species: species.name.clone(),
            class: species.size_class(tree.size.dbh_m),
            size: tree.size,
            alive: tree.alive,
            stem_volume_m3: tree.stem.volume_m3(),
            stem: tree.stem,
            wood: Some(tree.wood),
            radius_m: tree.foot_radius_m,
            flare_lobes: tree.flare_lobes,
        })
    }
}

/// [`grow`] or [`grow_snag`].
type Grow =
    fn(&Species, &TreeSize, &TreeMaterials, &GrowthParams, Key) -> Result<GrownTree, ParamError>;
