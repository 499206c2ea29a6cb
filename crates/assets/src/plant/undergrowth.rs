//! Patches of grass, herbs and ferns, and the tufts and mats that grow on trails.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use nemoral_seed::{Draw, Rng};

use super::shape::{Shape, around, leaning};
use crate::materials::WorldMaterials;

/// How deep every plant is set into the ground, so that none floats above rough ground.
pub(crate) const SUNK_M: f32 = 0.03;

/// Points in a disc, at least `spacing_m` apart as far as there is room, some of them clumped.
pub(crate) fn scatter(count: u32, radius_m: f32, spacing_m: f32, rng: &mut impl Rng) -> Vec<Vec2> {
    let mut points: Vec<Vec2> = Vec::new();
    let mut tries = 12 * count;
    while (points.len() as u32) < count && tries > 0 {
        tries -= 1;
        let p = if points.is_empty() || rng.chance(0.6) {
            let r = radius_m * rng.unit_f32().sqrt();
            around(rng.range_f32(0.0, TAU)).truncate() * r
        } else {
            let near = *rng.choose(&points);
            let r = spacing_m * rng.range_f32(1.0, 2.2);
            near + around(rng.range_f32(0.0, TAU)).truncate() * r
        };
        if p.length() <= radius_m && points.iter().all(|q| q.distance(p) >= spacing_m) {
            points.push(p);
        }
    }
    points
}

/// How far untrodden blades lean, radians: the least and the most.
const UPRIGHT: [f32; 2] = [0.05, 0.55];

/// A tuft of grass: images of blades around a foot, leaning out.
fn tuft(
    shape: &mut Shape,
    foot: Vec2,
    cards: u32,
    lean: [f32; 2],
    scale: f32,
    materials: &WorldMaterials,
    rng: &mut impl Rng,
) {
    let turn = rng.range_f32(0.0, TAU);
    for i in 0..cards {
        let azimuth = turn + TAU * (i as f32 + rng.range_f32(-0.3, 0.3)) / cards as f32;
        let out = around(azimuth);
        let base = foot.extend(-SUNK_M) + out * rng.range_f32(0.0, 0.025);
        let along = leaning(azimuth, rng.range_f32(lean[0], lean[1]));
        // The flat side faces partly outwards, partly along the rim, so that no view is all edges.
        let across = around(azimuth + rng.range_f32(0.9, 2.2));
        let size = scale * rng.range_f32(0.8, 1.2);
        let (heads, blades) = materials
            .grass
            .split_last()
            .expect("there are cards of grass");
        let card = if rng.chance(0.05) {
            heads
        } else {
            rng.choose(blades)
        };
        shape.card(card, base, along, across, size);
    }
}

/// A patch of grass; `variant` runs from sparse and low to dense and tall.
pub(crate) fn grass(variant: u32, materials: &WorldMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    let lush = (variant % 4) as f32 / 3.0;
    let tufts = 14 + (34.0 * lush) as u32 + rng.below(10);
    let scale = rng.range_f32(0.55, 0.8) + 0.45 * lush;
    for foot in scatter(tufts, 0.75, 0.06, rng) {
        let edge = 1.0 - 0.35 * foot.length() / 0.75;
        tuft(
            &mut shape,
            foot,
            4 + rng.below(3),
            UPRIGHT,
            scale * edge * rng.range_f32(0.7, 1.15),
            materials,
            rng,
        );
    }
    shape
}

/// A patch of herbs: rosettes of broad leaves, leafy stems, trefoils; variants weigh them
/// differently.
pub(crate) fn herbs(variant: u32, materials: &WorldMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    let weights = match variant % 4 {
        0 => [0.7, 0.2, 0.1],
        1 => [0.1, 0.75, 0.15],
        2 => [0.1, 0.15, 0.75],
        _ => [0.35, 0.35, 0.3],
    };
    let plants = 16 + rng.below(14);
    for foot in scatter(plants, 0.65, 0.05, rng) {
        match rng.weighted(&weights) {
            Some(0) => rosette(&mut shape, foot, [0.7, 1.35], materials, rng),
            Some(1) => stems(&mut shape, foot, materials, rng),
            _ => trefoils(&mut shape, foot, [0.8, 1.3], materials, rng),
        }
    }
    shape
}

/// A rosette of broad leaves. `sizes` are the least and the greatest scale of the images.
fn rosette(
    shape: &mut Shape,
    foot: Vec2,
    sizes: [f32; 2],
    materials: &WorldMaterials,
    rng: &mut impl Rng,
) {
    let leaves = 6 + rng.below(5);
    let turn = rng.range_f32(0.0, TAU);
    let kind = rng.choose(&materials.broad_leaf);
    let size = rng.range_f32(sizes[0], sizes[1]);
    for i in 0..leaves {
        let azimuth = turn + 2.4 * i as f32;
        let along = leaning(azimuth, rng.range_f32(0.55, 1.30));
        let across = along.cross(Vec3::Z) + 0.25 * rng.range_f32(-1.0, 1.0) * Vec3::Z;
        let base = foot.extend(-0.5 * SUNK_M) + 0.01 * around(azimuth);
        shape.card(kind, base, along, across, size * rng.range_f32(0.75, 1.15));
    }
}

