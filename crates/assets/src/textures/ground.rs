//! The forest floor, on tiles of 4 m, and the faces of cuttings.

use glam::{IVec2, Vec2, Vec3};
use nemoral_seed::{Draw, Key};

use super::canvas::{Canvas, Stroke};
use super::fallen::{FallenFoliage, anywhere, direction};
use super::noise::{fbm, gradient, ridged, smoothstep, unit, value, warp, worley};
use super::tile::{Texels, Tile};
use crate::lanes::{Vec2x16, rgb};

/// Texels along a side of the floor's tiles.
pub(crate) const FLOOR_TEXELS: usize = 1024;
/// Metres along a side of the floor's tiles.
pub(crate) const FLOOR_M: f32 = 4.0;

/// What lies on a tile, and how much of it, pieces per m²: so many leaves as large as a beech's or
/// an oak's, and needles as long as a maritime pine's, and more of smaller ones.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Debris {
    pub(crate) leaves: f32,
    /// Leaf length relative to a whole leaf: trodden leaves are broken.
    pub(crate) leaf_scale: f32,
    pub(crate) needles: f32,
    pub(crate) twigs: f32,
    pub(crate) grass: f32,
}

/// Strews a tile with leaves, needles, twigs and grass.
pub(crate) fn strew(
    tile: Tile,
    size_m: f32,
    debris: Debris,
    fallen: &FallenFoliage,
    key: Key,
) -> Tile {
    let mut rng = key.rng();
    let count = |per_m2: f32| (per_m2 * size_m * size_m) as u32;
    let mut canvas = Canvas::over(tile, Vec2::splat(size_m));
    // Needles lie under, between and over the leaves.
    let needles = count(debris.needles * fallen.needle_density());
    fallen.strew_needles(&mut canvas, size_m, needles / 2, &mut rng);
    let leaves = count(debris.leaves * fallen.leaf_density());
    let of_leaves = (size_m, debris.leaf_scale);
    fallen.strew_leaves(&mut canvas, of_leaves, leaves, &mut rng);
    for _ in 0..count(debris.twigs) {
        let from = anywhere(&mut rng, size_m);
        let length = 0.05 + 0.45 * rng.unit_f32() * rng.unit_f32();
        let along = direction(&mut rng);
        let sag = along.perp() * length * rng.range_f32(-0.12, 0.12);
        let width = rng.range_f32(0.003, 0.010);
        let tone = rng.range_f32(0.6, 1.3);
        canvas.stroke(&Stroke {
            points: Stroke::bowed(from, length * along, sag),
            width_m: [width, 0.5 * width],
            colour: [Vec3::new(0.125, 0.098, 0.076) * tone; 2],
            level: 0.02,
        });
    }
    fallen.strew_needles(&mut canvas, size_m, needles - needles / 2, &mut rng);
    for _ in 0..count(debris.grass) {
        let from = anywhere(&mut rng, size_m);
        let along = direction(&mut rng);
        let length = rng.range_f32(0.04, 0.13);
        let to = from + length * along;
        let side = along.perp() * length * rng.range_f32(-0.25, 0.25);
        let dry = rng.unit_f32();
        let green =
            Vec3::new(0.085, 0.135, 0.034).lerp(Vec3::new(0.24, 0.19, 0.085), dry * dry * dry);
        let tone = rng.range_f32(0.6, 1.1);
        canvas.stroke(&Stroke {
            points: [from, 0.5 * (from + to) + side, to],
            width_m: [0.006, 0.002],
            colour: [green * 0.45 * tone, green * tone],
            level: rng.range_f32(0.005, 0.03),
        });
    }
    canvas.into_tile().0
}

/// Dark forest soil: crumbs, fragments, damp patches.
fn humus(p: Vec2x16, seed: u32) -> Texels {
    let broad = fbm(p, IVec2::splat(5), 4, 0.55, seed);
    let crumbs = fbm(p, IVec2::splat(90), 3, 0.6, seed ^ 0x10);
    let tone = 1.0 + 0.35 * broad + 0.45 * crumbs;
    Texels {
        albedo: rgb(0.073, 0.052, 0.034) * tone.max(0.2),
        height: 0.004 * crumbs + 0.004 * broad,
    }
}

/// Leaf litter, of the stand's own leaves.
pub(crate) fn leaf_litter(fallen: &FallenFoliage, key: Key) -> Tile {
    let seed = key.to_u64() as u32;
    let soil = Tile::bake(FLOOR_TEXELS, FLOOR_TEXELS, |p| humus(p, seed));
    let debris = Debris {
        leaves: 620.0,
        leaf_scale: 1.0,
        needles: 350.0,
        twigs: 16.0,
        grass: 4.0,
    };
    let mut tile = strew(soil, FLOOR_M, debris, fallen, key);
    tile.darken_hollows(5, 0.010, 1.2);
    tile.with_luminance_of(Vec3::new(0.132, 0.085, 0.058))
}

/// Needle litter under conifers.
pub(crate) fn needle_litter(fallen: &FallenFoliage, key: Key) -> Tile {
    let seed = key.to_u64() as u32;
    let soil = Tile::bake(FLOOR_TEXELS, FLOOR_TEXELS, |p| humus(p, seed));
    let debris = Debris {
        leaves: 14.0,
        leaf_scale: 0.9,
        needles: 3200.0,
        twigs: 22.0,
        grass: 3.0,
    };
    let mut tile = strew(soil, FLOOR_M, debris, fallen, key);
    tile.darken_hollows(5, 0.007, 0.9);
    let tile = tile.recolour(|p, t| {
        // Drifts of older, darker needles.
        let drift = fbm(p, IVec2::splat(4), 4, 0.5, seed ^ 0x77);
        t.albedo * (1.0 + 0.45 * drift)
    });
    tile.with_luminance_of(Vec3::new(0.160, 0.090, 0.053))
}

