//! The surface of a shape in small pieces.

use glam::Vec3;
use nemoral_scene::{Card, MaterialId, Mesh, Prototype, Triangle};

use super::{MaskCoverage, PARTS};

/// A small piece of a shape's surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Its middle.
    pub(super) at: Vec3,
    /// The area of one side of thin leaves, of which half the surface of a closed mesh counts.
    pub(super) area_m2: f32,
    pub(super) material: MaterialId,
    /// Whether it is of a mesh that no mask cuts out.
    pub(super) is_solid: bool,
}

/// Calls a function with the pieces of all cards and triangles that reach below `top_m`. They are
/// at most `size_m` long, but for those of very large ones.
pub(super) fn for_each_piece(
    shape: &Prototype,
    masks: &MaskCoverage,
    (size_m, top_m): (f32, f32),
    mut take: impl FnMut(Piece),
) {
    let mesh = shape.mesh();
    for card in shape
        .cards()
        .iter()
        .filter(|card| reaches(&card.corners(), top_m))
    {
        of_card(card, masks, size_m, &mut take);
    }
    for triangle in mesh
        .triangles
        .iter()
        .filter(|t| reaches(&corners(mesh, t), top_m))
    {
        of_triangle(mesh, triangle, masks, size_m, &mut take);
    }
}

/// The size of pieces at which long cards and triangles that reach below `top_m` are about `most`.
pub(super) fn size_of_most(shape: &Prototype, top_m: f32, most: f32) -> f32 {
    let mesh = shape.mesh();
    let cards = shape.cards().iter();
    let cards = cards
        .filter(|card| reaches(&card.corners(), top_m))
        .map(|card| card.edge_u.length() * card.edge_v.length());
    let triangles = mesh.triangles.iter().map(|t| corners(mesh, t));
    let triangles = triangles
        .filter(|corners| reaches(corners, top_m))
        .map(|[a, b, c]| {
            let squares = [a - b, b - c, c - a].map(Vec3::length_squared);
            squares.into_iter().fold(0.0, f32::max)
        });
    (cards.chain(triangles).sum::<f32>() / most).sqrt()
}

fn reaches(corners: &[Vec3], top_m: f32) -> bool {
    corners.iter().any(|corner| corner.z < top_m)
}

fn corners(mesh: &Mesh, triangle: &Triangle) -> [Vec3; 3] {
    triangle.corners.map(|i| mesh.positions[i as usize])
}

fn of_card(card: &Card, masks: &MaskCoverage, size_m: f32, take: &mut impl FnMut(Piece)) {
    let pieces = |edge: Vec3| ((edge.length() / size_m).ceil() as usize).clamp(1, 256);
    let (nu, nv) = (pieces(card.edge_u), pieces(card.edge_v));
    // The parts of the mask that a piece overlaps.
    let parts = |i: usize, of: usize| [i * PARTS / of, ((i + 1) * PARTS).div_ceil(of)];
    let area_m2 = card.area_m2() / (nu * nv) as f32;
    for (i, j) in (0..nv).flat_map(|j| (0..nu).map(move |i| (i, j))) {
        let material = usize::from(card.material.0);
        let opaque = masks.opaque(material, parts(i, nu), parts(j, nv));
        let middle = |i: usize, of: usize| (i as f32 + 0.5) / of as f32;
        take(Piece {
            at: card.corner + card.edge_u * middle(i, nu) + card.edge_v * middle(j, nv),
            area_m2: area_m2 * opaque,
            material: card.material,
            is_solid: false,
        });
    }
}

/// Half the surface of a closed mesh counts, as the other half is its back. What a mask cuts out is
/// no closed mesh.
fn of_triangle(
    mesh: &Mesh,
    triangle: &Triangle,
    masks: &MaskCoverage,
    size_m: f32,
    take: &mut impl FnMut(Piece),
) {
    let [a, b, c] = corners(mesh, triangle);
    let (u, v) = (b - a, c - a);
    let longest = u.length().max(v.length()).max((c - b).length());
    let n = ((longest / size_m).ceil() as u32).clamp(1, 64);
    let is_solid = !masks.cuts_out(triangle.material);
    let half = if is_solid {
        1.0
    } else {
        2.0 * masks.opaque(usize::from(triangle.material.0), [0, PARTS], [0, PARTS])
    };
    let area_m2 = half * 0.25 * u.cross(v).length() / (n * n) as f32;
    let mut piece = |at: Vec3| {
        take(Piece {
            at,
            area_m2,
            material: triangle.material,
            is_solid,
        });
    };
    let step = 1.0 / (3 * n) as f32;
    for (i, j) in (0..n).flat_map(|j| (0..n - j).map(move |i| (i, j))) {
        // The middles of the small triangles that stand on their base, and of those on their tip.
        let (x, y) = ((3 * i) as f32 * step, (3 * j) as f32 * step);
        piece(a + u * (x + step) + v * (y + step));
        if i + j + 1 < n {
            piece(a + u * (x + 2.0 * step) + v * (y + 2.0 * step));
        }
    }
}
