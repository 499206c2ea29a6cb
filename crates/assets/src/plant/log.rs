//! Logs: stems on the ground, in five stages of decay.

use std::f32::consts::TAU;

use glam::{IVec2, Vec2, Vec3};
use nemoral_scene::{DecayStage, MaterialId};
use nemoral_seed::{Domain, Draw, Key, Rng};

use super::fungus::bracket;
use super::shape::Shape;
use crate::materials::LogMaterials;
use crate::textures::noise::at::{fbm, smoothstep};

/// How flat a log is: its height over its width, by stage.
const FLATNESS: [f32; 5] = [1.0, 1.0, 0.94, 0.76, 0.52];
/// How uneven its surface is, relative to its radius, by stage.
const UNEVEN: [f32; 5] = [0.02, 0.03, 0.06, 0.13, 0.17];
const FUNGI: Domain = Domain::new("assets.log.fungi");

/// Groups of bracket fungi on a metre of a log at most, by stage: they feed on wood that is dead
/// for some years and still sound enough to hold them.
const FUNGI_PER_M: [f32; 5] = [0.0, 0.5, 1.0, 0.8, 0.0];
/// Distance of two rings, metres.
const RING_M: f32 = 0.34;

/// What a log is to be like.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LogPlan {
    pub(crate) stage: DecayStage,
    pub(crate) length_m: f32,
    /// At its thick and at its thin end, metres.
    pub(crate) radius_m: [f32; 2],
    /// Whether its thick end is sawn; it is broken otherwise.
    pub(crate) is_sawn: bool,
}

impl LogPlan {
    /// Half of its height at its thick and its thin end, metres.
    pub(crate) fn half_height_m(&self) -> [f32; 2] {
        self.radius_m
            .map(|r| r * FLATNESS[self.stage.index()].sqrt())
    }

    /// The volume of the truncated cone that it is, m³.
    pub(crate) fn volume_m3(&self) -> f64 {
        let [a, b] = self.radius_m.map(f64::from);
        std::f64::consts::PI / 3.0 * f64::from(self.length_m) * (a * a + a * b + b * b)
    }
}

/// A log along x, its thick end at negative x, its axis on the x-axis, its upper side up.
pub(crate) fn log(plan: &LogPlan, materials: &LogMaterials, key: Key) -> Shape {
    let mut rng = key.rng();
    let surface = Surface::new(plan, &mut rng);
    let mut shape = Shape::default();
    surface.side(materials.side[plan.stage.index()], &mut shape);
    let sawn = plan.is_sawn && plan.stage <= DecayStage::Loosening;
    let face = materials.faces[usize::from(plan.stage != DecayStage::Fresh)];
    let torn = materials.torn[plan.stage.index()];
    for (at_tip, cut) in [(false, sawn), (true, false)] {
        let material = if cut { face } else { torn };
        surface.end(at_tip, !cut, material, &mut shape);
    }
    stubs(plan, materials, &mut shape, &mut rng);
    surface.fungi(materials.fungus, &mut shape, &mut key.domain(FUNGI).rng());
    shape
}

/// The side of a log, by its own coordinates: u around from the underside, t along.
struct Surface<'a> {
    plan: &'a LogPlan,
    seed: u32,
    /// A bow to one side, metres.
    bow_m: f32,
    rings: u32,
    sides: u32,
}

impl<'a> Surface<'a> {
    fn new(plan: &'a LogPlan, rng: &mut impl Rng) -> Self {
        let thickest = plan.radius_m[0];
        Self {
            plan,
            seed: rng.below(u32::MAX),
            bow_m: plan.length_m * plan.length_m * rng.range_f32(-0.0022, 0.0022),
            rings: ((plan.length_m / RING_M).ceil() as u32).clamp(5, 44),
            sides: if thickest < 0.08 { 10 } else { 16 },
        }
    }

    fn is_rotten(&self) -> bool {
        self.plan.stage == DecayStage::Rotten
    }

    fn centre(&self, t: f32) -> Vec3 {
        let bow = self.bow_m * (4.0 * t * (1.0 - t) - 0.5);
        Vec3::new(self.plan.length_m * (t - 0.5), bow, 0.0)
    }