/// Moss cushions, bare humus and scattered litter.
pub(crate) fn moss_and_soil(fallen: &FallenFoliage, key: Key) -> Tile {
    let seed = key.to_u64() as u32;
    let ground = Tile::bake(FLOOR_TEXELS, FLOOR_TEXELS, |p| {
        let soil = humus(p, seed);
        let q = warp(p, IVec2::splat(9), (0.03, 0.03), seed ^ 0x21);
        let field = fbm(q, IVec2::splat(6), 5, 0.55, seed ^ 0x22);
        let there = smoothstep(-0.12, 0.08, field);
        let cushions = worley(q, IVec2::splat(70), 1.0, seed ^ 0x23);
        let fine = value(p, IVec2::splat(320), seed ^ 0x24);
        let dome = (1.0 - cushions.f1).max(0.0);
        let tone = (0.55 + 0.6 * dome) * (0.75 + 0.5 * fine);
        let dark = rgb(0.042, 0.060, 0.021);
        let light = rgb(0.076, 0.092, 0.033);
        let moss = dark.lerp(light, unit(cushions.id) * 0.6 + 0.4 * (0.5 + field)) * tone;
        Texels {
            albedo: soil.albedo.lerp(moss, there),
            height: soil.height + there * (0.006 + 0.012 * dome),
        }
    });
    let debris = Debris {
        leaves: fallen.scattered(110.0),
        leaf_scale: 0.95,
        needles: 420.0,
        twigs: 18.0,
        grass: 60.0,
    };
    let mut tile = strew(ground, FLOOR_M, debris, fallen, key);
    tile.darken_hollows(6, 0.010, 0.8);
    tile.with_luminance_of(Vec3::new(0.082, 0.076, 0.042))
}

/// A freshly cut or filled slope: mineral soil, stones, root ends, wash lines.
pub(crate) fn bare_soil(fallen: &FallenFoliage, key: Key) -> Tile {
    let seed = key.to_u64() as u32;
    let mut tile = Tile::bake(FLOOR_TEXELS, FLOOR_TEXELS, |p| {
        let q = warp(p, IVec2::splat(7), (0.03, 0.03), seed);
        let broad = fbm(q, IVec2::splat(4), 5, 0.55, seed ^ 0x10);
        let clods = worley(q, IVec2::splat(46), 1.0, seed ^ 0x20);
        let crumbs = fbm(p, IVec2::splat(100), 3, 0.6, seed ^ 0x30);
        let wash = ridged(q, IVec2::splat(9), 3, 0.55, seed ^ 0x40);
        let stones = worley(q, IVec2::splat(60), 0.9, seed ^ 0x50);
        let size = 0.12 + 0.38 * unit(stones.id ^ 0xABCD);
        let stone = smoothstep(size, size - 0.08, stones.f1) * unit(stones.id).lt(0.16).indicator();
        let earth = rgb(0.215, 0.148, 0.094).lerp(rgb(0.150, 0.112, 0.080), 0.5 + 0.9 * broad)
            * (1.0 + 0.38 * crumbs + 0.25 * broad)
            * (0.86 + 0.2 * unit(clods.id))
            * (1.0 - 0.22 * smoothstep(0.78, 0.95, wash));
        let grey = rgb(0.19, 0.19, 0.19) * (0.6 + 0.7 * unit(stones.id ^ 0x77));
        Texels {
            albedo: earth.lerp(grey * rgb(1.10, 1.0, 0.86), stone),
            height: 0.010 * (1.0 - clods.f1) + 0.004 * crumbs + 0.012 * stone - 0.01 * wash,
        }
    });
    let debris = Debris {
        leaves: 10.0,
        leaf_scale: 0.8,
        needles: 60.0,
        twigs: 9.0,
        grass: 5.0,
    };
    tile.darken_hollows(7, 0.010, 0.9);
    let rooted = strew(tile, FLOOR_M, debris, fallen, key);
    rooted
        .recolour(|p, t| t.albedo * (1.0 + 0.06 * gradient(p, IVec2::splat(220), seed ^ 0x91)))
        .with_luminance_of(Vec3::new(0.165, 0.120, 0.083))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::Species;

    /// The red of a grey square metre that is strewn with leaves of a species, by texel.
    fn strewn(name: &str) -> Vec<f32> {
        let grey = Tile::bake(256, 256, |_| Texels {
            albedo: Vec3::splat(GREY).into(),
            height: 0.0.into(),
        });
        let debris = Debris {
            leaves: 300.0,
            leaf_scale: 1.0,
            ..Debris::default()
        };
        let species = [Species::built_in(name).expect("is built in")];
        let fallen = FallenFoliage::of(&species, &[1.0]);
        let tile = strew(grey, 1.0, debris, &fallen, Key::world(1));
        tile.texels.iter().map(|texel| texel.albedo.x).collect()
    }

    const GREY: f32 = 0.01;

    #[test]
    fn litter_is_painted_with_the_stands_own_leaves() {
        let beech = strewn("beech");
        assert_eq!(beech, strewn("beech"));
        assert_ne!(beech, strewn("english_oak"));
    }

    #[test]
    fn small_leaves_cover_as_much_ground_as_large_ones() {
        let cover = |name: &str| {
            let texels = strewn(name);
            let covered = texels.iter().filter(|red| **red != GREY).count();
            covered as f64 / texels.len() as f64
        };
        let [beech, birch, oak] = ["beech", "silver_birch", "english_oak"].map(cover);
        assert!((0.2..0.7).contains(&beech), "{beech}");
        for other in [birch, oak] {
            assert!((0.7..1.4).contains(&(other / beech)), "{other} {beech}");
        }
    }
}
