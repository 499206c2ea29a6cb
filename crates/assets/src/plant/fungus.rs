//! Bracket fungi on dead wood: shelves in groups, their upper side up.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use nemoral_scene::MaterialId;
use nemoral_seed::Draw;

use super::shape::Shape;

/// Corners of a bracket's rim.
const CORNERS: u32 = 10;

/// Adds a bracket that grows out of wood: `at` is on the wood's surface, `out` level and away from
/// it, of length 1.
pub(crate) fn bracket(
    shape: &mut Shape,
    at: Vec3,
    out: Vec3,
    radius_m: f32,
    material: MaterialId,
    rng: &mut impl Draw,
) {
    let side = Vec3::Z.cross(out);
    let [wide, thick] = [rng.range_f32(1.0, 1.5), rng.range_f32(0.22, 0.42)];
    let lobes = rng.range_f32(0.0, TAU);
    let rim: Vec<Vec3> = (0..CORNERS)
        .map(|i| {
            let angle = TAU * i as f32 / CORNERS as f32;
            let (sin, cos) = (libm::sinf(angle), libm::cosf(angle));
            // Its back is in the wood.
            let reach = if cos > 0.0 { cos } else { 0.45 * cos };
            let lobe = 1.0 + 0.08 * libm::sinf(3.0 * angle + lobes);
            at + radius_m * lobe * (out * reach + side * (wide * sin))
                - Vec3::Z * (0.12 * radius_m * cos.max(0.0))
        })
        .collect();
    let back = at - out * (0.2 * radius_m);
    for (apex, is_top) in [(thick, true), (-0.7 * thick, false)] {
        let first = shape.mesh.positions.len() as u32;
        let up = if is_top { Vec3::Z } else { Vec3::NEG_Z };
        // Zones run along the rim above; below it is pale throughout.
        let zone = |share: f32| Vec2::new(if is_top { share } else { 0.97 }, 0.5);
        shape.push(back + Vec3::Z * (apex * radius_m), up, zone(0.05));
        for &p in &rim {
            let normal = (up + 0.5 * (p - back).normalize_or(out)).normalize_or(up);
            shape.push(p, normal, zone(0.93));
        }
        for i in 0..CORNERS {
            let (a, b) = (first + 1 + i, first + 1 + (i + 1) % CORNERS);
            let corners = if is_top { [first, a, b] } else { [first, b, a] };
            shape.triangle(corners, material);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_seed::Key;

    #[test]
    fn a_bracket_is_closed_and_faces_outwards() {
        for i in 0..16 {
            let mut shape = Shape::default();
            let out = Vec3::new(0.6, 0.8, 0.0);
            let mut rng = Key::world(i).rng();
            bracket(&mut shape, Vec3::ZERO, out, 0.08, MaterialId(0), &mut rng);
            let mesh = &shape.mesh;
            let mut volume = 0.0;
            for t in &mesh.triangles {
                let [a, b, c] = t.corners.map(|i| mesh.positions[i as usize]);
                volume += a.dot(b.cross(c)) / 6.0;
                let normal: Vec3 = t.corners.iter().map(|&i| mesh.normals[i as usize]).sum();
                assert!((b - a).cross(c - a).dot(normal) > 0.0, "{i}");
            }
            assert!((1e-5..1e-3).contains(&volume), "{volume}");
            let reach = mesh
                .positions
                .iter()
                .map(|p| p.dot(out))
                .fold(0.0, f32::max);
            assert!((0.05..0.1).contains(&reach), "{reach}");
        }
    }
}
