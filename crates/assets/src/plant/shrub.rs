//! Gorse, heather and bramble: woody stems by sweep, foliage by cards.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use nemoral_seed::{Draw, Rng};

use super::shape::{Shape, around, leaning};
use super::undergrowth::{SUNK_M, arched, on_line};
use crate::materials::WorldMaterials;

/// A shrub's kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ShrubKind {
    Gorse,
    Heather,
    Bramble,
}

impl ShrubKind {
    pub(crate) const ALL: [Self; 3] = [Self::Gorse, Self::Heather, Self::Bramble];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Gorse => "gorse",
            Self::Heather => "heather",
            Self::Bramble => "bramble",
        }
    }

    /// Grows an individual; `rank` 0..1 runs from the smallest to the tallest of the kind.
    pub(crate) fn grow(self, rank: f32, materials: &WorldMaterials, rng: &mut impl Rng) -> Shape {
        match self {
            Self::Gorse => gorse(0.65 + 1.35 * rank, materials, rng),
            Self::Heather => heather(0.45 + 0.65 * rank, materials, rng),
            Self::Bramble => bramble(0.50 + 0.60 * rank, materials, rng),
        }
    }
}

/// Stems that fork twice; the outer forks carry spiny branch ends, the inside is bare and brown.
fn gorse(height: f32, materials: &WorldMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    let stems = 7 + (4.0 * height) as u32 + rng.below(4);
    let turn = rng.range_f32(0.0, TAU);
    for i in 0..stems {
        let azimuth = turn + TAU * (i as f32 + rng.range_f32(-0.35, 0.35)) / stems as f32;
        let tilt = rng.range_f32(0.10, 0.85);
        let length = height * rng.range_f32(0.62, 0.95) * (1.0 - 0.22 * tilt);
        let base = around(azimuth) * 0.06 * height - SUNK_M * Vec3::Z;
        // Stems start flat and rise.
        let line = arched(base, azimuth, length, tilt + 0.25, 0.55 * tilt, 6);
        let r = 0.011 * height.sqrt() * rng.range_f32(0.8, 1.2);
        let radii: Vec<f32> = (0..6).map(|k| r * (1.0 - 0.15 * k as f32)).collect();
        shape.tube(&line, &radii, 5, materials.shrub_wood);
        let forks = 5 + (6.0 * height) as u32;
        for k in 0..forks {
            let t = 0.25 + 0.75 * (k as f32 + rng.unit_f32()) / forks as f32;
            let (from, along) = on_line(&line, t);
            let spread = around(rng.range_f32(0.0, TAU));
            let way = (along + 0.85 * spread + 0.25 * Vec3::Z).normalize_or(Vec3::Z);
            let reach = height * rng.range_f32(0.12, 0.24) * (1.25 - 0.5 * t);
            let to = from + reach * way;
            let twig = 0.35 * r * (1.2 - 0.6 * t);
            shape.tube(
                &[from, from.lerp(to, 0.5) + 0.04 * reach * spread, to],
                &[twig, 0.8 * twig, 0.5 * twig],
                4,
                materials.shrub_wood,
            );
            let ends = 5 + rng.below(3);
            for e in 0..ends {
                let s = 0.30 + 0.70 * e as f32 / (ends - 1) as f32;
                let at = from.lerp(to, s);
                let out = (way + 0.95 * leaning(rng.range_f32(0.0, TAU), rng.range_f32(0.2, 1.4)))
                    .normalize_or(way);
                let across = around(rng.range_f32(0.0, TAU));
                shape.card(
                    rng.choose(&materials.gorse),
                    at,
                    out,
                    across,
                    rng.range_f32(0.75, 1.15),
                );
            }
        }
    }
    shape
}

