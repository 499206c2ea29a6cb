//! Why a shape is refused.

use std::fmt;

use crate::{MaterialId, Prototype};

/// Why a shape is not a [`Prototype`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PrototypeError {
    /// Neither triangles nor cards.
    Empty {
        /// The shape's name.
        name: String,
    },
    /// Normals or uvs are neither as many as positions nor none.
    VertexArrays {
        /// The shape's name.
        name: String,
        /// How many positions, normals and uvs there are.
        lengths: [usize; 3],
    },
    /// There are blends, but not one for each triangle.
    Blends {
        /// The shape's name.
        name: String,
        /// How many blends there are.
        blends: usize,
        /// How many triangles there are.
        triangles: usize,
    },
    /// A triangle's corner is out of range.
    Index {
        /// The shape's name.
        name: String,
        /// The triangle's number.
        triangle: usize,
        /// The offending index.
        index: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// Its ambient occlusion belongs to another shape, or to a mesh with blends, which must have
    /// none.
    AmbientOcclusion {
        /// The shape's name.
        name: String,
        /// The number of vertices and of cards for which there are shares.
        shares: [usize; 2],
        /// How many vertices and cards there are.
        lengths: [usize; 2],
    },
    /// Windows are not as many as cards, not finite, or too many different ones.
    Windows {
        /// The shape's name.
        name: String,
        /// How many windows there are.
        windows: usize,
        /// How many cards there are.
        cards: usize,
        /// How many different pairs of a material and a window are allowed.
        allowed: usize,
    },
    /// A coordinate, a normal or a uv is not finite, or a coordinate is beyond
    /// ±[`Prototype::FARTHEST_M`].
    NotFinite {
        /// The shape's name.
        name: String,
    },
    /// A material is not in the library.
    Material {
        /// The shape's name.
        name: String,
        /// The offending material.
        material: MaterialId,
        /// How many materials there are.
        materials: usize,
    },
}

impl fmt::Display for PrototypeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty { name } => write!(f, "shape `{name}` has neither triangles nor cards"),
            Self::VertexArrays {
                name,
                lengths: [p, n, t],
            } => {
                write!(
                    f,
                    "shape `{name}` has {p} positions, {n} normals and {t} uvs: give one of each, \
                     or none"
                )
            }
            Self::Blends {
                name,
                blends,
                triangles,
            } => write!(
                f,
                "shape `{name}` has {blends} blends for {triangles} triangles: give one of each, \
                 or none"
            ),
            Self::Index {
                name,
                triangle,
                index,
                vertices,
            } => write!(
                f,
                "shape `{name}`, triangle {triangle}: vertex {index} of {vertices} does not exist"
            ),
            Self::AmbientOcclusion {
                name,
                shares: [of_vertices, of_cards],
                lengths: [vertices, cards],
            } => write!(
                f,
                "shape `{name}` has ambient occlusion of {of_vertices} vertices and {of_cards} \
                 cards for {vertices} and {cards}: give one of each, and none to shapes that blend"
            ),
            Self::Windows {
                name,
                windows,
                cards,
                allowed,
            } => write!(
                f,
                "shape `{name}` has {windows} windows for {cards} cards: give one of each with \
                 finite numbers, at most {allowed} different ones, or none"
            ),
            Self::NotFinite { name } => {
                write!(
                    f,
                    "shape `{name}` has a coordinate, a normal or a uv that is not finite, or a \
                     coordinate beyond ±{:e} m",
                    Prototype::FARTHEST_M
                )
            }
            Self::Material {
                name,
                material,
                materials,
            } => {
                write!(
                    f,
                    "shape `{name}`: material {} of {materials} does not exist",
                    material.0
                )
            }
        }
    }
}

impl std::error::Error for PrototypeError {}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;
    use crate::{Blend, Material, MaterialLibrary, Mesh, Semantic, Triangle};

    /// The error message about a mesh that was made invalid.
    fn refused(spoil: impl Fn(&mut Mesh)) -> String {
        let mut library = MaterialLibrary::new();
        library.add(Material::plain("soil", Semantic::Soil, Vec3::ONE));
        let mut mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            uvs: vec![Vec2::ZERO; 3],
            triangles: vec![Triangle {
                corners: [0, 1, 2],
                material: MaterialId(0),
            }],
            blends: vec![Blend::uniform(MaterialId(0))],
        };
        spoil(&mut mesh);
        match Prototype::new("heap", mesh, Vec::new(), &library) {
            Ok(_) => String::new(),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn what_is_no_shape_is_refused_by_name() {
        assert_eq!(refused(|_| ()), "");
        assert_eq!(refused(|m| m.blends.clear()), "");
        assert_eq!(refused(|m| m.normals.clear()), "");
        assert_eq!(refused(|m| m.uvs.clear()), "");
        type Spoil = fn(&mut Mesh);
        let not_finite = "shape `heap` has a coordinate, a normal or a uv that is not finite, or a \
                          coordinate beyond ±1e9 m";
        let spoilt: [(Spoil, &str); 10] = [
            (
                |m| *m = Mesh::default(),
                "shape `heap` has neither triangles nor cards",
            ),
            (
                |m| m.uvs.truncate(2),
                "shape `heap` has 3 positions, 3 normals and 2 uvs: give one of each, or none",
            ),
            (
                |m| m.blends.push(Blend::uniform(MaterialId(0))),
                "shape `heap` has 2 blends for 1 triangles: give one of each, or none",
            ),
            (
                |m| m.triangles[0].corners[1] = 3,
                "shape `heap`, triangle 0: vertex 3 of 3 does not exist",
            ),
            (
                |m| m.triangles[0].material = MaterialId(1),
                "shape `heap`: material 1 of 1 does not exist",
            ),
            (
                |m| m.blends[0].corners[2][1] = MaterialId(7),
                "shape `heap`: material 7 of 1 does not exist",
            ),
            (|m| m.positions[2].x = f32::NAN, not_finite),
            (|m| m.positions[1].z = -1.1e9, not_finite),
            (|m| m.normals[1].z = f32::NAN, not_finite),
            (|m| m.uvs[0].y = f32::INFINITY, not_finite),
        ];
        for (spoil, said) in spoilt {
            assert_eq!(refused(spoil), said);
        }
    }
}
