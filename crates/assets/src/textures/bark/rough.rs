//! Bark of maritime pine, eucalypt and oak, of thin and dead wood.

use glam::{IVec2, Vec3};

use super::{HEIGHT, WIDTH, with_lichen};
use crate::lanes::{F32x16, Vec3x16, rgb};
use crate::textures::noise::{fbm, gradient, ridged, scramble, smoothstep, unit, warp, worley};
use crate::textures::tile::{Texels, Tile};

/// Maritime pine: long plates of flakes on flakes between dark, deep fissures.
pub(super) fn plates(seed: u32) -> Tile {
    let mut tile = Tile::bake(WIDTH, HEIGHT, |p| {
        let q = warp(p, IVec2::new(6, 5), (0.030, 0.05), seed);
        let q = warp(q, IVec2::new(36, 24), (0.007, 0.008), seed ^ 0x11);
        // Fissures along the stem part long plates; finer ones across part these.
        let long = worley(q, IVec2::new(14, 5), 1.0, seed ^ 0x22);
        let short = worley(q, IVec2::new(18, 19), 1.0, seed ^ 0x23);
        let shallow = 0.16 + 0.22 * gradient(p, IVec2::new(9, 8), seed ^ 0x33);
        // Flakes lie on flakes: towards a fissure there are fewer of them, in torn steps.
        let torn = fbm(q, IVec2::new(24, 14), 4, 0.62, seed ^ 0x55);
        let from_edge = (long.border() / 0.30).min(short.border() / 0.22 + 1.2 * shallow.max(0.0));
        let stack = 4.8 * smoothstep(0.0, 1.0, from_edge + 0.18 * torn) + 1.4 * torn;
        let layer = stack.floor().max(0.0);
        let step = (stack - layer).clamp(0.0, 1.0);
        let lift = smoothstep(0.0, 0.25, step);
        let mottle = fbm(p, IVec2::new(9, 12), 4, 0.6, seed ^ 0x44);
        let grain = fbm(p, IVec2::new(130, 80), 2, 0.6, seed ^ 0x66);
        let height = 0.17 * (layer + lift) + 0.04 * grain;
        // Each flake has seen the weather for another time: red when fresh, then grey.
        let age = unit(scramble(long.id ^ (layer.to_u32() * 0x9E37_79B1)));
        let outer = (0.22 * (layer - 1.0) + 0.9 * (age - 0.5) + 0.8 * mottle).clamp(0.0, 1.0);
        let fissure = rgb(0.040, 0.025, 0.019);
        let inner = rgb(0.150, 0.084, 0.054);
        let weathered = rgb(0.140, 0.112, 0.094);
        let mut top = inner.lerp(weathered, outer);
        top = fissure.lerp(top, smoothstep(-0.1, 1.9, stack));
        top *= (0.58 + 0.42 * lift) * (1.0 + 0.25 * mottle + 0.28 * grain);
        top *= 0.9 + 0.2 * unit(long.id);
        let top = with_lichen(p, top, 0.03, seed ^ 0x77);
        Texels {
            albedo: top,
            height,
        }
    });
    tile.darken_hollows(9, 0.5, 0.8);
    tile
}

/// Eucalypt: smooth skin in patches of several ages, shed in long strips.
pub(super) fn patches(seed: u32) -> Tile {
    let mut tile = Tile::bake(WIDTH, HEIGHT, |p| {
        let q = warp(p, IVec2::new(4, 3), (0.05, 0.05), seed);
        let skins = [
            rgb(0.46, 0.40, 0.31),
            rgb(0.36, 0.31, 0.25),
            rgb(0.285, 0.255, 0.215),
            rgb(0.37, 0.25, 0.155),
            rgb(0.235, 0.205, 0.175),
        ];
        let streak = fbm(p, IVec2::new(40, 5), 3, 0.55, seed ^ 0x12);
        let fine = gradient(p, IVec2::new(150, 60), seed ^ 0x13);
        let mut colour = skins[0];
        let mut height = F32x16::splat(0.0);
        let mut rim = F32x16::splat(0.0);
        for (layer, &skin) in skins.iter().enumerate().skip(1) {
            let salt = seed ^ (0x100 * layer as u32);
            // Long patches: wide noise, stretched along the stem, with torn edges.
            let field = fbm(q, IVec2::new(4, 2), 4, 0.5, salt)
                + 0.16 * fbm(q, IVec2::new(36, 10), 2, 0.5, salt ^ 0x31);
            let edge = field - 0.04 - 0.055 * layer as f32;
            let there = smoothstep(-0.008, 0.012, edge);
            colour = colour.lerp(skin * (1.0 + 0.10 * streak), there);
            height += 0.25 * there;
            let fades = edge.gt(-0.018).select(1.0, 0.8);
            rim = rim.max(1.0 - (edge.abs() / 0.018).min(1.0)) * fades;
        }
        colour *= 1.0 + 0.10 * streak + 0.05 * fine;
        colour *= 1.0 - 0.28 * rim;
        // Grey-green algae and dark weeping stains.
        let stain = smoothstep(0.25, 0.75, fbm(p, IVec2::new(14, 2), 3, 0.55, seed ^ 0x21));
        colour = colour.lerp(colour * rgb(0.66, 0.66, 0.62), 0.8 * stain);
        let spots = worley(p, IVec2::new(40, 80), 1.0, seed ^ 0x25);
        let spot = (1.0 - smoothstep(0.08, 0.20, spots.f1)) * unit(spots.id).lt(0.04).indicator();
        colour *= 1.0 - 0.35 * spot;
        Texels {
            albedo: colour,
            height: height + 0.04 * streak,
        }
    });
    tile.darken_hollows(6, 0.5, 0.5);
    tile
}

