//! Stumps: a sawn disc on a flaring, rooted foot.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use nemoral_seed::{Draw, Key};

use super::shape::{Shape, around};
use crate::materials::StumpMaterials;

/// Corners around a stump.
const SIDES: u32 = 28;
/// Rings of the cut face.
const RINGS: u32 = 5;
/// How far a stump reaches into the ground: as far as on a slope of 45 degrees none of its foot
/// hangs in the air. Metres, and for each metre of its radius, of which two lobes that run into
/// each other are nearly three.
const ROOT_M: f32 = 0.15;
const ROOT_PER_RADIUS: f32 = 2.8;

/// A stump of a felled tree: `radius_m` at its cut, `height_m` above the ground.
pub(crate) fn stump(
    radius_m: f32,
    height_m: f32,
    old: bool,
    materials: &StumpMaterials,
    key: Key,
) -> Shape {
    let mut rng = key.rng();
    let lobes = 4 + rng.below(3);
    let turn = rng.range_f32(0.0, TAU);
    let roots: Vec<(f32, f32)> = (0..lobes)
        .map(|i| {
            let azimuth = turn + TAU * (i as f32 + rng.range_f32(-0.25, 0.25)) / lobes as f32;
            (azimuth, rng.range_f32(0.20, 0.55))
        })
        .collect();
    let out_of_round = rng.range_f32(0.0, 0.06);
    let long_axis = rng.range_f32(0.0, TAU);
    // The radius at an azimuth and a height: a flare of root lobes that dies out upwards.
    let radius = |azimuth: f32, z: f32| {
        let flare = libm::exp(-f64::from(z + 0.04) / 0.16) as f32;
        let lobe: f32 = roots
            .iter()
            .map(|&(at, size)| {
                let c = around(azimuth).dot(around(at)).max(0.0);
                size * (c * c * c) * (c * c * c)
            })
            .sum();
        let oval = 1.0 + out_of_round * around(2.0 * azimuth).dot(around(long_axis));
        radius_m * (oval + (0.12 + lobe) * flare.min(1.9))
    };
    // The saw went in a little askew.
    let askew = leaning_cut(rng.range_f32(0.0, TAU), rng.range_f32(0.0, 0.10));
    // Felling: a face cut on one side, deeper than the back cut, and a hinge of torn wood between.
    let fell = around(rng.range_f32(0.0, TAU));
    let step = rng.range_f32(0.0, 0.035);
    let top = |p: Vec2| {
        let q = p.extend(0.0);
        let face = (q.dot(fell) / radius_m - 0.55).clamp(0.0, 0.08) / 0.08;
        height_m + askew.dot(q) - step * face
    };
    // The edge of the cut, where the wall ends: all levels of the wall are below its lowest corner.
    let edge: Vec<Vec3> = (0..SIDES)
        .map(|k| k as f32 / SIDES as f32 * TAU)
        .map(|azimuth| rim(around(azimuth), radius(azimuth, height_m), &top))
        .collect();
    let lowest_m = edge.iter().fold(height_m, |low, p| low.min(p.z));
    let root_m = ROOT_M + ROOT_PER_RADIUS * radius_m;
    let levels = [-root_m, -0.10, 0.0, 0.05, 0.11, 0.20, 0.32, 0.45];
    let levels: Vec<f32> = levels
        .iter()
        .copied()
        .filter(|z| *z < lowest_m - 0.02)
        .collect();
    let mut shape = Shape::default();
    let wraps = (TAU * radius_m).round().max(1.0);
    let columns = SIDES + 1;
    let rows = levels.len() as u32 + 1;
    for row in 0..rows {
        for k in 0..columns {
            let u = (k % SIDES) as f32 / SIDES as f32;
            let out = around(u * TAU);
            let position = match levels.get(row as usize) {
                Some(&z) => out * radius(u * TAU, z) + Vec3::Z * z,
                None => edge[(k % SIDES) as usize],
            };
            let v = 0.5 * position.z;
            shape.push(
                position,
                out + 0.35 * Vec3::Z,
                Vec2::new(k as f32 / SIDES as f32 * wraps, v),
            );
        }
    }
    for row in 0..rows - 1 {
        for k in 0..SIDES {
            let a = row * columns + k;
            let (b, c, d) = (a + 1, a + columns, a + columns + 1);
            shape.triangle([a, b, d], materials.bark);
            shape.triangle([a, d, c], materials.bark);
        }
    }
    let face = materials.faces[usize::from(old)];
    let first = shape.mesh.positions.len() as u32;
    for ring in 0..=RINGS {
        let share = ring as f32 / RINGS as f32;
        for k in 0..columns {
            let u = (k % SIDES) as f32 / SIDES as f32;
            let out = around(u * TAU);
            let p = rim(out, share * radius(u * TAU, height_m), &top);
            // The image has wood up to 0.46 and bark to 0.5.
            let uv = Vec2::splat(0.5) + 0.495 * share * out.truncate();
            shape.push(p, Vec3::Z - askew, uv);
        }
    }
    for ring in 0..RINGS {
        for k in 0..SIDES {
            let a = first + ring * columns + k;
            let (b, c, d) = (a + 1, a + columns, a + columns + 1);
            if ring > 0 {
                shape.triangle([a, d, b], face);
            }
            shape.triangle([a, c, d], face);
        }
    }
    shape
}

fn rim(out: Vec3, r: f32, top: &impl Fn(Vec2) -> f32) -> Vec3 {
    let p = (out * r).truncate();
    p.extend(top(p))
}

/// The slope of a cut: rise per metre along an azimuth.
fn leaning_cut(azimuth: f32, slope: f32) -> Vec3 {
    around(azimuth) * slope
}
