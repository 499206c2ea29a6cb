//! Contact sheets of every texture and card: `texture_sheet FOLDER [SEED]`.
//!
//! `ground.png` and `wood.png` show tiles, repeated once to the right so that a seam would show;
//! `cards.png` shows cards through their masks over two greys.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::path::Path;

use image::{Rgb, RgbImage, imageops};
use nemoral_assets::{AssetParams, Library, Species, StandSpecies};
use nemoral_scene::Material;
use nemoral_seed::Key;

const CELL: u32 = 256;
const COLUMNS: u32 = 8;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let folder = args.next().unwrap_or_else(|| "sheet".to_owned());
    let seed = args.next().map_or(Ok(7), |s| s.parse())?;
    std::fs::create_dir_all(&folder)?;
    let species = Species::all().into_iter();
    let params = AssetParams {
        individuals_per_species: 1,
        species: species
            .map(|species| StandSpecies {
                species,
                dbh_mean_m: 0.3,
                trees_per_ha: 300.0,
            })
            .collect(),
        ..AssetParams::default()
    };
    let library = Library::grow(&params, Key::world(seed))?;
    let materials = library.materials.materials();
    let mut seen = Vec::new();
    let mut solid: Vec<&Material> = Vec::new();
    for m in materials.iter().filter(|m| m.mask.is_none()) {
        let texture = std::sync::Arc::as_ptr(&m.albedo);
        if !seen.contains(&texture) {
            seen.push(texture);
            solid.push(m);
        }
    }
    let (ground, wood): (Vec<_>, Vec<_>) = solid.into_iter().partition(|m| m.ground);
    let cards: Vec<_> = materials.iter().filter(|m| m.mask.is_some()).collect();
    let folder = Path::new(&folder);
    sheet(&ground, tile).save(folder.join("ground.png"))?;
    sheet(&wood, tile).save(folder.join("wood.png"))?;
    sheet(&cards, card).save(folder.join("cards.png"))?;
    for m in ground.iter().chain(&wood) {
        whole(m).save(folder.join(format!("{}.png", m.name)))?;
    }
    Ok(())
}

fn sheet(materials: &[&Material], picture: fn(&Material) -> RgbImage) -> RgbImage {
    let rows = (materials.len() as u32).div_ceil(COLUMNS);
    let mut sheet = RgbImage::from_pixel(COLUMNS * (CELL + 8), rows * (CELL + 8), Rgb([255; 3]));
    for (i, material) in materials.iter().enumerate() {
        let (x, y) = (i as u32 % COLUMNS, i as u32 / COLUMNS);
        let at = |k: u32| i64::from(4 + k * (CELL + 8));
        imageops::replace(&mut sheet, &picture(material), at(x), at(y));
    }
    sheet
}

fn whole(m: &Material) -> RgbImage {
    let (w, h) = (m.albedo.width(), m.albedo.height());
    RgbImage::from_fn(w as u32, h as u32, |x, y| {
        let [r, g, b, _] = m.albedo.srgb()[y as usize * w + x as usize];
        Rgb([r, g, b])
    })
}

fn tile(m: &Material) -> RgbImage {
    let one = whole(m);
    let mut two = RgbImage::new(2 * one.width(), one.height());
    imageops::replace(&mut two, &one, 0, 0);
    imageops::replace(&mut two, &one, i64::from(one.width()), 0);
    let side = two.width().max(two.height());
    let small = imageops::resize(
        &two,
        CELL * two.width() / side,
        CELL * two.height() / side,
        imageops::FilterType::Triangle,
    );
    let mut cell = RgbImage::from_pixel(CELL, CELL, Rgb([255; 3]));
    imageops::replace(&mut cell, &small, 0, 0);
    cell
}

/// A card with its foot down, in its true proportions.
fn card(m: &Material) -> RgbImage {
    let colours = whole(m);
    let mask = m.mask.as_ref().expect("cards have masks");
    RgbImage::from_fn(CELL, CELL, |x, y| {
        let (w, h) = (colours.width(), colours.height());
        let (column, row) = (x * w / CELL, (CELL - 1 - y) * h / CELL);
        if mask.texel(column as usize, row as usize) {
            *colours.get_pixel(column, row)
        } else if x < CELL / 2 {
            Rgb([150; 3])
        } else {
            Rgb([40; 3])
        }
    })
}
