//! The things of a chunk: what was placed, numbered, stood on the ground, and known.

use std::f64::consts::TAU;
use std::sync::Arc;

use nemoral_assets::TreeSize;
use nemoral_placement::Site;
use nemoral_raycast::Blas;
use nemoral_scene::glam::{DVec2, DVec3, Mat3, Vec2};
use nemoral_scene::{
    ChunkCoord, Instance, ObjectId, ObjectKind, ObjectRecord, Surface, TreeRecord,
};
use nemoral_seed::{Domain, Draw, Key};
use nemoral_trails::DressingKind;

use super::assets::WorldAssets;
use super::ground::{ChunkGround, GroundModel};
use super::looks::{Look, Looks, grown_scale, sapling_scale};
use super::placement::StandLayer;
use crate::Error;
use crate::plan::{Forest, Hasher, Node, OfWorld, Stage};

const LOOK: Domain = Domain::new("pipeline.look");

/// One rock, tree, stump, shrub or stone.
#[derive(Clone, Debug)]
pub struct Thing {
    /// Its true id.
    pub object: ObjectId,
    /// What it is.
    pub kind: ObjectKind,
    /// World position of its foot.
    pub position_m: DVec3,
    /// What it occupies at the ground, metres.
    pub radius_m: f64,
    /// Index into the library's assets of its kind.
    pub asset: usize,
    /// Size relative to the asset.
    pub scale: f64,
    /// Chunk axes from the asset's axes.
    pub linear: Mat3,
    /// 0..1, varies its colour.
    pub variation: f32,
    /// Does it lie on a trail (a stone)?
    pub on_trail: bool,
}

/// The things of a chunk, in order of their ids.
#[derive(Clone, Debug, Default)]
pub struct Things(pub Vec<Thing>);

impl Thing {
    /// Its shape with its ray-casting tree.
    #[must_use]
    pub fn shape<'a>(&self, assets: &'a WorldAssets) -> &'a Arc<Blas> {
        match self.kind {
            ObjectKind::Tree => &assets.standing[self.asset].blas,
            ObjectKind::Stump => &assets.stumps[self.asset],
            ObjectKind::Shrub => &assets.shrubs[self.asset],
            _ if self.on_trail => &assets.trail_stones[self.asset],
            _ => &assets.rocks[self.asset],
        }
    }

    /// It, placed in its chunk.
    #[must_use]
    pub fn instance(&self, shape: &Blas, chunk: ChunkCoord, chunk_size_m: f64) -> Instance {
        let local = self.position_m - chunk.origin_m(chunk_size_m).extend(0.0);
        Instance {
            prototype: Arc::clone(shape.prototype()),
            position_m: local.as_vec3(),
            linear: self.linear,
            object: self.object,
            variation: self.variation,
        }
    }

    /// Its row of `instances.csv`.
    #[must_use]
    pub fn object_record(&self, assets: &WorldAssets) -> ObjectRecord {
        let library = &assets.library;
        let plant = |plants: &[nemoral_assets::PlantAsset]| {
            (plants[self.asset].name.clone(), plants[self.asset].height_m)
        };
        let (species, height_m) = match self.kind {
            ObjectKind::Tree => {
                let tree = &assets.standing[self.asset].tree;
                (tree.species.clone(), tree.size.height_m)
            }
            ObjectKind::Stump => plant(&library.stumps),
            ObjectKind::Shrub => plant(&library.shrubs),
            _ if self.on_trail => plant(&library.trail_stones),
            _ => plant(&library.rocks),
        };
        ObjectRecord {
            object: self.object,
            kind: self.kind,
            species,
            position_m: self.position_m,
            radius_m: self.radius_m,
            height_m: height_m * self.scale,
        }
    }

    /// Its row of `trees.csv`, if it is a tree.
    #[must_use]
    pub fn tree_record(&self, assets: &WorldAssets) -> Option<TreeRecord> {
        if self.kind != ObjectKind::Tree {
            return None;
        }
        let tree = &assets.standing[self.asset].tree;
        let (size, s) = (&tree.size, self.scale);
        Some(TreeRecord {
            object: self.object,
            species: tree.species.clone(),
            position_m: self.position_m,
            dbh_m: dbh_m(size, s),
            height_m: size.height_m * s,
            crown_base_m: size.crown_base_m * s,
            crown_radius_m: size.crown_radius_m * s,
            leaf_area_m2: size.leaf_area_m2 * s * s,
            stem_volume_m3: tree.stem_volume_m3 * s * s * s,
            lean_rad: size.lean_rad,
            age_class: tree.class.name().to_owned(),
            alive: tree.alive,
        })
    }
}

/// The diameter at breast height of a tree scaled by `s`. A grown tree's changes little within the few
/// decimetres between its own breast height and that of its copy; a sapling's stem is taken as a cone.
/// One under 1.3 m has none: 0.
fn dbh_m(size: &TreeSize, s: f64) -> f64 {
    const BREAST_M: f64 = 1.3;
    if s > 0.89 {
        return size.dbh_m * s;
    }
    let above_m = (s * size.height_m - BREAST_M).max(0.0);
    size.dbh_m * above_m / (size.height_m - BREAST_M)
}

