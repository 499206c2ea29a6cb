//! Rock, the cut face of a stump, and bracket fungi.

use glam::{IVec2, Vec2, Vec3};

use super::noise::{fbm, gradient, scramble, smoothstep, unit, value, warp, worley};
use super::tile::{Texels, Tile};
use crate::lanes::{F32x16, Vec2x16, rgb};

/// Side of the tile of cliffs, metres.
pub(crate) const CLIFF_M: f32 = 3.2;

/// Granite with lichens, on a tile of 1 m.
pub(crate) fn rock(seed: u32) -> Tile {
    let mut tile = Tile::bake(512, 512, |p| {
        let grains = worley(p, IVec2::splat(210), 1.0, seed);
        let kind = unit(grains.id);
        // Feldspar, quartz and mica.
        let (feldspar, quartz) = (rgb(0.30, 0.275, 0.245), rgb(0.245, 0.24, 0.235));
        let others = kind
            .lt(0.84)
            .select_colour(quartz, rgb(0.165, 0.155, 0.145));
        let mineral = kind.lt(0.50).select_colour(feldspar, others);
        let broad = fbm(p, IVec2::splat(3), 5, 0.55, seed ^ 0x10);
        let rough = fbm(p, IVec2::splat(24), 4, 0.6, seed ^ 0x20);
        let q = warp(p, IVec2::splat(5), (0.06, 0.06), seed ^ 0x30);
        let mut colour = mineral * (1.0 + 0.28 * broad + 0.22 * rough);
        // Weathering: brown iron stains, dark water films.
        let stain = smoothstep(0.05, 0.55, fbm(q, IVec2::splat(4), 4, 0.55, seed ^ 0x50));
        colour = colour.lerp(colour * rgb(0.86, 0.74, 0.60), 0.7 * stain);
        let film = smoothstep(0.15, 0.6, fbm(q, IVec2::splat(5), 4, 0.6, seed ^ 0x60));
        colour *= 1.0 - 0.45 * film;
        // Lichens: crusts with lobed margins in two colours, moss where it is damp.
        for (k, tint) in [rgb(0.37, 0.38, 0.29), rgb(0.24, 0.26, 0.17)]
            .into_iter()
            .enumerate()
        {
            let salt = seed ^ (0x1000 + 0x100 * k as u32);
            let lobes = warp(p, IVec2::splat(30), (0.012, 0.012), salt);
            let crusts = worley(
                lobes,
                IVec2::splat(if k == 0 { 9 } else { 14 }),
                1.0,
                salt ^ 1,
            );
            let radius = 0.16 + 0.34 * unit(crusts.id);
            let alive = unit(crusts.id ^ 0x5555).lt(0.42).indicator();
            let there = alive * smoothstep(radius, radius - 0.05, crusts.f1);
            let ring = 0.8 + 0.25 * smoothstep(0.3, 1.0, crusts.f1 / radius);
            let dust = 0.75 + 0.5 * value(p, IVec2::splat(200), salt ^ 2);
            colour = colour.lerp(tint * ring * dust, 0.65 * there);
        }
        let damp = fbm(q, IVec2::splat(6), 5, 0.62, seed ^ 0x70) + 0.35 * film - 0.2;
        let moss = smoothstep(0.10, 0.30, damp);
        let cushion = 0.6 + 0.8 * value(p, IVec2::splat(170), seed ^ 0x71);
        colour = colour.lerp(rgb(0.052, 0.066, 0.024) * cushion, 0.85 * moss);
        Texels {
            albedo: colour,
            height: 0.5 * rough + 0.3 * broad + 0.25 * moss * cushion,
        }
    });
    tile.darken_hollows(6, 0.5, 0.6);
    tile.with_luminance_of(Vec3::new(0.190, 0.182, 0.150))
}