    fn radius(&self, u: f32, t: f32) -> f32 {
        let [butt, tip] = self.plan.radius_m;
        let smooth = butt + (tip - butt) * t;
        let stage = self.plan.stage.index();
        // Waves as long as the log is thick; what rots falls in above all on the upper side.
        let along = (self.plan.length_m / (4.0 * butt)).ceil().max(1.0) as i32;
        let wave = fbm(
            Vec2::new(u, 0.98 * t),
            IVec2::new(3, along),
            3,
            0.55,
            self.seed,
        );
        let mut r = smooth * (1.0 + UNEVEN[stage] * (1.6 * wave - 0.1 * UNEVEN[stage]));
        if self.is_rotten() {
            // A mound runs out at its ends.
            let end = t.min(1.0 - t) * self.plan.length_m;
            r *= 0.62 + 0.38 * smoothstep(0.0, 0.28, end);
        }
        r
    }

    fn point(&self, u: f32, t: f32) -> Vec3 {
        let angle = TAU * u;
        let flat = FLATNESS[self.plan.stage.index()].sqrt();
        let out = Vec3::new(0.0, libm::sinf(angle) / flat, -libm::cosf(angle) * flat);
        self.centre(t) + out * self.radius(u, t)
    }

    fn normal(&self, u: f32, t: f32) -> Vec3 {
        let (du, dt) = (0.5 / self.sides as f32, 0.5 / self.rings as f32);
        let around = self.point(u + du, t) - self.point(u - du, t);
        let along = self.point(u, (t + dt).min(1.0)) - self.point(u, (t - dt).max(0.0));
        around.cross(along).normalize_or(Vec3::Z)
    }

    /// v of uv: as long as u is around, two to one as bark tiles are.
    fn v(&self, t: f32) -> f32 {
        let around = TAU * 0.5 * (self.plan.radius_m[0] + self.plan.radius_m[1]);
        0.5 * t * self.plan.length_m / around
    }

    fn side(&self, material: MaterialId, shape: &mut Shape) {
        let columns = self.sides + 1;
        for ring in 0..=self.rings {
            let t = ring as f32 / self.rings as f32;
            for k in 0..columns {
                let u = (k % self.sides) as f32 / self.sides as f32;
                let at = self.point(u, t);
                let uv = Vec2::new(k as f32 / self.sides as f32, self.v(t));
                let out = at - self.centre(t);
                let normal = self.normal(u, t);
                let normal = if normal.dot(out) > 0.0 { normal } else { out };
                shape.push(at, normal, uv);
            }
        }
        for ring in 0..self.rings {
            for k in 0..self.sides {
                let a = ring * columns + k;
                let (b, c, d) = (a + 1, a + columns, a + columns + 1);
                shape.triangle([a, b, d], material);
                shape.triangle([a, d, c], material);
            }
        }
    }

    /// Bracket fungi along the sides and upper flanks, in groups.
    fn fungi(&self, material: MaterialId, shape: &mut Shape, rng: &mut impl Rng) {
        let most = FUNGI_PER_M[self.plan.stage.index()] * self.plan.length_m;
        let groups = (most * rng.unit_f32()).round() as u32;
        for _ in 0..groups {
            let is_left = rng.chance(0.5);
            let middle = rng.range_f32(0.08, 0.92);
            let largest_m = (0.5 * self.plan.radius_m[0]).clamp(0.03, 0.1);
            for _ in 0..4 + rng.below(8) {
                let t =
                    (middle + rng.normal() as f32 * 0.22 / self.plan.length_m).clamp(0.03, 0.97);
                // From a little below the widest place to the upper flank.
                let u = rng.range_f32(0.22, 0.40);
                let u = if is_left { 1.0 - u } else { u };
                let at = self.point(u, t);
                let level = (at - self.centre(t))
                    .with_x(0.0)
                    .with_z(0.0)
                    .normalize_or(Vec3::Y);
                let turn = Vec3::X * rng.range_f32(-0.3, 0.3);
                let share = rng.unit_f32();
                let radius_m = largest_m * (0.3 + 0.7 * share * share);
                bracket(
                    shape,
                    at,
                    (level + turn).normalize_or(level),
                    radius_m,
                    material,
                    rng,
                );
            }
        }
    }

