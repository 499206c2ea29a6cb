//! Bark of Scots pine's upper stem, spruce, Douglas fir; and rough fibres.

use glam::IVec2;

use super::{HEIGHT, WIDTH, with_lichen};
use crate::lanes::{F32x16, rgb};
use crate::textures::noise::{fbm, gradient, ridged, smoothstep, unit, value, warp, worley};
use crate::textures::tile::{Texels, Tile};

/// Scots pine high up: thin orange paper that peels in flakes, with pale edges.
pub(super) fn flakes(seed: u32) -> Tile {
    let mut tile = Tile::bake(WIDTH, HEIGHT, |p| {
        let q = warp(p, IVec2::new(8, 10), (0.03, 0.02), seed);
        let q = warp(q, IVec2::new(50, 70), (0.006, 0.004), seed ^ 0x11);
        let mut height = F32x16::splat(0.0);
        let mut edge = F32x16::splat(0.0);
        let mut tone = F32x16::splat(0.5);
        // Sheets over sheets: each covers a random part, and curls at its edge.
        for layer in 1..4_u32 {
            let cells = worley(
                q,
                IVec2::new(9, 13) * layer as i32,
                1.0,
                seed ^ (0x100 * layer),
            );
            let there = unit(cells.id).lt(0.5).indicator() * smoothstep(0.02, 0.06, cells.border());
            let curl = there * (1.0 - smoothstep(0.05, 0.14, cells.border()));
            height += 0.35 * there + 0.25 * curl;
            edge = edge.max(curl);
            tone += there * (unit(cells.id.rotate_left(9)) - 0.5) * 0.5;
        }
        let grain = fbm(p, IVec2::new(60, 90), 3, 0.6, seed ^ 0x66);
        let cloud = fbm(p, IVec2::new(5, 7), 3, 0.5, seed ^ 0x77);
        let tone = (tone + 0.35 * cloud).clamp(0.0, 1.0);
        let orange = rgb(0.34, 0.165, 0.07);
        let pale = rgb(0.36, 0.24, 0.14);
        let grey = rgb(0.22, 0.16, 0.11);
        let skin = grey
            .lerp(orange, smoothstep(0.1, 0.5, tone))
            .lerp(pale, 0.6 * edge);
        Texels {
            albedo: skin * (1.0 + 0.22 * grain),
            height: height + 0.05 * grain,
        }
    });
    tile.darken_hollows(6, 0.5, 0.7);
    tile
}

/// Spruce: rounded scales of 1 to 3 cm that lift at their edges, red-brown below grey.
pub(super) fn scales(seed: u32) -> Tile {
    let mut tile = Tile::bake(WIDTH, HEIGHT, |p| {
        let q = warp(p, IVec2::new(20, 34), (0.016, 0.010), seed);
        let q = warp(q, IVec2::new(70, 110), (0.004, 0.003), seed ^ 0x11);
        let big = worley(q, IVec2::new(42, 58), 1.0, seed ^ 0x22);
        let small = worley(q, IVec2::new(78, 120), 1.0, seed ^ 0x33);
        // A scale is a shallow dome, highest towards its lower edge.
        let tilt = (0.5 - big.offset.y).clamp(0.0, 1.0);
        let dome = smoothstep(0.0, 0.13, big.border()) * (0.6 + 0.4 * tilt);
        // Some scales lie close, and no gap is seen between them.
        let lifted = 0.25 + 0.75 * unit(big.id ^ 0x91);
        let dome = 1.0 - lifted * (1.0 - dome);
        let fine = smoothstep(0.0, 0.2, small.border());
        let grain = fbm(p, IVec2::new(110, 160), 2, 0.6, seed ^ 0x44);
        let cloud = fbm(p, IVec2::new(4, 5), 4, 0.55, seed ^ 0x55);
        let shed = smoothstep(0.55, 0.8, unit(big.id) + 0.25 * cloud);
        let grey = rgb(0.155, 0.135, 0.115);
        let red = rgb(0.165, 0.105, 0.075);
        let top = grey.lerp(red, 0.35 + 0.55 * shed) * (1.0 + 0.28 * grain + 0.25 * cloud);
        let top = with_lichen(p, top, 0.06, seed ^ 0x77) * (0.85 + 0.3 * (unit(small.id) - 0.5));
        let gap = rgb(0.070, 0.048, 0.036);
        Texels {
            albedo: gap.lerp(top, dome * (0.8 + 0.2 * fine)),
            height: dome * (0.7 + 0.15 * fine) + 0.04 * grain,
        }
    });
    tile.darken_hollows(5, 0.5, 0.6);
    tile
}

