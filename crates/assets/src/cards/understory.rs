//! Foliage of shrubs, ferns, herbs and grasses.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use nemoral_seed::{Draw, Rng};

use super::card_raster::CardDrawing;
use super::foliage::{heading, stalk, varied};
use crate::materials::optics::{BRAMBLE, CURED, EVERGREEN, HERB};
use crate::textures::canvas::{Leaf, Outline, Stroke};
use crate::textures::fallen::FallenLeaf;

/// A leaf with the usual habits; change what differs.
pub(super) fn plain_leaf(
    outline: &Arc<Outline>,
    base: Vec2,
    angle: f32,
    length_m: f32,
    aspect: f32,
) -> Leaf {
    Leaf {
        outline: outline.clone(),
        base,
        direction: heading(angle),
        length_m,
        width_m: length_m * aspect,
        bend: 0.0,
        colour: Vec3::ZERO,
        veins: 0.22,
        browning: 0.1,
        level: 0.0,
    }
}

/// A branch end of gorse: green rods beset with stiff spines, some with flowers.
pub(crate) fn gorse(rng: &mut impl Rng, flowers: bool) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let petal = Arc::new(Outline::ovate(0.8, 0.5));
    let green = Vec3::new(0.062, 0.098, 0.036);
    let main = stalk(0.26, 0.005, green * 0.9, rng);
    drawing.stroke(main);
    let mut rods = vec![main];
    for i in 0..9 {
        let t = 0.08 + 0.86 * i as f32 / 9.0;
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let angle = side * rng.range_f32(0.45, 0.85);
        let from = main.at(t);
        let length = rng.range_f32(0.08, 0.13) * (1.15 - 0.6 * t);
        let rod = Stroke {
            points: [
                from,
                from + 0.5 * length * heading(angle),
                from + length * heading(0.6 * angle),
            ],
            width_m: [0.0035, 0.002],
            colour: [green * 0.8, green],
            level: 0.0,
        };
        rods.push(rod);
    }
    for (k, rod) in rods.iter().enumerate() {
        drawing.stroke(*rod);
        let spines = if k == 0 { 34 } else { 24 };
        let [a, _, c] = rod.points;
        let along = (c - a).normalize_or(Vec2::Y);
        for i in 0..spines {
            let t = (i as f32 + rng.unit_f32()) / spines as f32;
            let from = rod.at(t);
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let out = along.rotate(heading(side * rng.range_f32(0.45, 1.15)).perp() * -1.0);
            let length = rng.range_f32(0.014, 0.032) * (1.1 - 0.4 * t);
            let colour = varied(EVERGREEN.albedo, rng) * rng.range_f32(0.6, 1.1);
            drawing.stroke(Stroke {
                points: [from, from + 0.5 * length * out, from + length * out],
                width_m: [0.0024, 0.0008],
                colour: [colour * 0.75, colour],
                level: 0.0,
            });
        }
        if flowers && k > 0 {
            for _ in 0..rng.below(4) {
                let angle = rng.range_f32(-1.4, 1.4);
                let mut flower = plain_leaf(
                    &petal,
                    rod.at(rng.range_f32(0.45, 0.95)),
                    angle,
                    0.015,
                    0.65,
                );
                flower.colour = Vec3::new(0.56, 0.40, 0.022) * rng.range_f32(0.7, 1.0);
                flower.browning = 0.0;
                flower.veins = 0.0;
                drawing.leaf(flower);
            }
        }
    }
    drawing
}

/// The colour of heather's shoots.
pub(crate) const HEATHER_SHOOT: Vec3 = Vec3::new(0.068, 0.092, 0.040);
/// The colour of its bells.
pub(crate) const HEATHER_BELL: Vec3 = Vec3::new(0.25, 0.11, 0.165);

