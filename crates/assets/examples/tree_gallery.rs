//! Draws every species from sapling to snag beside a person of 1.8 m, with its bark and leaves close by:
//! `tree_gallery FOLDER [SPECIES | FILE.toml]...`.
//!
//! Orthographic, from the south; sun from the upper left, behind the viewer, and a grey sky.

use std::path::Path;
use std::time::Instant;

use nemoral_assets::{
    AssetParams, Library, SizeClass, Species, StandParams, StandSpecies, TreeAsset,
};
use nemoral_scene::glam::{Vec2, Vec3};
use nemoral_scene::{MaterialId, MaterialLibrary};
use nemoral_seed::Key;

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
            None => Species::read(Path::new(&name))?,
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
        row.push((2, of(&libraries[2].snags, 2).remove(1)));
        report(&row);
        let trees: Vec<_> = row
            .iter()
            .map(|(i, tree)| (tree, &libraries[*i].materials))
            .collect();
        let path = Path::new(&folder).join(format!("{}.png", s.name));
        whole(&trees).save(path)?;
        let path = Path::new(&folder).join(format!("{}.close.png", s.name));
        close(trees[trees.len() - 2]).save(path)?;
    }
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
    };
    let params = AssetParams {
        species: species.iter().map(stand).collect(),
        individuals_per_species: 2,
        saplings_per_species: 2,
        snags_per_species: 2,
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
            "{:14} {:7} {:5} d {:.3} H {:5.2} base {:5.2} r {:.2} LA {:5.1} lean {:.1}: {} triangles, {} cards, {:.3} m3",
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

/// A z-buffered picture.
struct Canvas {
    width: usize,
    height: usize,
    pixel_m: f32,
    depth: Vec<f32>,
    colour: Vec<Vec3>,
    /// World x of the left edge, world z of the upper edge.
    corner: Vec2,
}

/// Pixels are drawn so many times finer each way, and averaged.
const FINER: usize = 2;

fn whole(trees: &[(&TreeAsset, &MaterialLibrary)]) -> image::RgbImage {
    let tallest = trees
        .iter()
        .fold(2.0_f32, |m, (t, _)| m.max(t.prototype.bounds().max.z));
    let mut at = 0.5;
    let mut places = Vec::new();
    for (tree, _) in trees {
        let bounds = tree.prototype.bounds();
        places.push(at - bounds.min.x);
        at += bounds.max.x - bounds.min.x + 0.8;
    }
    let pixel_m = ((tallest + 1.5) / 900.0).max(at / 1900.0);
    let mut canvas = Canvas::new(
        [at + 1.2, tallest + 1.5],
        Vec2::new(0.0, tallest + 0.7),
        pixel_m,
    );
    canvas.person(at);
    for ((tree, library), x) in trees.iter().zip(places) {
        canvas.tree(tree, library, Vec3::new(x, 0.0, 0.0));
    }
    canvas.into_image()
}

/// The foot of a stem, and leaves at the side of the crown.
fn close((tree, library): (&TreeAsset, &MaterialLibrary)) -> image::RgbImage {
    let size = [3.2, 2.6];
    let mut left = Canvas::new(size, Vec2::new(-1.6, 2.5), 0.0035);
    left.tree(tree, library, Vec3::ZERO);
    let mut up = Canvas::new(
        size,
        Vec2::new(-1.6, 0.55 * tree.size.height_m as f32 + 1.3),
        0.0035,
    );
    up.tree(tree, library, Vec3::ZERO);
    let nearest = tree
        .prototype
        .cards()
        .iter()
        .min_by(|a, b| a.corner.y.total_cmp(&b.corner.y));
    let middle = nearest.map_or(Vec3::Z, |c| c.corner);
    let mut right = Canvas::new(
        [2.2, 2.6],
        Vec2::new(middle.x - 1.1, middle.z + 1.3),
        0.0035,
    );
    right.tree(tree, library, Vec3::ZERO);
    let pictures = [left, up, right].map(Canvas::into_image);
    let width = pictures.iter().map(|p| p.width() + 8).sum();
    let mut out = image::RgbImage::new(width, pictures[0].height());
    let mut x = 0;
    for picture in pictures {
        for (column, row, pixel) in picture.enumerate_pixels() {
            if row < out.height() {
                out.put_pixel(x + column, row, *pixel);
            }
        }
        x += picture.width() + 8;
    }
    out
}

/// Sun and sky on a surface; a leaf lets a part of the sun through.
fn light(normal: Vec3, albedo: Vec3, transmittance: Vec3) -> Vec3 {
    let n = normal.normalize_or(Vec3::Z);
    // The side that is seen.
    let n = if n.y > 0.0 { -n } else { n };
    let sun = n.dot(Vec3::new(-0.45, -0.55, 0.70));
    let direct = 3.0 * (albedo * sun.max(0.0) + transmittance * (-sun).max(0.0));
    direct + 0.9 * albedo * (0.6 + 0.4 * n.z)
}

impl Canvas {
    fn new(size_m: [f32; 2], corner: Vec2, pixel_m: f32) -> Self {
        let pixel_m = pixel_m / FINER as f32;
        let [width, height] = size_m.map(|s| (s / pixel_m) as usize / FINER * FINER);
        Self {
            width,
            height,
            pixel_m,
            depth: vec![f32::INFINITY; width * height],
            colour: vec![Vec3::new(0.9, 1.0, 1.1); width * height],
            corner,
        }
    }

    fn person(&mut self, x: f32) {
        let person = [(0.0, 0.0), (0.4, 0.0), (0.4, 1.8), (0.0, 1.8)];
        let p = person.map(|(dx, z)| Vec3::new(x + dx, -2.0, z));
        for corners in [[0, 1, 2], [0, 2, 3]] {
            self.triangle(corners.map(|c| p[c]), |_| Some(Vec3::new(0.6, 0.05, 0.05)));
        }
    }

    fn tree(&mut self, tree: &TreeAsset, library: &MaterialLibrary, at: Vec3) {
        let mesh = tree.prototype.mesh();
        let texel = |id: MaterialId, uv: Vec2| library.get(id).albedo.sample(uv, 0.0);
        for t in &mesh.triangles {
            let p = t.corners.map(|c| mesh.positions[c as usize] + at);
            let n = t.corners.map(|c| mesh.normals[c as usize]);
            let uv = t.corners.map(|c| mesh.uvs[c as usize]);
            self.triangle(p, |w| {
                let n = n[0] * w.x + n[1] * w.y + n[2] * w.z;
                let uv = uv[0] * w.x + uv[1] * w.y + uv[2] * w.z;
                Some(light(n, texel(t.material, uv), Vec3::ZERO))
            });
        }
        for card in tree.prototype.cards() {
            let material = library.get(card.material);
            let c = card.corners().map(|c| c + at);
            let uv = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
            let normal = card.edge_u.cross(card.edge_v);
            for corners in [[0, 1, 2], [0, 2, 3]] {
                let [a, b, d] = corners.map(|k| uv[k]);
                self.triangle(corners.map(|k| c[k]), |w| {
                    let at = a * w.x + b * w.y + d * w.z;
                    let opaque = material
                        .mask
                        .as_ref()
                        .is_none_or(|m| m.is_opaque(at.x, at.y));
                    let albedo = texel(card.material, at);
                    opaque.then(|| light(normal, albedo, material.transmittance))
                });
            }
        }
    }

    /// Draws where `shade`, given barycentric weights, is something.
    fn triangle(&mut self, p: [Vec3; 3], shade: impl Fn(Vec3) -> Option<Vec3>) {
        let s = p.map(|p| Vec2::new(p.x - self.corner.x, self.corner.y - p.z) / self.pixel_m);
        let area = (s[1] - s[0]).perp_dot(s[2] - s[0]);
        if area.abs() < 1e-9 {
            return;
        }
        let low = s[0].min(s[1]).min(s[2]).max(Vec2::ZERO);
        let high = s[0].max(s[1]).max(s[2]).max(Vec2::ZERO);
        let (right, bottom) = (
            (high.x as usize + 1).min(self.width),
            (high.y as usize + 1).min(self.height),
        );
        for y in low.y as usize..bottom {
            for x in low.x as usize..right {
                let q = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let w = Vec3::new(
                    (s[1] - q).perp_dot(s[2] - q),
                    (s[2] - q).perp_dot(s[0] - q),
                    (s[0] - q).perp_dot(s[1] - q),
                ) / area;
                if w.min_element() < 0.0 {
                    continue;
                }
                let depth = p[0].y * w.x + p[1].y * w.y + p[2].y * w.z;
                let pixel = y * self.width + x;
                if depth < self.depth[pixel]
                    && let Some(colour) = shade(w)
                {
                    self.depth[pixel] = depth;
                    self.colour[pixel] = colour;
                }
            }
        }
    }

    fn into_image(self) -> image::RgbImage {
        let ground = (self.corner.y / self.pixel_m) as usize;
        let colour = |x: usize, y: usize| {
            let i = y * self.width + x;
            if y >= ground && self.depth[i] > -1.0 {
                Vec3::new(0.12, 0.10, 0.075)
            } else {
                self.colour[i]
            }
        };
        let (width, height) = (self.width / FINER, self.height / FINER);
        image::RgbImage::from_fn(width as u32, height as u32, |x, y| {
            let (x, y) = (x as usize * FINER, y as usize * FINER);
            let sum: Vec3 = (0..FINER * FINER)
                .map(|k| colour(x + k % FINER, y + k / FINER))
                .sum();
            let mean = 0.62 * sum / (FINER * FINER) as f32;
            image::Rgb(
                mean.to_array()
                    .map(|v| (v.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0) as u8),
            )
        })
    }
}
