//! All nine species against numbers that are written out here and not read from their files.
#![allow(clippy::print_stdout, reason = "what was measured, for --nocapture")]

mod bark;
mod colours;
mod forms;
mod optics;
mod recognition;

use std::sync::LazyLock;

use nemoral_assets::{AssetParams, Library, Species, StandSpecies};
use nemoral_scene::Material;
use nemoral_scene::glam::{Vec2, Vec3};
use nemoral_seed::Key;

/// A library with the textures of every species but only one tree of each, as the tests are about
/// textures.
static LIBRARY: LazyLock<Library> = LazyLock::new(|| {
    let of = |species| StandSpecies {
        species,
        dbh_mean_m: 0.25,
        trees_per_ha: 300.0,
    };
    let params = AssetParams {
        species: Species::all().into_iter().map(of).collect(),
        individuals_per_species: 1,
        saplings_per_species: 2,
        snags_per_species: 1,
        ..AssetParams::default()
    };
    Library::grow(&params, Key::world(7)).expect("valid")
});

fn named(name: &str) -> &'static Material {
    let all = LIBRARY.materials.materials();
    let found = all.iter().find(|m| m.name == name);
    found.unwrap_or_else(|| panic!("no material {name}"))
}

/// The pictures of a species' leafy twigs.
fn foliage(species: &str) -> impl Iterator<Item = &'static Material> {
    let start = format!("{species}.foliage.");
    let all = LIBRARY.materials.materials().iter();
    all.filter(move |m| m.name.starts_with(&start))
}

/// The centres of the opaque texels: all of them where there is no mask.
fn opaque(m: &Material) -> Vec<Vec2> {
    let (w, h) = (m.albedo.width(), m.albedo.height());
    (0..w * h)
        .map(|i| (i % w, i / w))
        .filter(|&(x, y)| m.mask.as_ref().is_none_or(|k| k.texel(x, y)))
        .map(|(x, y)| Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32))
        .collect()
}

/// The mean linear colour at some places of a texture, for samples that cover `texels` texels.
fn mean_colour(m: &Material, at: &[Vec2], texels: f32) -> Vec3 {
    let footprint = texels / m.albedo.width().max(m.albedo.height()) as f32;
    let sum = |sum: [f64; 3], &uv: &Vec2| {
        let c = m.albedo.sample(uv, footprint).to_array();
        [0, 1, 2].map(|k| sum[k] + f64::from(c[k]))
    };
    let sum = at.iter().fold([0.0; 3], sum);
    Vec3::from(sum.map(|s| (s / at.len() as f64) as f32))
}

/// Luminance of linear sRGB (Rec. 709).
fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}
