//! One library for all tests of properties, and what they ask of it.

use std::sync::LazyLock;

use nemoral_assets::{AssetParams, Library, PlantAsset};
use nemoral_scene::glam::Vec3;
use nemoral_scene::{Material, Prototype, Semantic};
use nemoral_seed::Key;

pub(crate) const KEY: Key = Key::world(7);

pub(crate) fn params() -> AssetParams {
    AssetParams {
        individuals_per_species: 1,
        ..AssetParams::default()
    }
}

/// One library for all tests: it takes seconds to grow.
pub(crate) static LIBRARY: LazyLock<Library> =
    LazyLock::new(|| Library::grow(&params(), KEY).expect("valid"));

pub(crate) fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// Linear colours of a material's texture, row by row.
pub(crate) fn texels(m: &Material) -> Vec<Vec3> {
    let (w, h) = (m.albedo.width(), m.albedo.height());
    (0..w * h)
        .map(|i| {
            let uv = Vec3::new(
                ((i % w) as f32 + 0.5) / w as f32,
                ((i / w) as f32 + 0.5) / h as f32,
                0.0,
            );
            m.albedo.sample(uv.truncate(), 0.0)
        })
        .collect()
}

pub(crate) fn materials() -> &'static [Material] {
    LIBRARY.materials.materials()
}

pub(crate) fn named(name: &str) -> &'static Material {
    let found = materials().iter().find(|m| m.name == name);
    found.unwrap_or_else(|| panic!("no material {name}"))
}

pub(crate) fn semantics(p: &Prototype) -> Vec<Semantic> {
    let triangles = p.mesh().triangles.iter().map(|t| t.material);
    let mut all: Vec<_> = triangles
        .chain(p.cards().iter().map(|c| c.material))
        .map(|m| LIBRARY.materials.get(m).semantic)
        .collect();
    all.sort();
    all.dedup();
    all
}

pub(crate) fn all_plants() -> impl Iterator<Item = &'static PlantAsset> {
    LIBRARY.plants.iter().flatten()
}
