//! Collision shapes: stems as cylinders, everything solid as triangles.

use std::fmt::Write;

use nemoral_scene::glam::{Vec2, Vec3};
use nemoral_scene::{Instance, MaterialLibrary, Prototype, Semantic};

/// An upright cylinder in a shape's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Its centre, metres.
    pub centre_m: Vec3,
    /// Its radius, metres.
    pub radius_m: f32,
    /// Its length, metres.
    pub length_m: f32,
}

/// The length that a stem's cylinders have at most, metres.
const LENGTH_M: f32 = 1.5;

/// The stem of a tree as cylinders on top of each other, which follow its lean and its taper; none
/// for shapes without a stem. Limbs and branches are not in it.
///
/// The radius of each is the mean distance of the stem's surface from its axis there.
#[must_use]
pub fn stem_cylinders(shape: &Prototype, materials: &MaterialLibrary) -> Vec<Cylinder> {
    let mesh = shape.mesh();
    let is_stem = |semantic| {
        matches!(
            semantic,
            Semantic::Stem | Semantic::RootFlare | Semantic::Snag
        )
    };
    let triangles: Vec<[Vec3; 3]> = mesh
        .triangles
        .iter()
        .filter(|t| is_stem(materials.get(t.material).semantic))
        .map(|t| t.corners.map(|c| mesh.positions[c as usize]))
        .collect();
    let heights = triangles.iter().flatten().map(|p| p.z);
    let low = heights.clone().fold(f32::INFINITY, f32::min);
    let high = heights.fold(f32::NEG_INFINITY, f32::max);
    if high <= low {
        return Vec::new();
    }
    let count = ((high - low) / LENGTH_M).ceil().max(1.0);
    let length_m = (high - low) / count;
    let mut cylinders = Vec::new();
    for i in 0..count as usize {
        let middle = low + (i as f32 + 0.5) * length_m;
        if let Some((centre, radius_m)) = section(&triangles, middle) {
            cylinders.push(Cylinder {
                centre_m: centre.extend(middle),
                radius_m,
                length_m,
            });
        }
    }
    cylinders
}

/// Centre and mean radius of the section of some triangles with a level, by the lengths of the
/// pieces of its outline; `None` if the level cuts none.
fn section(triangles: &[[Vec3; 3]], level: f32) -> Option<(Vec2, f32)> {
    let mut pieces: Vec<[Vec2; 2]> = Vec::new();
    for corners in triangles {
        let mut ends = Vec::new();
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            if (a.z < level) != (b.z < level) {
                let t = (level - a.z) / (b.z - a.z);
                ends.push(a.lerp(b, t).truncate());
            }
        }
        if let [a, b] = ends[..] {
            pieces.push([a, b]);
        }
    }
    let length: f32 = pieces.iter().map(|[a, b]| a.distance(*b)).sum();
    if length <= 0.0 {
        return None;
    }
    let middle = |[a, b]: &[Vec2; 2]| (*a + *b) / 2.0;
    let centre = pieces
        .iter()
        .map(|p| middle(p) * p[0].distance(p[1]))
        .sum::<Vec2>()
        / length;
    let radius = pieces
        .iter()
        .map(|p| middle(p).distance(centre) * p[0].distance(p[1]))
        .sum::<f32>()
        / length;
    (radius > 0.0).then_some((centre, radius))
}

/// The triangles of some instances as an OBJ file, without materials; cards, which collide with
/// nothing, are not in it. `about` is the point that becomes the origin.
pub(super) fn obj(instances: &[&Instance], about: Vec3) -> String {
    let mut text = String::from("# Triangles in metres, z up.\n");
    let mut first = 1;
    for instance in instances {
        let mesh = instance.prototype.mesh();
        let linear = instance.linear.as_dmat3();
        let offset = (instance.position_m - about).as_dvec3();
        // A mirror turns triangles inside out.
        let is_mirrored = linear.determinant() < 0.0;
        for &position in &mesh.positions {
            let p = (linear * position.as_dvec3() + offset).as_vec3();
            let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
        }
        for triangle in &mesh.triangles {
            let [a, mut b, mut c] = triangle.corners.map(|corner| first + corner);
            if is_mirrored {
                (b, c) = (c, b);
            }
            let _ = writeln!(text, "f {a} {b} {c}");
        }
        first += mesh.positions.len() as u32;
    }
    text
}
