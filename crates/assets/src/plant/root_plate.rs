//! Root plates: what a thrown tree tore out of the ground.

use std::f32::consts::TAU;

use glam::{IVec2, Vec2, Vec3};
use nemoral_seed::{Draw, Key};

use super::shape::Shape;
use crate::materials::RootPlateMaterials;
use crate::textures::ground::FLOOR_M;
use crate::textures::noise::fbm;

/// Sectors and rings of a face.
const SECTORS: u32 = 28;
const RINGS: u32 = 7;

/// A root plate in the plane x = 0, upright: its stem leaves it towards positive x, and its centre
/// is the origin.
pub(crate) fn root_plate(radius_m: f32, materials: &RootPlateMaterials, key: Key) -> Shape {
    let mut rng = key.rng();
    let seed = rng.below(u32::MAX);
    let thick_m = radius_m * rng.range_f32(0.30, 0.40);
    // Its outline is torn, and wider than high.
    let outline = |u: f32| {
        let wave = fbm(Vec2::new(u, 0.37), IVec2::new(5, 3), 4, 0.6, seed);
        radius_m * (0.86 + 0.34 * wave) * (1.0 + 0.08 * libm::cosf(2.0 * TAU * u))
    };
    let point = |u: f32, share: f32, is_back: bool| {
        let angle = TAU * u;
        let r = share * outline(u);
        let lumps = fbm(
            Vec2::new(
                0.5 + 0.45 * share * libm::cosf(angle),
                0.5 + 0.45 * share * libm::sinf(angle),
            ),
            IVec2::new(7, 7),
            4,
            0.6,
            seed ^ u32::from(is_back),
        );
        // The front was the forest floor, flat up to the stem's flare; the back bulges.
        let x = if is_back {
            -thick_m * ((1.0 - share * share) + 0.55 * lumps)
        } else {
            0.10 * thick_m * lumps + 0.35 * thick_m * (1.0 - share) * (1.0 - share)
        };
        Vec3::new(x, r * libm::cosf(angle), r * libm::sinf(angle))
    };
    let mut shape = Shape::default();
    let columns = SECTORS + 1;
    for (is_back, material) in [(false, materials.floor), (true, materials.soil)] {
        let start = shape.mesh.positions.len() as u32;
        let way = if is_back { -1.0 } else { 1.0 };
        for ring in 0..=RINGS {
            let share = ring as f32 / RINGS as f32;
            for k in 0..columns {
                let u = (k % SECTORS) as f32 / SECTORS as f32;
                // Both faces end on one rim.
                let mut at = point(u, share, is_back);
                if ring == RINGS {
                    at.x = 0.0;
                }
                let rim = at.with_x(0.0).normalize_or_zero() * share * share;
                let uv = Vec2::new(at.y, at.z) / FLOOR_M;
                shape.push(at, Vec3::X * way * (1.1 - share) + rim, uv);
            }
        }
        for ring in 0..RINGS {
            for k in 0..SECTORS {
                let a = start + ring * columns + k;
                let (b, c, d) = (a + 1, a + columns, a + columns + 1);
                let mut triangle = |[a, b, c]: [u32; 3]| {
                    let corners = if is_back { [a, c, b] } else { [a, b, c] };
                    shape.triangle(corners, material);
                };
                triangle([a, c, d]);
                if ring > 0 {
                    triangle([a, d, b]);
                }
            }
        }
    }
    // Roots that broke: most around the rim, some out of the back.
    for i in 0..16 + rng.below(9) {
        let u = (i as f32 + rng.range_f32(-0.4, 0.4)) / 20.0;
        let angle = TAU * u;
        let radial = Vec3::new(0.0, libm::cosf(angle), libm::sinf(angle));
        let from = outline(u.rem_euclid(1.0)) * rng.range_f32(0.55, 0.9);
        let base = radial * from - Vec3::X * (0.25 * thick_m);
        let thick = radius_m * rng.range_f32(0.012, 0.045);
        let length = radius_m * (0.25 + 0.75 * rng.unit_f32() * rng.unit_f32());
        let mut way = radial - Vec3::X * rng.range_f32(0.0, 0.9);
        let mut line = vec![base];
        let mut radii = vec![thick];
        for j in 1..=4 {
            let kink = Vec3::new(
                rng.range_f32(-0.35, 0.30),
                rng.range_f32(-0.35, 0.35),
                rng.range_f32(-0.45, 0.25),
            );
            way = (way.normalize_or(radial) + kink).normalize_or(radial);
            line.push(line[j - 1] + way * (0.25 * length + 0.1 * radius_m * f32::from(j == 1)));
            radii.push(thick * (1.0 - 0.19 * j as f32));
        }
        shape.tube(&line, &radii, 6, materials.root);
    }
    shape
}