/// A bundle of heather: upright shoots with scale leaves, some with bells.
pub(crate) fn heather(rng: &mut impl Rng, flowers: bool) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    // All shoots rise from one woody foot.
    let wood = Vec3::new(0.10, 0.075, 0.05);
    drawing.stroke(stalk(0.05, 0.006, wood, rng));
    for i in 0..17 {
        let angle = rng.range_f32(-0.42, 0.42);
        let base = Vec2::new(rng.range_f32(-0.006, 0.006), 0.0);
        let length = rng.range_f32(0.14, 0.27);
        let shade = 0.55 + 0.45 * i as f32 / 17.0;
        let colour = varied(HEATHER_SHOOT, rng) * shade;
        let shoot = Stroke {
            points: [
                base,
                base + 0.5 * length * heading(1.2 * angle),
                base + length * heading(angle),
            ],
            width_m: [0.003, 0.002],
            colour: [wood * shade, colour],
            level: 0.0,
        };
        drawing.stroke(shoot);
        let leaves = 46;
        for k in 0..leaves {
            let t = 0.16 + 0.84 * k as f32 / leaves as f32;
            let side = if k % 2 == 0 { 1.0 } else { -1.0 };
            let out = heading(angle + side * rng.range_f32(0.4, 0.9));
            let from = shoot.at(t);
            if flowers && t > 0.55 && rng.chance(0.42) {
                let colour = HEATHER_BELL * shade * rng.range_f32(0.7, 1.2);
                let tip = from + 0.006 * out;
                drawing.bell(Stroke::straight(from, tip, [0.004, 0.003], colour));
            } else {
                let colour = colour * rng.range_f32(0.75, 1.2);
                let tip = from + 0.0085 * out;
                drawing.stroke(Stroke::straight(from, tip, [0.0025, 0.0012], colour));
            }
        }
    }
    drawing
}

/// A bramble leaf: three, sometimes five, toothed leaflets on a stalk.
pub(crate) fn bramble(rng: &mut impl Rng, autumn: bool) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let outline = Arc::new(Outline::ovate(0.65, 0.75).toothed(13.0, 0.10));
    let petiole = stalk(0.055, 0.0032, Vec3::new(0.10, 0.085, 0.04), rng);
    drawing.stroke(petiole);
    let tip = petiole.at(1.0);
    let five = rng.chance(0.4);
    let spread: &[f32] = if five {
        &[1.75, -1.75, 0.95, -0.95, 0.0]
    } else {
        &[1.25, -1.25, 0.0]
    };
    for &angle in spread {
        let at = if angle == 0.0 {
            tip + Vec2::new(0.0, 0.012)
        } else {
            tip
        };
        let length = rng.range_f32(0.055, 0.075)
            * if angle == 0.0 { 1.15 } else { 1.0 }
            * if angle.abs() > 1.5 { 0.75 } else { 1.0 };
        let mut leaf = plain_leaf(&outline, at, angle + rng.range_f32(-0.1, 0.1), length, 0.66);
        leaf.colour = varied(BRAMBLE.albedo, rng);
        if autumn {
            leaf.colour = leaf
                .colour
                .lerp(Vec3::new(0.17, 0.075, 0.03), rng.range_f32(0.1, 0.5));
        }
        leaf.veins = 0.34;
        leaf.browning = rng.range_f32(0.0, 0.35);
        leaf.bend = rng.range_f32(-0.06, 0.06);
        drawing.stroke(Stroke::straight(
            tip,
            at,
            [0.003; 2],
            Vec3::new(0.10, 0.085, 0.04),
        ));
        drawing.leaf(leaf);
    }
    drawing
}

/// One pinna of a bracken frond: pinnules along a midrib, smaller to the tip.
pub(crate) fn bracken_pinna(rng: &mut impl Rng, brown: bool) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let outline = Arc::new(Outline::ovate(0.30, 0.55).toothed(7.0, 0.28));
    let rib = stalk(0.30, 0.003, Vec3::new(0.13, 0.125, 0.05), rng);
    let colour = if brown {
        Vec3::new(0.215, 0.125, 0.058)
    } else {
        HERB.albedo
    };
    let pairs = 17;
    for i in 0..pairs {
        let t = 0.04 + 0.94 * i as f32 / pairs as f32;
        for side in [-1.0, 1.0] {
            let length = 0.068 * (1.0 - t).max(0.10) * rng.range_f32(0.88, 1.1);
            let angle = side * (1.22 - 0.35 * t + rng.range_f32(-0.06, 0.06));
            let mut leaf = plain_leaf(&outline, rib.at(t), angle, length, 0.34);
            leaf.width_m = leaf.width_m.max(0.012 * (1.0 - 0.7 * t));
            leaf.colour = varied(colour, rng) * (0.82 + 0.2 * t);
            leaf.bend = -side * 0.10;
            leaf.browning = if brown { 0.5 } else { rng.range_f32(0.0, 0.25) };
            leaf.veins = 0.2;
            drawing.leaf(leaf);
        }
    }
    drawing.stroke(rib);
    drawing
}

