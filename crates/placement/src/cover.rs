//! Undergrowth: a jittered grid over the whole plane.

use std::f64::consts::TAU;

use glam::DVec2;
use nemoral_scene::ChunkCoord;
use nemoral_seed::{Domain, Draw, Key};

use crate::layers::site::SiteFilter;
use crate::variety::check_weights;
use nemoral_scene::ParamError;

const COVER: Domain = Domain::new("placement.cover");

/// The most cells along the edge of a chunk: four million in all.
const MOST_CELLS_ACROSS: f64 = 2000.0;

/// One kind of undergrowth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoverKind {
    /// Its share among the points, relative to the other varieties' weights; at least 0.
    pub weight: f64,
    /// The radius that must be free of trail at scale 1, metres; at least 0.
    pub radius_m: f64,
    /// The range of its scale, uniform; more than 0.
    pub scale: (f64, f64),
}

/// Everything that decides where undergrowth stands, except the seed.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundCoverParams {
    /// The edge of a chunk, metres; 1 to 10⁴.
    pub chunk_size_m: f64,
    /// The grid's spacing, metres; at least 0.01 and a 2000th of a chunk, at most a chunk. A chunk
    /// need not hold a whole number of cells.
    pub cell_m: f64,
    /// The greatest distance of a point from its cell's centre, in cells; 0 to 2. Direction and
    /// distance are uniform (paper, section IV-D).
    pub jitter: f64,
    /// The kinds; at least one.
    pub varieties: Vec<CoverKind>,
}

impl Default for GroundCoverParams {
    /// Patches about every 1.2 m.
    fn default() -> Self {
        Self {
            chunk_size_m: 50.0,
            cell_m: 1.2,
            jitter: 0.6,
            varieties: vec![CoverKind {
                weight: 1.0,
                radius_m: 0.3,
                scale: (0.7, 1.3),
            }],
        }
    }
}

/// A place for a patch of undergrowth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoverPoint {
    /// World position, metres.
    pub position_m: DVec2,
    /// Its turn about the vertical, in `[0, 2π)`.
    pub yaw_rad: f64,
    /// Its size relative to its prototype.
    pub scale: f64,
    /// The index of its variety.
    pub variety: u16,
    /// Its own key, for whatever else is drawn for it.
    pub key: Key,
}

/// Sweeps the plane on a grid and moves each point off its cell's centre (paper, section IV-D).
///
/// The grid belongs to the plane, not to the chunk: its cells are keyed by their global index and
/// run across borders. Points may stand beside trunks and rocks, or half under them.
#[derive(Clone, Debug)]
pub struct GroundCover {
    params: GroundCoverParams,
    weights: Vec<f64>,
    key: Key,
}

impl GroundCover {
    /// Checks the parameters.
    ///
    /// # Errors
    /// A [`ParamError`] for a value out of range.
    pub fn new(params: GroundCoverParams, key: Key) -> Result<Self, ParamError> {
        ParamError::check_within("chunk_size_m", params.chunk_size_m, 1.0, 1e4)?;
        ParamError::check_within("cell_m", params.cell_m, 0.01, params.chunk_size_m)?;
        ParamError::check(
            params.chunk_size_m / params.cell_m <= MOST_CELLS_ACROSS,
            "cell_m",
            params.cell_m,
            "at least a 2000th of chunk_size_m",
        )?;
        ParamError::check_within("jitter", params.jitter, 0.0, 2.0)?;
        let weights: Vec<f64> = params.varieties.iter().map(|v| v.weight).collect();
        check_weights("varieties", weights.iter().copied())?;
        for (i, v) in params.varieties.iter().enumerate() {
            ParamError::check_within(format!("varieties[{i}].radius_m"), v.radius_m, 0.0, 1e3)?;
            let (low, high) = v.scale;
            if !(low > 0.0 && low <= high && high <= 1e3) {
                return Err(ParamError::new(
                    format!("varieties[{i}].scale"),
                    format!("{:?}", v.scale),
                    "a range (low, high) with 0 < low <= high <= 1000",
                ));
            }
        }
        Ok(Self {
            weights,
            params,
            key: key.domain(COVER),
        })
    }

    /// The undergrowth of a chunk, in the order of cells, rows from the south.
    ///
    /// `density` is the share of points to keep at a world position (0 and less: none, 1 and more:
    /// all), such as canopy openness, wetness or a user's map. It is called for each point
    /// separately, so a point never depends on another.
    #[must_use]
    pub fn points(
        &self,
        coord: ChunkCoord,
        allowed: &dyn SiteFilter,
        density: &dyn Fn(DVec2) -> f64,
    ) -> Vec<CoverPoint> {
        let GroundCoverParams {
            chunk_size_m,
            cell_m,
            jitter,
            ..
        } = self.params;
        let low = coord.origin_m(chunk_size_m);
        let high = low + DVec2::splat(chunk_size_m);
        // Points are moved off the centres of their cells, so those of cells beyond the border may
        // lie in the chunk.
        let cells = |low: f64, high: f64| {
            let reach = (jitter + 1.0) * cell_m;
            let first = ((low - reach) / cell_m).floor() as i64;
            let last = ((high + reach) / cell_m).floor() as i64;
            first..=last
        };
        let mut points = Vec::new();
        for y in cells(low.y, high.y) {
            for x in cells(low.x, high.x) {
                let centre_m = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) * cell_m;
                let key = self.key.chunk([x as i32, y as i32]);
                let point = self.point(key, centre_m);
                // Every chunk computes the same bits for a point, so that exactly one claims it.
                let here = ChunkCoord::containing(point.position_m, chunk_size_m) == coord;
                if here && self.stays(&point, allowed, density) {
                    points.push(point);
                }
            }
        }
        points
    }

    fn point(&self, key: Key, centre_m: DVec2) -> CoverPoint {
        let mut rng = key.rng();
        let direction_rad = rng.range_f64(0.0, TAU);
        let distance_m = rng.range_f64(0.0, self.params.jitter * self.params.cell_m);
        let (sin, cos) = libm::sincos(direction_rad);
        let yaw_rad = rng.range_f64(0.0, TAU);
        let size = rng.unit_f64();
        let variety = rng.weighted(&self.weights).unwrap_or(0);
        let (small, large) = self.params.varieties[variety].scale;
        CoverPoint {
            position_m: centre_m + DVec2::new(cos, sin) * distance_m,
            yaw_rad,
            scale: small + (large - small) * size,
            variety: variety as u16,
            key,
        }
    }

    fn stays(
        &self,
        point: &CoverPoint,
        allowed: &dyn SiteFilter,
        density: &dyn Fn(DVec2) -> f64,
    ) -> bool {
        let radius_m = self.params.varieties[usize::from(point.variety)].radius_m * point.scale;
        point
            .key
            .domain(COVER)
            .rng()
            .chance(density(point.position_m))
            && allowed.allows(point.position_m, radius_m)
    }
}
