//! One axis as a tube of triangles with a closed end.

use std::f64::consts::{PI, TAU};

use nemoral_scene::glam::{DVec3, Vec2};
use nemoral_scene::{MaterialId, Mesh, Triangle};

use super::Tessellation;
use super::bark_map::{BarkMap, Zone};
use super::rings::{Ring, tangent};
use crate::tree::flare::Flare;
use crate::tree::materials::TreeMaterials;
use crate::tree::skeleton::{Axis, beside};

/// The greatest distance between a polygon's side and its circle, metres.
const CHORD_M: f64 = 0.004;

/// One axis on its way to the mesh.
pub(super) struct Tube<'a> {
    pub(super) axis: &'a Axis,
    /// Does it end in a point?
    pub(super) pointed: bool,
    pub(super) flare: Option<&'a Flare>,
    /// Is the whole tree dead?
    pub(super) snag: bool,
    /// Height at which the upper bark begins.
    pub(super) upper_from_m: f64,
    pub(super) materials: &'a TreeMaterials,
    pub(super) tessellation: Tessellation,
}

impl Tube<'_> {
    pub(super) fn mesh(&self, rings: &[Ring], mesh: &mut Mesh) {
        let bark = BarkMap::new(self, rings);
        let rings = &bark.with_borders(rings);
        let greatest = rings.iter().fold(0.0_f64, |m, r| m.max(r.radius));
        let n = sides(self.axis.order, greatest, self.tessellation.tolerance);
        let first = mesh.positions.len() as u32;
        let columns = n as u32 + 1;
        let grid = self.grid(rings, n);
        let along = self.vertices(rings, n, &grid, &bark, mesh);
        // A pointed twig has no last ring.
        let drawn = along.len();
        for (i, pair) in rings[..drawn].windows(2).enumerate() {
            let v = 0.5 * (along[i] + along[i + 1]);
            let material = self.material(pair[0], pair[1], bark.zone(v));
            for j in 0..n as u32 {
                let a = first + i as u32 * columns + j;
                let (b, d) = (a + 1, a + columns);
                mesh.triangles.push(Triangle {
                    corners: [a, b, d + 1],
                    material,
                });
                mesh.triangles.push(Triangle {
                    corners: [a, d + 1, d],
                    material,
                });
            }
        }
        let zone = bark.zone(along[drawn - 1]);
        let start = first + (drawn as u32 - 1) * columns;
        self.end(rings, n, start, zone, mesh);
    }

    /// Positions by ring and side, n + 1 for each ring, as the seam is stored twice. Frames are
    /// carried along without twist (rotation-minimising frames, Wang et al. 2008; here by
    /// projection, which suffices for short joints).
    fn grid(&self, rings: &[Ring], n: usize) -> Vec<DVec3> {
        let widen = equal_area(n);
        let mut grid = Vec::with_capacity(rings.len() * (n + 1));
        let mut side = beside(tangent(rings, 0));
        for (i, ring) in rings.iter().enumerate() {
            let along = tangent(rings, i);
            side = (side - along * side.dot(along))
                .try_normalize()
                .unwrap_or_else(|| beside(along));
            let other = along.cross(side);
            for j in 0..=n {
                let angle = TAU * (j % n) as f64 / n as f64;
                let (sin, cos) = libm::sincos(angle);
                let flare = self.flare.map_or(1.0, |f| f.factor(angle, ring.centre.z));
                grid.push(ring.centre + (side * cos + other * sin) * (ring.radius * widen * flare));
            }
        }
        grid
    }

    /// Pushes the vertices of the rings that are drawn; returns v of each.
    fn vertices(
        &self,
        rings: &[Ring],
        n: usize,
        grid: &[DVec3],
        bark: &BarkMap,
        mesh: &mut Mesh,
    ) -> Vec<f64> {
        let mut v = bark.v0;
        let mut vs = Vec::with_capacity(rings.len());
        let columns = n + 1;
        let drawn = rings.len() - usize::from(self.pointed);
        for (i, ring) in rings.iter().enumerate().take(drawn) {
            if i > 0 {
                v += ring.centre.distance(rings[i - 1].centre) * bark.per_m;
            }
            vs.push(v);
            for j in 0..columns {
                let at = |i: usize, j: usize| grid[i * columns + j % n];
                let across = at(i, j + 1) - at(i, j + n - 1);
                let along = at((i + 1).min(rings.len() - 1), j) - at(i.saturating_sub(1), j);
                let radial = (at(i, j) - ring.centre).normalize_or(DVec3::Z);
                let normal = across
                    .cross(along)
                    .try_normalize()
                    .filter(|m| m.dot(radial) > 0.05)
                    .unwrap_or(radial);
                mesh.positions.push(grid[i * columns + j].as_vec3());
                mesh.normals.push(normal.as_vec3());
                let u = bark.u0 + bark.wraps * j as f64 / n as f64 + bark.spiral * (v - bark.v0);
                mesh.uvs.push(Vec2::new(u as f32, v as f32));
            }
        }
        vs
    }

    /// Closes the far end: a living twig with a point, a broken branch with a flat cut.
    fn end(&self, rings: &[Ring], n: usize, first: u32, zone: Zone, mesh: &mut Mesh) {
        let last = rings[rings.len() - 1];
        let along = tangent(rings, rings.len() - 1);
        let material = self.material(last, last, zone);
        let uv = mesh.uvs[first as usize];
        let beyond = if self.axis.dead || self.pointed {
            0.0
        } else {
            last.radius
        };
        let tip = last.centre + along * beyond;
        if self.pointed {
            // A point has no normal of its own: every side has its own.
            for j in 0..n as u32 {
                let [a, b] = [first + j, first + j + 1].map(|k| mesh.normals[k as usize]);
                let apex = mesh.positions.len() as u32;
                mesh.positions.push(tip.as_vec3());
                mesh.normals.push((a + b).normalize_or(a));
                mesh.uvs.push(uv);
                mesh.triangles.push(Triangle {
                    corners: [first + j, first + j + 1, apex],
                    material,
                });
            }
            return;
        }
        let mut ring = first;
        if self.axis.dead {
            ring = mesh.positions.len() as u32;
            for j in 0..=n {
                mesh.positions.push(mesh.positions[first as usize + j]);
                mesh.normals.push(along.as_vec3());
                mesh.uvs.push(mesh.uvs[first as usize + j]);
            }
        }
        let apex = mesh.positions.len() as u32;
        mesh.positions.push(tip.as_vec3());
        mesh.normals.push(along.as_vec3());
        mesh.uvs.push(uv);
        for j in 0..n as u32 {
            mesh.triangles.push(Triangle {
                corners: [ring + j, ring + j + 1, apex],
                material,
            });
        }
    }

    /// The material of a piece, by its order and the radius of its thicker end.
    fn material(&self, a: Ring, b: Ring, zone: Zone) -> MaterialId {
        let m = self.materials;
        if a.radius.max(b.radius) <= self.tessellation.trunk_radius_m {
            if self.axis.dead { m.dead } else { m.branch }
        } else if self.snag {
            m.snag
        } else if let Some(flare) = self.flare {
            if 0.5 * (a.centre.z + b.centre.z) < flare.top_m() && zone != Zone::Upper {
                m.flare
            } else {
                match zone {
                    Zone::Lower => m.stem,
                    Zone::Change => m.change,
                    Zone::Upper => m.upper,
                }
            }
        } else {
            m.limb
        }
    }
}

