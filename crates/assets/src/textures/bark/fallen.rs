//! The sides of logs: bark that comes off, bare wood, and moss on the upper side.
//!
//! u runs once around a log from its underside, so that 0.5 is the upper side.

use std::f32::consts::TAU;

use glam::IVec2;
use nemoral_scene::DecayStage;

use super::super::noise::{fbm, gradient, ridged, smoothstep, value, worley};
use super::super::tile::{Texels, Tile};
use super::{HEIGHT, WIDTH};
use crate::lanes::{F32x16, Vec2x16, Vec3x16, rgb};

/// Moss in cushions, as at the feet of stems.
const MOSS: Vec3x16 = rgb(0.052, 0.068, 0.024);

/// How far up a place on the side is: -1 below, 1 above.
fn upwards(p: Vec2x16) -> F32x16 {
    -(TAU * p.x).map(libm::cosf)
}

/// The colour under moss that covers about `cover` of the upper half.
fn mossy(p: Vec2x16, albedo: Vec3x16, cover: f32, seed: u32) -> Vec3x16 {
    let field = 0.34 * upwards(p)
        + 0.62 * fbm(p, IVec2::new(5, 10), 4, 0.55, seed)
        + 0.10 * gradient(p, IVec2::new(50, 100), seed ^ 1);
    let there = smoothstep(0.52 - 0.72 * cover, 0.66 - 0.72 * cover, field);
    let cushion = 0.65 + 0.7 * value(p, IVec2::new(90, 180), seed ^ 2);
    albedo.lerp(MOSS * cushion, 0.92 * there)
}

/// Bare wood, silver where it is dry: its colour and its height.
fn wood(p: Vec2x16, grey: Vec3x16, seed: u32) -> (Vec3x16, F32x16) {
    let fibre = fbm(p, IVec2::new(56, 4), 3, 0.6, seed);
    let crack = ridged(p, IVec2::new(14, 2), 2, 0.5, seed ^ 1);
    let crack = smoothstep(0.84, 0.97, crack);
    let stain = fbm(p, IVec2::new(4, 6), 3, 0.5, seed ^ 2);
    let colour = grey * (1.0 + 0.28 * fibre + 0.22 * stain) * (1.0 - 0.55 * crack);
    (colour, 0.2 * fibre - crack)
}

/// A bark that has come off in a third of its places, above all on the upper side.
pub(crate) fn loosening(bark: &Tile, seed: u32) -> Tile {
    bark.recolour(|p, t| {
        let field = fbm(p, IVec2::new(4, 5), 4, 0.55, seed) + 0.10 * upwards(p);
        let torn = 0.06 * gradient(p, IVec2::new(40, 60), seed ^ 3);
        let off = smoothstep(0.10, 0.14, field + torn);
        // The shadow of the bark's edge on the wood.
        let edge = smoothstep(0.02, 0.10, field + torn) - off;
        let (wood, _) = wood(p, rgb(0.185, 0.150, 0.112), seed ^ 4);
        let colour = t.albedo.lerp(wood, off) * (1.0 - 0.45 * edge);
        mossy(p, colour, 0.16, seed ^ 5)
    })
}

/// The side of a log without bark, at one of the last three stages of decay.
pub(crate) fn decayed(stage: DecayStage, seed: u32) -> Tile {
    let (grey, moss, blocks) = match stage {
        DecayStage::Fresh | DecayStage::Loosening | DecayStage::Bare => {
            (rgb(0.150, 0.130, 0.106), 0.45, 0.0)
        }
        DecayStage::Soft => (rgb(0.112, 0.072, 0.044), 0.70, 1.0),
        DecayStage::Rotten => (rgb(0.080, 0.052, 0.034), 0.92, 0.7),
    };
    let mut tile = Tile::bake(WIDTH / 2, HEIGHT / 2, |p| {
        let (wood, relief) = wood(p, grey, seed);
        // Brown rot breaks wood into cubes.
        let cubes = worley(p, IVec2::new(16, 30), 0.8, seed ^ 6);
        let joint = blocks * (1.0 - smoothstep(0.02, 0.12, cubes.border()));
        let wood = wood * (1.0 - 0.6 * joint);
        // Flakes of bark stay where they are sheltered.
        let flakes = fbm(p, IVec2::new(5, 5), 4, 0.55, seed ^ 7) - 0.22 * upwards(p);
        let bark = (1.0 - blocks) * smoothstep(0.26, 0.32, flakes);
        let rough = 1.0 + 0.5 * fbm(p, IVec2::new(40, 40), 2, 0.5, seed ^ 8);
        let colour = wood.lerp(rgb(0.078, 0.060, 0.046) * rough, bark);
        Texels {
            albedo: mossy(p, colour, moss, seed ^ 9),
            height: relief + 0.5 * bark - joint,
        }
    });
    tile.darken_hollows(4, 0.8, 0.7);
    tile
}
