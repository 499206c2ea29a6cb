//! Draws trees of every species beside a person of 1.8 m: `tree_gallery FOLDER [DBH_CM]`.
//!
//! Orthographic, from the south, a pixel is 2 cm; sun from the upper left, behind the viewer.

use std::path::Path;

use nemoral_assets::{
    FoliageCard, GrownTree, GrowthParams, ParamError, Species, TreeMaterials, TreeSize, grow,
};
use nemoral_scene::glam::{Vec2, Vec3};
use nemoral_scene::{AlphaMask, Material, MaterialId, MaterialLibrary, Semantic};
use nemoral_seed::{Key, Stage};

const PIXEL_M: f32 = 0.02;
const INDIVIDUALS: u64 = 3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments
        .next()
        .ok_or("usage: tree_gallery FOLDER [DBH_CM]")?;
    let dbh_m = arguments
        .next()
        .map(|d| d.parse::<f64>())
        .transpose()?
        .map(|cm| cm / 100.0);
    for species in Species::all() {
        let (library, materials) = materials(&species)?;
        let mut trees = Vec::new();
        for i in 0..INDIVIDUALS {
            let key = Key::world(7).stage(Stage::new("gallery")).item(i);
            let dbh_m = dbh_m.unwrap_or([0.2, 0.32, 0.45][i as usize]);
            trees.push(tree(
                &species,
                &species.draw_size(dbh_m, key),
                &materials,
                key,
            )?);
        }
        let path = Path::new(&folder).join(format!("{}.png", species.name));
        picture(&trees, &library).save(path)?;
    }
    Ok(())
}

#[allow(
    clippy::print_stdout,
    reason = "the table is what the user runs this for"
)]
fn tree(
    species: &Species,
    size: &TreeSize,
    materials: &TreeMaterials,
    key: Key,
) -> Result<GrownTree, ParamError> {
    let start = std::time::Instant::now();
    let tree = grow(species, size, materials, &GrowthParams::default(), key)?;
    println!(
        "{:13} d {:.3}/{:.3} H {:.2}/{:.2} base {:.2}/{:.2} r {:.2}/{:.2} LA {:.0}/{:.0} lean {:.1}: {} triangles, {} cards, {:.2} m3, {:.1} ms",
        species.name,
        size.dbh_m,
        tree.size.dbh_m,
        size.height_m,
        tree.size.height_m,
        size.crown_base_m,
        tree.size.crown_base_m,
        size.crown_radius_m,
        tree.size.crown_radius_m,
        size.leaf_area_m2,
        tree.size.leaf_area_m2,
        tree.size.lean_rad.to_degrees(),
        tree.mesh.triangles.len(),
        tree.cards.len(),
        tree.stem_volume_m3,
        start.elapsed().as_secs_f64() * 1e3,
    );
    Ok(tree)
}

/// Plain colours, and masks of strokes: enough to judge form.
fn materials(
    species: &Species,
) -> Result<(MaterialLibrary, TreeMaterials), Box<dyn std::error::Error>> {
    let mut library = MaterialLibrary::new();
    let mut plain = |name: &str, semantic, r, g, b| {
        library.add(Material::plain(name, semantic, Vec3::new(r, g, b)))
    };
    let (stem, twig) = match species.name {
        "maritime_pine" => (Vec3::new(0.16, 0.10, 0.07), Vec3::new(0.14, 0.10, 0.07)),
        "eucalyptus" => (Vec3::new(0.38, 0.33, 0.27), Vec3::new(0.25, 0.2, 0.15)),
        _ => (Vec3::new(0.17, 0.15, 0.12), Vec3::new(0.13, 0.11, 0.09)),
    };
    let ids = [
        plain("stem", Semantic::Stem, stem.x, stem.y, stem.z),
        plain(
            "flare",
            Semantic::RootFlare,
            0.8 * stem.x,
            0.85 * stem.y,
            0.8 * stem.z,
        ),
        plain("limb", Semantic::Limb, stem.x, stem.y, stem.z),
        plain("branch", Semantic::Branch, twig.x, twig.y, twig.z),
        plain("dead", Semantic::Twig, 0.2, 0.18, 0.16),
    ];
    let (colour, width_m, height_m, leaf_layers) = match species.name {
        "maritime_pine" => (Vec3::new(0.055, 0.10, 0.03), 0.35, 0.35, 1.0),
        "eucalyptus" => (Vec3::new(0.09, 0.14, 0.075), 0.35, 0.5, 1.3),
        _ => (Vec3::new(0.06, 0.12, 0.03), 0.42, 0.42, 1.3),
    };
    let mut foliage = Vec::new();
    for variant in 0..3 {
        let mask = leaf_mask(species.name, variant)?;
        let opaque_fraction = mask.opaque_fraction() as f32;
        let shade = colour * (0.9 + 0.12 * variant as f32);
        let material = Material {
            mask: Some(mask.into()),
            ..Material::plain("leaves", Semantic::Leaf, shade)
        };
        foliage.push(FoliageCard {
            material: library.add(material),
            width_m,
            height_m,
            opaque_fraction,
            leaf_layers,
        });
    }
    let [stem, flare, limb, branch, dead] = ids;
    Ok((
        library,
        TreeMaterials {
            stem,
            flare,
            limb,
            branch,
            dead,
            foliage,
        },
    ))
}

