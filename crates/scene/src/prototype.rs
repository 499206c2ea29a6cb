//! Shapes: triangles and leaf cards, made once and placed many times.

use std::fmt;
use std::sync::Arc;

use glam::{Mat3, Vec2, Vec3};

use crate::{AmbientOcclusion, Bounds, Card, MaterialId, MaterialLibrary, Mesh, ObjectId};

/// A shape that instances share: a tree, a rock, a patch of grass, a chunk's ground.
#[derive(Clone, Debug)]
pub struct Prototype {
    name: String,
    mesh: Mesh,
    cards: Vec<Card>,
    bounds: Bounds,
    ambient_occlusion: Option<AmbientOcclusion>,
}

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
    /// A blend's share is not within 0..=1.
    Share {
        /// The shape's name.
        name: String,
        /// The triangle's number.
        triangle: usize,
        /// The offending share.
        share: f32,
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
    /// A coordinate is not finite.
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
            Self::Share {
                name,
                triangle,
                share,
            } => write!(
                f,
                "shape `{name}`, triangle {triangle}: its blend has a share of {share}, allowed is \
                 0..=1"
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
            Self::NotFinite { name } => {
                write!(f, "shape `{name}` has a coordinate that is not finite")
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

impl Prototype {
    /// Makes a shape from valid parts.
    ///
    /// # Errors
    /// If it is empty, its vertex arrays differ in length (except empty ones), blends are missing,
    /// an index or material is out of range, or a coordinate is not finite.
    pub fn new(
        name: impl Into<String>,
        mesh: Mesh,
        cards: Vec<Card>,
        library: &MaterialLibrary,
    ) -> Result<Self, PrototypeError> {
        let name = name.into();
        let vertices = mesh.positions.len();
        let lengths = [vertices, mesh.normals.len(), mesh.uvs.len()];
        if mesh.triangles.is_empty() && cards.is_empty() {
            return Err(PrototypeError::Empty { name });
        }
        if lengths[1..].iter().any(|n| ![0, vertices].contains(n)) {
            return Err(PrototypeError::VertexArrays { name, lengths });
        }
        if ![0, mesh.triangles.len()].contains(&mesh.blends.len()) {
            return Err(PrototypeError::Blends {
                name,
                blends: mesh.blends.len(),
                triangles: mesh.triangles.len(),
            });
        }
        for (triangle, blend) in mesh.blends.iter().enumerate() {
            if let Some(&share) = blend.shares.iter().find(|s| !(0.0..=1.0).contains(*s)) {
                return Err(PrototypeError::Share {
                    name,
                    triangle,
                    share,
                });
            }
        }
        for (i, triangle) in mesh.triangles.iter().enumerate() {
            if let Some(&index) = triangle.corners.iter().find(|&&c| c as usize >= vertices) {
                return Err(PrototypeError::Index {
                    name,
                    triangle: i,
                    index,
                    vertices,
                });
            }
        }
        let used = mesh
            .triangles
            .iter()
            .map(|t| t.material)
            .chain(mesh.blends.iter().map(|b| b.other))
            .chain(cards.iter().map(|c| c.material));
        let materials = library.materials().len();
        for material in used {
            if usize::from(material.0) >= materials {
                return Err(PrototypeError::Material {
                    name,
                    material,
                    materials,
                });
            }
        }
        let corners = cards.iter().flat_map(Card::corners);
        let bounds = Bounds::of_points(mesh.positions.iter().copied().chain(corners));
        // A NaN would be lost by min and max, so every point is looked at.
        let finite = mesh.positions.iter().all(|p| p.is_finite())
            && cards.iter().flat_map(Card::corners).all(Vec3::is_finite);
        if !finite {
            return Err(PrototypeError::NotFinite { name });
        }
        Ok(Self {
            name,
            mesh,
            cards,
            bounds,
            ambient_occlusion: None,
        })
    }

    /// The same shape with ambient occlusion.
    ///
    /// # Errors
    /// If there is not one share for each vertex and for each corner of each card, or if the mesh
    /// blends.
    pub fn with_ambient_occlusion(
        self,
        ambient_occlusion: AmbientOcclusion,
    ) -> Result<Self, PrototypeError> {
        let shares = [
            ambient_occlusion.vertices.len(),
            ambient_occlusion.cards.len(),
        ];
        let lengths = [self.mesh.positions.len(), self.cards.len()];
        if shares != lengths || !self.mesh.blends.is_empty() {
            return Err(PrototypeError::AmbientOcclusion {
                name: self.name,
                shares,
                lengths,
            });
        }
        Ok(Self {
            ambient_occlusion: Some(ambient_occlusion),
            ..self
        })
    }

    /// The parts of the shape that are of some materials, without blends and ambient occlusion;
    /// `None` if there are none.
    ///
    /// # Errors
    /// As [`Prototype::new`], if the library is not the shape's own.
    pub fn retaining(
        &self,
        keep: impl Fn(MaterialId) -> bool,
        library: &MaterialLibrary,
    ) -> Result<Option<Self>, PrototypeError> {
        let triangles = self.mesh.triangles.iter().copied();
        let triangles: Vec<_> = triangles.filter(|t| keep(t.material)).collect();
        let cards = self.cards.iter().copied();
        let cards: Vec<_> = cards.filter(|c| keep(c.material)).collect();
        if triangles.is_empty() && cards.is_empty() {
            return Ok(None);
        }
        let mesh = Mesh {
            triangles,
            blends: Vec::new(),
            ..self.mesh.clone()
        };
        Self::new(self.name.clone(), mesh, cards, library).map(Some)
    }

    /// The name, for logs and exports.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The triangles.
    #[must_use]
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The cards.
    #[must_use]
    pub fn cards(&self) -> &[Card] {
        &self.cards
    }

    /// The ambient occlusion between its parts; `None` if it is not known, which counts as
    /// unoccluded.
    #[must_use]
    pub fn ambient_occlusion(&self) -> Option<&AmbientOcclusion> {
        self.ambient_occlusion.as_ref()
    }

    /// The box around everything, transparent texels included.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }
}

/// A shape placed in a chunk.
#[derive(Clone, Debug)]
pub struct Instance {
    /// The shape that is placed.
    pub prototype: Arc<Prototype>,
    /// Where its origin stands: chunk-local, metres, z above the world's zero.
    pub position_m: Vec3,
    /// Chunk axes from the shape's axes: rotation, scale, and shear along the ground.
    pub linear: Mat3,
    /// Its object id; [`ObjectId::NONE`] for ground and undergrowth.
    pub object: ObjectId,
    /// A keyed number, 0..1, that varies the colour of this instance.
    pub variation: f32,
}

impl Instance {
    /// The linear part of a plant that stands upright on a slope: a turn about the vertical and a
    /// uniform scale, then a shear that keeps verticals vertical and lays its foot on the ground.
    /// `gradient` is (dz/dx, dz/dy) of the ground, (0, 0) for no shear.
    #[must_use]
    pub fn upright(yaw_rad: f32, scale: f32, gradient: Vec2) -> Mat3 {
        let turn = Mat3::from_rotation_z(yaw_rad) * scale;
        let shear = Mat3::from_cols(
            Vec3::new(1.0, 0.0, gradient.x),
            Vec3::new(0.0, 1.0, gradient.y),
            Vec3::Z,
        );
        shear * turn
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Blend, Triangle};
    use crate::{Material, Semantic};

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
            blends: vec![Blend::NONE],
        };
        spoil(&mut mesh);
        match Prototype::new("heap", mesh, Vec::new(), &library) {
            Ok(_) => String::new(),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn ambient_occlusion_is_of_every_vertex_and_card() {
        let mut library = MaterialLibrary::new();
        library.add(Material::plain("leaf", Semantic::Leaf, Vec3::ONE));
        let card = Card {
            corner: Vec3::ZERO,
            edge_u: Vec3::X,
            edge_v: Vec3::Y,
            material: MaterialId(0),
        };
        let shape = Prototype::new("heap", Mesh::default(), vec![card], &library).expect("sound");
        assert_eq!(shape.ambient_occlusion(), None);
        let of = |vertices: usize, cards: usize| AmbientOcclusion {
            vertices: vec![9; vertices],
            cards: vec![[9; 4]; cards],
        };
        let lit = shape
            .clone()
            .with_ambient_occlusion(of(0, 1))
            .expect("one of each");
        assert_eq!(lit.ambient_occlusion(), Some(&of(0, 1)));
        let error = shape
            .with_ambient_occlusion(of(1, 2))
            .expect_err("another's");
        let said = "shape `heap` has ambient occlusion of 1 vertices and 2 cards for 0 and 1: give \
                    one of each, and none to shapes that blend";
        assert_eq!(error.to_string(), said);
    }

    #[test]
    fn what_is_no_shape_is_refused_by_name() {
        assert_eq!(refused(|_| ()), "");
        assert_eq!(refused(|m| m.blends.clear()), "");
        assert_eq!(refused(|m| m.normals.clear()), "");
        assert_eq!(refused(|m| m.uvs.clear()), "");
        type Spoil = fn(&mut Mesh);
        let spoilt: [(Spoil, &str); 9] = [
            (
                |m| *m = Mesh::default(),
                "shape `heap` has neither triangles nor cards",
            ),
            (
                |m| m.uvs.truncate(2),
                "shape `heap` has 3 positions, 3 normals and 2 uvs: give one of each, or none",
            ),
            (
                |m| m.blends.push(Blend::NONE),
                "shape `heap` has 2 blends for 1 triangles: give one of each, or none",
            ),
            (
                |m| m.blends[0].shares[2] = 1.5,
                "shape `heap`, triangle 0: its blend has a share of 1.5, allowed is 0..=1",
            ),
            (
                |m| m.blends[0].shares[0] = f32::NAN,
                "shape `heap`, triangle 0: its blend has a share of NaN, allowed is 0..=1",
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
                |m| m.blends[0].other = MaterialId(7),
                "shape `heap`: material 7 of 1 does not exist",
            ),
            (
                |m| m.positions[2].x = f32::NAN,
                "shape `heap` has a coordinate that is not finite",
            ),
        ];
        for (spoil, said) in spoilt {
            assert_eq!(refused(spoil), said);
        }
    }
}
