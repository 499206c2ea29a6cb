//! Roots that spread over the ground from the feet of old trees.

use std::sync::Arc;

use nemoral_assets::{Library, PlantKind};
use nemoral_raycast::Blas;
use nemoral_scene::glam::{DMat3, DVec2, DVec3};
use nemoral_scene::{ChunkCoord, InstancePlace, ObjectId, Surface};
use nemoral_seed::{Domain, Draw, Key};
use nemoral_stand::{SceneObject, SceneObjects};

use super::assets::WorldAssets;
use super::chunk_ground::ChunkGround;

const SURFACE_ROOTS: Domain = Domain::new("pipeline.surface_roots");

/// How far lobes of the flare of young and of old trees reach, metres. Young trees have no roots at
/// the surface.
const LOBES_M: [f64; 2] = [0.13, 0.4];
/// What a large lobe adds to the stem's radius. Species with larger ones have more such roots.
const LARGE_LOBE: f64 = 0.32;
/// Soil of usual depth, metres; where it is thinner there are more roots.
const SOIL_M: f64 = 0.5;
/// How far a root of usual size may miss the ground, metres.
const GAP_M: f64 = 0.035;
/// The sizes that are tried where the ground is uneven, relative to that for the lobe.
const SIZES: [f64; 3] = [1.0, 0.7, 0.5];
/// Away from trails' edges and from water, metres.
const CLEAR_M: f64 = 0.25;

/// The roots of a chunk's trees at the surface, `amount` times the usual.
pub(crate) fn surface_roots(
    (at, chunk_size_m): (ChunkCoord, f64),
    world: Key,
    amount: f64,
    objects: &SceneObjects,
    assets: &WorldAssets,
    ground: &ChunkGround,
) -> Vec<(InstancePlace, Arc<Blas>)> {
    let mut all = Vec::new();
    let key = world.domain(SURFACE_ROOTS).chunk(at);
    let origin_m = at.origin_m(chunk_size_m).extend(0.0);
    for object in &objects.0 {
        // Users' own models have feet of their own.
        let each = Library::SURFACE_ROOTS;
        let of = assets
            .species_of(object)
            .map(|of| of * each..(of + 1) * each);
        let roots = &assets.plants[PlantKind::SurfaceRoot];
        let Some(shapes) = of.and_then(|of| roots.get(of)) else {
            continue;
        };
        let key = key.item(u64::from(object.object.item()));
        let lobes = &assets.standing[object.asset].tree.flare_lobes;
        for (i, lobe) in lobes.iter().enumerate() {
            let mut rng = key.item(i as u64).rng();
            let (sin, cos) = libm::sincos(lobe.azimuth_rad);
            let reach = object.linear.as_dmat3() * DVec3::new(cos, sin, 0.0) * lobe.radius_m;
            let reach_m = reach.truncate();
            let chance = amount * likelihood(reach_m.length(), lobe.share, object, ground);
            if !rng.chance(chance) {
                continue;
            }
            let shape = &shapes[rng.below(each as u32) as usize];
            let size = rng.range_f64(0.65, 1.2);
            let placed = SIZES
                .iter()
                .find_map(|share| Run::new(object, reach_m, share * size, shape, ground));
            if let Some(run) = placed {
                let place = InstancePlace {
                    position_m: (run.start_m - origin_m).as_vec3(),
                    linear: (run.axes * run.scale).as_mat3(),
                    object: ObjectId::NONE,
                    variation: object.variation,
                };
                all.push((place, Arc::clone(shape)));
            }
        }
    }
    all
}

/// How likely a root goes on from a lobe that reaches so far.
fn likelihood(reach_m: f64, share: f64, object: &SceneObject, ground: &ChunkGround) -> f64 {
    let [young, old] = LOBES_M;
    let age = ((reach_m - young) / (old - young)).clamp(0.0, 1.0);
    let soil_m = ground.conditions(object.position_m.truncate()).soil_m;
    let thin = (1.0 + 0.8 * (SOIL_M - soil_m)).clamp(0.6, 1.4);
    age * (share / LARGE_LOBE).min(1.0) * thin
}

/// Where a root lies.
struct Run {
    /// The end of its lobe, on the ground.
    start_m: DVec3,
    /// Along it, across it, and the normal of the ground.
    axes: DMat3,
    scale: f64,
}

impl Run {
    /// A root of a size relative to that for its lobe; `None` where the ground is too uneven, or
    /// there is a trail or water.
    fn new(
        object: &SceneObject,
        reach_m: DVec2,
        size: f64,
        shape: &Blas,
        ground: &ChunkGround,
    ) -> Option<Self> {
        const PLACES: usize = 6;
        let way = reach_m.try_normalize()?;
        let scale = size * (reach_m.length() / Library::ROOT_LOBE_M).clamp(0.5, 1.7);
        let start = object.position_m.truncate() + reach_m;
        let length_m = scale * f64::from(shape.prototype().bounds().max.x);
        let step_m = length_m / (PLACES - 1) as f64;
        let heights: [_; PLACES] = std::array::from_fn(|i| {
            let p = start + way * (step_m * i as f64);
            (p, ground.height_m(p))
        });
        let is_clear = |p: DVec2| {
            ground.trail_edge_m(p) > CLEAR_M
                && ground.is_clear_of_water(p, CLEAR_M)
                && ground.puddle_edge_m(p) > CLEAR_M
        };
        if !heights.iter().all(|(p, _)| is_clear(*p)) {
            return None;
        }
        // The line with the least squares of misses.
        let mean = heights.iter().map(|(_, z)| z).sum::<f64>() / PLACES as f64;
        let middle = 0.5 * (PLACES - 1) as f64;
        let off = |i: usize| i as f64 - middle;
        let (mut rise, mut squares) = (0.0, 0.0);
        for (i, (_, z)) in heights.iter().enumerate() {
            rise += off(i) * (z - mean);
            squares += off(i) * off(i);
        }
        let slope = rise / squares;
        let misses = (heights.iter().enumerate()).map(|(i, (_, z))| z - mean - slope * off(i));
        if misses.fold(0.0, |most: f64, miss| most.max(miss.abs())) > GAP_M * scale {
            return None;
        }
        let along = way.extend(slope / step_m).normalize();
        // Across it lies on the ground of its middle.
        let side = way.perp();
        let aside_m = 0.2 * scale;
        let at = start + way * (0.4 * length_m);
        let across = (ground.height_m(at + side * aside_m) - ground.height_m(at - side * aside_m))
            / (2.0 * aside_m);
        let normal = along.cross(side.extend(across)).normalize();
        Some(Self {
            start_m: start.extend(mean - slope * middle),
            axes: DMat3::from_cols(along, normal.cross(along), normal),
            scale,
        })
    }
}