/// The face of a cliff, on a tile of 3.2 m: blocks between joints, each broken a little deeper or
/// less deep than its neighbours, with streaks of water and lichens.
pub(crate) fn cliff(seed: u32) -> Tile {
    let mut tile = Tile::bake(512, 512, |p| {
        let q = warp(p, IVec2::splat(3), (0.13, 0.13), seed);
        let blocks = worley(q, IVec2::new(3, 8), 1.0, seed ^ 0x10);
        let chips = worley(q, IVec2::new(9, 21), 1.0, seed ^ 0x11);
        // Joints are open here and closed there.
        let open = smoothstep(-0.15, 0.30, fbm(p, IVec2::splat(5), 3, 0.5, seed ^ 0x12));
        let joint = open * (1.0 - smoothstep(0.0, 0.05, blocks.f2 - blocks.f1));
        let hair = 1.0 - smoothstep(0.0, 0.09, chips.f2 - chips.f1);
        let hair = hair * smoothstep(0.45, 0.75, unit(chips.id ^ 0x33));
        let rough = fbm(p, IVec2::splat(40), 4, 0.6, seed ^ 0x20);
        let broad = fbm(q, IVec2::splat(3), 4, 0.55, seed ^ 0x21);
        let grains = value(p, IVec2::splat(230), seed ^ 0x22);
        let tone = 0.84 + 0.22 * unit(blocks.id) + 0.16 * unit(chips.id);
        let mut colour = rgb(0.205, 0.190, 0.165)
            * tone
            * (1.0 + 0.22 * rough + 0.20 * broad + 0.22 * (grains - 0.5));
        let stain = smoothstep(0.05, 0.5, fbm(q, IVec2::splat(5), 4, 0.55, seed ^ 0x30));
        colour = colour.lerp(colour * rgb(0.92, 0.72, 0.54), 0.7 * stain);
        let film = smoothstep(0.10, 0.55, fbm(q, IVec2::splat(4), 5, 0.6, seed ^ 0x31));
        colour *= 1.0 - 0.5 * film;
        let lobes = warp(p, IVec2::splat(40), (0.010, 0.010), seed ^ 0x40);
        let crusts = worley(lobes, IVec2::splat(22), 1.0, seed ^ 0x41);
        let radius = 0.14 + 0.34 * unit(crusts.id);
        let alive = unit(crusts.id ^ 0x5555).lt(0.35).indicator();
        let there = alive * smoothstep(radius, radius - 0.07, crusts.f1);
        colour = colour.lerp(rgb(0.30, 0.31, 0.24), 0.55 * there);
        let damp = fbm(q, IVec2::splat(6), 5, 0.62, seed ^ 0x50) + 0.4 * film + 0.25 * joint;
        let moss = smoothstep(0.36, 0.58, damp);
        colour = colour.lerp(rgb(0.050, 0.062, 0.024), 0.8 * moss);
        colour *= 1.0 - 0.70 * joint.max(0.45 * hair);
        Texels {
            albedo: colour,
            height: 0.10 * unit(blocks.id) + 0.03 * unit(chips.id) + 0.02 * rough
                - 0.10 * joint
                - 0.03 * hair,
        }
    });
    tile.darken_hollows(6, 0.6, 0.55);
    tile.with_luminance_of(Vec3::new(0.165, 0.152, 0.126))
}

/// Loose stone, cleaner than rock, on a tile of 0.5 m.
pub(crate) fn stone(seed: u32) -> Tile {
    let mut tile = Tile::bake(256, 256, |p| {
        let broad = fbm(p, IVec2::splat(4), 4, 0.55, seed);
        let speck = gradient(p, IVec2::splat(100), seed ^ 1);
        let dirt = smoothstep(-0.05, 0.5, fbm(p, IVec2::splat(6), 4, 0.55, seed ^ 2));
        let grey = rgb(0.25, 0.238, 0.215) * (1.0 + 0.3 * broad + 0.2 * speck);
        Texels {
            albedo: grey.lerp(rgb(0.125, 0.095, 0.068), 0.6 * dirt),
            height: broad + 0.3 * speck,
        }
    });
    tile.darken_hollows(5, 0.8, 0.4);
    tile.with_luminance_of(Vec3::new(0.205, 0.186, 0.160))
}

