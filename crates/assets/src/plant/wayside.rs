//! What lies across ways, under them and beside them: roots, steps, culverts, and beds of stones.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use nemoral_scene::MaterialId;
use nemoral_seed::{Draw, Key, Rng};

use super::rock::{RockPlan, StoneMaterials, stone};
use super::shape::{Shape, around};

/// Radius of a bed of stones, metres.
const BED_M: f32 = 0.52;

/// The stones of a bed at most.
const BED_STONES: usize = 95;

/// A root of a tree, 0.8 to 1.7 m long, along x: it rises from the ground, winds over it, may fork,
/// and sinks into it again.
pub(crate) fn root(material: MaterialId, rng: &mut impl Rng) -> Shape {
    let mut shape = Shape::default();
    let length = rng.range_f32(0.8, 1.7);
    let radius = rng.range_f32(0.016, 0.042);
    let [wide, narrow] = [rng.range_f32(0.02, 0.09), rng.range_f32(0.01, 0.03)];
    let [wide_phase, narrow_phase] = [rng.range_f32(0.0, TAU), rng.range_f32(0.0, TAU)];
    let bump_phase = rng.range_f32(0.0, TAU);
    let at = |t: f32| {
        let y =
            wide * libm::sinf(4.0 * t + wide_phase) + narrow * libm::sinf(13.0 * t + narrow_phase);
        // Its upper side is above the ground but near the ends.
        let arch = 1.0 - libm::powf((2.0 * t - 1.0).abs(), 3.0);
        let bump = 0.35 * libm::sinf(9.0 * t + bump_phase);
        Vec3::new(
            length * (t - 0.5),
            y,
            radius * (2.4 * arch - 2.0 + bump * arch),
        )
    };
    let thick = |t: f32| radius * (1.0 - 0.45 * t);
    let points: Vec<f32> = (0..=12).map(|i| i as f32 / 12.0).collect();
    let line: Vec<Vec3> = points.iter().map(|&t| at(t)).collect();
    let radii: Vec<f32> = points.iter().map(|&t| thick(t)).collect();
    shape.tube(&line, &radii, 8, material);
    if rng.chance(0.6) {
        let from = rng.range_f32(0.3, 0.55);
        let turn = rng.range_f32(0.35, 0.75) * if rng.chance(0.5) { 1.0 } else { -1.0 };
        let reach = rng.range_f32(0.35, 0.6) * length;
        let start = at(from);
        let side = |t: f32| {
            let angle = turn * (1.0 + 0.3 * t);
            let out = Vec3::new(libm::cosf(angle), libm::sinf(angle), 0.0);
            start + out * (reach * t) - Vec3::Z * (1.9 * radius * t * t)
        };
        let points: Vec<f32> = (0..=6).map(|i| i as f32 / 6.0).collect();
        let line: Vec<Vec3> = points.iter().map(|&t| side(t)).collect();
        let radii: Vec<f32> = points
            .iter()
            .map(|&t| 0.7 * thick(from) * (1.0 - 0.5 * t))
            .collect();
        shape.tube(&line, &radii, 6, material);
    }
    shape
}

/// Of what a step is made.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepMaterials {
    pub(crate) log: MaterialId,
    /// The earth behind it.
    pub(crate) tread: MaterialId,
}

/// A step on a way a metre wide that goes down along +y by a fifth to a third: a log across it, two
/// stakes that hold it, and earth behind, trodden about level.
pub(crate) fn step(of: StepMaterials, rng: &mut impl Rng) -> Shape {
    const TREAD_M: f32 = 0.42;
    let mut shape = Shape::default();
    let radius = rng.range_f32(0.055, 0.075);
    let half = rng.range_f32(0.5, 0.62);
    let skew = rng.range_f32(-0.04, 0.04);
    let bow = rng.range_f32(-0.012, 0.012);
    let top = radius * 1.25;
    let at = |t: f32| {
        let x = half * (2.0 * t - 1.0);
        let off = 1.0 - (2.0 * t - 1.0) * (2.0 * t - 1.0);
        Vec3::new(
            x,
            skew * (2.0 * t - 1.0) + bow * off,
            top - radius + 0.5 * bow * off,
        )
    };
    let line: Vec<Vec3> = (0..=8).map(|i| at(i as f32 / 8.0)).collect();
    let taper = rng.range_f32(-0.12, 0.12);
    let radii: Vec<f32> = (0..=8)
        .map(|i| radius * (1.0 + taper * (i as f32 / 4.0 - 1.0)))
        .collect();
    shape.tube(&line, &radii, 10, of.log);
    for t in [rng.range_f32(0.12, 0.25), rng.range_f32(0.75, 0.88)] {
        let foot = at(t) + Vec3::Y * (1.25 * radius);
        let thick = rng.range_f32(0.018, 0.026);
        let head = top + rng.range_f32(-0.015, 0.025);
        let lean = Vec3::new(rng.range_f32(-0.03, 0.03), -0.01, 0.0);
        let line = [foot.with_z(-0.12), foot.with_z(head) + lean];
        shape.tube(&line, &[thick, 0.9 * thick], 7, of.log);
    }
    // The tread begins under the log's upper side and runs out in the ground.
    const ROWS: usize = 8;
    const COLUMNS: usize = 16;
    let phases = [(); 3].map(|()| rng.range_f32(0.0, TAU));
    let point = |i: usize, k: usize| {
        let (v, u) = (
            i as f32 / ROWS as f32,
            2.0 * k as f32 / COLUMNS as f32 - 1.0,
        );
        let edge = 1.0 - u * u * u * u;
        let reach = TREAD_M * (0.85 + 0.12 * libm::sinf(5.0 * u + phases[0])) * edge.max(0.25);
        let rough = 0.006
            * (libm::sinf(9.0 * u + 7.0 * v + phases[1])
                + libm::sinf(17.0 * u - 11.0 * v + phases[2]));
        let height = (0.85 * top) * (1.0 - v) * edge + rough - 0.03 * v - 0.05 * (1.0 - edge);
        Vec3::new(0.98 * half * u, at(0.5 + 0.5 * u).y - reach * v, height)
    };
    let row = |i: usize| (0..=COLUMNS).map(|k| point(i, k)).collect();
    let rows: Vec<Vec<Vec3>> = (0..=ROWS).map(row).collect();
    shape.surface(&rows, |i, k| rows[i][k].truncate() / 2.0, of.tread);
    shape
}

