//! Draws every species from sapling to snag, and at a wood's edge, beside a board of 1.8 m, with
//! its bark and leaves close by, and one sheet of all species, `species.png`:
//! `tree_gallery FOLDER [SPECIES | FILE.toml]...`.
//!
//! Orthographic, from the south; sun from the upper left, behind the viewer, and a grey sky.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

mod canvas;

use std::path::Path;

use std::time::Instant;

use nemoral_assets::{
    AssetParams, Library, SizeClass, Species, StandParams, StandSpecies, TreeAsset,
};
use nemoral_scene::MaterialLibrary;
use nemoral_scene::glam::{Vec2, Vec3};
use nemoral_seed::Key;

use canvas::{Canvas, Standing};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments
        .next()
        .ok_or("usage: tree_gallery FOLDER [SPECIES | FILE.toml]...")?;
    std::fs::create_dir_all(&folder)?;
    let mut species = Vec::new();
    for name in arguments {
        species.push(match Species::built_in(&name) {
            Some(species) => species,
            None => Species::from_toml(&std::fs::read_to_string(&name)?, &name)?,
        });
    }
    if species.is_empty() {
        species = Species::all();
    }
    let classes = [SizeClass::Young, SizeClass::Middle, SizeClass::Mature];
    let libraries = classes
        .iter()
        .map(|&class| grow(&species, class))
        .collect::<Result<Vec<_>, _>>()?;
    for s in &species {
        let of = |trees: &[TreeAsset], n: usize| -> Vec<TreeAsset> {
            let of = trees.iter().filter(|t| t.species == s.name);
            of.take(n).cloned().collect()
        };
        let mut row = vec![(0, of(&libraries[0].saplings, 2).remove(1))];
        for (i, library) in libraries.iter().enumerate() {
            row.extend(
                of(&library.trees, 2)
                    .into_iter()
                    .skip(usize::from(i < 2))
                    .map(|t| (i, t)),
            );
        }
        // Two trees of the stand, and then the same two at its edge, with light from the right.
        row.push((2, of(&libraries[2].trees, 4).remove(3)));
        row.push((2, of(&libraries[2].snags, 2).remove(1)));
        report(&row);
        let trees: Vec<_> = row
            .iter()
            .map(|(i, tree)| (tree, &libraries[*i].materials))
            .collect();
        let path = Path::new(&folder).join(format!("{}.png", s.name));
        whole(&trees, 1900.0).save(path)?;
        let path = Path::new(&folder).join(format!("{}.close.png", s.name));
        close(trees[trees.len() - 3]).save(path)?;
    }
    let grown = &libraries[2];
    let thickest = |s: &Species| {
        let mut of = grown.trees.iter().filter(|t| t.species == s.name);
        of.nth(1)
    };
    let one_each: Vec<_> = species
        .iter()
        .filter_map(|s| thickest(s).map(|t| (t, &grown.materials)))
        .collect();
    sheet(&one_each).save(Path::new(&folder).join("species.png"))?;
    Ok(())
}

#[allow(
    clippy::print_stdout,
    reason = "the figures are what the user runs this for"
)]
fn grow(species: &[Species], class: SizeClass) -> Result<Library, Box<dyn std::error::Error>> {
    let start = Instant::now();
    let stand = |s: &Species| StandSpecies {
        species: s.clone(),
        dbh_mean_m: s.class_dbh_m(class),
        trees_per_ha: 300.0,
    };
    let params = AssetParams {
        species: species.iter().map(stand).collect(),
        individuals_per_species: 2,
        saplings_per_species: 2,
        snags_per_species: 2,
        edge_trees: true,
        stand: StandParams {
            shape: 6.0,
            dbh_min_m: 0.07,
            dbh_max_m: 1.2,
        },
        ..AssetParams::default()
    };
    let library = Library::grow(&params, Key::world(7))?;
    let seconds = start.elapsed().as_secs_f64();
    println!(
        "{} species, {}: {seconds:.2} s",
        species.len(),
        class.name()
    );
    Ok(library)
}

#[allow(
    clippy::print_stdout,
    reason = "the table is what the user runs this for"
)]
fn report(row: &[(usize, TreeAsset)]) {
    for (_, tree) in row {
        let (t, p) = (&tree.size, &tree.prototype);
        println!(
            "{:14} {:7} {:5} d {:.3} H {:5.2} base {:5.2} r {:.2} LA {:5.1} lean {:.1}: {} \
             triangles, {} cards, {:.3} m3",
            tree.species,
            tree.class.name(),
            if tree.alive { "alive" } else { "dead" },
            t.dbh_m,
            t.height_m,
            t.crown_base_m,
            t.crown_radius_m,
            t.leaf_area_m2,
            t.lean_rad.to_degrees(),
            p.mesh().triangles.len(),
            p.cards().len(),
            tree.stem_volume_m3,
        );
    }
}

