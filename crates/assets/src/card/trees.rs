//! Foliage of the trees (`reference/vegetation.md` sections 1.4 and 3.2).

use std::sync::Arc;

use glam::{Vec2, Vec3};
use nemoral_seed::{Draw, Rng};

use super::sketch::Sketch;
use crate::optics::{EUCALYPT, OAK, PINE};
use crate::texture::canvas::{Leaf, Outline, Stroke};

/// The unit vector `angle` radians to the left of +y.
pub(crate) fn heading(angle: f32) -> Vec2 {
    let a = f64::from(angle);
    Vec2::new(-libm::sin(a) as f32, libm::cos(a) as f32)
}

/// A leaf colour varied as leaves vary: hue by ±4°, value by ±15 % (section 3.2).
pub(crate) fn varied(colour: Vec3, rng: &mut impl Rng) -> Vec3 {
    let hue = rng.range_f32(-1.0, 1.0);
    // Towards yellow, red and green rise together; towards blue-green red falls.
    let tint = Vec3::new(1.0 + 0.14 * hue, 1.0 + 0.02 * hue, 1.0 - 0.12 * hue);
    colour * tint * rng.range_f32(0.85, 1.15)
}

/// An upright twig from the origin with a slight bend.
pub(crate) fn stalk(length_m: f32, width_m: f32, colour: Vec3, rng: &mut impl Rng) -> Stroke {
    let tip = Vec2::new(rng.range_f32(-0.06, 0.06) * length_m, length_m);
    Stroke {
        points: [Vec2::ZERO, Vec2::new(-0.5 * tip.x, 0.5 * length_m), tip],
        width_m: [width_m, 0.6 * width_m],
        colour: [colour, colour * 1.1],
        level: 0.0,
    }
}

/// A tuft of maritime pine: pairs of stiff needles of 13-21 cm around the end of a shoot.
pub(crate) fn pine(rng: &mut impl Rng) -> Sketch {
    let mut sketch = Sketch::default();
    let shoot = stalk(0.13, 0.009, Vec3::new(0.155, 0.105, 0.068), rng);
    let pairs = rng.between(74, 92);
    for i in 0..pairs {
        // The shoot is drawn once half of the needles are behind it.
        if i == pairs / 2 {
            sketch.twig(shoot);
        }
        let front = i as f32 / pairs as f32;
        let t = rng.unit_f32();
        let base = shoot.at(0.12 + 0.88 * t);
        let spread = 1.42 - 0.95 * t;
        let angle = rng.range_f32(-1.0, 1.0) * spread;
        let length = rng.range_f32(0.12, 0.20) * (1.0 - 0.25 * angle.abs() / 1.4);
        let shade = 0.50 + 0.5 * front;
        let old = rng.chance(0.035);
        let green = if old {
            Vec3::new(0.20, 0.125, 0.06)
        } else {
            varied(PINE.albedo, rng)
        };
        for side in [-1.0, 1.0] {
            let a = angle + side * rng.range_f32(0.01, 0.06);
            let tip = base + length * heading(a * 0.86);
            let middle = base + 0.5 * length * heading(a * 1.1);
            sketch.blade(Stroke {
                points: [base, middle, tip],
                width_m: [0.0022, 0.0012],
                colour: [green * 0.72 * shade, green * shade],
                level: 0.0,
            });
        }
    }
    sketch
}

/// A hanging twig of eucalypt: sickle leaves of 11-20 cm that all turn to the tip.
pub(crate) fn eucalypt(rng: &mut impl Rng) -> Sketch {
    let mut sketch = Sketch::default();
    let outlines = [Outline::ovate(0.6, 1.1), Outline::ovate(0.7, 0.9)].map(Arc::new);
    let twig = stalk(0.30, 0.006, Vec3::new(0.19, 0.125, 0.080), rng);
    let count = rng.between(13, 17);
    let mut leaves: Vec<(f32, Vec2, Leaf)> = (0..count)
        .map(|i| {
            let t = (i as f32 + rng.range_f32(0.2, 0.8)) / count as f32;
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let angle = side * rng.range_f32(0.18, 0.85) * (1.05 - 0.45 * t);
            let node = twig.at(0.10 + 0.9 * t);
            let direction = heading(angle);
            let length = rng.range_f32(0.11, 0.20) * (1.0 - 0.25 * t);
            // Young leaves at the tip are reddish, old ones glaucous.
            let mut colour = varied(EUCALYPT.albedo, rng);
            colour = colour.lerp(Vec3::new(0.30, 0.34, 0.33) * 0.5, rng.range_f32(0.05, 0.28));
            if t > 0.88 {
                colour = colour.lerp(Vec3::new(0.15, 0.10, 0.045), 0.35);
            }
            let depth = rng.unit_f32();
            let leaf = Leaf {
                outline: outlines[i as usize % 2].clone(),
                base: node + 0.018 * direction,
                direction,
                length_m: length,
                width_m: length * rng.range_f32(0.16, 0.22),
                // The sickle turns in towards the twig's tip.
                bend: -side * rng.range_f32(0.10, 0.38),
                colour: colour * (0.62 + 0.42 * depth),
                veins: 0.22,
                browning: rng.range_f32(0.0, 0.25),
                level: 0.0,
            };
            (depth, node, leaf)
        })
        .collect();
    leaves.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (i, (_, node, leaf)) in leaves.into_iter().enumerate() {
        if i as u32 == count / 2 {
            sketch.twig(twig);
        }
        sketch.twig(Stroke::straight(
            node,
            leaf.base,
            [0.0022; 2],
            Vec3::new(0.16, 0.12, 0.06),
        ));
        sketch.leaf(leaf);
    }
    sketch
}

/// A rosette of English oak: lobed leaves of 7-12 cm around the end of a twig.
pub(crate) fn oak(rng: &mut impl Rng) -> Sketch {
    let mut sketch = Sketch::default();
    let outlines = [Outline::lobed(4.5, 0.45), Outline::lobed(5.2, 0.40)].map(Arc::new);
    let twig = stalk(0.11, 0.006, Vec3::new(0.125, 0.098, 0.072), rng);
    sketch.twig(twig);
    let count = rng.between(9, 11);
    for i in 0..count {
        let front = i as f32 / count as f32;
        // Outer leaves are drawn first and point away; the last ones stand in front.
        let t = if i < 3 {
            rng.range_f32(0.35, 0.75)
        } else {
            rng.range_f32(0.85, 1.0)
        };
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let angle = side * (1.75 - 1.5 * front + rng.range_f32(-0.25, 0.25)).max(0.05);
        let direction = heading(angle);
        let base = twig.at(t);
        let length = rng.range_f32(0.075, 0.12) * (1.0 - 0.2 * front);
        let mut colour = varied(OAK.albedo, rng) * (0.68 + 0.36 * front);
        if rng.chance(0.12) {
            colour = colour.lerp(Vec3::new(0.16, 0.14, 0.035), 0.5);
        }
        sketch.leaf(Leaf {
            outline: outlines[rng.below(2) as usize].clone(),
            base: base + 0.006 * direction,
            direction,
            length_m: length,
            width_m: length * rng.range_f32(0.50, 0.62),
            bend: rng.range_f32(-0.16, 0.16),
            colour,
            veins: 0.26,
            browning: rng.range_f32(0.0, 0.3),
            level: 0.0,
        });
    }
    sketch
}
