//! The litter of a chunk: patches of what the trees around shed, on planes of the ground's mesh.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use nemoral_assets::LitterPatches;
use nemoral_placement::{CoverKind, CoverPoint, GroundCover, GroundCoverParams};
use nemoral_raycast::{Blas, Group, RayScene};
use nemoral_scene::glam::{DVec2, Vec3};
use nemoral_scene::{
    ChunkCoord, InstancePlace, ObjectKind, Ray, RayCaster, Semantic, Surface, TrailSurfaceKind,
};
use nemoral_seed::{Domain, Draw, Key};
use nemoral_stand::{
    FloorComposition, FloorCover, GroundPlane, Litter, LitterSite, LitterSurface, LowPlant,
    SceneObjects, SkyViewFactor,
};
use nemoral_trails::TrailZone;

use super::assets::WorldAssets;
use super::chunk_geometry::ObjectGeometry;
use super::chunk_ground::ChunkGround;
use super::ground::TerrainField;
use super::ground_mesh::floor_composition;
use super::low_plants::near;
use crate::{Error, config};

const PATCHES: Domain = Domain::new("pipeline.litter");
const THERE: Domain = Domain::new("pipeline.litter.there");
const SPECIES: Domain = Domain::new("pipeline.litter.species");

/// Side of a cell of the grid, metres. Patches reach over its border.
const CELL_M: f64 = 1.3;
/// The greatest distance of a patch from its cell's middle, in cells.
const JITTER: f64 = 0.35;
/// The range of scales of patches.
const SCALE: (f64, f64) = (0.9, 1.12);
/// How far the plane of a wide and of a narrow patch may miss the ground, metres: about as high as
/// a dry leaf stands up. Where a wide one misses it farther there are narrow ones, and where these
/// do, nothing.
const GAPS_M: [f64; 2] = [0.018, 0.015];
/// How far the four narrow patches that take the place of a wide one are from its middle, metres.
const APART_M: f64 = 0.45;
/// The distance at which the ground around tells whether a place is in a hollow, metres.
const HOLLOW_M: f64 = 2.5;
/// How far from a puddle's hollow litter ends, metres.
const PUDDLE_M: f64 = 0.25;
/// How far a tree's leaves fall beyond its crown, metres.
const FALL_M: f64 = 1.5;
/// How much the species of a stand count everywhere, beside the trees that stand near.
const BLOWN: f64 = 0.2;
/// Stems farther from a chunk than this change none of its litter, metres.
const STEMS_M: f64 = 9.0;

/// The litter of a world.
#[derive(Debug)]
pub(crate) struct LitterLayer {
    grid: GroundCover,
    litter: Litter,
    floor: FloorComposition<TerrainField>,
}

/// A patch of litter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LitterPatch {
    /// The number of the species that it is of among those of the stand.
    pub species: usize,
    /// Whether it is one of the wide ones.
    pub is_wide: bool,
    /// How deep it is, 0..1.
    pub depth: f64,
    /// Its place, turn and size.
    pub at: LowPlant,
    /// The plane that it lies on.
    pub plane: GroundPlane,
}

impl LitterPatch {
    /// What the surfaces of litter are.
    pub(crate) const PARTS: [Semantic; 4] = [
        Semantic::Litter,
        Semantic::FallenTwig,
        Semantic::FallenBark,
        Semantic::Stone,
    ];
}

/// What sheds litter in and around a chunk, and what holds it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stems {
    /// Grown trees: the place, how far their leaves fall, metres, and the species.
    trees: Vec<(DVec2, f64, usize)>,
    /// Feet of trees and stumps: the place and the radius, metres.
    feet: Vec<(DVec2, f64)>,
    /// The share of each species of the stand.
    shares: Vec<f64>,
}

impl Stems {
    /// Those of a chunk and of the chunks around it.
    pub(crate) fn new(
        (at, chunk_size_m): (ChunkCoord, f64),
        around: &[Arc<SceneObjects>],
        assets: &WorldAssets,
    ) -> Self {
        let low = at.origin_m(chunk_size_m) - STEMS_M;
        let high = low + chunk_size_m + 2.0 * STEMS_M;
        let mut stems = Self {
            shares: assets.shares.iter().map(|(_, share)| *share).collect(),
            ..Self::default()
        };
        for object in around.iter().flat_map(|objects| &objects.0) {
            let place = object.position_m.truncate();
            let is_stem = matches!(object.kind, ObjectKind::Tree | ObjectKind::Stump);
            if !is_stem || place.cmplt(low).any() || place.cmpgt(high).any() {
                continue;
            }
            stems.feet.push((place, object.radius_m));
            let is_grown = object.asset < assets.first_sapling;
            if let Some(species) = assets.species_of(object).filter(|_| is_grown) {
                let size = &assets.standing[object.asset].tree.size;
                let reach_m = size.crown_radius_m * object.scale + FALL_M;
                stems.trees.push((place, reach_m.min(STEMS_M), species));
            }
        }
        stems
    }