/// Douglas fir: broad corky ribs with deep furrows between them, rusty where they are torn.
pub(super) fn furrows(seed: u32) -> Tile {
    let mut tile = Tile::bake(WIDTH, HEIGHT, |p| {
        let q = warp(p, IVec2::new(4, 4), (0.05, 0.02), seed);
        let q = warp(q, IVec2::new(30, 24), (0.010, 0.008), seed ^ 0x11);
        // Ribs 6 to 12 cm wide; furrows run long, fork, and close.
        let rib = gradient(q, IVec2::new(13, 3), seed ^ 0x20).abs()
            + 0.25 * gradient(q, IVec2::new(27, 6), seed ^ 0x30).abs();
        let width = 0.42 + 0.16 * gradient(p, IVec2::new(5, 4), seed ^ 0x40);
        let depth = smoothstep(0.05, width, rib);
        // Ribs break across now and then, and in layers.
        let blocks = worley(q, IVec2::new(10, 9), 1.0, seed ^ 0x50);
        let broken = 0.5 + 0.5 * smoothstep(0.0, 0.09, blocks.border());
        let layers = 5.0 * (depth + 0.15 * fbm(q, IVec2::new(24, 20), 3, 0.5, seed ^ 0x60));
        let step = smoothstep(0.0, 0.25, layers - layers.floor());
        let grain = fbm(p, IVec2::new(90, 60), 3, 0.6, seed ^ 0x70);
        let cloud = fbm(p, IVec2::new(4, 6), 4, 0.55, seed ^ 0x80);
        let rust = rgb(0.19, 0.095, 0.05);
        let grey = rgb(0.15, 0.125, 0.105);
        let top = rust.lerp(grey, smoothstep(0.5, 0.95, depth + 0.2 * cloud));
        let top = top * (0.8 + 0.2 * step) * (1.0 + 0.3 * grain) * (0.8 + 0.2 * broken);
        let top = with_lichen(p, top, 0.05, seed ^ 0x90);
        let bottom = rgb(0.030, 0.019, 0.013);
        Texels {
            albedo: bottom.lerp(top, depth),
            height: 1.3 * depth * (0.85 + 0.15 * broken) + 0.06 * grain,
        }
    });
    tile.darken_hollows(16, 0.6, 1.8);
    tile
}

/// Rough bark that stays on the foot of smooth stems: long fibres, fissured.
pub(super) fn fibrous(seed: u32) -> Tile {
    let mut tile = Tile::bake(WIDTH, HEIGHT, |p| {
        let q = warp(p, IVec2::new(6, 4), (0.03, 0.02), seed);
        let fibre = fbm(q, IVec2::new(56, 5), 4, 0.6, seed ^ 0x10);
        let crack = smoothstep(
            0.74,
            0.96,
            ridged(q, IVec2::new(16, 4), 2, 0.5, seed ^ 0x20),
        );
        let cloud = fbm(p, IVec2::new(4, 5), 3, 0.5, seed ^ 0x30);
        let tone = 0.75 + 0.5 * value(p, IVec2::new(80, 30), seed ^ 0x40);
        let grey = rgb(0.20, 0.17, 0.14);
        let brown = rgb(0.21, 0.145, 0.095);
        let top = grey.lerp(brown, smoothstep(-0.3, 0.4, cloud)) * tone * (1.0 + 0.4 * fibre);
        Texels {
            albedo: top * (1.0 - 0.7 * crack),
            height: 0.35 * fibre - crack,
        }
    });
    tile.darken_hollows(6, 0.8, 0.8);
    tile
}
