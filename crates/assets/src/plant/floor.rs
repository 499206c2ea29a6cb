//! What lies on the ground in three dimensions: twigs, fruits, leaves.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use nemoral_scene::MaterialId;
use nemoral_seed::{Draw, Rng};

use super::shape::{Shape, around};
use super::undergrowth::scatter;
use crate::materials::WorldMaterials;
use crate::tree::FruitLook;

/// Radius of a litter patch, metres.
const PATCH_M: f32 = 0.8;

/// A patch of fallen twigs (3-14 mm thick), of cones, nuts and capsules, of each species by its
/// share of the stand, and of curled leaves.
pub(crate) fn litter(
    fruits: &[(FruitLook, f64)],
    materials: &WorldMaterials,
    rng: &mut impl Rng,
) -> Shape {
    let mut shape = Shape::default();
    for at in scatter(7 + rng.below(9), PATCH_M - 0.25, 0.08, rng) {
        twig(&mut shape, at, materials.fallen_twig, rng);
    }
    for (look, share) in fruits {
        let mean = share * look.per_m2 * f64::from(0.5 * TAU * PATCH_M * PATCH_M);
        let count = mean as u32 + u32::from(rng.chance(mean.fract()));
        for at in scatter(count, PATCH_M - 0.1, 0.12, rng) {
            fruit(&mut shape, at, look, materials.cone, rng);
        }
    }
    for at in scatter(30 + rng.below(40), PATCH_M - 0.12, 0.03, rng) {
        leaf(&mut shape, at, materials, rng);
    }
    shape
}

/// A crooked twig with a fork or two, resting on the ground.
pub(super) fn twig(shape: &mut Shape, at: Vec2, material: MaterialId, rng: &mut impl Rng) {
    let length = 0.12 + 0.40 * rng.unit_f32() * rng.unit_f32();
    let radius = rng.range_f32(0.0016, 0.0055) * (0.6 + 1.2 * length);
    let mut heading = rng.range_f32(0.0, TAU);
    let line = crooked(at.extend(radius), &mut heading, length, 5, rng);
    let radii: Vec<f32> = (0..5).map(|i| radius * (1.0 - 0.16 * i as f32)).collect();
    shape.tube(&line, &radii, 5, material);
    for _ in 0..rng.below(3) {
        let from = 1 + rng.below(3) as usize;
        let mut turn = heading + if rng.chance(0.5) { 0.7 } else { -0.7 };
        let side = crooked(line[from], &mut turn, 0.45 * length, 3, rng);
        let r = radii[from] * 0.7;
        shape.tube(&side, &[r, 0.75 * r, 0.5 * r], 4, material);
    }
}

fn crooked(
    start: Vec3,
    heading: &mut f32,
    length: f32,
    count: usize,
    rng: &mut impl Rng,
) -> Vec<Vec3> {
    let step = length / (count - 1) as f32;
    let mut at = start;
    (0..count)
        .map(|_| {
            let here = at;
            *heading += rng.range_f32(-0.35, 0.35);
            at += step * around(*heading);
            // Bows lift off the ground, but not below it.
            at.z = (at.z + step * rng.range_f32(-0.10, 0.13)).clamp(start.z.min(0.004), 0.06);
            here
        })
        .collect()
}

/// A cone, nut or capsule.
pub(super) fn fruit(
    shape: &mut Shape,
    at: Vec2,
    of: &FruitLook,
    material: MaterialId,
    rng: &mut impl Draw,
) {
    let [least, most] = of.length_m.map(|l| l as f32);
    let [slim, thick] = of.width_ratio.map(|r| r as f32);
    let length = least + (most - least) * rng.unit_f32();
    let ratio = slim + (thick - slim) * rng.unit_f32();
    let scales = of.scales as f32;
    // Small ones need few faces.
    let (rings, sides) = if length < 0.045 { (6, 6) } else { (9, 10) };
    let egg = Egg {
        length,
        thick: 0.5 * ratio * length / (1.0 + 0.5 * scales),
        heading: rng.range_f32(0.0, TAU),
        rise: rng.range_f32(-0.08, 0.15),
        open: scales * rng.range_f32(0.6, 1.0),
        rings,
        sides,
    };
    egg.lay(shape, at, material);
}

/// An egg of whorled scales on its side: a cone, or, without scales, a nut.
struct Egg {
    length: f32,
    /// Its greatest radius.
    thick: f32,
    heading: f32,
    /// How much its axis rises.
    rise: f32,
    /// How far scales stand off, as a share of the radius.
    open: f32,
    rings: u32,
    sides: u32,
}

impl Egg {
    fn lay(&self, shape: &mut Shape, at: Vec2, material: MaterialId) {
        let Self {
            length,
            thick,
            open,
            rings,
            sides,
            ..
        } = *self;
        let axis = (around(self.heading) + Vec3::Z * self.rise).normalize_or(Vec3::X);
        let side = axis.cross(Vec3::Z).normalize_or(Vec3::Y);
        let up = side.cross(axis);
        let centre = at.extend(0.75 * thick);
        // Broadest a third up; scales step in and out in turn.
        let point = |ring: u32, k: u32| {
            let t = ring as f32 / rings as f32;
            let egg = (6.75 * t * (1.0 - t) * (1.0 - t)).max(0.0).sqrt();
            let scale = if (ring + k).is_multiple_of(2) {
                1.0 + open
            } else {
                1.0 - open
            };
            let c = around(TAU * (k % sides) as f32 / sides as f32);
            centre + axis * length * (t - 0.4) + (side * c.x + up * c.y) * thick * egg * scale
        };
        for ring in 0..rings {
            for k in 0..sides {
                let corners = [(ring, k), (ring, k + 1), (ring + 1, k + 1), (ring + 1, k)];
                let p = corners.map(|(r, k)| point(r, k));
                let normal = (p[3] - p[1]).cross(p[2] - p[0]);
                let v = [0, 1, 2, 3].map(|i| {
                    let (r, k) = corners[i];
                    shape.push(p[i], normal, Vec2::new(0.02 * k as f32, 0.02 * r as f32))
                });
                shape.triangle([v[0], v[2], v[1]], material);
                shape.triangle([v[0], v[3], v[2]], material);
            }
        }
    }
}

/// A leaf lying nearly flat, one end lifted.
fn leaf(shape: &mut Shape, at: Vec2, materials: &WorldMaterials, rng: &mut impl Rng) {
    let heading = rng.range_f32(0.0, TAU);
    let lift = rng.range_f32(-0.05, 0.45);
    let along = around(heading) + Vec3::Z * lift;
    let roll = rng.range_f32(-0.5, 0.5);
    let across = around(heading + 0.25 * TAU) + Vec3::Z * roll;
    let kind = rng.choose(&materials.fallen_leaf);
    // High enough that the lower edge of the rolled leaf is above the ground.
    let height = 0.004 + 0.5 * roll.abs() * kind.width_m + 0.05 * kind.height_m;
    shape.card(
        kind,
        at.extend(height),
        along,
        across,
        rng.range_f32(0.75, 1.1),
    );
}
