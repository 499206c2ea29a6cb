//! A prototype, ready for rays.

use std::sync::Arc;

use glam::DVec3;
use nemoral_scene::{AlphaMask, MaterialLibrary, Prototype};

use crate::exact::{self, LocalRay, Meeting};

/// A prototype with its acceleration structure: made once, shared by all its instances.
///
/// Primitives are numbered: the triangles of the mesh in their order, then the cards in theirs.
#[derive(Debug)]
pub struct Blas {
    prototype: Arc<Prototype>,
    /// By material id, up to the largest id in use.
    masks: Vec<Option<Arc<AlphaMask>>>,
}

impl Blas {
    /// Prepares a prototype that is valid against `materials` (see [`Prototype::new`]).
    #[must_use]
    pub fn build(prototype: Arc<Prototype>, materials: &MaterialLibrary) -> Self {
        let masks = materials
            .materials()
            .iter()
            .map(|m| m.mask.clone())
            .collect();
        Self { prototype, masks }
    }

    /// The prototype.
    #[must_use]
    pub fn prototype(&self) -> &Arc<Prototype> {
        &self.prototype
    }

    pub(crate) fn primitive_count(&self) -> usize {
        self.prototype.mesh().triangles.len() + self.prototype.cards().len()
    }

    /// Where the ray meets an opaque point of a primitive, whatever the distance.
    pub(crate) fn meet(&self, primitive: u32, ray: &LocalRay) -> Option<Meeting> {
        let mesh = self.prototype.mesh();
        let index = primitive as usize;
        let (meeting, material, uv) = match mesh.triangles.get(index) {
            Some(triangle) => {
                let [a, b, c] = triangle
                    .corners
                    .map(|i| mesh.positions[i as usize].as_dvec3());
                let m = exact::triangle(ray, a, b, c)?;
                (
                    m,
                    triangle.material,
                    crate::surface::triangle_uv(mesh, triangle, m),
                )
            }
            None => {
                let card = &self.prototype.cards()[index - mesh.triangles.len()];
                let m = exact::card(
                    ray,
                    card.corner.as_dvec3(),
                    card.edge_u.as_dvec3(),
                    card.edge_v.as_dvec3(),
                )?;
                (
                    m,
                    card.material,
                    DVec3::new(m.u, m.v, 0.0).as_vec3().truncate(),
                )
            }
        };
        let opaque = self.masks[usize::from(material.0)]
            .as_ref()
            .is_none_or(|mask| mask.is_opaque(uv.x, uv.y));
        opaque.then_some(meeting)
    }
}
