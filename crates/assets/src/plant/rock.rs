//! Rocks and stones: cut, worn and half buried.

use std::f32::consts::TAU;

use glam::{IVec3, Vec2, Vec3};
use nemoral_scene::MaterialId;
use nemoral_seed::{Draw, Key};

use super::shape::{Shape, leaning};
use crate::textures::noise::at::{scramble, unit};

/// The least width of what is labelled as a stone, metres.
const SMALLEST_STONE_M: f32 = 0.05;

/// What rock to make.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RockPlan {
    /// Mean half-width of the ball that planes cut, metres.
    pub(crate) radius_m: f32,
    /// How many times the icosahedron's faces are divided into four.
    pub(crate) subdivisions: u32,
    /// Share of its height that is under z = 0.
    pub(crate) sunk: f32,
    /// Depth of worn relief, as a share of the radius.
    pub(crate) roughness: f32,
    pub(crate) material: MaterialId,
    /// Metres that one repetition of the texture covers.
    pub(crate) tile_m: f32,
}

/// Of what stones are made: those over 5 cm are labelled as stones, smaller ones are a part of the
/// soil.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct StoneMaterials {
    pub(crate) stone: MaterialId,
    pub(crate) pebble: MaterialId,
}

/// A half-width of a cobble for [`RockPlan`], metres. Once cut, most are 6 to 16 cm wide, the small
/// ones more frequent (cobbles of Wentworth's scale, 1922, have 6.4 to 25.6 cm).
pub(crate) fn cobble_m(rng: &mut impl Draw) -> f32 {
    0.042 * libm::exp2f(1.4 * rng.unit_f32())
}

/// A stone, labelled by its width.
pub(crate) fn stone(plan: &RockPlan, materials: StoneMaterials, key: Key) -> Shape {
    let mut shape = rock(plan, key);
    let material = if width_m(&shape) < SMALLEST_STONE_M {
        materials.pebble
    } else {
        materials.stone
    };
    for triangle in &mut shape.mesh.triangles {
        triangle.material = material;
    }
    shape
}

/// The mean of a shape's extents along x and y, metres.
fn width_m(shape: &Shape) -> f32 {
    let points = || shape.mesh.positions.iter().map(|p| p.truncate());
    let low = points().fold(Vec2::MAX, Vec2::min);
    let high = points().fold(Vec2::MIN, Vec2::max);
    0.5 * (high - low).element_sum()
}

/// A rock: a stretched ball, cut by 6-12 planes, worn by noise.
pub(crate) fn rock(plan: &RockPlan, key: Key) -> Shape {
    let mut rng = key.rng();
    let seed = key.to_u64() as u32;
    let stretch = Vec3::new(
        rng.range_f32(0.9, 1.25),
        rng.range_f32(0.7, 1.0),
        rng.range_f32(0.55, 0.9),
    );
    let planes: Vec<(Vec3, f32)> = (0..6 + rng.below(7))
        .map(|_| {
            let tilt = libm::acos(rng.range_f64(-0.75, 1.0)) as f32;
            (
                leaning(rng.range_f32(0.0, TAU), tilt),
                rng.range_f32(0.55, 0.86),
            )
        })
        .collect();
    let (mut points, faces) = icosphere(plan.subdivisions);
    for p in &mut points {
        let mut q = *p;
        for &(n, d) in &planes {
            let over = q.dot(n) - d;
            if over > 0.0 {
                // Not quite flat: the edge is worn round.
                q -= n * over * 0.94;
            }
        }
        let relief = noise(q * 2.2, seed)
            + 0.5 * noise(q * 4.9, seed ^ 1)
            + 0.28 * noise(q * 11.0, seed ^ 2);
        q *= 1.0 + plan.roughness * relief;
        *p = q * stretch * plan.radius_m;
    }
    let low = points.iter().fold(f32::MAX, |a, p| a.min(p.z));
    let high = points.iter().fold(f32::MIN, |a, p| a.max(p.z));
    let shift = Vec3::Z * (-low - plan.sunk * (high - low));
    for p in &mut points {
        *p += shift;
    }
    // Each rock shows another piece of the texture.
    let shift = Vec2::new(rng.unit_f32(), rng.unit_f32());
    creased(&points, &faces, shift, plan)
}

