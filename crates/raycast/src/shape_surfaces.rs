//! What the primitives of a shape are made of: masks, and the windows of them that cards show.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec2;
use nemoral_scene::{AlphaMask, MaterialId, MaterialLibrary, Prototype, TextureWindow};

/// A material, and which part of its texture a card shows.
#[derive(Clone, Debug)]
pub(crate) struct ShapeSurface {
    pub(crate) material: MaterialId,
    pub(crate) mask: Option<Arc<AlphaMask>>,
    /// `None` for the whole texture.
    pub(crate) window: Option<TextureWindow>,
}

impl ShapeSurface {
    /// The texture coordinate at a place on a card.
    #[inline(always)]
    pub(crate) fn card_uv(&self, s: f64, t: f64) -> Vec2 {
        match &self.window {
            Some(window) => window.uv(s, t),
            None => Vec2::new(s as f32, t as f32),
        }
    }
}

/// The different surfaces of a shape, and which of them each primitive has.
#[derive(Debug, Default)]
pub(crate) struct ShapeSurfaces {
    all: Vec<ShapeSurface>,
    /// Of each material in the library; [`UNUSED`] where the shape has none of it.
    of_material: Vec<u16>,
    /// Of each card, or none if all show whole textures.
    of_card: Vec<u16>,
    /// Of each quad.
    of_quad: Vec<u16>,
    /// Of each triangle, the quad that it is the first of, [`SECOND`] or [`ALONE`]; empty if there
    /// are no quads. A search would cost hits on quads more than the rest of their shading.
    quad_of: Vec<u32>,
}

/// What a triangle is a part of.
#[derive(Clone, Copy, Debug)]
pub(crate) enum QuadPart {
    /// The triangle stands alone.
    None,
    /// The first triangle of a quad, which stands for the quad.
    First(usize),
    /// The second triangle of a quad, which is no primitive of its own.
    Second,
}

const UNUSED: u16 = u16::MAX;

/// The second triangle of a quad.
const SECOND: u32 = u32::MAX;

/// A triangle that stands alone.
const ALONE: u32 = u32::MAX - 1;

impl ShapeSurfaces {
    /// The surfaces of a shape that is valid against `materials`.
    pub(crate) fn of(prototype: &Prototype, materials: &MaterialLibrary) -> Self {
        let mut surfaces = Self {
            of_material: vec![UNUSED; materials.materials().len()],
            ..Self::default()
        };
        let mut known = HashMap::new();
        let mut number = |material: MaterialId, window: TextureWindow| {
            let window = (window != TextureWindow::WHOLE).then_some(window);
            let key = (material, window.map(TextureWindow::to_bits));
            let next = surfaces.all.len() as u16;
            let found = *known.entry(key).or_insert(next);
            if found == next {
                surfaces.all.push(ShapeSurface {
                    material,
                    mask: materials.get(material).mask.clone(),
                    window,
                });
                if window.is_none() {
                    surfaces.of_material[usize::from(material.0)] = next;
                }
            }
            found
        };
        for triangle in &prototype.mesh().triangles {
            number(triangle.material, TextureWindow::WHOLE);
        }
        let whole = prototype.card_windows().is_empty();
        for (i, card) in prototype.cards().iter().enumerate() {
            let found = number(card.material, prototype.card_window(i));
            if !whole {
                surfaces.of_card.push(found);
            }
        }
        if !prototype.quads().is_empty() {
            surfaces.quad_of = vec![ALONE; prototype.mesh().triangles.len()];
        }
        for (i, quad) in prototype.quads().iter().enumerate() {
            let (card, window) = quad.card(prototype.mesh());
            surfaces.of_quad.push(number(card.material, window));
            let [first, second] = quad.triangles.map(|t| t as usize);
            surfaces.quad_of[first] = i as u32;
            surfaces.quad_of[second] = SECOND;
        }
        surfaces
    }

    #[inline(always)]
    pub(crate) fn get(&self, surface: u16) -> &ShapeSurface {
        &self.all[usize::from(surface)]
    }

    pub(crate) fn all(&self) -> &[ShapeSurface] {
        &self.all
    }

    /// The surface of a material's triangles and of cards without windows.
    pub(crate) fn of_material(&self, material: MaterialId) -> u16 {
        self.of_material[usize::from(material.0)]
    }

    pub(crate) fn of_card(&self, card: usize, material: MaterialId) -> u16 {
        let of_card = self.of_card.get(card).copied();
        of_card.unwrap_or_else(|| self.of_material(material))
    }

    pub(crate) fn of_quad(&self, quad: usize) -> u16 {
        self.of_quad[quad]
    }

    /// What a triangle is a part of, among the quads of the shape.
    pub(crate) fn part(&self, triangle: u32) -> QuadPart {
        match self.quad_of.get(triangle as usize) {
            None | Some(&ALONE) => QuadPart::None,
            Some(&SECOND) => QuadPart::Second,
            Some(&quad) => QuadPart::First(quad as usize),
        }
    }

    /// The memory that the tables take, bytes; masks are not included.
    pub(crate) fn memory_bytes(&self) -> usize {
        let numbers = self.of_material.len() + self.of_card.len() + self.of_quad.len();
        size_of_val(self.all.as_slice())
            + numbers * size_of::<u16>()
            + size_of_val(self.quad_of.as_slice())
    }
}
