//! How much sky is seen through the crowns: light for cameras and for undergrowth.

use std::sync::Arc;

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{ChunkCoord, ObjectKind, Surface};
use nemoral_seed::Key;

use super::assets::WorldAssets;
use super::ground::ChunkGround;
use super::things::Things;
use crate::Error;
use crate::plan::{AnyChunk, Demand, Hasher, Node, OfWorld, Stage};

/// Heights above ground of a grid's layers, metres. Above the last the sky is taken as open.
const HEIGHTS_M: [f64; 5] = [0.3, 4.0, 9.0, 15.0, 24.0];

/// Share of a crown's leaf area that meets a ray, G, times the clumping of shoots, Ω: spherical
/// leaf angles and a mix of conifers and broadleaves (vegetation.md 2.3).
const G_OMEGA: f64 = 0.5 * 0.75;

/// Crowns farther than this do not matter.
const REACH_M: f64 = 45.0;

/// The share of the sky hemisphere, weighted by the cosine, that is seen past the crowns: a grid
/// over a chunk, at several heights above its ground.
#[derive(Clone, Debug)]
pub struct Openness {
    origin_m: DVec2,
    cell_m: f64,
    /// Nodes along a side.
    side: usize,
    /// Ground height at each column of nodes.
    ground_m: Vec<f64>,
    /// `HEIGHTS_M.len()` values for each column.
    values: Vec<f32>,
}

impl Openness {
    /// The openness at a world point, trilinear; 0 is closed, 1 is open.
    #[must_use]
    pub fn at(&self, world_m: DVec3) -> f32 {
        let p = (world_m.truncate() - self.origin_m) / self.cell_m;
        let top = (self.side - 1) as f64;
        let (x, y) = (p.x.clamp(0.0, top), p.y.clamp(0.0, top));
        let (column, row) = (
            (x as usize).min(self.side - 2),
            (y as usize).min(self.side - 2),
        );
        let (fx, fy) = (x - column as f64, y - row as f64);
        let corners = [
            (0, 0, (1.0 - fx) * (1.0 - fy)),
            (1, 0, fx * (1.0 - fy)),
            (0, 1, (1.0 - fx) * fy),
            (1, 1, fx * fy),
        ];
        let node = |dx, dy| (row + dy) * self.side + column + dx;
        let ground: f64 = corners
            .iter()
            .map(|&(dx, dy, w)| w * self.ground_m[node(dx, dy)])
            .sum();
        let height = world_m.z - ground;
        let layers = HEIGHTS_M.len();
        if height >= HEIGHTS_M[layers - 1] {
            // Fades to open sky over the last ten metres.
            let fade = ((height - HEIGHTS_M[layers - 1]) / 10.0).min(1.0) as f32;
            let last = self.blend(&corners, node, layers - 1);
            return last + (1.0 - last) * fade;
        }
        let upper = HEIGHTS_M
            .iter()
            .position(|&h| height < h)
            .unwrap_or(layers - 1)
            .max(1);
        let (low, high) = (HEIGHTS_M[upper - 1], HEIGHTS_M[upper]);
        let t = ((height - low) / (high - low)).clamp(0.0, 1.0) as f32;
        let (below, above) = (
            self.blend(&corners, node, upper - 1),
            self.blend(&corners, node, upper),
        );
        below + (above - below) * t
    }

    fn blend(
        &self,
        corners: &[(usize, usize, f64); 4],
        node: impl Fn(usize, usize) -> usize,
        layer: usize,
    ) -> f32 {
        let value = |dx, dy| self.values[node(dx, dy) * HEIGHTS_M.len() + layer];
        corners
            .iter()
            .map(|&(dx, dy, w)| w as f32 * value(dx, dy))
            .sum()
    }
}

/// A crown: an upright ellipsoid filled with leaves.
#[derive(Clone, Copy, Debug)]
struct Crown {
    centre: DVec3,
    radius_m: f64,
    half_height_m: f64,
    /// G Ω times leaf area density, 1/m.
    extinction: f64,
}

impl Crown {
    /// Optical depth of the way through it from `from` along `direction`.
    fn optical_depth(&self, from: DVec3, direction: DVec3) -> f64 {
        // In units where it is a unit sphere.
        let axes = DVec3::new(self.radius_m, self.radius_m, self.half_height_m);
        let (o, d) = ((from - self.centre) / axes, direction / axes);
        let (a, b, c) = (d.dot(d), o.dot(d), o.dot(o) - 1.0);
        let discriminant = b * b - a * c;
        if discriminant <= 0.0 {
            return 0.0;
        }
        let root = discriminant.sqrt();
        let (enter, leave) = (((-b - root) / a).max(0.0), (-b + root) / a);
        (leave - enter).max(0.0) * self.extinction
    }
}