/// Numbers the sites of a chunk and stands them on its ground.
#[derive(Clone, Copy, Debug)]
pub struct ThingStage;

impl Stage<Forest> for ThingStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<WorldAssets>,
        OfWorld<GroundModel>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, Vec<Site>>,
        Node<ChunkCoord, Vec<Site>>,
    );
    type Output = Things;
    const ID: &'static str = "chunk.things";
    const VERSION: u32 = 3;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(
        &self,
        at: ChunkCoord,
        world: Key,
        (assets, model, ground, rocks, woody): (
            Arc<WorldAssets>,
            Arc<GroundModel>,
            Arc<ChunkGround>,
            Arc<Vec<Site>>,
            Arc<Vec<Site>>,
        ),
    ) -> Result<Things, Error> {
        let mut placed: Vec<Placed> = Vec::new();
        for site in rocks.iter() {
            placed.push(Placed::new(ObjectKind::Rock, site));
        }
        for site in woody.iter() {
            placed.push(match StandLayer::of(site) {
                StandLayer::Trees => Placed::new(ObjectKind::Tree, site),
                StandLayer::Stumps => Placed::new(ObjectKind::Stump, site),
                StandLayer::Shrubs => Placed::new(ObjectKind::Shrub, site),
                StandLayer::Saplings => Placed::sapling(site, assets.first_sapling),
            });
        }
        let stones = model.trails().map(|t| t.dressing(at)).unwrap_or_default();
        let kinds = assets.library.trail_stones.len() as u32;
        for (i, stone) in stones
            .iter()
            .filter(|d| d.kind == DressingKind::Stone)
            .enumerate()
        {
            let key = world.domain(LOOK).chunk(at).item(i as u64);
            let asset = key.rng().below(kinds) as usize;
            placed.push(Placed {
                kind: ObjectKind::Rock,
                position_m: stone.position_m,
                radius_m: assets.library.trail_stones[asset].radius_m * stone.scale,
                asset,
                size: Size::Given(stone.scale),
                key,
                on_trail: true,
            });
        }
        let things = placed.iter().enumerate().map(|(i, p)| {
            let object = u16::try_from(i + 1)
                .ok()
                .and_then(|item| ObjectId::new(at, item));
            let object = object.ok_or_else(|| {
                let message = format!("{} things: a chunk holds at most 65,535", placed.len());
                Error::of_stage(std::io::Error::other(message))
            })?;
            Ok(p.stand(object, &ground, &assets.looks))
        });
        Ok(Things(things.collect::<Result<_, Error>>()?))
    }
}

/// A thing on the map, before it stands on the ground.
struct Placed {
    kind: ObjectKind,
    position_m: DVec2,
    radius_m: f64,
    asset: usize,
    size: Size,
    key: Key,
    on_trail: bool,
}

/// A thing's size relative to its asset.
#[derive(Clone, Copy)]
enum Size {
    Given(f64),
    Drawn,
    Sapling,
}

impl Size {
    /// The scale of a place among all sizes, 0..1.
    fn scale(self, place: f64) -> f64 {
        match self {
            Self::Given(scale) => scale,
            Self::Drawn => grown_scale(place),
            Self::Sapling => sapling_scale(place),
        }
    }
}

impl Placed {
    fn new(kind: ObjectKind, site: &Site) -> Self {
        Self {
            kind,
            position_m: site.position_m,
            radius_m: site.radius_m,
            asset: usize::from(site.variety),
            size: Size::Drawn,
            key: site.key,
            on_trail: false,
        }
    }

    fn sapling(site: &Site, first: usize) -> Self {
        Self {
            asset: first + usize::from(site.variety),
            size: Size::Sapling,
            ..Self::new(ObjectKind::Tree, site)
        }
    }

    fn stand(&self, object: ObjectId, ground: &ChunkGround, looks: &Looks) -> Thing {
        let mut rng = self.key.domain(LOOK).rng();
        let look = match self.kind {
            ObjectKind::Tree => {
                let pattern = match self.size {
                    Size::Sapling => &looks.saplings,
                    _ => &looks.trees,
                };
                pattern.at(self.position_m, &mut rng)
            }
            _ => Look {
                yaw_rad: rng.range_f64(0.0, TAU),
                size: rng.unit_f64(),
            },
        };
        let variation = rng.unit_f32();
        let scale = self.size.scale(look.size);
        let sample = Surface::sample(ground, self.position_m);
        // Trees stand upright on a slope, their flare reaches into it; the rest lies along it.
        let gradient = match self.kind {
            ObjectKind::Tree | ObjectKind::Stump => Vec2::ZERO,
            _ => sample.gradient.as_vec2(),
        };
        Thing {
            object,
            kind: self.kind,
            position_m: self.position_m.extend(sample.height_m),
            radius_m: self.radius_m,
            asset: self.asset,
            scale,
            linear: Instance::upright(look.yaw_rad as f32, scale as f32, gradient),
            variation,
            on_trail: self.on_trail,
        }
    }
}