/// A whole fern frond (male fern), to be cut into slices that an arching frond is bent from.
pub(crate) fn fern_frond(rng: &mut impl Rng) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let outline = Arc::new(Outline::ovate(0.22, 0.75).toothed(15.0, 0.38));
    let rib = Stroke {
        points: [Vec2::ZERO, Vec2::new(0.0, 0.30), Vec2::new(0.0, 0.60)],
        width_m: [0.006, 0.002],
        colour: [Vec3::new(0.13, 0.10, 0.05), Vec3::new(0.10, 0.13, 0.045)],
        level: 0.0,
    };
    let pairs = 23;
    for i in 0..pairs {
        let t = 0.10 + 0.89 * i as f32 / pairs as f32;
        let rise = ((t - 0.10) / 0.28).min(1.0);
        let reach = (0.45 + 0.55 * rise) * ((1.02 - t) / 0.70).min(1.0);
        for side in [-1.0, 1.0] {
            let length = 0.105 * reach * rng.range_f32(0.9, 1.08) + 0.006;
            let angle = side * (1.30 - 0.45 * t + rng.range_f32(-0.05, 0.05));
            let mut leaf = plain_leaf(&outline, rib.at(t), angle, length, 0.23);
            leaf.width_m = leaf.width_m.max(0.014 * (1.05 - t));
            leaf.colour = varied(HERB.albedo, rng) * (0.78 + 0.25 * t);
            leaf.bend = -side * 0.13;
            leaf.browning = rng.range_f32(0.0, 0.2);
            drawing.leaf(leaf);
        }
    }
    drawing.stroke(rib);
    drawing
}

/// A tuft of grass blades; `cured` is the share of dead blades, `heads` adds flowering stalks.
pub(crate) fn grass(rng: &mut impl Rng, cured: f64, heads: bool) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let blades = rng.between(40, 48);
    for i in 0..blades {
        let front = i as f32 / blades as f32;
        let x = rng.range_f32(-0.05, 0.05);
        let base = Vec2::new(x, -0.004);
        let lean = 3.5 * x + rng.range_f32(-0.26, 0.26);
        let length = rng.range_f32(0.14, 0.34);
        let droop = lean * rng.range_f32(1.2, 2.2);
        let middle = base + 0.55 * length * heading(-lean);
        let tip = middle + 0.5 * length * heading(-droop);
        let dead = rng.chance(cured);
        let colour = if dead {
            varied(CURED.albedo, rng) * 0.72
        } else {
            varied(HERB.albedo, rng)
        } * (0.62 + 0.42 * front);
        let width = rng.range_f32(0.0042, 0.0072);
        drawing.stroke(Stroke {
            points: [base, middle, tip],
            width_m: [width, 0.0010],
            colour: [colour * 0.55, colour * 1.05],
            level: 0.0,
        });
    }
    if heads {
        for _ in 0..4 {
            let lean = rng.range_f32(-0.22, 0.22);
            let length = rng.range_f32(0.34, 0.46);
            let straw = varied(Vec3::new(0.24, 0.19, 0.095), rng);
            let stem = Stroke {
                points: [
                    Vec2::ZERO,
                    0.5 * length * heading(-0.5 * lean),
                    length * heading(-lean),
                ],
                width_m: [0.0022, 0.0016],
                colour: [straw * 0.6, straw],
                level: 0.0,
            };
            drawing.stroke(stem);
            for k in 0..26 {
                let t = 0.74 + 0.26 * k as f32 / 26.0;
                let out = heading(-lean + if k % 2 == 0 { 0.5 } else { -0.5 });
                let from = stem.at(t);
                drawing.stroke(Stroke::straight(
                    from,
                    from + 0.012 * out,
                    [0.0034, 0.0018],
                    straw * rng.range_f32(0.7, 1.1),
                ));
            }
        }
    }
    // All blades start in one foot, so that the image is attached.
    drawing.stroke(Stroke::straight(
        Vec2::ZERO,
        Vec2::new(0.0, 0.10),
        [0.006, 0.002],
        HERB.albedo * 0.6,
    ));
    drawing
}

/// Broad basal leaves on their stalks (plantain, dock, primrose): one in front of two.
pub(crate) fn broad_leaf(rng: &mut impl Rng) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let outline = Arc::new(Outline::ovate(0.75, 0.62));
    let length = rng.range_f32(0.10, 0.14);
    let aspect = rng.range_f32(0.34, 0.46);
    for (angle, size) in [(0.75, 0.8), (-0.75, 0.85), (0.0, 1.0)] {
        let angle = angle + rng.range_f32(-0.12, 0.12);
        let out = heading(angle);
        let from = 0.035 * size * out;
        drawing.stroke(Stroke::straight(
            Vec2::ZERO,
            from,
            [0.004, 0.003],
            Vec3::new(0.11, 0.125, 0.05),
        ));
        let mut leaf = plain_leaf(
            &outline,
            from,
            angle,
            length * size * rng.range_f32(0.9, 1.1),
            aspect,
        );
        leaf.colour = varied(HERB.albedo, rng);
        leaf.bend = -0.12 * angle + rng.range_f32(-0.08, 0.08);
        leaf.veins = 0.30;
        leaf.browning = rng.range_f32(0.0, 0.40);
        drawing.leaf(leaf);
    }
    // The stalks meet in one foot.
    drawing.stroke(Stroke::straight(
        Vec2::ZERO,
        Vec2::new(0.0, 0.03),
        [0.005, 0.003],
        Vec3::new(0.11, 0.125, 0.05),
    ));
    drawing
}

