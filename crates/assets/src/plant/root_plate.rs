//! Root plates: what a thrown tree tore out of the ground.

use std::f32::consts::TAU;

use glam::{IVec2, Vec2, Vec3};
use nemoral_seed::{Draw, Key, Rng};

use super::shape::Shape;
use crate::materials::RootPlateMaterials;
use crate::textures::ground::FLOOR_M;
use crate::textures::noise::at::fbm;

/// Sectors and rings of a face.
const SECTORS: u32 = 40;
const RINGS: u32 = 8;

/// A lateral root: where it leaves the plate, as a share of a turn, and how thick it is there, as a
/// share of the plate's radius.
struct Lateral {
    turn: f32,
    thick: f32,
}

/// A root plate in the plane x = 0, upright: its stem leaves it towards positive x, and its centre
/// is the origin.
pub(crate) fn root_plate(radius_m: f32, materials: &RootPlateMaterials, key: Key) -> Shape {
    let mut rng = key.rng();
    let seed = rng.below(u32::MAX);
    let thick_m = radius_m * rng.range_f32(0.30, 0.40);
    let count = 8 + rng.below(4);
    let laterals: Vec<Lateral> = (0..count)
        .map(|i| Lateral {
            turn: (i as f32 + rng.range_f32(-0.35, 0.35)) / count as f32,
            thick: rng.range_f32(0.035, 0.085),
        })
        .collect();
    let plate = Plate {
        radius_m,
        thick_m,
        seed,
        laterals,
    };
    let mut shape = Shape::default();
    plate.faces(&mut shape, materials);
    for lateral in &plate.laterals {
        plate.lateral(lateral, &mut shape, materials, &mut rng);
    }
    for _ in 0..30 + rng.below(16) {
        plate.fine_root(&mut shape, materials, &mut rng);
    }
    for i in 0..10 + rng.below(8) {
        plate.clod(i % 3 == 0, &mut shape, materials, &mut rng);
    }
    shape
}

struct Plate {
    radius_m: f32,
    thick_m: f32,
    seed: u32,
    laterals: Vec<Lateral>,
}

impl Plate {
    /// The distance of the rim from the centre: soil hangs on along the laterals, and is torn off
    /// between them.
    fn rim_m(&self, turn: f32) -> f32 {
        let torn = fbm(Vec2::new(turn, 0.37), IVec2::new(6, 3), 5, 0.65, self.seed);
        let held = (self.laterals.iter()).map(|lateral| {
            let off = (turn - lateral.turn + 0.5).rem_euclid(1.0) - 0.5;
            libm::expf(-off * off / 0.0011) * (0.10 + 2.4 * lateral.thick)
        });
        let held = held.fold(0.0, f32::max);
        self.radius_m * (0.66 + 0.30 * torn + held)
    }

    /// A point of a face, at a share of the way from the centre to the rim.
    fn point(&self, turn: f32, share: f32, is_back: bool) -> Vec3 {
        let angle = TAU * turn;
        let (sin, cos) = (libm::sinf(angle), libm::cosf(angle));
        let r = share * self.rim_m(turn);
        let at = Vec2::new(0.5 + 0.45 * share * cos, 0.5 + 0.45 * share * sin);
        let seed = self.seed ^ u32::from(is_back);
        let lumps = fbm(at, IVec2::new(7, 7), 4, 0.65, seed);
        // The rim is bent to and fro; both faces end on it.
        let bent = fbm(
            Vec2::new(turn, 0.71),
            IVec2::new(5, 3),
            3,
            0.6,
            self.seed ^ 2,
        );
        let rim = 0.55 * self.thick_m * bent;
        let inner = 1.0 - share * share;
        // The front was the forest floor, and rises to the stem's flare; the back bulges.
        let x = if is_back {
            -self.thick_m * inner.sqrt() * (0.85 + 0.95 * lumps)
        } else {
            let flare = (1.0 - share) * (1.0 - share);
            self.thick_m * (0.40 * flare + 0.30 * inner * lumps)
        };
        Vec3::new(x + share * share * rim, r * cos, r * sin)
    }