/// The mouth of a culvert: the end of a pipe 0.4 m wide, with its axis about at z = 0, that comes
/// out of the ground along +x. As ground has no holes, its inside ends at a dark wall a hand deep.
pub(crate) fn culvert([pipe, dark]: [MaterialId; 2], rng: &mut impl Rng) -> Shape {
    const SIDES: u32 = 24;
    let mut shape = Shape::default();
    let [outer, inner] = [0.215, 0.17];
    let axis_m = 0.03 + rng.range_f32(-0.02, 0.02);
    let out = rng.range_f32(0.22, 0.4);
    let tilt = rng.range_f32(-0.04, 0.02);
    // From the buried end along the outside, over the rim, and along the inside to its dark end.
    let rings = [
        (-1.4, outer, Vec2::Y),
        (out - 0.015, outer, Vec2::Y),
        (out, outer - 0.012, Vec2::X),
        (out, inner + 0.008, Vec2::X),
        (out - 0.012, inner, Vec2::NEG_Y),
        (out - 0.14, inner, Vec2::NEG_Y),
    ];
    let mut along = 0.0;
    for (i, (x, radius, facing)) in rings.iter().enumerate() {
        if i > 0 {
            let (x0, r0, _) = rings[i - 1];
            along += Vec2::new(x - x0, radius - r0).length();
        }
        for k in 0..=SIDES {
            let angle = TAU * k as f32 / SIDES as f32;
            let radial = Vec3::new(0.0, libm::cosf(angle), libm::sinf(angle));
            let p = Vec3::new(*x, 0.0, axis_m + tilt * x) + radial * *radius;
            let uv = Vec2::new(k as f32 / SIDES as f32, along) * 2.0;
            shape.push(p, Vec3::X * facing.x + radial * facing.y, uv);
        }
    }
    for i in 0..rings.len() as u32 - 1 {
        for k in 0..SIDES {
            let a = i * (SIDES + 1) + k;
            let (b, c, d) = (a + 1, a + SIDES + 1, a + SIDES + 2);
            shape.triangle([a, b, d], pipe);
            shape.triangle([a, d, c], pipe);
        }
    }
    let wall_m = out - 0.13;
    let at = |y: f32, z: f32| Vec3::new(wall_m, y, axis_m + tilt * wall_m + z);
    let middle = shape.push(at(0.0, 0.0), Vec3::X, Vec2::ZERO);
    let rim: Vec<u32> = (0..=SIDES)
        .map(|k| {
            let angle = TAU * k as f32 / SIDES as f32;
            let (y, z) = (inner * libm::cosf(angle), inner * libm::sinf(angle));
            shape.push(at(y, z), Vec3::X, Vec2::new(y, z))
        })
        .collect();
    for pair in rim.windows(2) {
        shape.triangle([middle, pair[0], pair[1]], dark);
    }
    shape
}