    /// The distance from the nearest foot, metres.
    fn distance_m(&self, world_m: DVec2) -> f64 {
        let feet = self.feet.iter();
        feet.map(|(place, radius_m)| place.distance(world_m) - radius_m)
            .fold(f64::INFINITY, f64::min)
    }

    /// The number of a species whose leaves lie at a place.
    fn species(&self, world_m: DVec2, key: Key) -> usize {
        let mut weights: Vec<f64> = self.shares.iter().map(|share| BLOWN * share).collect();
        for (place, reach_m, species) in &self.trees {
            weights[*species] += (1.0 - place.distance(world_m) / reach_m).max(0.0);
        }
        key.rng().weighted(&weights).unwrap_or(0)
    }
}

/// Heights of the mesh of a chunk's ground, and beyond its border those of the ground.
pub(crate) struct GroundHeights<'a> {
    mesh: RayScene,
    ground: &'a ChunkGround,
    origin_m: DVec2,
}

impl<'a> GroundHeights<'a> {
    /// The ground is the first of a chunk's instances.
    pub(crate) fn new(geometry: &ObjectGeometry, ground: &'a ChunkGround, origin_m: DVec2) -> Self {
        let first = geometry.in_summer().instances().first();
        let shapes = first.map(|(instance, shape)| (instance.place(), Arc::clone(shape)));
        let group = Arc::new(Group::build(shapes.into_iter().collect()));
        Self {
            mesh: RayScene::new(vec![(Vec3::ZERO, group)]),
            ground,
            origin_m,
        }
    }

    fn height_m(&self, world_m: DVec2) -> f64 {
        let height_m = self.ground.height_m(world_m);
        let from = (world_m - self.origin_m).extend(height_m + 1.0).as_vec3();
        let hit = self.mesh.closest_surface(&Ray::new(from, Vec3::NEG_Z));
        hit.map_or(height_m, |hit| f64::from(from.z - hit.distance_m))
    }
}

/// What decides about the litter of a chunk.
struct Around<'a> {
    ground: &'a ChunkGround,
    mesh: &'a GroundHeights<'a>,
    sky: &'a SkyViewFactor,
    stems: &'a Stems,
    is_hidden: &'a dyn Fn(DVec2) -> bool,
}

/// What was found for a place.
enum Found {
    Patch(LitterPatch),
    /// No litter lies there.
    Nothing,
    /// A trail or water is too near for a patch of that size.
    NoRoom,
    /// The ground is too uneven for a patch of that size.
    Uneven,
}

impl LitterLayer {
    /// `None` if there is none.
    pub(crate) fn new(
        wanted: &config::Litter,
        floor: &config::Floor,
        chunk_size_m: f64,
        world: Key,
    ) -> Result<Option<Self>, Error> {
        if !wanted.is_any() {
            return Ok(None);
        }
        let params = GroundCoverParams {
            chunk_size_m,
            cell_m: CELL_M,
            jitter: JITTER,
            varieties: vec![CoverKind {
                weight: 1.0,
                radius_m: 0.0,
                scale: SCALE,
            }],
        };
        let grid = GroundCover::new(params, world.domain(PATCHES)).map_err(Error::of_stage)?;
        Ok(Some(Self {
            grid,
            litter: Litter {
                cover: wanted.cover,
                on_trails: wanted.on_trails,
            },
            floor: floor_composition([floor.leaf_litter, floor.needle_litter, floor.moss], world)?,
        }))
    }