/// A broom of thin upright stems, green for the upper two thirds.
fn heather(height: f32, materials: &WorldMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    let stems = 20 + rng.below(10);
    for i in 0..stems {
        let azimuth = 2.4 * i as f32 + rng.range_f32(-0.4, 0.4);
        let tilt = 0.75 * (i as f32 / stems as f32).sqrt() + rng.range_f32(-0.08, 0.08);
        let length = height * rng.range_f32(0.75, 1.05) * (1.0 - 0.2 * tilt);
        let base = around(azimuth) * 0.05 * height * rng.unit_f32() - SUNK_M * Vec3::Z;
        let line = arched(base, azimuth, length, 1.1 * tilt, 0.65 * tilt, 5);
        let r = rng.range_f32(0.0028, 0.0045);
        let radii: Vec<f32> = (0..5).map(|k| r * (1.0 - 0.18 * k as f32)).collect();
        shape.tube(&line, &radii, 4, materials.shrub_wood);
        let bundles = 9 + (9.0 * height) as u32;
        for k in 0..bundles {
            let t = 0.22 + 0.78 * (k as f32 + rng.unit_f32()) / bundles as f32;
            let (at, along) = on_line(&line, t);
            let spread = around(rng.range_f32(0.0, TAU));
            let way = along + 0.55 * spread + 0.2 * Vec3::Z;
            let size = rng.range_f32(0.6, 0.95);
            shape.card(
                rng.choose(&materials.heather),
                at,
                way,
                around(rng.range_f32(0.0, TAU)),
                size,
            );
        }
    }
    shape
}

/// A mound of arching canes; leaves turn their faces up and out.
fn bramble(height: f32, materials: &WorldMaterials, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    let canes = 20 + rng.below(8);
    for i in 0..canes {
        let azimuth = 2.4 * i as f32 + rng.range_f32(-0.5, 0.5);
        let length = height * rng.range_f32(1.2, 2.4);
        let root = around(azimuth + rng.range_f32(-1.0, 1.0)) * rng.range_f32(0.0, 0.40) * height;
        let root = root - SUNK_M * Vec3::Z;
        cane(&mut shape, root, azimuth, length, materials, rng);
    }
    shape
}

/// An arching cane of the bramble with its leaves.
pub(crate) fn cane(
    shape: &mut Shape,
    root: Vec3,
    azimuth: f32,
    length: f32,
    materials: &WorldMaterials,
    rng: &mut impl Rng,
) {
    let mut line = arched(
        root,
        azimuth,
        length,
        rng.range_f32(0.0, 0.9),
        rng.range_f32(2.1, 2.7),
        14,
    );
    // A cane that reaches the ground runs along it.
    for p in line.iter_mut().skip(1) {
        p.z = p.z.max(0.03);
    }
    let r = rng.range_f32(0.0030, 0.0055);
    let radii: Vec<f32> = (0..14).map(|k| r * (1.0 - 0.055 * k as f32)).collect();
    shape.tube(&line, &radii, 5, materials.cane);
    let nodes = (length / 0.040) as u32;
    for k in 0..nodes {
        let t = 0.10 + 0.90 * (k as f32 + rng.unit_f32()) / nodes as f32;
        let (at, along) = on_line(&line, t);
        let out = leaf_direction(at, along, k, rng);
        // The face looks up and away from the middle of the mound.
        let face = (Vec3::Z + 0.5 * Vec3::new(at.x, at.y, 0.0) + 0.45 * random_level(rng))
            .normalize_or(Vec3::Z);
        let flat = (out - face * out.dot(face)).normalize_or(along);
        let across = flat.cross(face);
        let size = rng.range_f32(0.85, 1.35);
        shape.card(rng.choose(&materials.bramble), at, flat, across, size);
    }
}

/// Leaves stand left and right of the cane in turn.
fn leaf_direction(at: Vec3, along: Vec3, node: u32, rng: &mut impl Rng) -> Vec3 {
    let side = along.cross(Vec3::Z).normalize_or(Vec3::X);
    let sign = if node.is_multiple_of(2) { 1.0 } else { -1.0 };
    let outward = Vec2::new(at.x, at.y).normalize_or_zero().extend(0.0);
    side * sign + 0.4 * along + 0.3 * outward + 0.5 * random_level(rng)
}

fn random_level(rng: &mut impl Rng) -> Vec3 {
    around(rng.range_f32(0.0, TAU))
}