/// Stones beside stones, from gravel to the size of a head, half sunk.
pub(crate) fn bed(materials: StoneMaterials, key: Key) -> Shape {
    let mut rng = key.rng();
    let mut stones: Vec<(Vec2, f32)> = Vec::new();
    // Large ones lie first, and small ones fill what is left between.
    for i in 0..2400 {
        if stones.len() >= BED_STONES {
            break;
        }
        let largest = 0.095 * libm::expf(-3.0 * i as f32 / 2400.0);
        let radius = largest * rng.range_f32(0.7, 1.0);
        let angle = rng.range_f32(0.0, TAU);
        let out = (BED_M - radius) * rng.unit_f32().sqrt();
        let at = Vec2::new(libm::cosf(angle), libm::sinf(angle)) * out;
        if (stones.iter()).all(|(other, r)| at.distance(*other) > 0.93 * (radius + r)) {
            stones.push((at, radius));
        }
    }
    let mut shape = Shape::default();
    for (i, (at, radius_m)) in stones.into_iter().enumerate() {
        let key = key.item(i as u64);
        let plan = RockPlan {
            radius_m,
            subdivisions: 1,
            sunk: key.item(1).rng().range_f32(0.35, 0.6),
            roughness: 0.05,
            material: materials.stone,
            tile_m: 0.5,
        };
        let turn = around(key.item(2).rng().range_f32(0.0, TAU)).truncate();
        shape.add(&stone(&plan, materials, key.item(0)), turn, at.extend(0.0));
    }
    shape
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_come_out_of_the_ground_and_go_back() {
        for i in 0..32 {
            let shape = root(MaterialId(0), &mut Key::world(i).rng());
            let mesh = &shape.mesh;
            let top = mesh.positions.iter().fold(0.0_f32, |a, p| a.max(p.z));
            assert!((0.01..0.08).contains(&top), "{top}");
            let end = mesh.positions.iter().fold(0.0_f32, |a, p| a.max(p.x.abs()));
            for p in mesh.positions.iter().filter(|p| p.x.abs() > end - 0.005) {
                assert!(p.z < 0.005, "an end is buried: {p}");
            }
        }
    }

    #[test]
    fn steps_are_as_high_as_a_log_and_level_behind_it() {
        let of = StepMaterials {
            log: MaterialId(0),
            tread: MaterialId(1),
        };
        for i in 0..16 {
            let mesh = step(of, &mut Key::world(i).rng()).mesh;
            let top = mesh.positions.iter().fold(0.0_f32, |a, p| a.max(p.z));
            assert!((0.06..0.13).contains(&top), "{top}");
            let reach = mesh.positions.iter().fold(0.0_f32, |a, p| a.max(p.x.abs()));
            assert!((0.48..0.7).contains(&reach), "{reach}");
            for t in mesh.triangles.iter().filter(|t| t.material == of.tread) {
                let [a, b, c] = t.corners.map(|c| mesh.positions[c as usize]);
                assert!((b - a).cross(c - a).z > 0.0, "its earth faces up");
                assert!(mesh.normals[t.corners[0] as usize].z > 0.4);
            }
            // Its earth ends in the ground, away from the log.
            let end = &mesh.positions[mesh.positions.len() - 17..];
            assert!(end.iter().all(|p| p.z < 0.0), "{end:?}");
        }
    }

    #[test]
    fn a_culvert_is_a_pipe_whose_faces_look_out_of_the_wall() {
        let mesh = culvert([MaterialId(0), MaterialId(1)], &mut Key::world(3).rng()).mesh;
        for t in &mesh.triangles {
            let [a, b, c] = t.corners.map(|c| mesh.positions[c as usize]);
            let normals = t.corners.map(|c| mesh.normals[c as usize]);
            let facing = (b - a).cross(c - a);
            let mean = normals[0] + normals[1] + normals[2];
            assert!(
                facing.length() < 1e-7 || facing.dot(mean) > 0.0,
                "{facing} {mean}"
            );
        }
        let dark = mesh
            .triangles
            .iter()
            .filter(|t| t.material == MaterialId(1));
        assert!(
            dark.flat_map(|t| t.corners)
                .all(|c| mesh.positions[c as usize].x < 0.3)
        );
    }

    #[test]
    fn stones_of_a_bed_lie_beside_each_other_and_cover_it() {
        for i in 0..8 {
            let materials = StoneMaterials {
                stone: MaterialId(0),
                pebble: MaterialId(1),
            };
            let shape = bed(materials, Key::world(i));
            let mesh = &shape.mesh;
            assert_eq!(mesh.normals.len(), mesh.positions.len());
            assert_eq!(mesh.uvs.len(), mesh.positions.len());
            let reach = shape.reach_m();
            assert!((0.4..0.62).contains(&reach), "{reach}");
            // The share of a grid's cells of 4 cm that a stone is above.
            let mut covered = std::collections::BTreeSet::new();
            for p in mesh.positions.iter().filter(|p| p.z > 0.0) {
                covered.insert(((p.x / 0.04).floor() as i32, (p.y / 0.04).floor() as i32));
            }
            let cells = std::f32::consts::PI * BED_M * BED_M / (0.04 * 0.04);
            let share = covered.len() as f32 / cells;
            assert!(share > 0.5, "{share}");
        }
    }
}
