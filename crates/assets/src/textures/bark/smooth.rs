//! Bark of beech, birch and cork oak.

use glam::IVec2;

use super::{HEIGHT, WIDTH};
use crate::lanes::{F32x16, Vec2x16, rgb};
use crate::textures::noise::{
    Worley, fbm, gradient, ridged, smoothstep, unit, value, warp, worley,
};
use crate::textures::tile::{Texels, Tile};

/// Beech: smooth and silver grey, with level wrinkles, scars where branches were, and lichens.
pub(super) fn beech(seed: u32) -> Tile {
    let mut tile = Tile::bake(WIDTH, HEIGHT, |p| {
        let q = warp(p, IVec2::new(4, 6), (0.03, 0.015), seed);
        let wrinkles = fbm(q, IVec2::new(4, 44), 3, 0.5, seed ^ 0x10);
        let fine = fbm(p, IVec2::new(36, 150), 2, 0.5, seed ^ 0x20);
        let cloud = fbm(p, IVec2::new(3, 4), 4, 0.5, seed ^ 0x30);
        // Crusts of lichen: large soft-edged maps of paler and of greener grey.
        let maps = fbm(q, IVec2::new(5, 9), 5, 0.6, seed ^ 0x40);
        let pale = smoothstep(0.06, 0.20, maps);
        let green = smoothstep(0.05, 0.45, fbm(p, IVec2::new(2, 2), 4, 0.55, seed ^ 0x50));
        let scar = scars(q, IVec2::new(3, 5), 0.22, seed ^ 0x60);
        let grey = rgb(0.195, 0.190, 0.175);
        let colour = grey
            .lerp(rgb(0.27, 0.27, 0.25), 0.55 * pale)
            .lerp(rgb(0.145, 0.165, 0.105), 0.28 * green);
        Texels {
            albedo: colour
                * (1.0 + 0.09 * wrinkles + 0.05 * fine + 0.10 * cloud)
                * (1.0 - 0.55 * scar),
            height: 0.3 * wrinkles + 0.1 * fine - 0.5 * scar,
        }
    });
    tile.darken_hollows(6, 0.8, 0.35);
    tile
}

/// Scars over the places where branches were: thin dark arcs. The result is 1 where a scar is
/// deepest.
fn scars(p: Vec2x16, frequency: IVec2, share: f32, seed: u32) -> F32x16 {
    let Worley { offset, id, .. } = worley(p, frequency, 0.7, seed);
    let size = 0.10 + 0.12 * unit(id.rotate_left(7));
    // An arch open below: its line falls away on both sides.
    let x = offset.x / size;
    let line = offset.y / size + 0.55 * x * x - 0.2;
    let arc = (1.0 - (line.abs() / 0.16).min(1.0)) * (1.0 - smoothstep(0.9, 1.4, x.abs()));
    let knot = 1.0 - smoothstep(0.25, 0.5, (offset / (0.6 * size)).length());
    unit(id).gt(share + 0.25).select(0.0, arc.max(0.6 * knot))
}

/// Silver birch: white paper with level pores, dark bands, and black scars like diamonds.
pub(super) fn birch(seed: u32) -> Tile {
    let mut tile = Tile::bake(WIDTH, HEIGHT, |p| {
        let q = warp(p, IVec2::new(6, 8), (0.02, 0.012), seed);
        let bands = fbm(q, IVec2::new(3, 40), 3, 0.55, seed ^ 0x10);
        let cloud = fbm(p, IVec2::new(3, 4), 4, 0.5, seed ^ 0x20);
        // Pores: level dashes of 1 to 5 cm.
        let pores = worley(q, IVec2::new(15, 110), 1.0, seed ^ 0x30);
        let long = 0.12 + 0.30 * unit(pores.id);
        let pore = unit(pores.id.rotate_left(11)).lt(0.5).indicator()
            * (1.0 - smoothstep(0.8 * long, long, pores.offset.x.abs()))
            * (1.0 - smoothstep(0.14, 0.30, pores.offset.y.abs()));
        // Curls of paper, with a shadow below and buff skin inside.
        let curl = smoothstep(0.36, 0.44, fbm(q, IVec2::new(4, 26), 3, 0.5, seed ^ 0x40));
        let black = rents(p, seed ^ 0x50).max(0.9 * scars(q, IVec2::new(3, 6), 0.0, seed ^ 0x60));
        let white = rgb(0.62, 0.60, 0.55) * (1.0 + 0.10 * bands + 0.12 * cloud);
        let paper = white.lerp(rgb(0.45, 0.33, 0.24), 0.45 * curl);
        let dark =
            rgb(0.045, 0.040, 0.036) * (1.0 + 1.5 * value(p, IVec2::new(90, 120), seed ^ 0x70));
        Texels {
            albedo: paper
                .lerp(rgb(0.13, 0.11, 0.095), 0.85 * pore)
                .lerp(dark, black),
            height: 0.2 * bands - 0.3 * pore - 0.4 * black + 0.25 * curl,
        }
    });
    tile.darken_hollows(5, 0.8, 0.3);
    tile
}