/// Sides of the polygon round an axis of this greatest radius.
pub(super) fn sides(order: usize, radius: f64, tolerance: f64) -> usize {
    if order == 0 {
        return if radius < 0.06 { 12 } else { 20 };
    }
    let n = PI / libm::acos(1.0 - (CHORD_M * tolerance / radius).min(0.9));
    (n.ceil() as usize).clamp(3, 12)
}

/// A polygon of n sides has the circle's area if its corners are this much farther out.
fn equal_area(n: usize) -> f64 {
    let step = TAU / n as f64;
    (step / libm::sin(step)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::sweep::tests::{key, materials};

    #[test]
    fn a_ring_has_the_area_of_its_circle() {
        let ends = [DVec3::ZERO, DVec3::new(0.4, -0.3, 1.2)];
        let axis = Axis {
            order: 1,
            dead: false,
            points: ends.to_vec(),
            parent: None,
            leafy_from: 2.0,
            key: key(0),
        };
        let tube = Tube {
            axis: &axis,
            pointed: false,
            flare: None,
            snag: false,
            upper_from_m: f64::INFINITY,
            materials: &materials(),
            tessellation: Tessellation {
                trunk_radius_m: 0.04,
                tolerance: 1.0,
            },
        };
        let radii = [0.31, 0.02];
        let rings = [0, 1].map(|i| Ring {
            centre: ends[i],
            radius: radii[i],
        });
        for n in 3..=20 {
            let grid = tube.grid(&rings, n);
            for (corners, ring) in grid.chunks(n + 1).zip(rings) {
                // The last corner is the first one again.
                let twice: DVec3 = corners
                    .windows(2)
                    .map(|w| (w[0] - ring.centre).cross(w[1] - ring.centre))
                    .sum();
                let circle = PI * ring.radius * ring.radius;
                let share = 0.5 * twice.length() / circle;
                assert!((share - 1.0).abs() < 1e-5, "{n} sides: {share}");
            }
        }
    }
}