    /// The patches of a chunk, but none where something else hides the ground.
    pub(crate) fn lay(
        &self,
        at: ChunkCoord,
        (ground, mesh): (&ChunkGround, &GroundHeights<'_>),
        sky: &SkyViewFactor,
        stems: &Stems,
        is_hidden: &dyn Fn(DVec2) -> bool,
    ) -> Vec<LitterPatch> {
        let around = Around {
            ground,
            mesh,
            sky,
            stems,
            is_hidden,
        };
        let mut patches = Vec::new();
        for point in self.grid.points(at, &|_: DVec2, _: f64| true, &|_| 1.0) {
            let found = self.patch(whole(&point), true, true, &around);
            let is_drawn = match found {
                Found::Patch(patch) => {
                    patches.push(patch);
                    continue;
                }
                Found::Nothing => continue,
                Found::NoRoom => true,
                Found::Uneven => false,
            };
            for part in 0..4 {
                let found = self.patch(quarter(&point, part), false, is_drawn, &around);
                if let Found::Patch(patch) = found {
                    patches.push(patch);
                }
            }
        }
        patches
    }

    /// What lies at a place. Whether litter is there at all is drawn, unless it was before.
    fn patch(&self, of: LowPlant, is_wide: bool, is_drawn: bool, around: &Around<'_>) -> Found {
        let (p, ground) = (of.position_m, around.ground);
        let size = usize::from(!is_wide);
        let radius_m = LitterPatches::RADII_M[size] * of.scale;
        let edge_m = ground.trail_edge_m(p);
        let is_dry =
            ground.is_clear_of_water(p, radius_m) && ground.puddle_edge_m(p) > radius_m + PUDDLE_M;
        // Narrow ones may lie on trails and across their edges.
        if !is_dry || (is_wide && edge_m < radius_m) {
            return Found::NoRoom;
        }
        if ground.is_pit(p) || (around.is_hidden)(p) {
            return Found::Nothing;
        }
        let site = self.site(p, edge_m, around);
        let mut there = of.key.domain(THERE).rng();
        if is_drawn && !there.chance(self.litter.chance(&site) * ground.litterfall(p)) {
            return Found::Nothing;
        }
        let plane = GroundPlane::fit(p, radius_m, |p| around.mesh.height_m(p));
        if plane.gap_m > GAPS_M[size] {
            return Found::Uneven;
        }
        Found::Patch(LitterPatch {
            species: around.stems.species(p, of.key.domain(SPECIES)),
            is_wide,
            depth: self.litter.depth(&site),
            at: of,
            plane,
        })
    }

    fn site(&self, p: DVec2, trail_edge_m: f64, of: &Around<'_>) -> LitterSite {
        let ground = of.ground;
        let here = ground.sample(p);
        let around = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y];
        let around = around.map(|way| ground.height_m(p + HOLLOW_M * way));
        let surface = if trail_edge_m < 0.0 {
            match ground.trail_kind(p) {
                _ if ground.trail_zone(p, true) == TrailZone::Rut => LitterSurface::Trail,
                Some(TrailSurfaceKind::LeafLitter | TrailSurfaceKind::Needles) => {
                    LitterSurface::LitteredTrail
                }
                _ => LitterSurface::Trail,
            }
        } else if self.floor.cover(p, ground.conditions(p).wetness) == FloorCover::Moss {
            LitterSurface::Moss
        } else {
            LitterSurface::Litter
        };
        LitterSite {
            sky_view: f64::from(of.sky.at(p.extend(here.height_m + 0.3))),
            hollow_m: around.iter().sum::<f64>() / 4.0 - here.height_m,
            slope: here.gradient.length(),
            stem_m: of.stems.distance_m(p),
            trail_edge_m,
            surface,
        }
    }
}

/// A wide patch.
fn whole(point: &CoverPoint) -> LowPlant {
    LowPlant {
        position_m: point.position_m,
        yaw_rad: point.yaw_rad,
        scale: point.scale,
        key: point.key,
    }
}

/// One of the four narrow patches in the place of a wide one.
fn quarter(point: &CoverPoint, part: u32) -> LowPlant {
    let key = point.key.item(u64::from(part) + 1);
    let mut rng = key.rng();
    let (sin, cos) = libm::sincos(point.yaw_rad + FRAC_PI_2 * f64::from(part));
    LowPlant {
        position_m: point.position_m + DVec2::new(cos, sin) * (APART_M * point.scale),
        yaw_rad: rng.range_f64(0.0, TAU),
        scale: rng.range_f64(SCALE.0, SCALE.1),
        key,
    }
}

/// The patches of a chunk as instances. They have no ids.
pub(crate) fn instances(
    patches: &[LitterPatch],
    origin_m: DVec2,
    assets: &WorldAssets,
) -> Vec<(InstancePlace, Arc<Blas>)> {
    let placed = patches.iter().filter_map(|patch| {
        let shapes = &assets.shed.get(patch.species)?[usize::from(!patch.is_wide)];
        let weights = near(patch.depth, shapes.len());
        let (place, shape) = patch
            .at
            .place(shapes, Some(&weights), &patch.plane, origin_m)?;
        Some((place, Arc::clone(shape)))
    });
    placed.collect()
}
