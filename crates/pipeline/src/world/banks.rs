//! What sticks out of the slopes that trails cut: stones, lumps of earth, ends of roots.

use nemoral_placement::{CoverKind, GroundCover, GroundCoverParams};
use nemoral_scene::glam::{DMat3, DVec2, DVec3};
use nemoral_scene::{ChunkCoord, InstancePlace, ObjectId, Surface};
use nemoral_seed::{Domain, Draw, Key};
use nemoral_stand::{GroundPlane, LOW_PLANT_VARIATION};
use nemoral_trails::TrailZone;

use super::chunk_ground::ChunkGround;
use crate::Error;

const BANKS: Domain = Domain::new("pipeline.banks");
const THERE: Domain = Domain::new("pipeline.banks.there");
const ROOTED: Domain = Domain::new("pipeline.banks.rooted");

/// Side of a cell of the grid, metres on the map.
const CELL_M: f64 = 0.5;
/// The places in a cell.
const PLACES: u64 = 2;
/// The share of the places in a steep cut that have something, usually.
const SHARE: f64 = 0.8;
/// The slopes from which there is something, and where there is most.
const SLOPES: [f64; 2] = [0.4, 0.75];
/// How far from a trail's edge its banks reach at most, metres.
const REACH_M: f64 = 4.0;
/// The radius on which a bank must be nearly plane, and how far it may miss the plane, metres.
const PLANE_M: [f64; 2] = [0.12, 0.04];
/// Away from the water of streams and puddles, metres.
const DRY_M: f64 = 0.4;

/// Something in a bank.
pub(crate) struct BankPiece {
    /// The bank around it.
    pub(crate) plane: GroundPlane,
    /// Its size relative to its shape.
    pub(crate) scale: f64,
    /// Whether roots come out of the bank there.
    pub(crate) is_rooty: bool,
    /// Its own key.
    pub(crate) key: Key,
}

impl BankPiece {
    /// The piece as one of several shapes, turned so that its z is the bank's normal and its x
    /// downhill; `None` without shapes. `origin_m` is the world position of the instance's frame.
    pub(crate) fn place<'s, S>(
        &self,
        shapes: &'s [S],
        origin_m: DVec2,
    ) -> Option<(InstancePlace, &'s S)> {
        let mut rng = self.key.domain(LOW_PLANT_VARIATION).rng();
        let last = u32::try_from(shapes.len()).ok()?.checked_sub(1)?;
        let shape = shapes.get(rng.below(last + 1) as usize)?;
        let gradient = self.plane.gradient;
        let normal = (-gradient).extend(1.0).normalize_or(DVec3::Z);
        let down = (-gradient)
            .extend(-gradient.length_squared())
            .normalize_or(DVec3::X);
        let turn = DMat3::from_cols(down, normal.cross(down), normal);
        let at_m = (self.plane.middle_m - origin_m).extend(self.plane.height_m);
        let place = InstancePlace {
            position_m: at_m.as_vec3(),
            linear: (turn * self.scale).as_mat3(),
            object: ObjectId::NONE,
            variation: rng.unit_f32(),
        };
        Some((place, shape))
    }
}

/// What is in the banks of a chunk, `amount` times the usual.
pub(crate) fn banks(
    (at, chunk_size_m): (ChunkCoord, f64),
    world: Key,
    amount: f64,
    ground: &ChunkGround,
) -> Result<Vec<BankPiece>, Error> {
    if amount <= 0.0 {
        return Ok(Vec::new());
    }
    let params = GroundCoverParams {
        chunk_size_m,
        cell_m: CELL_M,
        jitter: 0.5,
        varieties: vec![CoverKind {
            weight: 1.0,
            radius_m: 0.0,
            scale: (1.0, 1.0),
        }],
    };
    let grid = GroundCover::new(params, world.domain(BANKS)).map_err(Error::of_stage)?;
    let is_near = |p: DVec2| (-CELL_M..REACH_M).contains(&ground.trail_edge_m(p));
    let cells = grid.points(at, &|p: DVec2, _: f64| is_near(p), &|_| 1.0);
    let places = cells.iter().flat_map(|cell| {
        (0..PLACES).map(|place| {
            let key = cell.key.item(place);
            let mut rng = key.rng();
            let [x, y, scale] = [(); 3].map(|()| rng.unit_f64());
            let off_m = CELL_M * (DVec2::new(x, y) - 0.5);
            (cell.position_m + off_m, 0.75 + 0.5 * scale, key)
        })
    });
    let pieces = places.filter_map(|(p, scale, key)| {
        let chance = SHARE * amount * steepness(ground, p);
        if !key.domain(THERE).rng().chance(chance) {
            return None;
        }
        let [radius_m, gap_m] = PLANE_M;
        let plane = GroundPlane::fit(p, radius_m, |p| ground.height_m(p));
        let is_dry = ground.is_clear_of_water(p, DRY_M) && ground.puddle_edge_m(p) > DRY_M;
        (is_dry && plane.gap_m < gap_m).then(|| BankPiece {
            plane,
            scale,
            // There are no roots where there are no trees.
            is_rooty: (key.domain(ROOTED).rng()).chance(0.75 * ground.litterfall(p)),
            key,
        })
    });
    Ok(pieces.collect())
}

/// 0 on ground that no trail has cut, 1 where one has cut it steeply.
fn steepness(ground: &ChunkGround, p: DVec2) -> f64 {
    let (edge_m, away) = ground.trail_edge(p);
    if !(0.0..REACH_M).contains(&edge_m) || ground.trail_zone(p, false) != TrailZone::CutSlope {
        return 0.0;
    }
    // What is filled falls away from the trail.
    let rise = ground.sample(p).gradient.dot(away.normalize_or_zero());
    ((rise - SLOPES[0]) / (SLOPES[1] - SLOPES[0])).clamp(0.0, 1.0)
}
