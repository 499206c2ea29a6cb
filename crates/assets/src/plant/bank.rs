//! What sticks out of a slope that a trail has cut: stones, lumps of earth, ends of roots.
//!
//! A shape lies on the plane z = 0, whose +x is downhill.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::Vec3;
use nemoral_scene::MaterialId;
use nemoral_seed::{Draw, Key};

use super::rock::{RockPlan, StoneMaterials, rock, stone};
use super::shape::{Shape, around};
use crate::textures::ground::FLOOR_M;

/// How far from its middle things begin, metres.
const REACH_M: f32 = 0.2;

/// What things in a bank are made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BankMaterials {
    pub(crate) stones: StoneMaterials,
    pub(crate) soil: MaterialId,
    pub(crate) root: MaterialId,
}

/// Some stones and lumps, and ends of roots if the bank is under trees.
pub(crate) fn bank(is_rooty: bool, materials: &BankMaterials, key: Key) -> Shape {
    let mut shape = Shape::default();
    let mut rng = key.rng();
    let stony = rng.unit_f32();
    let lumps = 4 + rng.below(5);
    let stones = (7.0 * stony * stony * stony) as u32 + rng.below(3);
    let roots = if is_rooty { 2 + rng.below(4) } else { 0 };
    for i in 0..lumps + stones {
        let is_stone = i >= lumps;
        // Few are large.
        let share = rng.unit_f32();
        let radius_m = if is_stone {
            0.012 + 0.066 * share * share * share * share * share
        } else {
            0.022 + 0.06 * share * share
        };
        let plan = RockPlan {
            radius_m,
            subdivisions: 1 + u32::from(radius_m > 0.045),
            sunk: rng.range_f32(0.4, 0.65),
            roughness: if is_stone { 0.06 } else { 0.16 },
            material: materials.soil,
            tile_m: if is_stone { 0.5 } else { FLOOR_M },
        };
        let at = around(rng.range_f32(0.0, TAU)) * (REACH_M * rng.unit_f32().sqrt());
        let turn = around(rng.range_f32(0.0, TAU)).truncate();
        let key = key.item(u64::from(i));
        let piece = if is_stone {
            stone(&plan, materials.stones, key)
        } else {
            rock(&plan, key)
        };
        shape.add(&piece, turn, at);
    }
    for _ in 0..roots {
        root_end(&mut shape, materials.root, &mut rng);
    }
    shape
}

/// The end of a root: out of the bank, about its way down, and limp.
fn root_end(shape: &mut Shape, material: MaterialId, rng: &mut impl Draw) {
    const PIECES: usize = 6;
    let thick = {
        let share = rng.unit_f32();
        0.0025 + 0.013 * share * share * share
    };
    let length = rng.range_f32(0.12, 0.3) + 9.0 * thick;
    let heading = (rng.normal() as f32 * 0.9).clamp(-FRAC_PI_2, FRAC_PI_2);
    let bend = rng.range_f32(-1.1, 1.1);
    let start = around(rng.range_f32(0.0, TAU)) * (REACH_M * rng.unit_f32().sqrt());
    // It leaves the bank at this angle, and falls back to it or hangs just over it.
    let rise = rng.range_f32(0.35, 0.9);
    let hang = rng.range_f32(0.75, 1.1);
    let wave = [rng.range_f32(0.0, TAU), rng.range_f32(2.0, 5.0)];
    let at = |t: f32| {
        let way = around(heading + bend * t) * (length * t);
        let side =
            around(heading + FRAC_PI_2) * (0.05 * length * libm::sinf(wave[0] + wave[1] * t));
        let out = length * rise * t * (1.0 - hang * t);
        start + way + side + Vec3::Z * (out - 1.5 * thick * (1.0 - t))
    };
    let shares = (0..=PIECES).map(|i| i as f32 / PIECES as f32);
    let line: Vec<Vec3> = shares.clone().map(at).collect();
    let radii: Vec<f32> = shares.map(|t| thick * (1.0 - 0.7 * t)).collect();
    shape.tube(&line, &radii, 5, material);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_sticks_out_is_rooted_in_the_bank() {
        let materials = BankMaterials {
            stones: StoneMaterials {
                stone: MaterialId(0),
                pebble: MaterialId(3),
            },
            soil: MaterialId(1),
            root: MaterialId(2),
        };
        for i in 0..32 {
            let is_rooty = i % 2 == 0;
            let shape = bank(is_rooty, &materials, Key::world(i));
            let mesh = &shape.mesh;
            assert_eq!(mesh.normals.len(), mesh.positions.len());
            assert_eq!(mesh.uvs.len(), mesh.positions.len());
            assert!(shape.reach_m() < 0.9, "{}", shape.reach_m());
            for p in &mesh.positions {
                assert!((-0.12..0.25).contains(&p.z), "{p}");
            }
            // Every piece that hangs together begins below the plane.
            let has_roots = (mesh.triangles.iter()).any(|t| t.material == materials.root);
            assert_eq!(has_roots, is_rooty);
            assert!(mesh.triangles.len() < 4000, "{}", mesh.triangles.len());
        }
    }
}