/// Leaves as tapered strokes from the twig: needles fanned, sickles hanging, rosettes.
fn leaf_mask(species: &str, variant: u32) -> Result<AlphaMask, Box<dyn std::error::Error>> {
    let mut strokes: Vec<(Vec2, Vec2, f32)> = Vec::new();
    let v = variant as f32;
    match species {
        "maritime_pine" => {
            for k in 0..60 {
                let t = k as f32 / 59.0;
                let angle = (t - 0.5) * 3.9 + 0.1 * (k as f32 * 1.7 + v).sin();
                let from = Vec2::new(0.5, 0.12 + 0.35 * ((k * 7 % 10) as f32 / 10.0));
                strokes.push((
                    from,
                    from + Vec2::new(angle.sin(), angle.cos()) * 0.48,
                    0.006,
                ));
            }
        }
        "eucalyptus" => {
            strokes.push((Vec2::new(0.5, 0.0), Vec2::new(0.5, 0.6), 0.008));
            for k in 0..11 {
                let side = if k % 2 == 0 { 1.0 } else { -1.0 };
                let from = Vec2::new(0.5, 0.06 * k as f32);
                let angle = side * (0.35 + 0.5 * ((k as f32 * 2.3 + v).sin().abs()));
                strokes.push((
                    from,
                    from + Vec2::new(angle.sin(), angle.cos()) * 0.42,
                    0.032,
                ));
            }
        }
        _ => {
            strokes.push((Vec2::new(0.5, 0.0), Vec2::new(0.5, 0.5), 0.01));
            for k in 0..10 {
                let side = if k % 2 == 0 { 1.0 } else { -1.0 };
                let from = Vec2::new(0.5, 0.15 + 0.04 * k as f32);
                let angle = side * (1.7 - 0.15 * k as f32 + 0.2 * (k as f32 + v).sin());
                strokes.push((
                    from,
                    from + Vec2::new(angle.sin(), angle.cos()) * 0.36,
                    0.085,
                ));
            }
        }
    }
    Ok(AlphaMask::from_fn(128, 128, |c, r| {
        let p = Vec2::new(c as f32 + 0.5, r as f32 + 0.5) / 128.0;
        strokes.iter().any(|&(a, b, width)| {
            let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            let taper = (4.0 * t * (1.0 - t)).sqrt().max(0.25);
            p.distance(a + (b - a) * t) < width * taper
        })
    })?)
}

/// A z-buffered picture.
struct Canvas {
    width: usize,
    height: usize,
    depth: Vec<f32>,
    colour: Vec<Vec3>,
    /// World x of the left edge, world z of the upper edge.
    corner: Vec2,
}

