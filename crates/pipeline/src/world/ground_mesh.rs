//! The mesh of a chunk's ground.

use std::sync::{Arc, Mutex, PoisonError};

use nemoral_assets::GroundMaterials;
use nemoral_raycast::Blas;
use nemoral_scene::glam::{DVec2, Vec3};
use nemoral_scene::{ChunkCoord, InstancePlace, MaterialId, Prototype, Surface, SurfaceSample};
use nemoral_seed::{Domain, Key};
use nemoral_stand::{FLOOR_FIELD, FloorComposition, ScalarField};
use nemoral_terrain::{GroundMesher, GroundZones, MeshParams, ZoneSample};
use nemoral_trails::{TrailPlace, TrailSurfaceKind, TrailZone};

use super::assets::{LyingSnow, WorldAssets};
use super::chunk_ground::ChunkGround;
use super::ground::TerrainField;
use super::snow::SnowCover;
use super::water::WaterMaterials;
use crate::Error;
use crate::config::Config;
use crate::plan::{Encode, Encoder};

const FLOOR: Domain = Domain::new("pipeline.floor");

/// The mesh of the ground, as a config describes it.
#[derive(Clone, Debug)]
pub(crate) struct GroundMeshRecipe {
    mesher: GroundMesher,
    params: MeshParams,
    /// The shares of ground covers, in the order of the library's floors.
    floor: [f64; 3],
}

impl GroundMeshRecipe {
    pub(crate) fn new(config: &Config) -> Result<Self, Error> {
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
        })
    }

    /// The ground of a chunk, placed in it, with or without the snow that lies on it.
    pub(crate) fn make(
        &self,
        (at, world): (ChunkCoord, Key),
        assets: &WorldAssets,
        ground: &ChunkGround,
        snow: Option<&LyingSnow>,
    ) -> Result<(InstancePlace, Arc<Blas>), Error> {
        let library = &assets.library;
        let floor = floor_composition(self.floor, world)?;
        let beds = assets.water.as_ref();
        let mud = beds.map_or(library.ground.bare_soil, |beds| beds.mud);
        let memoized = MemoizedGround::new(ground);
        let material = |p: DVec2, inside: bool| {
            bed_material(beds, ground, p).unwrap_or_else(|| {
                memoized.at(p, |trails| {
                    ground_material(&library.ground, mud, &floor, (ground, trails), p, inside)
                })
            })
        };
        let mesh = match snow {
            None => self.mesher.mesh(at, &memoized, &memoized, &material),
            Some(lying) => {
                let snow = SnowCover::new(lying, ground, &memoized);
                let material = |p: DVec2, inside: bool| match material(p, inside) {
                    below if !snow.hides(p) => below,
                    below => lying.materials.over(below),
                };
                self.mesher.mesh(at, &snow, &memoized, &material)
            }
        };
        let prototype = Prototype::new("ground", mesh, Vec::new(), &library.materials)
            .map_err(Error::of_stage)?;
        let blas = Arc::new(Blas::build(Arc::new(prototype), &library.materials));
        Ok((InstancePlace::at(Vec3::ZERO), blas))
    }
}

impl Encode for GroundMeshRecipe {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            // It is made from the parameters.
            mesher: _,
            params,
            floor,
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

/// The ground for its mesher, which asks several things of a place one after the other: the trails
/// around the last one are kept.
struct MemoizedGround<'a> {
    ground: &'a ChunkGround,
    last: Mutex<Option<TrailPlace<'a>>>,
}

impl<'a> MemoizedGround<'a> {
    fn new(ground: &'a ChunkGround) -> Self {
        Self {
            ground,
            last: Mutex::new(None),
        }
    }

    /// What `look` finds out of a place by the trails there.
    fn at<T>(&self, p: DVec2, look: impl FnOnce(Option<&TrailPlace<'_>>) -> T) -> T {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.as_ref().is_none_or(|last| last.world_m() != p) {
            *last = self.ground.trail_place(p);
        }
        look(last.as_ref())
    }
}

impl Surface for MemoizedGround<'_> {
    fn sample(&self, p: DVec2) -> SurfaceSample {
        self.at(p, |trails| self.ground.sample_at(p, trails))
    }
}

impl GroundZones for MemoizedGround<'_> {
    fn sample(&self, p: DVec2) -> ZoneSample {
        self.at(p, |trails| self.ground.zones_at(p, trails))
    }
}

/// The covers of a world's forest floor with these shares, in the order of the library's floors.
pub(crate) fn floor_composition(
    shares: [f64; 3],
    world: Key,
) -> Result<FloorComposition<TerrainField>, Error> {
    let field = TerrainField::new(FLOOR_FIELD, world.domain(FLOOR))?;
    FloorComposition::new(shares, field).map_err(Error::of_stage)
}

/// How far beyond the water its banks are bare and wet at the most, metres.
const BARE_M: f64 = 0.26;

/// The material of the bed and the wet banks of water; `None` elsewhere.
fn bed_material(
    beds: Option<&WaterMaterials>,
    ground: &ChunkGround,
    p: DVec2,
) -> Option<MaterialId> {
    let (beds, water) = (beds?, ground.water()?);
    let bank_m = ground.bank_m(p);
    // Far from water the waves, which are slow to compute, do not matter.
    if bank_m > BARE_M || bank_m > BARE_M * (0.45 + 0.55 * wave(p)) {
        return None;
    }
    let of_pond = water.ponds().any(|pond| pond.edge_m(p) < BARE_M);
    Some(if of_pond { beds.mud } else { beds.gravel })
}

/// Waves of some metres and less, −1..=1, by which the borders of what is bare are ragged.
fn wave(p: DVec2) -> f64 {
    let wave = |x: f64, y: f64| libm::sin(x + 1.3 * libm::sin(y));
    wave(2.1 * p.x + 0.7, 1.7 * p.y) * wave(2.6 * p.y, 1.9 * p.x + 0.4)
}

/// The material of a piece of ground: the trail's, or the floor's, of which `mud` is the wettest.
fn ground_material<F: ScalarField>(
    materials: &GroundMaterials,
    mud: MaterialId,
    floor: &FloorComposition<F>,
    (ground, trails): (&ChunkGround, Option<&TrailPlace<'_>>),
    p: DVec2,
    inside: bool,
) -> MaterialId {
    let trail = || {
        let kind = trails.and_then(TrailPlace::kind);
        materials.trail(kind.unwrap_or(TrailSurfaceKind::Gravel))
    };
    match trails.map_or(TrailZone::Off, |trails| trails.zone_on_side(inside)) {
        TrailZone::Surface => trail().surface,
        TrailZone::Rut => trail().rut,
        TrailZone::Strip => trail().strip,
        TrailZone::CutSlope => materials.cut_slope,
        TrailZone::Off if ground.is_pit(p) => materials.bare_soil,
        TrailZone::Off if ground.is_rock_face(p) => materials.rock_face.unwrap_or(mud),
        TrailZone::Off => {
            let wetness = ground.conditions(p).wetness;
            if ground.is_mud(p, wetness, || wave(p)) {
                mud
            } else {
                materials.floor[floor.cover(p, wetness).index()]
            }
        }
    }
}