fn stems(shape: &mut Shape, foot: Vec2, materials: &WorldMaterials, rng: &mut impl Rng) {
    for _ in 0..2 + rng.below(3) {
        let kind = rng.choose(&materials.leafy_stem);
        let azimuth = rng.range_f32(0.0, TAU);
        let base = foot.extend(-SUNK_M) + around(azimuth) * rng.range_f32(0.0, 0.03);
        let along = leaning(azimuth, rng.range_f32(0.0, 0.45));
        let size = rng.range_f32(0.55, 1.25);
        // Two images at right angles: pairs of leaves are crossed on real stems too.
        let across = around(rng.range_f32(0.0, TAU));
        shape.card(kind, base, along, across, size);
        shape.card(
            kind,
            base,
            along,
            across.cross(along),
            size * rng.range_f32(0.9, 1.0),
        );
    }
}

fn trefoils(
    shape: &mut Shape,
    foot: Vec2,
    sizes: [f32; 2],
    materials: &WorldMaterials,
    rng: &mut impl Rng,
) {
    for _ in 0..6 + rng.below(6) {
        let azimuth = rng.range_f32(0.0, TAU);
        let at = foot + around(azimuth).truncate() * 0.11 * rng.unit_f32().sqrt();
        let height = rng.range_f32(0.025, 0.075);
        // The leaf spreads level on top of its stalk.
        let along = leaning(azimuth, rng.range_f32(0.95, 1.45));
        let across = along.cross(Vec3::Z) + 0.3 * rng.range_f32(-1.0, 1.0) * Vec3::Z;
        let size = rng.range_f32(sizes[0], sizes[1]);
        shape.card(
            rng.choose(&materials.trefoil),
            at.extend(height),
            along,
            across,
            size,
        );
        shape.tube(
            &[at.extend(-SUNK_M), at.extend(height)],
            &[0.0012, 0.0009],
            3,
            materials.herb_stalk,
        );
    }
}

/// A patch of bracken: arching stalks that carry pairs of pinnae, some of them last year's.
pub(crate) fn bracken(materials: &WorldMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    let fronds = 8 + rng.below(7);
    let tall = rng.range_f32(0.75, 1.40);
    for foot in scatter(fronds, 0.65, 0.12, rng) {
        let dead = rng.chance(0.14);
        let length = tall * rng.range_f32(0.7, 1.15);
        let azimuth = rng.range_f32(0.0, TAU);
        let arch = rng.range_f32(1.35, 1.85) + if dead { 0.5 } else { 0.0 };
        bracken_frond(
            &mut shape, foot, azimuth, length, arch, dead, materials, rng,
        );
    }
    shape
}

/// One frond: bare below, then pairs of pinnae, longest first, in the plane of its arch.
#[expect(clippy::too_many_arguments, reason = "a frond is these numbers")]
pub(crate) fn bracken_frond(
    shape: &mut Shape,
    foot: Vec2,
    azimuth: f32,
    length: f32,
    arch: f32,
    dead: bool,
    materials: &WorldMaterials,
    rng: &mut impl Rng,
) {
    let line = arched(foot.extend(-SUNK_M), azimuth, length, 0.10, arch, 9);
    let radii: Vec<f32> = (0..9)
        .map(|i| 0.0045 * length * (1.15 - 0.11 * i as f32))
        .collect();
    shape.tube(&line, &radii, 4, materials.frond_stalk);
    let cards = if dead {
        &materials.bracken_dead
    } else {
        &materials.bracken
    };
    let pairs = 9;
    for i in 0..pairs {
        let t = 0.30 + 0.66 * i as f32 / (pairs - 1) as f32;
        let (at, along) = on_line(&line, t);
        let side = around(azimuth + 0.25 * TAU);
        let up = side.cross(along).normalize_or(Vec3::Z);
        let size = (0.36 * length / 0.30) * (1.08 - t) / 0.78 * rng.range_f32(0.9, 1.1);
        for sign in [-1.0, 1.0] {
            let lift = rng.range_f32(0.02, 0.22) - if dead { 0.5 } else { 0.0 };
            let out = side * sign + along * rng.range_f32(0.25, 0.5) + up * lift;
            shape.card(rng.choose(cards), at, out, along, size.max(0.12));
        }
    }
    let (tip, along) = on_line(&line, 0.96);
    let side = around(azimuth + 0.25 * TAU);
    shape.card(rng.choose(cards), tip, along, side, 0.35 * length);
}

