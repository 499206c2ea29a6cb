//! Ivy, moss and resin on the bark of a tree.

use std::f32::consts::TAU;

use glam::{IVec2, Vec2, Vec3};
use nemoral_scene::{MaterialLibrary, Prototype, Semantic};
use nemoral_seed::{Draw, Rng};

use super::shape::{Shape, around};
use crate::textures::noise::at::{fbm, smoothstep};
use crate::tree::FoliageCard;

/// How far a leaf's foot is from the bark, metres.
const OFF_BARK_M: f32 = 0.012;
/// The share of bark that leaves must be drawn over for it to look covered, as they overlap.
const OVERLAP: f32 = 1.9;
/// The most cards of one climber.
const CARDS_MAX: usize = 900;

/// The bark of a stem: its triangles from the foot up.
#[derive(Debug)]
pub(crate) struct Bark {
    corners: Vec<[Vec3; 3]>,
    /// Area up to and with each triangle, m².
    areas: Vec<f32>,
}

impl Bark {
    /// The bark of a tree's stem and root flare above the ground and below `top_m`.
    pub(crate) fn of(tree: &Prototype, library: &MaterialLibrary, top_m: f32) -> Self {
        let mesh = tree.mesh();
        let (mut corners, mut areas, mut area) = (Vec::new(), Vec::new(), 0.0);
        for triangle in &mesh.triangles {
            let semantic = library.get(triangle.material).semantic;
            if !matches!(
                semantic,
                Semantic::Stem | Semantic::RootFlare | Semantic::Snag
            ) {
                continue;
            }
            let at = triangle.corners.map(|i| mesh.positions[i as usize]);
            let [low, high] = [f32::min, f32::max].map(|f| f(f(at[0].z, at[1].z), at[2].z));
            if high < -0.05 || low > top_m {
                continue;
            }
            area += 0.5 * (at[1] - at[0]).cross(at[2] - at[0]).length();
            corners.push(at);
            areas.push(area);
        }
        Self { corners, areas }
    }

    /// The outline at a height; `None` where there is no bark.
    pub(crate) fn cross_section(&self, z: f32) -> Option<CrossSection> {
        let mut chords = Vec::new();
        let (mut centre, mut length) = (Vec2::ZERO, 0.0);
        for corners in &self.corners {
            let cut = |i: usize| {
                let (a, b) = (corners[i], corners[(i + 1) % 3]);
                let between = (a.z <= z) != (b.z <= z);
                between.then(|| a.lerp(b, (z - a.z) / (b.z - a.z)).truncate())
            };
            let mut ends = (0..3).filter_map(cut);
            if let (Some(a), Some(b)) = (ends.next(), ends.next()) {
                let chord = a.distance(b);
                centre += chord * a.midpoint(b);
                length += chord;
                chords.push([a, b]);
            }
        }
        (length > 0.0).then(|| CrossSection {
            centre: centre / length,
            chords,
        })
    }

    fn area_m2(&self) -> f32 {
        self.areas.last().copied().unwrap_or(0.0)
    }

    /// A place on the bark, with equal chances everywhere, and the way out of it.
    fn draw(&self, rng: &mut impl Rng) -> Option<(Vec3, Vec3)> {
        let pick = rng.unit_f32() * self.area_m2();
        let i = self.areas.partition_point(|&a| a <= pick);
        let [a, b, c] = *self.corners.get(i)?;
        let (mut u, mut v) = (rng.unit_f32(), rng.unit_f32());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let out = (b - a).cross(c - a).normalize_or(Vec3::X);
        Some((a + (b - a) * u + (c - a) * v, out))
    }
}

/// The outline of bark at a height.
#[derive(Debug)]
pub(crate) struct CrossSection {
    centre: Vec2,
    chords: Vec<[Vec2; 2]>,
}

impl CrossSection {
    /// Where its outermost part is in a direction from its centre, by the angle from +x.
    pub(crate) fn surface(&self, angle: f32) -> Option<Vec2> {
        let way = around(angle).truncate();
        let away = self.chords.iter().filter_map(|[a, b]| {
            let (chord, from) = (*b - *a, *a - self.centre);
            let across = way.perp_dot(chord);
            let along = from.perp_dot(way) / across;
            ((0.0..=1.0).contains(&along)).then(|| from.perp_dot(chord) / across)
        });
        let farthest = away.fold(0.0, f32::max);
        (farthest > 0.0).then(|| self.centre + way * farthest)
    }
}

