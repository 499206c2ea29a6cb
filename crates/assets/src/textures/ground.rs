//! The forest floor, on tiles of 4 m, and the faces of cuttings.

use std::sync::Arc;

use glam::{IVec2, Vec2, Vec3};
use nemoral_seed::{Draw, Key, Rng};

use super::canvas::{Canvas, Leaf, Outline, Stroke};
use super::noise::{fbm, gradient, ridged, smoothstep, unit, value, warp, worley};
use super::tile::{Texels, Tile};
use crate::lanes::{Vec2x16, rgb};
use crate::tree::Species;

/// Texels along a side of the floor's tiles.
pub(crate) const FLOOR_TEXELS: usize = 1024;
/// Metres along a side of the floor's tiles.
pub(crate) const FLOOR_M: f32 = 4.0;

/// A unit vector in a uniform direction, by rejection: no trigonometry.
pub(crate) fn direction(rng: &mut impl Rng) -> Vec2 {
    loop {
        let p = Vec2::new(rng.range_f32(-1.0, 1.0), rng.range_f32(-1.0, 1.0));
        let l = p.length_squared();
        if (1e-4..=1.0).contains(&l) {
            return p / l.sqrt();
        }
    }
}

fn anywhere(rng: &mut impl Rng, size_m: f32) -> Vec2 {
    Vec2::new(rng.range_f32(0.0, size_m), rng.range_f32(0.0, size_m))
}

/// What lies on a tile, and how much of it, pieces per m².
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Debris {
    pub(crate) leaves: f32,
    /// Leaf length relative to a whole leaf: trodden leaves are broken.
    pub(crate) leaf_scale: f32,
    pub(crate) needles: f32,
    pub(crate) twigs: f32,
    pub(crate) grass: f32,
}

/// The fallen needles of a stand's conifers.
#[derive(Clone, Debug)]
pub(crate) struct FallenNeedles {
    /// The least and the greatest length of each species' needles, and their width, metres.
    kinds: Vec<([f32; 2], f32)>,
}

impl FallenNeedles {
    /// Those of the species that have any; bits of twigs and stalks of leaves if none has.
    pub(crate) fn of(species: &[Species]) -> Self {
        let conifers = species.iter().filter(|s| s.leaves.kind.is_needle());
        let mut kinds: Vec<_> = conifers
            .map(|s| {
                let length_m = s.leaves.length_m.map(|m| m as f32);
                let ratio = s.leaves.width_ratio.map(|r| r as f32);
                (
                    length_m,
                    0.25 * (length_m[0] + length_m[1]) * (ratio[0] + ratio[1]),
                )
            })
            .collect();
        if kinds.is_empty() {
            kinds.push(([0.015, 0.05], 0.0015));
        }
        Self { kinds }
    }

    /// How many more of them cover the ground than of the long needles of maritime pine.
    fn density(&self) -> f32 {
        const LONG_M: f32 = 0.12;
        let means = self.kinds.iter().map(|(m, _)| 0.5 * (m[0] + m[1]));
        let mean_m = means.sum::<f32>() / self.kinds.len() as f32;
        (LONG_M / mean_m).clamp(1.0, 6.0)
    }

    fn scatter(&self, canvas: &mut Canvas, size_m: f32, count: u32, rng: &mut impl Rng) {
        for i in 0..count {
            let (lengths_m, width_m) = *rng.choose(&self.kinds);
            let from = anywhere(rng, size_m);
            let along = direction(rng);
            let length = rng.range_f32(lengths_m[0], lengths_m[1]);
            let side = along.perp() * length * rng.range_f32(-0.1, 0.1);
            let age = 1.0 - i as f32 / count as f32;
            let fresh =
                Vec3::new(0.225, 0.120, 0.062).lerp(Vec3::new(0.24, 0.165, 0.105), rng.unit_f32());
            let colour =
                fresh.lerp(Vec3::new(0.085, 0.055, 0.037), 0.75 * age) * rng.range_f32(0.7, 1.2);
            let width_m = width_m.clamp(0.0012, 0.0025);
            canvas.stroke(&Stroke {
                points: Stroke::bowed(from, length * along, side),
                width_m: [width_m, 0.6 * width_m],
                colour: [colour; 2],
                level: 0.012 * (1.0 - age),
            });
        }
    }
}

