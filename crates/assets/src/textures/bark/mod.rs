//! Bark, on tiles of 1 m × 2 m.

mod conifer;
mod fallen;
mod rough;
mod smooth;

use glam::IVec2;

pub(crate) use fallen::{decayed, loosening};
pub(crate) use rough::{dead, twig};

use super::noise::{fbm, gradient, smoothstep, value};
use super::tile::Tile;
use crate::lanes::{Vec2x16, Vec3x16, rgb};
use crate::tree::{BarkKind, BarkLayer, linear};

const WIDTH: usize = 512;
const HEIGHT: usize = 1024;

/// A bark whose mean colour is that of `layer`.
pub(crate) fn bake(layer: &BarkLayer, seed: u32) -> Tile {
    let recipe: fn(u32) -> Tile = match layer.kind {
        BarkKind::Plates => rough::plates,
        BarkKind::Patches => rough::patches,
        BarkKind::Ridges => rough::ridges,
        BarkKind::Flakes => conifer::flakes,
        BarkKind::Scales => conifer::scales,
        BarkKind::Furrows => conifer::furrows,
        BarkKind::Fibrous => conifer::fibrous,
        BarkKind::Smooth => smooth::beech,
        BarkKind::Birch => smooth::birch,
        BarkKind::Fissured => smooth::birch_foot,
        BarkKind::Cork => smooth::cork,
        BarkKind::StrippedCork => smooth::stripped_cork,
    };
    recipe(seed).with_mean(linear(layer.albedo))
}

/// Turns from one bark at v = 0 into the other at v = 1, along a torn border whose width is `soft`
/// (0..0.3).
pub(crate) fn between(lower: &Tile, upper: &Tile, soft: f32, seed: u32) -> Tile {
    lower.blend(upper, |p| {
        // Tongues of either reach far into the other, but not beyond the ends.
        let room = 4.0 * p.y * (1.0 - p.y);
        let tongues = 0.34 * fbm(p, IVec2::new(5, 3), 4, 0.55, seed);
        let torn = 0.12 * fbm(p, IVec2::new(40, 30), 2, 0.6, seed ^ 0x11);
        smoothstep(0.5 - soft, 0.5 + soft, p.y + room * (tongues + torn))
    })
}

/// Lichen: blotches with crisp edges, pale grey-green.
fn with_lichen(p: Vec2x16, albedo: Vec3x16, cover: f32, seed: u32) -> Vec3x16 {
    let field =
        fbm(p, IVec2::new(9, 18), 4, 0.6, seed) + 0.25 * gradient(p, IVec2::new(70, 140), seed ^ 5);
    let there = smoothstep(0.62 - cover, 0.70 - cover, field);
    let tone = 0.75 + 0.5 * value(p, IVec2::new(90, 180), seed ^ 9);
    albedo.lerp(rgb(0.20, 0.22, 0.15) * tone, 0.7 * there)
}

/// The same bark with moss and a film of green algae (`mossy` times as much as on an oak) and
/// splashed soil around v = 0, the foot of a stem. From v = 0.2 (0.4 m up) to 0.8 it is equal to
/// `bark`, so that there is no visible border between the two.
pub(crate) fn with_foot(bark: &Tile, mossy: f32, seed: u32) -> Tile {
    bark.recolour(|p, t| {
        let from_foot = p.y.min(1.0 - p.y);
        let is_foot = from_foot.lt(0.2);
        if !is_foot.any() {
            return t.albedo;
        }
        let fade = 1.0 - from_foot / 0.2;
        let noise = fbm(p, IVec2::new(7, 14), 4, 0.55, seed);
        let moss =
            smoothstep(0.30, 0.62, 0.85 * fade + 0.75 * noise - 0.10) * smoothstep(0.0, 0.35, fade);
        let soil = smoothstep(
            0.55,
            1.0,
            fade + 0.35 * gradient(p, IVec2::new(30, 60), seed ^ 1),
        );
        let cushion = 0.7 + 0.6 * value(p, IVec2::new(110, 220), seed ^ 2);
        // Algae run down with the water, and do not hide the bark.
        let runs = fbm(p, IVec2::new(22, 4), 3, 0.55, seed ^ 3);
        let film = fade.sqrt() * smoothstep(-0.25, 0.45, runs);
        let green = t.albedo * rgb(0.66, 0.92, 0.34);
        let filmed = t.albedo.lerp(green, (0.8 * mossy * film).min(0.8));
        let soiled = filmed.lerp(rgb(0.060, 0.045, 0.032), 0.55 * soil);
        let cushions = rgb(0.050, 0.064, 0.023) * cushion;
        is_foot.select_colour(soiled.lerp(cushions, 0.85 * mossy * moss), t.albedo)
    })
}