/// The lowest and the highest wounds that resin runs from, metres.
pub(crate) const WOUNDS_M: [f32; 2] = [0.3, 4.0];

/// Runs of resin from wounds of the bark.
pub(crate) fn resin(bark: &Bark, runs: &[FoliageCard], rng: &mut impl Rng) -> Shape {
    const TRIES: u32 = 20;
    let mut shape = Shape::default();
    let wounds = 3 + rng.below(6);
    // The bark's triangles reach beyond its top.
    let wounds: Vec<(Vec3, Vec3)> = (0..TRIES * wounds)
        .filter_map(|_| bark.draw(rng))
        .filter(|(at, _)| (WOUNDS_M[0]..WOUNDS_M[1]).contains(&at.z))
        .take(wounds as usize)
        .collect();
    for (at, out) in wounds {
        let down = (out * out.z - Vec3::Z).normalize_or(Vec3::NEG_Z);
        let across = out.cross(down);
        // A wound is often wider than one run.
        for _ in 0..1 + rng.below(3) {
            let image = rng.choose(runs);
            let beside = across * rng.range_f32(-0.03, 0.03) + down * rng.range_f32(-0.04, 0.04);
            let foot = at + beside + out * rng.range_f32(0.004, 0.008);
            shape.card(image, foot, down, across, rng.range_f32(0.6, 1.15));
        }
    }
    shape
}

/// Ivy that climbs to `top_m`, dense below and in tongues above.
pub(crate) fn ivy(bark: &Bark, top_m: f32, leaves: &[FoliageCard], rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    let seed = rng.below(u32::MAX);
    // One side is open for the longest.
    let open = rng.range_f32(0.0, TAU);
    let cover = |at: Vec3| {
        let turn = libm::atan2f(at.y, at.x) / TAU;
        let share = (at.z / top_m).max(0.0);
        let p = Vec2::new(turn.rem_euclid(1.0), (0.17 * at.z).rem_euclid(1.0));
        let tongues = 0.55 * fbm(p, IVec2::new(4, 3), 3, 0.55, seed);
        let side = 0.16 * libm::cosf(TAU * turn - open);
        // Full at the foot, the longest tongues reach the top.
        smoothstep(0.0, 0.16, 0.86 - share + tongues - side)
    };
    let card_m2: f32 = leaves
        .iter()
        .map(|l| l.width_m * l.height_m * l.opaque_fraction)
        .sum::<f32>()
        / leaves.len() as f32;
    let count = (OVERLAP * bark.area_m2() / card_m2) as usize;
    for _ in 0..count.min(CARDS_MAX) {
        let Some((at, out)) = bark.draw(rng) else {
            break;
        };
        if at.z > top_m || !rng.chance(f64::from(cover(at))) {
            continue;
        }
        let image = rng.choose(leaves);
        // Shoots climb; their leaves face the light.
        let across = out.cross(Vec3::Z).normalize_or(Vec3::Y);
        let tilt = rng.range_f32(0.10, 0.45);
        let climb = Vec3::Z + across * rng.range_f32(-0.7, 0.7);
        let along = climb + out * tilt;
        let scale = rng.range_f32(0.75, 1.15);
        let half = 0.5 * image.height_m * scale;
        let foot = at + out * OFF_BARK_M - along.normalize_or(Vec3::Z) * half;
        shape.card(image, foot + out * (half * tilt), along, across, scale);
    }
    shape
}

