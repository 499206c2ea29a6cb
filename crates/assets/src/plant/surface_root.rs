//! Roots that spread over the ground from the foot of an old tree.
//!
//! Such a root goes on from a lobe of the root flare as a ridge that falls steeply at first, then
//! winds outwards at the surface, dives here and there, forks, and sinks into the ground for good.
//! A shape lies along +x on the plane z = 0, for a lobe that ends [`LOBE_M`] from the stem's
//! middle; its x is 0 there.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use nemoral_scene::MaterialId;
use nemoral_seed::{Draw, Key};

use super::shape::{Shape, around};

/// The distance of the lobe's end from the middle of the stem for which roots are made, metres.
pub(crate) const LOBE_M: f32 = 0.3;
/// How far into the flare a root begins, metres.
const INSIDE_M: f32 = 0.16;
/// How far its sides reach into the ground below its upper side, metres.
const SKIRT_M: f32 = 0.13;
/// Points around its upper side; one more on either side is in the ground.
const AROUND: usize = 7;
const FORKS_MAX: u32 = 3;

/// One root and its forks.
pub(crate) fn surface_root(material: MaterialId, key: Key) -> Shape {
    let mut shape = Shape::default();
    let mut rng = key.rng();
    let main = Course::main(&mut rng);
    main.sweep(&mut shape, material);
    for i in 0..1 + rng.below(FORKS_MAX) {
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let fork = main.fork(side, &mut rng);
        fork.sweep(&mut shape, material);
    }
    shape
}

/// The course of a root over the ground, by t from 0, its beginning, to 1, its end.
struct Course {
    start: Vec2,
    heading: f32,
    length_m: f32,
    /// How far it turns along its length, radians.
    bend: f32,
    /// Half its width, and the same of the ridge that it begins with, metres.
    half_m: f32,
    ridge_m: f32,
    /// Phases of its windings and its dives.
    phases: [f32; 4],
}

impl Course {
    fn main(rng: &mut impl Draw) -> Self {
        Self {
            start: Vec2::new(-INSIDE_M, 0.0),
            heading: 0.0,
            length_m: rng.range_f32(1.1, 2.4),
            bend: rng.range_f32(-0.7, 0.7),
            half_m: rng.range_f32(0.026, 0.044),
            ridge_m: rng.range_f32(0.07, 0.12),
            phases: [(); 4].map(|()| rng.range_f32(0.0, TAU)),
        }
    }

    /// A thinner root that leaves this one.
    fn fork(&self, side: f32, rng: &mut impl Draw) -> Self {
        let t = rng.range_f32(0.15, 0.5);
        let share = rng.range_f32(0.5, 0.75);
        Self {
            start: self.place(t),
            heading: self.heading_at(t) + side * rng.range_f32(0.35, 0.85),
            length_m: rng.range_f32(0.35, 0.6) * self.length_m,
            bend: side * rng.range_f32(-0.7, 0.2),
            half_m: share * self.half_m_at(t),
            ridge_m: 0.0,
            phases: [(); 4].map(|()| rng.range_f32(0.0, TAU)),
        }
    }

    fn heading_at(&self, t: f32) -> f32 {
        let [slow, fast, ..] = self.phases;
        let winding = 0.35 * (libm::sinf(7.0 * t + slow) - libm::sinf(slow))
            + 0.2 * (libm::sinf(19.0 * t + fast) - libm::sinf(fast));
        self.heading + self.bend * t + winding
    }

    /// The place at t on the map.
    fn place(&self, t: f32) -> Vec2 {
        const STEPS: u32 = 24;
        let step = t / STEPS as f32;
        (0..STEPS).fold(self.start, |at, i| {
            let way = around(self.heading_at((i as f32 + 0.5) * step));
            at + way.truncate() * (self.length_m * step)
        })
    }

    fn half_m_at(&self, t: f32) -> f32 {
        self.half_m * (1.0 - 0.65 * t) + 0.5 * self.ridge(t)
    }