/// Oak: grey ridges that run together and part again, with dark furrows.
pub(super) fn ridges(seed: u32) -> Tile {
    let mut tile = Tile::bake(WIDTH, HEIGHT, |p| {
        let q = warp(p, IVec2::new(7, 6), (0.030, 0.03), seed);
        let q = warp(q, IVec2::new(44, 40), (0.005, 0.005), seed ^ 0x11);
        // Furrows are the zero lines of stretched noise, which never end but meet each other.
        let wide = gradient(q, IVec2::new(17, 6), seed ^ 0x10);
        let narrow = gradient(q, IVec2::new(34, 11), seed ^ 0x20);
        let wandering = (wide + 0.55 * narrow).abs();
        let depth = 0.34 + 0.14 * gradient(p, IVec2::new(6, 5), seed ^ 0x40);
        let ridge = smoothstep(0.03, depth, wandering);
        // Ridges are broken across into blocks of a few centimetres.
        let blocks = worley(q, IVec2::new(26, 34), 1.0, seed ^ 0x30);
        let broken = smoothstep(0.0, 0.10, blocks.border());
        let grain = fbm(p, IVec2::new(70, 50), 3, 0.6, seed ^ 0x50);
        let fibre = fbm(q, IVec2::new(120, 16), 2, 0.5, seed ^ 0x60);
        let height = ridge * (0.74 + 0.14 * broken + 0.16 * grain) + 0.06 * fibre;
        let tone = 0.5
            + 0.6 * fbm(p, IVec2::new(8, 8), 4, 0.55, seed ^ 0x70)
            + 0.25 * (unit(blocks.id) - 0.5);
        let top = rgb(0.140, 0.112, 0.086).lerp(rgb(0.185, 0.162, 0.136), tone.clamp(0.0, 1.0))
            * (1.0 + 0.30 * grain + 0.12 * fibre)
            * (0.82 + 0.18 * broken);
        let top = with_lichen(p, top, 0.10, seed ^ 0x80);
        // Algae tints the grey a little green.
        let green = smoothstep(0.1, 0.6, fbm(p, IVec2::new(3, 4), 3, 0.5, seed ^ 0x90));
        let top = top.lerp(rgb(0.105, 0.115, 0.060), 0.25 * green);
        Texels {
            albedo: rgb(0.040, 0.032, 0.025).lerp(top, ridge),
            height,
        }
    });
    tile.darken_hollows(8, 0.6, 0.9);
    tile
}

/// Young bark of branches and shrubs: fine, streaked along the stem.
pub(crate) fn twig(seed: u32, mean: Vec3) -> Tile {
    let mut tile = Tile::bake(WIDTH / 2, HEIGHT / 2, |p| {
        let streak = fbm(p, IVec2::new(40, 9), 3, 0.6, seed);
        let crack = ridged(p, IVec2::new(30, 14), 2, 0.5, seed ^ 0x10);
        let scars = worley(p, IVec2::new(24, 60), 1.0, seed ^ 0x20);
        let scar = 1.0 - smoothstep(0.10, 0.24, scars.f1);
        let crack = smoothstep(0.80, 0.97, crack);
        Texels {
            albedo: Vec3x16::from(mean)
                * (1.0 + 0.35 * streak + 0.35 * scar)
                * (1.0 - 0.45 * crack),
            height: 0.3 * streak - 0.7 * crack + 0.3 * scar,
        }
    });
    tile.darken_hollows(4, 0.8, 0.6);
    tile.with_luminance_of(mean)
}

/// Dead wood: bark lost in places, silver grey with long drying cracks.
pub(crate) fn dead(seed: u32) -> Tile {
    let mut tile = Tile::bake(WIDTH / 2, HEIGHT / 2, |p| {
        let fibre = fbm(p, IVec2::new(60, 4), 3, 0.6, seed);
        let crack = smoothstep(
            0.82,
            0.97,
            ridged(p, IVec2::new(16, 2), 2, 0.5, seed ^ 0x10),
        );
        let bark = smoothstep(0.02, 0.10, fbm(p, IVec2::new(6, 5), 4, 0.55, seed ^ 0x20));
        let wood = rgb(0.205, 0.180, 0.152) * (1.0 + 0.3 * fibre);
        let flake = rgb(0.095, 0.076, 0.060)
            * (1.0 + 0.5 * fbm(p, IVec2::new(40, 40), 2, 0.5, seed ^ 0x30));
        Texels {
            albedo: wood.lerp(flake, bark) * (1.0 - 0.5 * crack),
            height: 0.2 * fibre + 0.6 * bark - crack,
        }
    });
    tile.darken_hollows(4, 0.8, 0.8);
    tile.with_luminance_of(Vec3::new(0.138, 0.118, 0.098))
}
