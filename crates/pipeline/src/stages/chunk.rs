//! A chunk's geometry, ready for rays: two subtrees that are cached as long as the chunk lives.

use std::sync::Arc;

use nemoral_assets::GroundMaterials;
use nemoral_placement::CoverPoint;
use nemoral_raycast::{Blas, Group};
use nemoral_scene::glam::{DVec2, Mat3, Vec2, Vec3};
use nemoral_scene::{
    ChunkCoord, Instance, MaterialId, ObjectId, Prototype, Surface, TrailSurfaceKind,
};
use nemoral_seed::{Domain, Draw, Key};
use nemoral_terrain::{GroundMesher, MeshParams, Terrain, TerrainParams};
use nemoral_trails::{DressingKind, TrailZone};

use super::assets::WorldAssets;
use super::ground::{ChunkGround, GroundModel};
use super::things::Things;
use super::undergrowth::{Patch, PatchKind};
use crate::config::Config;
use crate::plan::{Encode, Encoder, Forest, Hasher, Node, OfWorld, Stage};
use crate::{Error, InputFiles};

const FLOOR: Domain = Domain::new("pipeline.floor");
const LOOK: Domain = Domain::new("pipeline.low.look");

/// What stands in a chunk, ground included.
#[derive(Debug)]
pub struct Solid(pub Arc<Group>);

/// A chunk's undergrowth and trail grass; `None` where nothing grows.
#[derive(Debug)]
pub struct Low(pub Option<Arc<Group>>);

/// Meshes the ground and stands the things of a chunk on it.
#[derive(Clone, Debug)]
pub struct SolidStage {
    mesher: GroundMesher,
    params: MeshParams,
    /// Of what covers the ground, in the order of the library's floors.
    floor: [f64; 3],
    chunk_size_m: f64,
}

impl SolidStage {
    /// The stage of a config.
    ///
    /// # Errors
    /// If the cells do not fit the chunk.
    pub fn new(config: &Config) -> Result<Self, Error> {
        let params = MeshParams {
            chunk_size_m: config.chunks.size_m,
            cell_m: config.terrain.cell_m,
            fine_cell_m: config.terrain.fine_cell_m,
            ..MeshParams::default()
        };
        let mesher =
            GroundMesher::new(params).map_err(|e| Error::request(format!("terrain: {e}")))?;
        Ok(Self {
            mesher,
            params,
            floor: {
                let floor = &config.undergrowth.floor;
                [floor.leaf_litter, floor.needle_litter, floor.moss]
            },
            chunk_size_m: config.chunks.size_m,
        })
    }
}

impl Encode for SolidStage {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            // Made of the parameters.
            mesher: _,
            params,
            floor,
            // One of the parameters.
            chunk_size_m: _,
        } = self;
        let MeshParams {
            chunk_size_m,
            cell_m,
            fine_cell_m,
            tolerance_m,
        } = params;
        encoder.field("chunk_size_m", chunk_size_m);
        encoder.field("cell_m", cell_m);
        encoder.field("fine_cell_m", fine_cell_m);
        encoder.field("tolerance_m", tolerance_m);
        encoder.field("floor", floor);
    }
}

impl Stage<Forest> for SolidStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<WorldAssets>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, Things>,
    );
    type Output = Solid;
    const ID: &'static str = "chunk.solid";
    const VERSION: u32 = 3;

    fn fingerprint(&self, hasher: &mut Hasher) {
        InputFiles::default().encode(hasher, self);
    }

    fn run(
        &self,
        at: ChunkCoord,
        world: Key,
        (assets, ground, things): (Arc<WorldAssets>, Arc<ChunkGround>, Arc<Things>),
    ) -> Result<Solid, Error> {
        let library = &assets.library;
        let floor = FloorPlan::new(self.floor, world)?;
        let material = |p: DVec2, inside: bool| floor.material(&library.ground, &ground, p, inside);
        let mesh = self.mesher.mesh(at, &*ground, &*ground, &material);
        let prototype = Prototype::new("ground", mesh, Vec::new(), &library.materials)
            .map_err(Error::of_stage)?;
        let blas = Arc::new(Blas::build(Arc::new(prototype), &library.materials));
        let mut instances = vec![(
            Instance {
                prototype: Arc::clone(blas.prototype()),
                position_m: Vec3::ZERO,
                linear: Mat3::IDENTITY,
                object: ObjectId::NONE,
                variation: 0.5,
            },
            blas,
        )];
        for thing in &things.0 {
            let shape = thing.shape(&assets);
            instances.push((
                thing.instance(shape, at, self.chunk_size_m),
                Arc::clone(shape),
            ));
        }
        Ok(Solid(Arc::new(Group::build(instances))))
    }
}

/// Which ground lies where: fields that choose between the floor's materials.
struct FloorPlan {
    patches: Terrain,
    /// Below the i-th of these the field has the i-th material, above the last the last.
    limits: [f64; 2],
}

/// Places along a side of the grid, in steps of some patches, that a floor's field is sampled at.
const FLOOR_SAMPLES: u32 = 48;