fn picture(trees: &[GrownTree], library: &MaterialLibrary) -> image::RgbImage {
    let widest = trees
        .iter()
        .map(|t| t.size.crown_radius_m)
        .fold(0.0, f64::max) as f32
        * 2.5
        + 1.0;
    let tallest = trees.iter().map(|t| t.size.height_m).fold(0.0, f64::max) as f32 + 1.5;
    let columns = trees.len() as f32 * widest + 1.5;
    let (width, height) = ((columns / PIXEL_M) as usize, (tallest / PIXEL_M) as usize);
    let mut canvas = Canvas {
        width,
        height,
        depth: vec![f32::INFINITY; width * height],
        colour: vec![Vec3::new(0.55, 0.68, 0.85); width * height],
        corner: Vec2::new(-1.5, tallest - 0.8),
    };
    let person = [
        Vec3::new(-1.0, -2.0, 0.0),
        Vec3::new(-0.6, -2.0, 0.0),
        Vec3::new(-0.6, -2.0, 1.8),
        Vec3::new(-1.0, -2.0, 1.8),
    ];
    for corners in [[0, 1, 2], [0, 2, 3]] {
        canvas.triangle(corners.map(|c| person[c]), |_| {
            Some(Vec3::new(0.7, 0.05, 0.05))
        });
    }
    for (i, tree) in trees.iter().enumerate() {
        let at = Vec3::new((i as f32 + 0.5) * widest, 0.0, 0.0);
        for t in &tree.mesh.triangles {
            let p = t.corners.map(|c| tree.mesh.positions[c as usize] + at);
            let n = t.corners.map(|c| tree.mesh.normals[c as usize]);
            let albedo = albedo(library, t.material);
            canvas.triangle(p, |w| {
                Some(albedo * light(n[0] * w.x + n[1] * w.y + n[2] * w.z, false))
            });
        }
        for card in &tree.cards {
            let material = library.get(card.material);
            let c = card.corners().map(|c| c + at);
            let uv = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
            let shade =
                albedo(library, card.material) * light(card.edge_u.cross(card.edge_v), true);
            for corners in [[0, 1, 2], [0, 2, 3]] {
                let [a, b, d] = corners.map(|k| uv[k]);
                canvas.triangle(corners.map(|k| c[k]), |w| {
                    let at = a * w.x + b * w.y + d * w.z;
                    material
                        .mask
                        .as_ref()
                        .is_none_or(|m| m.is_opaque(at.x, at.y))
                        .then_some(shade)
                });
            }
        }
    }
    canvas.into_image()
}

fn albedo(library: &MaterialLibrary, id: MaterialId) -> Vec3 {
    library.get(id).albedo.mean()
}

/// Sun and sky on a surface; a leaf lets a part through.
fn light(normal: Vec3, leaf: bool) -> f32 {
    let n = normal.normalize_or(Vec3::Z);
    let sun = n.dot(Vec3::new(-0.45, -0.5, 0.74));
    let lit = if leaf {
        sun.max(-0.55 * sun)
    } else {
        sun.max(0.0)
    };
    let sky = if leaf { 0.75 } else { 0.6 + 0.4 * n.z };
    3.2 * lit + 0.9 * sky
}

impl Canvas {
    /// Draws where `shade`, given barycentric weights, is something.
    fn triangle(&mut self, p: [Vec3; 3], shade: impl Fn(Vec3) -> Option<Vec3>) {
        let s = p.map(|p| Vec2::new(p.x - self.corner.x, self.corner.y - p.z) / PIXEL_M);
        let area = (s[1] - s[0]).perp_dot(s[2] - s[0]);
        if area.abs() < 1e-9 {
            return;
        }
        let (low, high) = (
            s[0].min(s[1]).min(s[2]).max(Vec2::ZERO),
            s[0].max(s[1]).max(s[2]),
        );
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
        let ground = (self.corner.y / PIXEL_M) as u32;
        image::RgbImage::from_fn(self.width as u32, self.height as u32, |x, y| {
            let i = y as usize * self.width + x as usize;
            let mut c = self.colour[i];
            if y >= ground && self.depth[i].is_infinite() {
                c = Vec3::new(0.2, 0.17, 0.12);
            }
            image::Rgb(
                c.to_array()
                    .map(|v| (v.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0) as u8),
            )
        })
    }
}