/// Triangles with normals that are smooth over worn parts and broken at edges sharper than 32°, and
/// uv laid on from the side that a face looks to.
fn creased(points: &[Vec3], faces: &[[u32; 3]], shift: Vec2, plan: &RockPlan) -> Shape {
    let normal = |f: &[u32; 3]| {
        let [a, b, c] = f.map(|i| points[i as usize]);
        (b - a).cross(c - a)
    };
    let mut around: Vec<Vec<usize>> = vec![Vec::new(); points.len()];
    for (i, f) in faces.iter().enumerate() {
        for &corner in f {
            around[corner as usize].push(i);
        }
    }
    let areas: Vec<Vec3> = faces.iter().map(normal).collect();
    let mut shape = Shape::default();
    for (i, f) in faces.iter().enumerate() {
        let own = areas[i].normalize_or(Vec3::Z);
        let corners = f.map(|corner| {
            let p = points[corner as usize];
            let smooth: Vec3 = around[corner as usize]
                .iter()
                .map(|&j| areas[j])
                .filter(|a| a.normalize_or(Vec3::Z).dot(own) > 0.85)
                .sum();
            let side = own.abs();
            let uv = if side.z >= side.x && side.z >= side.y {
                Vec2::new(p.x, p.y)
            } else if side.x >= side.y {
                Vec2::new(p.y, p.z)
            } else {
                Vec2::new(p.x, p.z)
            };
            // Half the face's own normal keeps facets readable.
            shape.push(
                p,
                smooth.normalize_or(own) + 0.5 * own,
                uv / plan.tile_m + shift,
            )
        });
        shape.triangle(corners, plan.material);
    }
    shape
}

/// A unit icosahedron whose faces are divided into four `n` times and projected onto the sphere.
fn icosphere(n: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    // The golden ratio.
    const G: f32 = 1.618_034;
    let mut points: Vec<Vec3> = [
        (-1.0, G, 0.0),
        (1.0, G, 0.0),
        (-1.0, -G, 0.0),
        (1.0, -G, 0.0),
        (0.0, -1.0, G),
        (0.0, 1.0, G),
        (0.0, -1.0, -G),
        (0.0, 1.0, -G),
        (G, 0.0, -1.0),
        (G, 0.0, 1.0),
        (-G, 0.0, -1.0),
        (-G, 0.0, 1.0),
    ]
    .iter()
    .map(|&(x, y, z)| Vec3::new(x, y, z).normalize_or(Vec3::Z))
    .collect();
    let mut faces: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..n {
        let mut middles = std::collections::BTreeMap::new();
        let mut middle = |a: u32, b: u32, points: &mut Vec<Vec3>| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let m = points[a as usize] + points[b as usize];
                points.push(m.normalize_or(Vec3::Z));
                points.len() as u32 - 1
            })
        };
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let ab = middle(a, b, &mut points);
                let bc = middle(b, c, &mut points);
                let ca = middle(c, a, &mut points);
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    (points, faces)
}

/// Value noise in space, -1..1.
fn noise(p: Vec3, seed: u32) -> f32 {
    let base = p.floor();
    let r = p - base;
    let f = r * r * (Vec3::splat(3.0) - 2.0 * r);
    let cell = base.as_ivec3();
    let at = |dx: i32, dy: i32, dz: i32| {
        let c = cell + IVec3::new(dx, dy, dz);
        let h = (c.x as u32).wrapping_mul(0x9E37_79B1)
            ^ scramble((c.y as u32).wrapping_mul(0x85EB_CA77).wrapping_add(seed))
                .wrapping_add((c.z as u32).wrapping_mul(0xC2B2_AE3D));
        2.0 * unit(scramble(h)) - 1.0
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let plane = |dz: i32| {
        mix(
            mix(at(0, 0, dz), at(1, 0, dz), f.x),
            mix(at(0, 1, dz), at(1, 1, dz), f.x),
            f.y,
        )
    };
    mix(plane(0), plane(1), f.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_seed::Key;

    #[test]
    fn an_icosphere_is_a_closed_sphere() {
        let (points, faces) = icosphere(3);
        assert_eq!((points.len(), faces.len()), (642, 1280));
        let volume: f32 = faces
            .iter()
            .map(|f| {
                let [a, b, c] = f.map(|i| points[i as usize]);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        assert!((volume / (2.0 / 3.0 * TAU) - 1.0).abs() < 0.02, "{volume}");
    }

    #[test]
    fn a_rock_is_sunk_as_asked() {
        for i in 0..8 {
            let plan = RockPlan {
                radius_m: 0.5,
                subdivisions: 3,
                sunk: 0.4,
                roughness: 0.06,
                material: MaterialId(0),
                tile_m: 1.0,
            };
            let b = rock(&plan, Key::world(i)).bounds();
            let sunk = -b.min.z / (b.max.z - b.min.z);
            assert!((sunk - 0.4).abs() < 1e-3, "{sunk}");
            assert!(b.max.x < 0.75 && b.max.x > 0.25);
        }
    }
}