    fn faces(&self, shape: &mut Shape, materials: &RootPlateMaterials) {
        let columns = SECTORS + 1;
        for (is_back, material) in [(false, materials.floor), (true, materials.soil)] {
            let start = shape.mesh.positions.len() as u32;
            let way = if is_back { -1.0 } else { 1.0 };
            let at = |ring: u32, k: u32| {
                let turn = (k % SECTORS) as f32 / SECTORS as f32;
                self.point(turn, ring as f32 / RINGS as f32, is_back)
            };
            for ring in 0..=RINGS {
                let share = ring as f32 / RINGS as f32;
                for k in 0..columns {
                    let p = at(ring, k);
                    // From the neighbours, but along the rim outwards too.
                    let outwards = at((ring + 1).min(RINGS), k) - at(ring.saturating_sub(1), k);
                    let along = at(ring, k + 1) - at(ring, k + SECTORS - 1);
                    let normal = outwards.cross(along).normalize_or(Vec3::X) * way;
                    let rim = p.with_x(0.0).normalize_or_zero() * share * share * share;
                    shape.push(p, normal + 0.7 * rim, Vec2::new(p.y, p.z) / FLOOR_M);
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
    }

    /// A root that runs out of the plate and broke beyond its rim, with a fork.
    fn lateral(
        &self,
        lateral: &Lateral,
        shape: &mut Shape,
        materials: &RootPlateMaterials,
        rng: &mut impl Rng,
    ) {
        let angle = TAU * lateral.turn;
        let radial = Vec3::new(0.0, libm::cosf(angle), libm::sinf(angle));
        let side = Vec3::X.cross(radial);
        let rim_m = self.rim_m(lateral.turn.rem_euclid(1.0));
        let reach = rim_m + self.radius_m * rng.range_f32(0.15, 0.55);
        let thick = self.radius_m * lateral.thick;
        let bow = rng.range_f32(-0.16, 0.16) * self.radius_m;
        let line: Vec<Vec3> = (0..7)
            .map(|i| {
                let t = i as f32 / 6.0;
                let kink = 0.05 * self.radius_m * rng.range_f32(-1.0, 1.0) * t;
                let depth = self.thick_m * (0.55 * (1.0 - t) + 0.12);
                radial * (0.12 * self.radius_m + (reach - 0.12 * self.radius_m) * t)
                    + side * (bow * t * t + kink)
                    - Vec3::X * (depth + kink.abs())
            })
            .collect();
        let radii: Vec<f32> = (0..7).map(|i| thick * (1.0 - 0.115 * i as f32)).collect();
        shape.tube(&line, &radii, 7, materials.root);
        let from = line[3 + rng.below(2) as usize];
        let sign = if rng.chance(0.5) { 1.0 } else { -1.0 };
        let way =
            (radial + 0.7 * sign * side - Vec3::X * rng.range_f32(0.0, 0.5)).normalize_or(radial);
        let length = self.radius_m * rng.range_f32(0.25, 0.5);
        let fork = [
            from,
            from + 0.5 * length * way,
            from + length * (way + 0.2 * radial),
        ];
        shape.tube(
            &fork,
            &[0.5 * thick, 0.38 * thick, 0.22 * thick],
            5,
            materials.root,
        );
    }

    /// A thin root that sticks out of the rim or the back.
    fn fine_root(&self, shape: &mut Shape, materials: &RootPlateMaterials, rng: &mut impl Rng) {
        let turn = rng.unit_f32();
        let share = rng.unit_f32().sqrt();
        let from = self.point(turn, share.min(0.97), true);
        let radial = from.with_x(0.0).normalize_or(Vec3::Z);
        let thick = self.radius_m * rng.range_f32(0.005, 0.016);
        let length = self.radius_m * (0.12 + 0.45 * rng.unit_f32() * rng.unit_f32());
        let mut way =
            (radial * (0.3 + share) - Vec3::X * rng.range_f32(0.1, 0.9)).normalize_or(radial);
        let mut line = vec![from - 0.06 * self.radius_m * way];
        for j in 0..3 {
            // Torn roots hang.
            let kink = Vec3::new(
                rng.range_f32(-0.4, 0.3),
                rng.range_f32(-0.4, 0.4),
                rng.range_f32(-0.6, 0.2),
            );
            way = (way + kink).normalize_or(radial);
            line.push(line[j] + way * length / 3.0);
        }
        let radii = [thick, 0.8 * thick, 0.6 * thick, 0.35 * thick];
        shape.tube(&line, &radii, 4, materials.root);
    }

    /// A clod of soil, or a stone, half in the back.
    fn clod(
        &self,
        is_stone: bool,
        shape: &mut Shape,
        materials: &RootPlateMaterials,
        rng: &mut impl Rng,
    ) {
        let at = self.point(rng.unit_f32(), 0.92 * rng.unit_f32().sqrt(), true);
        let size = self.radius_m * rng.range_f32(0.035, 0.095);
        let way = Vec3::new(
            rng.range_f32(-0.3, 0.3),
            rng.range_f32(-1.0, 1.0),
            rng.range_f32(-1.0, 1.0),
        );
        let along = way.normalize_or(Vec3::Y) * size;
        let bend = Vec3::X * (0.25 * size * rng.range_f32(-1.0, 1.0));
        let line = [at - 0.8 * along, at + bend, at + 0.7 * along];
        let radii = [0.60, 1.0, 0.55].map(|r| r * size * rng.range_f32(0.8, 1.1));
        let material = if is_stone {
            materials.stone
        } else {
            materials.soil
        };
        shape.tube(&line, &radii, 6, material);
    }
}