/// Directions towards the sky with their share of a horizontal surface's light.
fn directions() -> Vec<(DVec3, f64)> {
    // Rings of equal cosine-weighted solid angle: sin² of the zenith angle in thirds.
    let mut out = Vec::new();
    for (ring, count) in [(1.0_f64 / 6.0, 3), (0.5, 4), (5.0 / 6.0, 5)] {
        let (sin, cos) = (ring.sqrt(), (1.0 - ring).sqrt());
        for i in 0..count {
            let turn = std::f64::consts::TAU * (f64::from(i) + ring) / f64::from(count);
            let (s, c) = libm::sincos(turn);
            out.push((
                DVec3::new(sin * c, sin * s, cos),
                1.0 / 3.0 / f64::from(count),
            ));
        }
    }
    out
}

/// Makes the [`Openness`] of a chunk from the crowns of it and its neighbours.
#[derive(Clone, Copy, Debug)]
pub struct OpennessStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
}

impl Stage for OpennessStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<WorldAssets>,
        Node<ChunkCoord, ChunkGround>,
        AnyChunk<Things>,
    );
    type Output = Openness;
    const ID: &'static str = "chunk.openness";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        hasher.write_f64(self.chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (assets, ground, things): (Arc<WorldAssets>, Arc<ChunkGround>, Demand<'_, Things>),
    ) -> Result<Openness, Error> {
        let origin_m = at.origin_m(self.chunk_size_m);
        let centre = at.centre_m(self.chunk_size_m);
        let mut crowns = Vec::new();
        // Whole chunks until the reach is covered, so that neighbours see the same crowns.
        let rings = (REACH_M / self.chunk_size_m).ceil() as i32;
        for (dx, dy) in (-rings..=rings).flat_map(|x| (-rings..=rings).map(move |y| (x, y))) {
            for thing in &things.at(at.offset(dx, dy))?.0 {
                let far = thing.position_m.truncate().distance(centre) - self.chunk_size_m * 0.71;
                if thing.kind == ObjectKind::Tree && far < REACH_M {
                    crowns.push(crown(thing, &assets));
                }
            }
        }
        let cells = (self.chunk_size_m / 5.0).ceil() as usize;
        let (side, cell_m) = (cells + 1, self.chunk_size_m / cells as f64);
        let directions = directions();
        let mut ground_m = Vec::with_capacity(side * side);
        let mut values = Vec::with_capacity(side * side * HEIGHTS_M.len());
        for i in 0..side * side {
            let p = origin_m + DVec2::new((i % side) as f64, (i / side) as f64) * cell_m;
            let z = ground.height_m(p);
            let near: Vec<Crown> = crowns
                .iter()
                .filter(|c| c.centre.truncate().distance(p) < REACH_M)
                .copied()
                .collect();
            ground_m.push(z);
            for height in HEIGHTS_M {
                let from = p.extend(z + height);
                let seen: f64 = directions
                    .iter()
                    .map(|&(d, weight)| {
                        let depth: f64 = near.iter().map(|c| c.optical_depth(from, d)).sum();
                        weight * libm::exp(-depth)
                    })
                    .sum();
                values.push(seen as f32);
            }
        }
        Ok(Openness {
            origin_m,
            cell_m,
            side,
            ground_m,
            values,
        })
    }
}

fn crown(thing: &super::things::Thing, assets: &WorldAssets) -> Crown {
    let (size, s) = (&assets.standing[thing.asset].tree.size, thing.scale);
    let half_height_m = ((size.height_m - size.crown_base_m) * s / 2.0).max(0.1);
    let radius_m = (size.crown_radius_m * s).max(0.1);
    let volume = 4.0 / 3.0 * std::f64::consts::PI * radius_m * radius_m * half_height_m;
    let top = thing.position_m.z + size.height_m * s;
    Crown {
        centre: thing.position_m.truncate().extend(top - half_height_m),
        radius_m,
        half_height_m,
        extinction: G_OMEGA * size.leaf_area_m2 * s * s / volume,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_through_a_crown_is_its_chord() {
        let crown = Crown {
            centre: DVec3::new(0.0, 0.0, 10.0),
            radius_m: 2.0,
            half_height_m: 3.0,
            extinction: 0.5,
        };
        let up = |x| crown.optical_depth(DVec3::new(x, 0.0, 0.0), DVec3::Z);
        assert!((up(0.0) - 3.0).abs() < 1e-12);
        assert!((up(1.0) - 0.5 * 6.0 * 0.75_f64.sqrt()).abs() < 1e-12);
        assert_eq!(up(2.1), 0.0);
        // From its middle, half of it.
        assert!((crown.optical_depth(crown.centre, DVec3::Z) - 1.5).abs() < 1e-12);
        assert_eq!(
            crown.optical_depth(DVec3::new(0.0, 0.0, 20.0), DVec3::Z),
            0.0
        );
    }

    #[test]
    fn directions_share_the_hemisphere() {
        let all = directions();
        assert!((all.iter().map(|d| d.1).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(
            all.iter()
                .all(|(d, _)| (d.length() - 1.0).abs() < 1e-12 && d.z > 0.0)
        );
    }
}