/// Cushions of moss on the side of the bark towards `side_rad`, as high as `top_m` there and half
/// as high on the other side, `amount` times as dense as in a moist forest.
pub(crate) fn moss(
    bark: &Bark,
    (side_rad, top_m, amount): (f32, f32, f32),
    cushions: &[FoliageCard],
    rng: &mut impl Rng,
) -> Shape {
    let mut shape = Shape::default();
    let seed = rng.below(u32::MAX);
    let towards = around(side_rad);
    let card_m2 = cushions[0].width_m * cushions[0].height_m * cushions[0].opaque_fraction;
    let count = (1.5 * amount * bark.area_m2() / card_m2) as usize;
    for _ in 0..count.min(CARDS_MAX) {
        let Some((at, out)) = bark.draw(rng) else {
            break;
        };
        let facing = 0.5 + 0.5 * out.dot(towards);
        let height = top_m * (0.35 + 0.65 * facing);
        let turn = (libm::atan2f(at.y, at.x) / TAU).rem_euclid(1.0);
        let p = Vec2::new(turn, (0.21 * at.z).rem_euclid(1.0));
        let patch = 0.9 * fbm(p, IVec2::new(6, 9), 4, 0.6, seed);
        let drier = 0.35 * (1.0 - facing);
        let share = smoothstep(0.0, 0.3, 0.8 - at.z / height.max(0.05) + patch - drier);
        if !rng.chance(f64::from(share * (0.25 + 0.75 * facing))) {
            continue;
        }
        let image = rng.choose(cushions);
        let any = around(rng.range_f32(0.0, TAU)) + Vec3::Z * rng.range_f32(-1.0, 1.0);
        // Flat on the bark, mostly upright.
        let any = any + Vec3::Z * 1.5 * any.z.signum();
        let along = (any - out * any.dot(out)).normalize_or(Vec3::Z);
        let across = out.cross(along);
        // Cushions on thin stems are small, as they are flat.
        let thick = (at.truncate().length() / 0.14).clamp(0.35, 1.0);
        // Only flecks of it grow at the border of a patch.
        let scale = rng.range_f32(0.6, 1.2) * thick * (0.4 + 0.6 * share);
        let foot = at + out * rng.range_f32(0.003, 0.008);
        let foot = foot - along * (0.5 * image.height_m * scale);
        shape.card(
            image,
            foot,
            along + out * rng.range_f32(-0.04, 0.06),
            across,
            scale,
        );
    }
    shape
}

/// A carpet of ivy on the ground, of 0.75 m radius.
pub(crate) fn carpet(leaves: &[FoliageCard], rng: &mut impl Rng) -> Shape {
    const RADIUS_M: f32 = 0.75;
    let mut shape = Shape::default();
    for _ in 0..110 {
        let r = RADIUS_M * rng.unit_f32().sqrt();
        let at = around(rng.range_f32(0.0, TAU)) * r;
        let heading = rng.range_f32(0.0, TAU);
        let lift = rng.range_f32(0.05, 0.45);
        let image = rng.choose(leaves);
        let across = around(heading + 0.25 * TAU) + Vec3::Z * rng.range_f32(-0.25, 0.25);
        let height = rng.range_f32(0.02, 0.07) - 0.04 * (r / RADIUS_M);
        let foot = at + Vec3::Z * height.max(-0.01);
        let along = around(heading) + Vec3::Z * lift;
        shape.card(image, foot, along, across, rng.range_f32(0.7, 1.05));
    }
    shape
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The bark of a leaning stem of this radius, whose middle is at `middle` of each height.
    pub(crate) fn leaning_stem(radius_m: f32, top_m: f32, middle: impl Fn(f32) -> Vec2) -> Bark {
        const SIDES: u32 = 96;
        let (mut corners, mut areas) = (Vec::new(), Vec::new());
        let corner = |k: u32, z: f32| {
            let out = around(TAU * k as f32 / SIDES as f32).truncate();
            (middle(z) + out * radius_m).extend(z)
        };
        for k in 0..SIDES {
            let [a, b] = [corner(k, 0.0), corner(k + 1, 0.0)];
            let [c, d] = [corner(k + 1, top_m), corner(k, top_m)];
            corners.extend([[a, b, c], [a, c, d]]);
            areas.extend([1.0 + k as f32, 1.5 + k as f32]);
        }
        Bark { corners, areas }
    }

    #[test]
    fn a_cross_section_is_the_outline_at_its_height() {
        let lean = |z: f32| Vec2::new(0.2 * z, -0.1 * z);
        let bark = leaning_stem(0.15, 4.0, lean);
        for z in [0.1, 1.37, 3.9] {
            let section = bark.cross_section(z).expect("there is bark");
            for k in 0..50 {
                let angle = TAU * k as f32 / 50.0;
                let at = section.surface(angle).expect("it is closed");
                let out = at - lean(z);
                assert!((out.length() - 0.15).abs() < 2e-4, "{z} {angle}: {out}");
                assert!(out.dot(around(angle).truncate()) > 0.1499);
            }
        }
        assert!(bark.cross_section(4.1).is_none() && bark.cross_section(-0.1).is_none());
    }
}