    /// Closes an end: a saw's flat face, or splinters.
    fn end(&self, at_tip: bool, is_torn: bool, material: MaterialId, shape: &mut Shape) {
        let (t, way) = if at_tip { (1.0, 1.0) } else { (0.0, -1.0) };
        let out = Vec3::X * way;
        let r = self.plan.radius_m[usize::from(at_tip)];
        let rings: u32 = if is_torn { 3 } else { 1 };
        let columns = self.sides + 1;
        let start = shape.mesh.positions.len() as u32;
        for ring in 0..=rings {
            let share = 1.0 - ring as f32 / (rings + 1) as f32;
            for k in 0..columns {
                let u = (k % self.sides) as f32 / self.sides as f32;
                let edge = self.point(u, t) - self.centre(t);
                let mut at = self.centre(t) + edge * share;
                if is_torn && ring > 0 {
                    let p = Vec2::new(u, 0.2 + 0.6 * share);
                    let splinter = fbm(p, IVec2::new(7, 2), 2, 0.7, self.seed ^ 0x51);
                    at += out * r * (0.55 * splinter + 0.25 * (1.0 - share));
                }
                // The image of a cut has wood up to 0.46 and bark to 0.5.
                let angle = TAU * u;
                let around = Vec2::new(libm::sinf(angle), libm::cosf(angle));
                let uv = Vec2::splat(0.5) + 0.49 * share * around;
                shape.push(at, out, uv);
            }
        }
        let middle = self.centre(t) + if is_torn { out * 0.2 * r } else { Vec3::ZERO };
        let middle = shape.push(middle, out, Vec2::splat(0.5));
        let mut triangle = |[a, b, c]: [u32; 3]| {
            let corners = if at_tip { [a, b, c] } else { [a, c, b] };
            shape.triangle(corners, material);
        };
        for ring in 0..rings {
            for k in 0..self.sides {
                let a = start + ring * columns + k;
                let (b, c, d) = (a + 1, a + columns, a + columns + 1);
                triangle([a, b, d]);
                triangle([a, d, c]);
            }
        }
        let last = start + rings * columns;
        for k in 0..self.sides {
            triangle([last + k, last + k + 1, middle]);
        }
    }
}

/// What is left of branches. Those on the underside broke when the stem fell.
fn stubs(plan: &LogPlan, materials: &LogMaterials, shape: &mut Shape, rng: &mut impl Rng) {
    let (count, longest_m) = match plan.stage {
        DecayStage::Fresh => (3 + rng.below(6), 0.55),
        DecayStage::Loosening => (2 + rng.below(4), 0.30),
        DecayStage::Bare => (rng.below(3), 0.16),
        DecayStage::Soft | DecayStage::Rotten => (0, 0.0),
    };
    let [butt, tip] = plan.radius_m;
    for _ in 0..count {
        let t = rng.range_f32(0.25, 0.97);
        let r = butt + (tip - butt) * t;
        let thick = (r * rng.range_f32(0.12, 0.30)).clamp(0.006, 0.035);
        let length = longest_m * (0.25 + 0.75 * rng.unit_f32() * rng.unit_f32());
        let angle = TAU * rng.range_f32(0.27, 0.73);
        let out = Vec3::new(0.0, libm::sinf(angle), -libm::cosf(angle));
        // Branches of a lying tree point to its top.
        let way = (out + Vec3::X * rng.range_f32(0.2, 0.9)).normalize_or(Vec3::Z);
        let base = Vec3::new(plan.length_m * (t - 0.5), 0.0, 0.0) + out * (0.6 * r);
        let bend = Vec3::new(
            rng.range_f32(-0.1, 0.1),
            rng.range_f32(-0.1, 0.1),
            rng.range_f32(-0.05, 0.15),
        );
        let line = [
            base,
            base + way * (0.4 * r + 0.5 * length),
            base + (way + bend).normalize_or(way) * (0.4 * r + length),
        ];
        shape.tube(
            &line,
            &[thick, 0.85 * thick, 0.65 * thick],
            6,
            materials.stub,
        );
    }
}
