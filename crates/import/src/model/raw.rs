//! A model as its file has it, whatever the format.

use std::sync::Arc;

use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{Optics, Semantic};

use super::picture::Picture;

/// Parts, materials and pictures of a file.
#[derive(Debug, Default)]
pub(super) struct RawModel {
    pub(super) parts: Vec<RawPart>,
    pub(super) materials: Vec<RawMaterial>,
    pub(super) pictures: Vec<Picture>,
    /// What was not understood, or guessed.
    pub(super) notes: Vec<String>,
}

/// The first part of a name, which is enough to know what has it: at most 256 bytes.
pub(super) fn first_part(name: &str) -> &str {
    const MOST: usize = 256;
    let mut ends = (0..=name.len().min(MOST)).rev();
    let end = ends.find(|&i| name.is_char_boundary(i));
    &name[..end.unwrap_or(0)]
}

/// The first part of a name of a node or a group.
pub(super) fn cut(name: &str) -> Arc<str> {
    first_part(name).into()
}

/// Triangles of one material of one node. Indices are valid, and arrays are as long as positions or
/// empty.
#[derive(Debug)]
pub(super) struct RawPart {
    /// The names of its nodes, the nearest first.
    pub(super) names: Vec<Arc<str>>,
    /// The number of its material.
    pub(super) material: usize,
    pub(super) positions: Vec<DVec3>,
    pub(super) normals: Vec<DVec3>,
    /// Row 0 of a picture is at v = 0.
    pub(super) uvs: Vec<DVec2>,
    pub(super) triangles: Vec<[u32; 3]>,
}

#[derive(Clone, Debug)]
pub(super) struct RawMaterial {
    pub(super) name: String,
    /// Multiplies the picture; linear.
    pub(super) colour: Vec3,
    /// The number of its picture.
    pub(super) picture: Option<usize>,
    pub(super) alpha: Alpha,
    pub(super) roughness: f32,
    pub(super) hints: MaterialHints,
}

/// Where a material is opaque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Alpha {
    Everywhere,
    Nowhere,
    /// Where the alpha of its picture is at least this, 0..=255.
    From(f32),
    /// Where another picture, which is grey, is at least half white, and opaque if it has alpha.
    White(usize),
}

/// What a file says of a material beyond its looks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MaterialHints {
    pub(super) semantic: Option<Semantic>,
    pub(super) support: Option<Semantic>,
    pub(super) transmittance: Option<Vec3>,
    pub(super) optics: Option<Optics>,
}

impl RawMaterial {
    pub(super) fn plain(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            colour: Vec3::splat(0.5),
            picture: None,
            alpha: Alpha::Everywhere,
            roughness: 1.0,
            hints: MaterialHints::default(),
        }
    }
}

impl RawModel {
    /// Notes something once.
    pub(super) fn note(&mut self, note: impl Into<String>) {
        let note = note.into();
        if !self.notes.contains(&note) && self.notes.len() < 32 {
            self.notes.push(note);
        }
    }
}
