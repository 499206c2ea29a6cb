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

/// The materials whose colours a triangle of the ground has at its corners, between which they
/// pass over into each other, so that no border between grounds is sharp.
///
/// Everything but colour and roughness comes from the triangle's own material: its class, and what
/// a laser gets back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Blend {
    /// Of each corner two halves, which are equal inside of a ground.
    pub corners: [[MaterialId; 2]; 3],
}

impl Blend {
    /// One material at all corners.
    #[must_use]
    pub const fn uniform(material: MaterialId) -> Self {
        Self {
            corners: [[material; 2]; 3],
        }
    }

    /// The one material of all corners, if there is one.
    #[must_use]
    pub fn is_uniform(&self) -> bool {
        let all = self.corners.as_flattened();
        all.iter().all(|material| *material == all[0])
    }

    /// The three lowest of the corners' materials, in order; the last is repeated if there are
    /// fewer. More than three are rare, and the lowest stands for the others.
    #[must_use]
    pub fn materials(&self) -> [MaterialId; 3] {
        let all = self.corners.as_flattened();
        let above = |low: MaterialId| {
            all.iter()
                .copied()
                .filter(|&m| m > low)
                .min()
                .unwrap_or(low)
        };
        let first = all.iter().copied().min().expect("there are six halves");
        let second = above(first);
        [first, second, above(second)]
    }

    /// Which of [`materials`](Self::materials) the halves of each corner are, lower ones first.
    #[must_use]
    pub fn numbers(&self) -> [[usize; 2]; 3] {
        let materials = self.materials();
        let number = |m: MaterialId| materials.iter().position(|&known| known == m).unwrap_or(0);
        self.corners.map(|halves| {
            let mut numbers = halves.map(number);
            numbers.sort_unstable();
            numbers
        })
    }

    /// The mixture at a place whose weights are those of the corners, which sum to 1.
    #[must_use]
    pub fn at(&self, weights: [f32; 3]) -> GroundMixture {
        let mut shares = [0.0; 3];
        for (halves, weight) in self.numbers().into_iter().zip(weights) {
            for number in halves {
                shares[number] += 0.5 * weight;
            }
        }
        GroundMixture {
            materials: self.materials(),
            shares,
        }
    }
}

/// Ground materials that meet at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GroundMixture {
    /// In the order of their ids.
    pub materials: [MaterialId; 3],
    /// Of each its share, 0..=1, before borders are roughened. They sum to 1.
    pub shares: [f32; 3],
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grounds_meet_by_the_corners_halves() {
        let [a, b, c, d] = [2, 5, 9, 11].map(MaterialId);
        let blend = Blend {
            corners: [[c, c], [a, b], [b, a]],
        };
        assert!(!blend.is_uniform() && Blend::uniform(b).is_uniform());
        assert_eq!(blend.materials(), [a, b, c]);
        assert_eq!(blend.numbers(), [[2, 2], [0, 1], [0, 1]]);
        assert_eq!(blend.at([0.5, 0.25, 0.25]).shares, [0.25, 0.25, 0.5]);
        // Two are told by the last again, and of four the lowest stands for the highest.
        let two = Blend {
            corners: [[c, c], [a, a], [a, c]],
        };
        assert_eq!(two.materials(), [a, c, c]);
        assert_eq!(two.at([0.0, 0.0, 1.0]).shares, [0.5, 0.5, 0.0]);
        let four = Blend {
            corners: [[a, b], [c, c], [d, d]],
        };
        assert_eq!(four.materials(), [a, b, c]);
        assert_eq!(four.at([0.25, 0.25, 0.5]).shares, [0.625, 0.125, 0.25]);
    }
}