/// All trees side by side, `gap_m` apart.
fn row<'a>(trees: &[(&'a TreeAsset, &'a MaterialLibrary)], gap_m: f32) -> (Vec<Standing<'a>>, f32) {
    let mut x = 0.5;
    let mut row = Vec::new();
    for &(tree, library) in trees {
        let bounds = tree.prototype.bounds();
        let at = Vec3::new(x - bounds.min.x, 0.0, 0.0);
        row.push(Standing { tree, library, at });
        x += bounds.max.x - bounds.min.x + gap_m;
    }
    (row, x)
}

fn whole(trees: &[(&TreeAsset, &MaterialLibrary)], width_px: f32) -> image::RgbImage {
    let tallest = trees
        .iter()
        .fold(2.0_f32, |m, (t, _)| m.max(t.prototype.bounds().max.z));
    let (row, end) = row(trees, 0.8);
    let size_m = [end + 1.2, tallest + 1.5];
    let pixel_m = (size_m[1] / 900.0).max(size_m[0] / width_px);
    let mut canvas = Canvas::new(size_m, Vec2::new(0.0, tallest + 0.7), pixel_m);
    canvas.person(end);
    canvas.trees(&row);
    canvas.into_image()
}

/// A close view of a part of a tree, given its size and its upper left corner.
fn detail(
    (tree, library): (&TreeAsset, &MaterialLibrary),
    size_m: [f32; 2],
    corner: Vec2,
    pixel_m: f32,
) -> image::RgbImage {
    let mut canvas = Canvas::new(size_m, corner, pixel_m);
    let at = Vec3::ZERO;
    canvas.trees(&[Standing { tree, library, at }]);
    canvas.into_image()
}

/// The middle of the foliage nearest to the viewer.
fn nearest_leaves(tree: &TreeAsset) -> Vec3 {
    let cards = tree.prototype.cards().iter();
    let nearest = cards.min_by(|a, b| a.corner.y.total_cmp(&b.corner.y));
    nearest.map_or(Vec3::Z, |c| c.corner + 0.5 * (c.edge_u + c.edge_v))
}

/// The foot of a stem, the crown's inside, and leaves at its side.
fn close(tree: (&TreeAsset, &MaterialLibrary)) -> image::RgbImage {
    let (size, fine) = ([3.2, 2.6], 0.0035);
    let inside = Vec2::new(-1.6, 0.55 * tree.0.size.height_m as f32 + 1.3);
    let middle = nearest_leaves(tree.0);
    let leaves = Vec2::new(middle.x - 1.1, middle.z + 1.3);
    beside(&[
        detail(tree, size, Vec2::new(-1.6, 2.5), fine),
        detail(tree, size, inside, fine),
        detail(tree, [2.2, 2.6], leaves, fine),
    ])
}

/// One tree of each species; below them, in the same order, its bark at breast height and its
/// leaves.
fn sheet(trees: &[(&TreeAsset, &MaterialLibrary)]) -> image::RgbImage {
    let whole = whole(trees, 1440.0);
    let tile_px = whole.width() as f32 / trees.len() as f32 - 8.0;
    let barks: Vec<_> = trees
        .iter()
        .map(|&tree| detail(tree, [1.0; 2], Vec2::new(-0.5, 1.8), 1.0 / tile_px))
        .collect();
    let leaves: Vec<_> = trees
        .iter()
        .map(|&tree| {
            let middle = nearest_leaves(tree.0);
            let corner = Vec2::new(middle.x - 0.7, middle.z + 0.7);
            detail(tree, [1.4; 2], corner, 1.4 / tile_px)
        })
        .collect();
    let rows = [whole, beside(&barks), beside(&leaves)];
    let height = rows.iter().map(|r| r.height() + 8).sum();
    let mut out = paper(rows[0].width(), height);
    let mut y = 0;
    for row in &rows {
        image::imageops::replace(&mut out, row, 0, i64::from(y));
        y += row.height() + 8;
    }
    out
}

/// A white sheet.
fn paper(width: u32, height: u32) -> image::RgbImage {
    image::RgbImage::from_pixel(width, height, image::Rgb([255; 3]))
}

/// Pictures side by side.
fn beside(pictures: &[image::RgbImage]) -> image::RgbImage {
    let width = pictures.iter().map(|p| p.width() + 8).sum();
    let height = pictures.iter().map(image::RgbImage::height).max();
    let mut out = paper(width, height.unwrap_or(0));
    let mut x = 0;
    for picture in pictures {
        image::imageops::replace(&mut out, picture, i64::from(x), 0);
        x += picture.width() + 8;
    }
    out
}