    /// The height of the ridge that a root begins with, metres.
    fn ridge(&self, t: f32) -> f32 {
        self.ridge_m * libm::expf(-t * self.length_m / 0.22)
    }

    /// The height of the upper side over the ground, metres.
    fn top_m(&self, t: f32) -> f32 {
        let [.., dive, bump] = self.phases;
        // Forks begin in the middle of the root that they leave.
        let begin = if self.ridge_m > 0.0 { 1.0 } else { 0.6 };
        let half_m = self.half_m * (1.0 - 0.65 * t);
        let wave = 0.75 * libm::sinf(8.0 * t + dive) + 0.3 * libm::sinf(23.0 * t + bump);
        // It dives only away from the tree.
        let depth = (1.4 * t).min(1.0) * wave;
        let sink = ((t - 0.72) / 0.28).clamp(0.0, 1.0);
        begin * (self.ridge(t) + half_m * (0.75 + 1.05 * depth))
            - (3.0 * half_m + 0.02) * sink * sink
    }

    fn sweep(&self, shape: &mut Shape, material: MaterialId) {
        let rings = (self.length_m / 0.055).ceil() as usize + 1;
        let columns = AROUND + 2;
        let share = |i: usize| i as f32 / rings as f32;
        let ring = |t: f32| {
            let (at, heading) = (self.place(t), self.heading_at(t));
            let side = around(heading).truncate().perp();
            let (half_m, top_m) = (self.half_m_at(t), self.top_m(t));
            let point = move |k: usize| {
                let angle = PI * (k.clamp(1, AROUND) - 1) as f32 / (AROUND - 1) as f32;
                let (sin, cos) = (libm::sinf(angle), libm::cosf(angle));
                if k == 0 || k == columns - 1 {
                    (at - side * (1.5 * half_m * cos)).extend(top_m - SKIRT_M)
                } else {
                    (at - side * (half_m * cos)).extend(top_m + 1.1 * half_m * (sin - 1.0))
                }
            };
            (0..columns).map(point).collect::<Vec<Vec3>>()
        };
        let rows: Vec<Vec<Vec3>> = (0..=rings).map(|i| ring(share(i))).collect();
        // Each shows another piece of the bark, which is finer than the stem's.
        let [u, v, ..] = self.phases;
        let uv = |i: usize, k: usize| {
            let around = 0.3 * k as f32 / (columns - 1) as f32;
            Vec2::new(u + around, v + self.length_m * share(i))
        };
        shape.surface(&rows, uv, material);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_begin_in_the_flare_stick_out_and_end_in_the_ground() {
        for i in 0..64 {
            let shape = surface_root(MaterialId(0), Key::world(i));
            let mesh = &shape.mesh;
            assert_eq!(mesh.normals.len(), mesh.positions.len());
            assert_eq!(mesh.uvs.len(), mesh.positions.len());
            let top = |from: f32, to: f32| {
                let there = mesh.positions.iter().filter(|p| (from..to).contains(&p.x));
                there.fold(f32::NEG_INFINITY, |m, p| m.max(p.z))
            };
            assert!(
                (0.08..0.2).contains(&top(-0.5, -0.1)),
                "{}",
                top(-0.5, -0.1)
            );
            assert!(top(0.1, 0.3) > 0.02, "{}", top(0.1, 0.3));
            let end = mesh.positions.iter().fold(0.0_f32, |m, p| m.max(p.x));
            assert!((0.6..2.5).contains(&end), "{end}");
            // Sides reach into the ground wherever the root is above it.
            assert!(mesh.positions.iter().all(|p| (-0.35..0.2).contains(&p.z)));
            for t in &mesh.triangles {
                let [a, b, c] = t.corners.map(|c| mesh.positions[c as usize]);
                let facing = (b - a).cross(c - a);
                let normal = mesh.normals[t.corners[0] as usize];
                assert!(facing.dot(normal) > -1e-4, "it faces outwards");
            }
            assert!(mesh.triangles.len() < 4000, "{}", mesh.triangles.len());
        }
    }
}