/// Where the paper has burst: ragged black diamonds of different shapes, most of them small.
fn rents(p: Vec2x16, seed: u32) -> F32x16 {
    let torn = fbm(p, IVec2::new(26, 52), 4, 0.62, seed ^ 0x11);
    let bent = warp(p, IVec2::new(9, 14), (0.018, 0.012), seed ^ 0x22);
    let of = |frequency: IVec2, share: f32, largest: f32, seed: u32| {
        let Worley { offset, id, .. } = worley(bent, frequency, 0.95, seed);
        let own = |turn: u32| unit(id.rotate_left(turn));
        let size = largest * (0.22 + 0.78 * own(5) * own(19));
        // A diamond leans, and is wider or higher than a square that stands on its corner.
        let (wide, lean) = (0.75 + 0.75 * own(9), 0.5 * (own(23) - 0.5));
        let (x, y) = (offset.x + lean * offset.y, offset.y);
        let from_middle = x.abs() / wide + y.abs() * wide;
        let rent = 1.0 - smoothstep(0.72 * size, size, from_middle + 0.45 * size * torn);
        unit(id).gt(share).select(0.0, rent)
    };
    let large = of(IVec2::new(2, 5), 0.5, 0.38, seed ^ 0x33);
    large.max(of(IVec2::new(6, 13), 0.3, 0.34, seed ^ 0x44))
}

/// The foot of an old birch: black corky blocks, white in stripes between them.
pub(super) fn birch_foot(seed: u32) -> Tile {
    let mut tile = Tile::bake(WIDTH, HEIGHT, |p| {
        let q = warp(p, IVec2::new(6, 5), (0.04, 0.03), seed);
        let q = warp(q, IVec2::new(36, 40), (0.008, 0.008), seed ^ 0x11);
        let furrow = gradient(q, IVec2::new(13, 5), seed ^ 0x20).abs()
            + 0.4 * gradient(q, IVec2::new(27, 11), seed ^ 0x30).abs();
        let block = smoothstep(0.05, 0.28, furrow);
        let grain = fbm(p, IVec2::new(80, 60), 3, 0.6, seed ^ 0x40);
        let white = smoothstep(0.12, 0.26, fbm(q, IVec2::new(9, 3), 4, 0.55, seed ^ 0x50));
        let top = rgb(0.105, 0.095, 0.085) * (1.0 + 0.5 * grain);
        let paper = rgb(0.50, 0.48, 0.43) * (1.0 + 0.15 * grain);
        Texels {
            albedo: rgb(0.022, 0.019, 0.017)
                .lerp(top, block)
                .lerp(paper, 0.85 * white),
            height: 0.9 * block * (1.0 - 0.5 * white) + 0.08 * grain,
        }
    });
    tile.darken_hollows(9, 0.6, 1.0);
    tile
}

/// Cork: thick and knotty, with wide, deep furrows that meet.
pub(super) fn cork(seed: u32) -> Tile {
    let mut tile = Tile::bake(WIDTH, HEIGHT, |p| {
        let q = warp(p, IVec2::new(6, 8), (0.05, 0.03), seed);
        let q = warp(q, IVec2::new(28, 36), (0.012, 0.010), seed ^ 0x11);
        let deep = ridged(q, IVec2::new(8, 5), 2, 0.55, seed ^ 0x20);
        let furrow = smoothstep(0.62, 0.93, deep);
        let knots = fbm(q, IVec2::new(20, 30), 3, 0.6, seed ^ 0x30);
        let cracks = smoothstep(
            0.80,
            0.97,
            ridged(q, IVec2::new(22, 26), 2, 0.5, seed ^ 0x40),
        );
        let cloud = fbm(p, IVec2::new(4, 5), 4, 0.55, seed ^ 0x50);
        let grey = rgb(0.235, 0.215, 0.185);
        let buff = rgb(0.215, 0.165, 0.115);
        let top = grey.lerp(buff, smoothstep(-0.2, 0.5, cloud - 0.3 * knots))
            * (1.0 + 0.30 * knots)
            * (1.0 - 0.45 * cracks);
        Texels {
            albedo: top.lerp(rgb(0.045, 0.032, 0.024), furrow),
            height: 0.35 * knots - 1.2 * furrow - 0.3 * cracks,
        }
    });
    tile.darken_hollows(12, 0.8, 1.2);
    tile
}

/// Where the cork was taken some years ago: ochre to red-brown, smooth, with fine long cracks.
pub(super) fn stripped_cork(seed: u32) -> Tile {
    let mut tile = Tile::bake(WIDTH, HEIGHT, |p| {
        let q = warp(p, IVec2::new(5, 4), (0.03, 0.03), seed);
        let crack = smoothstep(
            0.88,
            0.985,
            ridged(q, IVec2::new(14, 4), 2, 0.5, seed ^ 0x10),
        );
        let streak = fbm(q, IVec2::new(26, 4), 3, 0.55, seed ^ 0x20);
        let cloud = fbm(p, IVec2::new(3, 4), 4, 0.55, seed ^ 0x30);
        let grain = fbm(p, IVec2::new(100, 100), 2, 0.6, seed ^ 0x40);
        let red = rgb(0.22, 0.085, 0.045);
        let dark = rgb(0.13, 0.075, 0.052);
        let skin = red.lerp(dark, smoothstep(-0.35, 0.45, cloud + 0.3 * streak));
        Texels {
            albedo: skin * (1.0 + 0.18 * streak + 0.12 * grain) * (1.0 - 0.75 * crack),
            height: 0.15 * streak + 0.06 * grain - crack,
        }
    });
    tile.darken_hollows(5, 0.8, 0.6);
    tile
}