/// The cut face of a stump: rings around (0.5, 0.5), bark outside radius 0.46, weathered by `age`
/// (0 fresh .. 1 grey). It does not tile.
pub(crate) fn cut_wood(seed: u32, age: f32) -> Tile {
    let tile = Tile::bake(256, 256, |p| {
        let d = p - Vec2::new(0.5, 0.5);
        // The pith is not in the middle, and rings are not round.
        let c = d - Vec2::new(0.03, -0.02);
        let wobble = 1.0 + 0.05 * fbm(p * 0.98, IVec2::splat(3), 2, 0.5, seed);
        let r = c.length() * wobble;
        // Rings get narrower outwards.
        let years = 30.0 * r.sqrt();
        let phase = years - years.floor();
        let late = smoothstep(0.45, 0.95, phase);
        let year = unit(scramble(years.floor().to_u32() ^ seed));
        let heart = smoothstep(0.30, 0.24, r);
        let fresh = rgb(0.47, 0.335, 0.20).lerp(rgb(0.36, 0.215, 0.115), heart);
        let wood = fresh * (1.0 - (0.25 + 0.2 * year) * late);
        let grey = rgb(0.185, 0.165, 0.140) * (1.0 - 0.35 * late);
        let mut colour = wood.lerp(grey, age);
        // Drying cracks run along radii, so the noise varies with the direction and hardly with the
        // radius.
        let along = c / c.length().max(1e-3);
        let spoke = gradient(along * 0.4 + Vec2::splat(0.5), IVec2::splat(16), seed ^ 7);
        let crack = smoothstep(0.06, 0.0, spoke.abs()) * smoothstep(0.05, 0.25, r);
        colour *= 1.0 - (0.35 + 0.35 * age) * crack;
        // Saw marks, dirt and algae.
        let saw = gradient(p, IVec2::new(4, 90), seed ^ 8);
        colour *= 1.0 + 0.08 * saw;
        let dirt = smoothstep(0.0, 0.5, fbm(p, IVec2::splat(4), 4, 0.55, seed ^ 9));
        colour = colour.lerp(rgb(0.075, 0.070, 0.042), (0.15 + 0.5 * age) * dirt);
        let bark = smoothstep(0.455, 0.47, d.length());
        let bark_tone = 1.0 + 0.4 * fbm(p, IVec2::splat(30), 2, 0.5, seed ^ 10);
        Texels {
            albedo: colour.lerp(rgb(0.085, 0.065, 0.05) * bark_tone, bark),
            height: F32x16::splat(0.0),
        }
    });
    let mean = Vec3::new(0.40, 0.28, 0.165).lerp(Vec3::new(0.150, 0.132, 0.108), age);
    tile.with_luminance_of(mean)
}

/// A bracket fungus: zones from its foot (u = 0) to its pale rim (u = 1).
pub(crate) fn fungus(seed: u32) -> Tile {
    Tile::bake(64, 64, |p| {
        let wavy = p.x + 0.03 * fbm(p, IVec2::splat(3), 2, 0.5, seed);
        let zones = fbm(Vec2x16::new(wavy, 0.5), IVec2::new(7, 1), 3, 0.7, seed ^ 1);
        let brown = rgb(0.125, 0.078, 0.046);
        let grey = rgb(0.205, 0.172, 0.135);
        let cream = rgb(0.46, 0.39, 0.28);
        let zone = brown.lerp(grey, smoothstep(-0.35, 0.35, zones));
        Texels {
            albedo: zone.lerp(cream, smoothstep(0.80, 0.95, wavy)),
            height: F32x16::splat(0.0),
        }
    })
}
