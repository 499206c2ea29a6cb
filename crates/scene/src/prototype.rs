//! Shapes: triangles and leaf cards, made once and placed many times.

mod error;

use std::collections::HashSet;

use glam::Vec3;

pub use self::error::PrototypeError;

use crate::quad::{self, Quad};
use crate::{
    AmbientOcclusion, Bounds, Card, MaterialId, MaterialLibrary, Mesh, Occluder, TextureWindow,
};

/// A shape that instances share: a tree, a rock, a patch of grass, a chunk's ground.
#[derive(Clone, Debug)]
pub struct Prototype {
    name: String,
    mesh: Mesh,
    cards: Vec<Card>,
    /// One for each card, or none if all show whole textures.
    card_windows: Vec<TextureWindow>,
    /// In order of their first triangles.
    quads: Vec<Quad>,
    bounds: Bounds,
    ambient_occlusion: Option<AmbientOcclusion>,
    occluders: Vec<Occluder>,
    /// How many different pairs of a material and a window its cards may have.
    max_windows: usize,
}

impl Prototype {
    /// The greatest coordinate of a shape, metres. It is far below the lengths whose squares are
    /// beyond f32.
    pub const FARTHEST_M: f32 = 1e9;

    /// Checks that a shape is sound, and finds the leaves among its triangles: see [`Quad`].
    ///
    /// # Errors
    /// If it is empty, its vertex arrays differ in length (except empty ones), blends are missing,
    /// an index or material is out of range, a coordinate, a normal or a uv is not finite, or a
    /// coordinate is beyond ±[`FARTHEST_M`](Self::FARTHEST_M).
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
            .chain(mesh.blends.iter().flat_map(|b| b.corners).flatten())
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
        let near = |p: Vec3| p.abs().cmple(Vec3::splat(Self::FARTHEST_M)).all();
        let sound = mesh.positions.iter().copied().all(near)
            && cards.iter().flat_map(Card::corners).all(near)
            && mesh.normals.iter().all(|n| n.is_finite())
            && mesh.uvs.iter().all(|uv| uv.is_finite());
        if !sound {
            return Err(PrototypeError::NotFinite { name });
        }
        let max_windows = ((1 << 16) - materials) / 2;
        let quads = with_few_windows(&mesh, quad::find(&mesh, library), max_windows);
        Ok(Self {
            name,
            mesh,
            cards,
            card_windows: Vec::new(),
            quads,
            bounds,
            ambient_occlusion: None,
            occluders: Vec::new(),
            max_windows,
        })
    }

    /// The same shape whose cards show windows of their textures and masks, one for each card in
    /// their order.
    ///
    /// # Errors
    /// If there is not one for each card, one is not finite, or there are too many different pairs
    /// of a material and a window: materials, windows of cards and windows of quads are numbered
    /// together with 16 bits.
    pub fn with_card_windows(self, windows: Vec<TextureWindow>) -> Result<Self, PrototypeError> {
        let distinct: HashSet<_> = (self.cards.iter().zip(&windows))
            .map(|(card, window)| (card.material, window.to_bits()))
            .collect();
        let sound = windows.len() == self.cards.len()
            && windows.iter().all(TextureWindow::is_finite)
            && distinct.len() <= self.max_windows;
        if !sound {
            return Err(PrototypeError::Windows {
                name: self.name,
                windows: windows.len(),
                cards: self.cards.len(),
                allowed: self.max_windows,
            });
        }
        let card_windows = windows;
        Ok(Self {
            card_windows,
            ..self
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

    /// The same shape with what hides light from the ground around it.
    #[must_use]
    pub fn with_occluders(self, occluders: Vec<Occluder>) -> Self {
        Self { occluders, ..self }
    }

    /// The parts of the shape that are of some materials, without blends, ambient occlusion and
    /// occluders; `None` if there are none.
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
        let kept = |(i, card): (usize, &Card)| keep(card.material).then_some((i, *card));
        let (numbers, cards): (Vec<usize>, Vec<Card>) =
            self.cards.iter().enumerate().filter_map(kept).unzip();
        if triangles.is_empty() && cards.is_empty() {
            return Ok(None);
        }
        let mesh = Mesh {
            triangles,
            blends: Vec::new(),
            ..self.mesh.clone()
        };
        let shape = Self::new(self.name.clone(), mesh, cards, library)?;
        if self.card_windows.is_empty() {
            return Ok(Some(shape));
        }
        let windows = numbers.iter().map(|&i| self.card_windows[i]).collect();
        shape.with_card_windows(windows).map(Some)
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

    /// What each card shows of its texture and mask; empty if all show them whole.
    #[must_use]
    pub fn card_windows(&self) -> &[TextureWindow] {
        &self.card_windows
    }

    /// What a card shows of its texture and mask.
    #[must_use]
    pub fn card_window(&self, card: usize) -> TextureWindow {
        let window = self.card_windows.get(card).copied();
        window.unwrap_or(TextureWindow::WHOLE)
    }

    /// The triangles that form cards in pairs, in order of their first triangles.
    #[must_use]
    pub fn quads(&self) -> &[Quad] {
        &self.quads
    }

    /// The memory that the shape takes, bytes. Materials are not included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let Mesh {
            positions,
            normals,
            uvs,
            triangles,
            blends,
        } = &self.mesh;
        let occlusion = self.ambient_occlusion.as_ref();
        size_of::<Self>()
            + self.name.len()
            + size_of_val(positions.as_slice())
            + size_of_val(normals.as_slice())
            + size_of_val(uvs.as_slice())
            + size_of_val(triangles.as_slice())
            + size_of_val(blends.as_slice())
            + size_of_val(self.cards.as_slice())
            + size_of_val(self.card_windows.as_slice())
            + size_of_val(self.quads.as_slice())
            + occlusion.map_or(0, |o| {
                size_of_val(o.vertices.as_slice()) + size_of_val(o.cards.as_slice())
            })
            + size_of_val(self.occluders.as_slice())
    }

    /// The ambient occlusion between its parts; `None` if it is not known, which counts as
    /// unoccluded.
    #[must_use]
    pub fn ambient_occlusion(&self) -> Option<&AmbientOcclusion> {
        self.ambient_occlusion.as_ref()
    }

    /// What hides light from the ground around the shape; none if it is not known.
    #[must_use]
    pub fn occluders(&self) -> &[Occluder] {
        &self.occluders
    }

    /// The box around everything, transparent texels included.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }
}

/// The quads whose windows are among the first `max` different ones: others stay triangles.
fn with_few_windows(mesh: &Mesh, mut quads: Vec<Quad>, max: usize) -> Vec<Quad> {
    let mut known = HashSet::new();
    quads.retain(|quad| {
        let (card, window) = quad.card(mesh);
        let key = (card.material, window.to_bits());
        known.contains(&key) || (known.len() < max && known.insert(key))
    });
    quads
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, Semantic};

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
}