/// An upright stem with pairs of leaves and perhaps a few small flowers.
pub(crate) fn leafy_stem(rng: &mut impl Rng, flowers: bool) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let outline = Arc::new(Outline::ovate(0.6, 0.9).toothed(9.0, 0.12));
    let petal = Arc::new(Outline::ovate(0.7, 0.3));
    let stem = stalk(0.30, 0.0038, Vec3::new(0.10, 0.115, 0.045), rng);
    drawing.stroke(stem);
    let pairs = 7;
    for i in 0..pairs {
        let t = 0.10 + 0.86 * i as f32 / pairs as f32;
        for side in [-1.0, 1.0] {
            let angle = side * (1.15 - 0.5 * t + rng.range_f32(-0.2, 0.2));
            let length = rng.range_f32(0.055, 0.08) * (1.15 - 0.65 * t);
            let mut leaf = plain_leaf(&outline, stem.at(t), angle, length, 0.46);
            leaf.colour = varied(HERB.albedo, rng) * (0.75 + 0.28 * t);
            leaf.bend = -side * rng.range_f32(-0.05, 0.2);
            leaf.browning = rng.range_f32(0.0, 0.3);
            drawing.leaf(leaf);
        }
    }
    if flowers {
        let white = rng.chance(0.5);
        for _ in 0..3 {
            let at =
                stem.at(rng.range_f32(0.86, 1.0)) + Vec2::new(rng.range_f32(-0.025, 0.025), 0.0);
            for k in 0..5 {
                let mut leaf = plain_leaf(&petal, at, k as f32 * 0.4 * PI, 0.009, 0.7);
                leaf.colour = if white {
                    Vec3::new(0.50, 0.50, 0.44)
                } else {
                    Vec3::new(0.52, 0.38, 0.03)
                };
                leaf.veins = 0.0;
                leaf.browning = 0.0;
                drawing.leaf(leaf);
            }
        }
    }
    drawing
}

/// A clover or wood-sorrel: three rounded leaflets on a thin stalk.
pub(crate) fn trefoil(rng: &mut impl Rng) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let outline = Arc::new(Outline::ovate(0.85, 0.42));
    let petiole = stalk(0.028, 0.002, Vec3::new(0.10, 0.12, 0.045), rng);
    drawing.stroke(petiole);
    for k in 0..3 {
        let angle = (k as f32 - 1.0) * 2.0 * PI / 3.0 * 0.92;
        let mut leaf = plain_leaf(
            &outline,
            petiole.at(1.0),
            angle,
            rng.range_f32(0.022, 0.028),
            0.80,
        );
        leaf.colour = varied(HERB.albedo, rng);
        leaf.veins = 0.25;
        drawing.leaf(leaf);
    }
    drawing
}

/// A fallen leaf of a kind.
pub(crate) fn fallen_leaf(rng: &mut impl Rng, of: &FallenLeaf) -> CardDrawing {
    let mut drawing = CardDrawing::default();
    let length = rng.range_f32(of.length_m[0], of.length_m[1]);
    let aspect = rng.range_f32(of.width_ratio[0], of.width_ratio[1]);
    let petiole = stalk(0.012, 0.002, Vec3::new(0.10, 0.07, 0.045), rng);
    drawing.stroke(petiole);
    let mut leaf = plain_leaf(&of.outline, petiole.at(0.9), 0.0, length, aspect);
    let tones = [
        Vec3::new(0.19, 0.115, 0.068),
        Vec3::new(0.149, 0.089, 0.060),
        Vec3::new(0.21, 0.15, 0.10),
    ];
    leaf.colour = varied(tones[rng.below(3) as usize], rng);
    leaf.bend = rng.range_f32(-0.25, 0.25);
    leaf.browning = 0.5;
    leaf.veins = 0.25;
    drawing.leaf(leaf);
    drawing
}
