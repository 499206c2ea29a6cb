//! A shape in parts of one material each, as the formats want them.

use std::collections::{BTreeMap, HashMap};

use nemoral_scene::glam::{Vec2, Vec3};
use nemoral_scene::{Material, MaterialId, MaterialLibrary, Prototype};

/// The triangles of one material of a shape; cards are two triangles each.
#[derive(Clone, Debug, PartialEq)]
pub struct Submesh {
    /// Its material.
    pub material: MaterialId,
    /// Positions, metres.
    pub positions: Vec<Vec3>,
    /// Unit normals, one for each position.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one for each position; row 0 of a texture is at v = 0.
    pub uvs: Vec<Vec2>,
    /// Three vertices for each triangle, counter-clockwise seen from outside.
    pub indices: Vec<u32>,
}

/// Whether a shape is ground.
#[must_use]
pub fn is_ground(shape: &Prototype, materials: &MaterialLibrary) -> bool {
    let first = shape.mesh().triangles.first();
    first.is_some_and(|t| materials.get(t.material).ground)
}

/// Whether the surfaces of a material are seen from both sides, as leaves are: those that cards
/// have, that a mask cuts out, or that let light through.
pub(crate) fn is_double_sided(material: &Material, has_cards: bool) -> bool {
    has_cards || material.mask.is_some() || material.transmittance.max_element() > 0.0
}

/// The parts of a shape in order of their materials: triangles first, then cards, in their order.
///
/// Texture coordinates of the ground are in repetitions of its texture, where those of a shape are
/// in metres.
#[must_use]
pub fn parts(shape: &Prototype, materials: &MaterialLibrary) -> Vec<Submesh> {
    let mesh = shape.mesh();
    let mut parts = BTreeMap::new();
    for triangle in &mesh.triangles {
        let tile_m = match materials.get(triangle.material) {
            material if material.ground => material.tile_m,
            _ => 1.0,
        };
        let flat = face_normal(triangle.corners.map(|c| mesh.positions[c as usize]));
        let (part, known) = of(&mut parts, triangle.material);
        for corner in triangle.corners {
            let mut add = || {
                part.positions.push(mesh.positions[corner as usize]);
                let normal = mesh.normal(corner).and_then(Vec3::try_normalize);
                part.normals.push(normal.unwrap_or(flat));
                part.uvs.push(mesh.uv(corner) / tile_m);
                part.positions.len() as u32 - 1
            };
            // Vertices without normals are shaded flat, so that triangles share none.
            let index = if mesh.normals.is_empty() {
                add()
            } else {
                *known.entry(corner).or_insert_with(add)
            };
            part.indices.push(index);
        }
    }
    for (number, card) in shape.cards().iter().enumerate() {
        let (part, _) = of(&mut parts, card.material);
        let first = part.positions.len() as u32;
        let window = shape.card_window(number);
        let normal = card.edge_u.cross(card.edge_v);
        let normal = normal.try_normalize().unwrap_or(Vec3::Z);
        const PLACES: [(f64, f64); 4] = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        for (corner, (s, t)) in card.corners().into_iter().zip(PLACES) {
            part.positions.push(corner);
            part.normals.push(normal);
            part.uvs.push(window.uv(s, t));
        }
        part.indices
            .extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
    }
    parts.into_values().map(|(part, _)| part).collect()
}

/// Parts, each with the numbers that its vertices have in the shape.
type Parts = BTreeMap<MaterialId, (Submesh, HashMap<u32, u32>)>;

fn of(parts: &mut Parts, material: MaterialId) -> &mut (Submesh, HashMap<u32, u32>) {
    parts.entry(material).or_insert_with(|| {
        let part = Submesh {
            material,
            positions: Vec::new(),
            normals: Vec::new(),
            uvs: Vec::new(),
            indices: Vec::new(),
        };
        (part, HashMap::new())
    })
}

fn face_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    let normal = (b - a).cross(c - a);
    normal.try_normalize().unwrap_or(Vec3::Z)
}
