//! Lying snow.

use glam::IVec2;

use super::noise::{fbm, smoothstep, unit, value, worley};
use super::tile::{Texels, Tile};
use crate::lanes::rgb;

/// Side of the tile, metres.
pub(crate) const SNOW_M: f32 = 3.0;

/// Forest snow of some days: soft undulations, grains, and flecks of litter. In a forest it is
/// darker than in the open, where its albedo is 0.99 in visible light.
pub(crate) fn snow(seed: u32) -> Tile {
    Tile::bake(512, 512, |p| {
        let broad = fbm(p, IVec2::splat(4), 4, 0.5, seed);
        let grains = value(p, IVec2::splat(256), seed ^ 0x10) - 0.5;
        let tone = 1.0 + 0.05 * broad + 0.05 * grains;
        // Needles, scales of bark, lichen: a fleck in one of twelve cells of 3 cm.
        let flecks = worley(p, IVec2::splat(100), 1.0, seed ^ 0x20);
        let is_there = unit(flecks.id).lt(0.08).indicator();
        let fleck = is_there * smoothstep(0.16, 0.08, flecks.f1);
        let colour = (rgb(0.86, 0.875, 0.90) * tone).lerp(rgb(0.13, 0.09, 0.055), 0.8 * fleck);
        Texels {
            albedo: colour,
            height: broad,
        }
    })
}