/// Fallen leaf colours, from just fallen to rotten.
const LEAVES: [Vec3; 6] = [
    Vec3::new(0.235, 0.150, 0.090),
    Vec3::new(0.190, 0.105, 0.058),
    Vec3::new(0.150, 0.089, 0.060),
    Vec3::new(0.215, 0.165, 0.115),
    Vec3::new(0.120, 0.072, 0.045),
    Vec3::new(0.085, 0.058, 0.040),
];

/// Strews a tile with leaves, needles, twigs and grass.
pub(crate) fn strew(
    tile: Tile,
    size_m: f32,
    debris: Debris,
    fallen: &FallenNeedles,
    key: Key,
) -> Tile {
    let mut rng = key.rng();
    let count = |per_m2: f32| (per_m2 * size_m * size_m) as u32;
    let outlines = [
        Outline::lobed(4.5, 0.42),
        Outline::ovate(0.9, 0.8),
        Outline::ovate(0.6, 1.1),
        Outline::lobed(4.0, 0.5),
    ]
    .map(Arc::new);
    let mut canvas = Canvas::over(tile, Vec2::splat(size_m));
    // Needles lie under, between and over the leaves.
    let needles = count(debris.needles * fallen.density());
    fallen.scatter(&mut canvas, size_m, needles / 2, &mut rng);
    let leaves = count(debris.leaves);
    for i in 0..leaves {
        let kind = rng.below(4) as usize;
        let age = 1.0 - i as f32 / leaves as f32;
        let pick = LEAVES[rng.below(6) as usize];
        let colour = pick.lerp(LEAVES[5], 0.7 * age) * rng.range_f32(0.75, 1.25);
        let (length, aspect) = match kind {
            2 => (rng.range_f32(0.09, 0.17), 0.19),
            1 => (rng.range_f32(0.04, 0.08), 0.58),
            _ => (rng.range_f32(0.06, 0.12), 0.56),
        };
        // Curled leaves are narrower.
        let aspect = aspect * rng.range_f32(0.55, 1.0);
        canvas.leaf(&Leaf {
            outline: outlines[kind].clone(),
            base: anywhere(&mut rng, size_m),
            direction: direction(&mut rng),
            length_m: length * debris.leaf_scale,
            width_m: length * debris.leaf_scale * aspect,
            bend: rng.range_f32(-0.35, 0.35),
            colour,
            veins: 0.16,
            browning: rng.range_f32(0.0, 0.4),
            level: 0.02 * (1.0 - age),
        });
    }
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
    fallen.scatter(&mut canvas, size_m, needles - needles / 2, &mut rng);
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

/// Leaf litter of a mixed forest.
pub(crate) fn leaf_litter(fallen: &FallenNeedles, key: Key) -> Tile {
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
pub(crate) fn needle_litter(fallen: &FallenNeedles, key: Key) -> Tile {
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
pub(crate) fn moss_and_soil(fallen: &FallenNeedles, key: Key) -> Tile {
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
        leaves: 110.0,
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
pub(crate) fn bare_soil(fallen: &FallenNeedles, key: Key) -> Tile {
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

    #[test]
    fn needles_are_as_long_as_the_stands() {
        let named = |name: &str| Species::built_in(name).expect("is built in");
        let spruce = FallenNeedles::of(&[named("norway_spruce"), named("beech")]);
        assert_eq!(spruce.kinds.len(), 1);
        assert!(spruce.kinds[0].0[1] < 0.03 && spruce.density() > 5.0);
        let pine = FallenNeedles::of(&[named("maritime_pine")]);
        assert!(pine.kinds[0].0[0] > 0.1 && pine.density() < 1.2);
        let none = FallenNeedles::of(&[named("beech")]);
        assert!(none.kinds[0].0[1] <= 0.05);
    }
}