impl FloorPlan {
    /// `shares`, positive in sum, are met by the field's own quantiles.
    fn new(shares: [f64; 3], world: Key) -> Result<Self, Error> {
        let params = TerrainParams {
            octaves: 4,
            scale_m: 14.0,
            lacunarity: 2.1,
            persistence: 0.6,
            max_height_m: 1.0,
        };
        let patches = Terrain::new(params, world.domain(FLOOR)).map_err(Error::of_stage)?;
        let places = (0..FLOOR_SAMPLES * FLOOR_SAMPLES)
            .map(|i| DVec2::new(f64::from(i % FLOOR_SAMPLES), f64::from(i / FLOOR_SAMPLES)) * 37.0);
        let mut field: Vec<f64> = places.map(|p| patches.height_m(p)).collect();
        field.sort_unstable_by(f64::total_cmp);
        let total: f64 = shares.iter().sum();
        let limit = |share: f64| {
            let rank = share / total * field.len() as f64;
            field.get(rank as usize).copied().unwrap_or(f64::INFINITY)
        };
        let limits = [limit(shares[0]), limit(shares[0] + shares[1])];
        Ok(Self { patches, limits })
    }

    fn material(
        &self,
        materials: &GroundMaterials,
        ground: &ChunkGround,
        p: DVec2,
        inside: bool,
    ) -> MaterialId {
        let trail = || {
            let kind = ground.trail_kind(p).unwrap_or(TrailSurfaceKind::Gravel);
            materials.trail(kind)
        };
        match ground.trail_zone(p, inside) {
            TrailZone::Surface => return trail().surface,
            TrailZone::Rut => return trail().rut,
            TrailZone::Strip => return trail().strip,
            TrailZone::CutSlope => return materials.cut_slope,
            TrailZone::Off => {}
        }
        let field = self.patches.height_m(p);
        let below = self.limits.iter().filter(|&&limit| field >= limit).count();
        materials.floor[below.min(materials.floor.len() - 1)]
    }
}

/// Grows the undergrowth of a chunk.
#[derive(Clone, Copy, Debug)]
pub struct LowStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
}

impl Stage<Forest> for LowStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<WorldAssets>,
        OfWorld<GroundModel>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, Vec<Patch>>,
        Node<ChunkCoord, Vec<CoverPoint>>,
    );
    type Output = Low;
    const ID: &'static str = "chunk.low";
    const VERSION: u32 = 3;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { chunk_size_m } = self;
        hasher.write_f64(*chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        world: Key,
        (assets, model, ground, patches, seedlings): (
            Arc<WorldAssets>,
            Arc<GroundModel>,
            Arc<ChunkGround>,
            Arc<Vec<Patch>>,
            Arc<Vec<CoverPoint>>,
        ),
    ) -> Result<Low, Error> {
        let origin = at.origin_m(self.chunk_size_m);
        let mut instances = Vec::new();
        // One of the shapes, with these chances, or with equal ones.
        let mut plant = |shapes: &[Arc<Blas>], weights: Option<&[f64]>, place: &Place| {
            let mut rng = place.key.domain(LOOK).rng();
            let chosen = match weights {
                Some(weights) => rng.weighted(weights),
                None if shapes.is_empty() => None,
                None => Some(rng.below(shapes.len() as u32) as usize),
            };
            let Some(shape) = chosen.and_then(|i| shapes.get(i)) else {
                return;
            };
            let sample = Surface::sample(&*ground, place.position_m);
            let gradient: Vec2 = sample.gradient.as_vec2();
            let instance = Instance {
                prototype: Arc::clone(shape.prototype()),
                position_m: (place.position_m - origin)
                    .extend(sample.height_m)
                    .as_vec3(),
                linear: Instance::upright(place.yaw_rad as f32, place.scale as f32, gradient),
                object: ObjectId::NONE,
                variation: rng.unit_f32(),
            };
            instances.push((instance, Arc::clone(shape)));
        };
        for Patch { kind, point } in patches.iter() {
            let shapes = match kind {
                PatchKind::Grass => &assets.grass,
                PatchKind::Herbs => &assets.herbs,
                PatchKind::Ferns => &assets.ferns,
                PatchKind::Litter => &assets.litter,
            };
            plant(shapes, None, &Place::of(point));
        }
        for point in seedlings.iter() {
            let weights = Some(&*assets.seedling_weights);
            plant(&assets.seedlings, weights, &Place::of(point));
        }
        let dressing = model.trails().map(|t| t.dressing(at)).unwrap_or_default();
        let tufts = dressing.iter().filter(|d| d.kind != DressingKind::Stone);
        for (i, d) in tufts.enumerate() {
            let key = world.domain(LOOK).chunk(at).item(i as u64);
            let place = Place {
                position_m: d.position_m,
                yaw_rad: d.yaw_rad,
                scale: d.scale,
                key,
            };
            plant(&assets.trail_tufts, None, &place);
        }
        Ok(Low(
            (!instances.is_empty()).then(|| Arc::new(Group::build(instances)))
        ))
    }
}

/// Where a low plant stands.
struct Place {
    position_m: DVec2,
    yaw_rad: f64,
    scale: f64,
    key: Key,
}

impl Place {
    fn of(point: &CoverPoint) -> Self {
        Self {
            position_m: point.position_m,
            yaw_rad: point.yaw_rad,
            scale: point.scale,
            key: point.key,
        }
    }
}