/// A patch of male ferns: one to three shuttlecocks of arching fronds.
pub(crate) fn male_fern(materials: &WorldMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    let plants = 1 + rng.below(3);
    for foot in scatter(plants, 0.40, 0.30, rng) {
        let fronds = 10 + rng.below(5);
        let turn = rng.range_f32(0.0, TAU);
        let size = rng.range_f32(0.75, 1.25);
        for i in 0..fronds {
            let azimuth = turn + TAU * (i as f32 + rng.range_f32(-0.3, 0.3)) / fronds as f32;
            let frond = rng.choose(&materials.fronds);
            let scale = size * rng.range_f32(0.75, 1.15);
            let mut tilt = rng.range_f32(0.25, 0.65);
            let mut base = foot.extend(-SUNK_M) + 0.02 * around(azimuth);
            let side = around(azimuth + 0.25 * TAU) + 0.15 * rng.range_f32(-1.0, 1.0) * Vec3::Z;
            for slice in frond {
                let along = leaning(azimuth, tilt);
                shape.card(slice, base, along, side, scale);
                base += along * slice.height_m * scale;
                tilt += rng.range_f32(0.22, 0.50);
            }
        }
    }
    shape
}

/// What grows on trails: grass, trodden grass, plantain, clover with some blades.
pub(crate) fn trail_tuft(variant: u32, materials: &WorldMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    match variant % 4 {
        0 => {
            let scale = rng.range_f32(0.30, 0.65);
            for foot in scatter(1 + rng.below(4), 0.09, 0.03, rng) {
                let cards = 4 + rng.below(4);
                tuft(&mut shape, foot, cards, UPRIGHT, scale, materials, rng);
            }
        }
        1 => {
            let scale = rng.range_f32(0.35, 0.75);
            for foot in scatter(2 + rng.below(5), 0.18, 0.05, rng) {
                let cards = 4 + rng.below(4);
                tuft(&mut shape, foot, cards, [0.3, 0.95], scale, materials, rng);
            }
        }
        2 => {
            for foot in scatter(2 + rng.below(5), 0.20, 0.07, rng) {
                rosette(&mut shape, foot, [0.3, 0.7], materials, rng);
            }
        }
        _ => {
            for foot in scatter(1 + rng.below(2), 0.14, 0.08, rng) {
                trefoils(&mut shape, foot, [0.5, 0.9], materials, rng);
            }
            for foot in scatter(1 + rng.below(2), 0.18, 0.05, rng) {
                let cards = 4 + rng.below(4);
                let scale = rng.range_f32(0.25, 0.5);
                tuft(&mut shape, foot, cards, [0.1, 0.8], scale, materials, rng);
            }
        }
    }
    shape
}

/// Radius of a mat of what wheels and feet keep low, metres.
const MAT_M: f32 = 0.24;

/// A mat between the ruts of a trail: short, leaning grass, among it plantain or clover, and a few
/// blades that were missed. Blades are shorter towards its rim.
pub(crate) fn strip_mat(variant: u32, materials: &WorldMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    let [rosettes, clover] = [[0, 0], [2, 0], [0, 2], [1, 1]][variant as usize % 4];
    for foot in scatter(rosettes + rng.below(2), 0.8 * MAT_M, 0.09, rng) {
        rosette(&mut shape, foot, [0.22, 0.5], materials, rng);
    }
    for foot in scatter(clover, 0.7 * MAT_M, 0.10, rng) {
        trefoils(&mut shape, foot, [0.6, 0.95], materials, rng);
    }
    for foot in scatter(20 + rng.below(10), MAT_M, 0.03, rng) {
        let cards = 3 + rng.below(3);
        let rim = 1.0 - 0.4 * foot.length() / MAT_M;
        let is_missed = rng.chance(0.07);
        let height = if is_missed {
            0.7
        } else {
            rng.range_f32(0.26, 0.50)
        };
        tuft(
            &mut shape,
            foot,
            cards,
            [0.3, 1.15],
            height * rim,
            materials,
            rng,
        );
    }
    shape
}

/// `count` points of a line that starts `low` off the vertical and ends `high` off it.
pub(crate) fn arched(
    base: Vec3,
    azimuth: f32,
    length: f32,
    low: f32,
    high: f32,
    count: usize,
) -> Vec<Vec3> {
    let step = length / (count - 1) as f32;
    let mut at = base;
    (0..count)
        .map(|i| {
            let here = at;
            let t = i as f32 / (count - 1) as f32;
            at += step * leaning(azimuth, low + (high - low) * t);
            here
        })
        .collect()
}

/// The point and the direction at a share t of a line's pieces.
pub(crate) fn on_line(line: &[Vec3], t: f32) -> (Vec3, Vec3) {
    let x = t.clamp(0.0, 1.0) * (line.len() - 1) as f32;
    let i = (x as usize).min(line.len() - 2);
    let along = line[i + 1] - line[i];
    (
        line[i] + along * (x - i as f32),
        along.normalize_or(Vec3::Z),
    )
}
