//! The parts of shapes: triangles and leaf cards.

use glam::{Vec2, Vec3};

use crate::MaterialId;

/// A corner-indexed triangle with its material. Counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Triangle {
    /// Indices into the mesh's vertices.
    pub corners: [u32; 3],
    /// Its material.
    pub material: MaterialId,
}

/// The blend of a triangle's colour into that of its neighbours, so that no border between two
/// grounds is sharp.
///
/// Everything else comes from the triangle's own material: class, roughness, what a laser gets
/// back.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Blend {
    /// The neighbours' material.
    pub other: MaterialId,
    /// Its share at the triangle's corners, 0..=1.
    pub shares: [f32; 3],
}

impl Blend {
    /// No blending.
    pub const NONE: Self = Self {
        other: MaterialId(0),
        shares: [0.0; 3],
    };
}

/// Indexed triangles with per-vertex normals and texture coordinates.
///
/// Invariant of a [`Prototype`](crate::Prototype): normals and texture coordinates are as many as
/// positions or none, indices are in range, and blends are as many as triangles or none.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Mesh {
    /// Positions, metres.
    pub positions: Vec<Vec3>,
    /// Unit shading normals; without them triangles are shaded flat.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, in repetitions of the texture (metres for ground materials); without
    /// them 0 everywhere. A LiDAR needs them only where a triangle's material has a mask. A mask
    /// does not repeat: coordinates outside 0..1 clamp.
    pub uvs: Vec<Vec2>,
    /// The triangles.
    pub triangles: Vec<Triangle>,
    /// One blend for each triangle, in their order, or none at all. Only ground materials blend.
    pub blends: Vec<Blend>,
}

impl Mesh {
    /// The shading normal of a vertex; `None` if the mesh has none.
    #[inline]
    #[must_use]
    pub fn normal(&self, vertex: u32) -> Option<Vec3> {
        self.normals.get(vertex as usize).copied()
    }

    /// The texture coordinate of a vertex.
    #[inline]
    #[must_use]
    pub fn uv(&self, vertex: u32) -> Vec2 {
        self.uvs.get(vertex as usize).copied().unwrap_or(Vec2::ZERO)
    }
}

/// A flat parallelogram with a whole texture and mask on it: leaves, needles, blades.
///
/// The point at (u, v) is `corner + u · edge_u + v · edge_v`, u and v in 0..1. Both sides are
/// visible; the normal is `edge_u × edge_v`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Card {
    /// The point at u = v = 0, metres.
    pub corner: Vec3,
    /// The vector from there to u = 1, metres.
    pub edge_u: Vec3,
    /// The vector from there to v = 1, metres.
    pub edge_v: Vec3,
    /// Its material.
    pub material: MaterialId,
}

impl Card {
    /// The four corners.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 4] {
        let (a, u, v) = (self.corner, self.edge_u, self.edge_v);
        [a, a + u, a + u + v, a + v]
    }

    /// Area of the whole parallelogram, m².
    #[must_use]
    pub fn area_m2(&self) -> f32 {
        self.edge_u.cross(self.edge_v).length()
    }
}
