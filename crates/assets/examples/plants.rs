//! Draws undergrowth, shrubs, stumps, rocks, trees and what climbs them on the forest floor, in sun
//! and shadow: `plants FOLDER [SEED]`. One PNG for each kind of plants, seen from 25° above
//! the horizon.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::path::Path;
use std::sync::Arc;

use image::{Rgb, RgbImage};
use nemoral_assets::{
    AssetParams, ClimberParams, Library, PlantKind, Species, StandSpecies, StemMoss,
};
use nemoral_scene::glam::{Mat3, Vec2, Vec3};
use nemoral_scene::{MaterialLibrary, Prototype};
use nemoral_seed::Key;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let folder = args.next().unwrap_or_else(|| "plants".to_owned());
    let seed = args.next().map_or(Ok(7), |s| s.parse())?;
    std::fs::create_dir_all(&folder)?;
    let params = AssetParams {
        individuals_per_species: 2,
        seedlings_per_species: 8,
        climbers: Some(ClimberParams {
            moss: StemMoss {
                amount: 1.0,
                height_m: 0.9,
            },
            lianas: true,
            resin: true,
        }),
        species: Species::all()
            .into_iter()
            .map(|species| StandSpecies {
                species,
                dbh_mean_m: 0.3,
                trees_per_ha: 300.0,
            })
            .collect(),
        ..AssetParams::default()
    };
    let library = Library::grow(&params, Key::world(seed))?;
    let folder = Path::new(&folder);
    let floor = &library.ground.floor;
    let lists = [
        ("grass", PlantKind::Grass, 1.7, 4),
        ("herbs", PlantKind::Herbs, 1.5, 4),
        ("ferns", PlantKind::Ferns, 2.2, 4),
        ("seedlings", PlantKind::Seedling, 0.3, 8),
        ("litter", PlantKind::Litter, 1.7, 4),
        ("shrubs", PlantKind::Shrub, 3.4, 4),
        ("rocks", PlantKind::Rock, 2.6, 4),
        ("stumps", PlantKind::Stump, 1.3, 5),
        ("trail_tufts", PlantKind::TrailTuft, 0.5, 6),
        ("strip_mats", PlantKind::StripMat, 0.6, 6),
        ("trail_stones", PlantKind::TrailStone, 0.25, 6),
    ];
    for (i, (name, kind, spacing_m, columns)) in lists.into_iter().enumerate() {
        let plants = library.plants[kind].iter();
        let things: Vec<_> = plants.map(|p| vec![p.prototype.clone()]).collect();
        let ground = floor[i % floor.len()];
        let picture = picture(&things, spacing_m, columns, ground, &library.materials);
        picture.save(folder.join(format!("{name}.png")))?;
    }
    let trees: Vec<_> = library
        .trees
        .iter()
        .map(|t| vec![t.prototype.clone()])
        .collect();
    picture(&trees, 9.0, 6, floor[0], &library.materials).save(folder.join("trees.png"))?;
    // Each species with ivy, with honeysuckle and resin, and with clematis.
    let mut climbed = Vec::new();
    for (tree, on) in library.trees.iter().zip(&library.climbers.trees).step_by(2) {
        let high = on.ivy.last().into_iter();
        let kinds = [
            high.collect::<Vec<_>>(),
            on.honeysuckle.iter().chain(&on.resin).collect(),
        ];
        for kind in kinds.into_iter().chain([on.clematis.iter().collect()]) {
            let mut all = vec![tree.prototype.clone()];
            all.extend(kind.into_iter().cloned());
            climbed.push(all);
        }
    }
    picture(&climbed, 7.0, 9, floor[0], &library.materials).save(folder.join("climbers.png"))?;
    Ok(())
}

/// Width of a picture, pixels; it is drawn at twice that resolution.
const WIDTH: usize = 1500;

/// A parallel projection: image axes and the direction of sight, with a z-buffer.
struct View {
    /// Its rows are the image's x axis, its y axis (down), and the direction away from the eye.
    axes: Mat3,
    corner: Vec2,
    pixel_m: f32,
    width: usize,
    height: usize,
    depth: Vec<f32>,
}

impl View {
    /// A view along `away` that holds a box.
    fn around(away: Vec3, points: &[Vec3], width: usize) -> Self {
        let right = away.cross(Vec3::Z).normalize_or(Vec3::X);
        let down = away.cross(right).normalize_or(-Vec3::Z);
        let axes = Mat3::from_cols(right, down, away).transpose();
        let (mut low, mut high) = (Vec2::MAX, Vec2::MIN);
        for p in points {
            let q = (axes * *p).truncate();
            low = low.min(q);
            high = high.max(q);
        }
        let pixel_m = (high.x - low.x) / width as f32;
        let height = ((high.y - low.y) / pixel_m) as usize + 1;
        Self {
            axes,
            corner: low,
            pixel_m,
            width,
            height,
            depth: vec![f32::INFINITY; width * height],
        }
    }

    fn project(&self, p: Vec3) -> Vec3 {
        let q = self.axes * p;
        ((q.truncate() - self.corner) / self.pixel_m).extend(q.z)
    }

    /// Visits the pixels of a triangle that are nearer than what is there: (pixel, weights).
    fn triangle(&mut self, p: [Vec3; 3], mut visit: impl FnMut(usize, Vec3) -> bool) {
        let s = p.map(|p| self.project(p));
        let [a, b, c] = s.map(Vec3::truncate);
        let area = (b - a).perp_dot(c - a);
        if area.abs() < 1e-9 {
            return;
        }
        let low = a.min(b).min(c).max(Vec2::ZERO);
        let high = a.max(b).max(c).max(Vec2::ZERO);
        for y in low.y as usize..(high.y as usize + 1).min(self.height) {
            for x in low.x as usize..(high.x as usize + 1).min(self.width) {
                let q = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let w = Vec3::new(
                    (b - q).perp_dot(c - q),
                    (c - q).perp_dot(a - q),
                    (a - q).perp_dot(b - q),
                ) / area;
                let z = s[0].z * w.x + s[1].z * w.y + s[2].z * w.z;
                let pixel = y * self.width + x;
                if w.min_element() >= 0.0 && z < self.depth[pixel] && visit(pixel, w) {
                    self.depth[pixel] = z;
                }
            }
        }
    }
}

/// What a pixel shows.
#[derive(Clone, Copy)]
struct Seen {
    at: Vec3,
    normal: Vec3,
    albedo: Vec3,
    transmittance: Vec3,
}

/// Every triangle of a scene: corners, normals, uv, material.
type Facet = ([Vec3; 3], [Vec3; 3], [Vec2; 3], nemoral_scene::MaterialId);

fn facets(things: &[(Arc<Prototype>, Vec3)]) -> Vec<Facet> {
    let mut all = Vec::new();
    for (thing, at) in things {
        let mesh = thing.mesh();
        for t in &mesh.triangles {
            let c = t.corners.map(|c| c as usize);
            all.push((
                c.map(|c| mesh.positions[c] + *at),
                c.map(|c| mesh.normals[c]),
                c.map(|c| mesh.uvs[c]),
                t.material,
            ));
        }
        for card in thing.cards() {
            let p = card.corners().map(|c| c + *at);
            let uv = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
            let n = card.edge_u.cross(card.edge_v).normalize_or(Vec3::Z);
            for k in [[0, 1, 2], [0, 2, 3]] {
                all.push((k.map(|k| p[k]), [n; 3], k.map(|k| uv[k]), card.material));
            }
        }
    }
    all
}

fn picture(
    things: &[Vec<Arc<Prototype>>],
    spacing_m: f32,
    columns: usize,
    ground: nemoral_scene::MaterialId,
    library: &MaterialLibrary,
) -> RgbImage {
    let placed: Vec<_> = things
        .iter()
        .enumerate()
        .flat_map(|(i, thing)| {
            let at = Vec2::new((i % columns) as f32 + 0.5, (i / columns) as f32 + 0.5) * spacing_m;
            thing.iter().map(move |part| (part.clone(), at.extend(0.0)))
        })
        .collect();
    let rows = things.len().div_ceil(columns) as f32;
    let size = Vec2::new(columns as f32, rows) * spacing_m;
    let mut facets = facets(&placed);
    let high = facets
        .iter()
        .flat_map(|f| f.0)
        .fold(0.0_f32, |z, p| z.max(p.z));
    let floor = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y].map(|c| c * size);
    for k in [[0, 1, 2], [0, 2, 3]] {
        let p = k.map(|k| floor[k].extend(0.0));
        let tile_m = library.get(ground).tile_m;
        facets.push((p, [Vec3::Z; 3], k.map(|k| floor[k] / tile_m), ground));
    }
    let frame: Vec<Vec3> = floor
        .iter()
        .enumerate()
        .flat_map(|(i, c)| {
            // Room for what stands in the last row.
            let top = if i > 1 { high } else { 0.3 * high };
            [c.extend(0.0), c.extend(top)]
        })
        .collect();
    let sun = Vec3::new(-0.55, -0.45, 0.70).normalize_or(Vec3::Z);
    let mut view = View::around(Vec3::new(0.0, 0.906, -0.423), &frame, 2 * WIDTH);
    let mut light = View::around(-sun, &frame, 3000);
    let opaque = |f: &Facet, w: Vec3| {
        let uv = f.2[0] * w.x + f.2[1] * w.y + f.2[2] * w.z;
        library
            .get(f.3)
            .mask
            .as_ref()
            .is_none_or(|m| m.is_opaque(uv.x, uv.y))
    };
    for f in &facets {
        light.triangle(f.0, |_, w| opaque(f, w));
    }
    let mut seen: Vec<Option<Seen>> = vec![None; view.width * view.height];
    let sight = view.axes.row(2);
    let pixel_m = view.pixel_m;
    for f in &facets {
        let material = library.get(f.3);
        let edge = f.0[1].distance(f.0[0]).max(1e-6);
        let per_m = f.2[1].distance(f.2[0]) / edge;
        view.triangle(f.0, |pixel, w| {
            if !opaque(f, w) {
                return false;
            }
            let uv = f.2[0] * w.x + f.2[1] * w.y + f.2[2] * w.z;
            let mut normal = (f.1[0] * w.x + f.1[1] * w.y + f.1[2] * w.z).normalize_or(Vec3::Z);
            if material.mask.is_some() && normal.dot(sight) > 0.0 {
                normal = -normal;
            }
            seen[pixel] = Some(Seen {
                at: f.0[0] * w.x + f.0[1] * w.y + f.0[2] * w.z,
                normal,
                albedo: material.albedo.sample(uv, per_m * pixel_m),
                transmittance: material.transmittance,
            });
            true
        });
    }
    let lit = |s: &Seen| {
        let q = light.project(s.at + 0.004 * s.normal);
        let mut sunny = 0.0;
        for (dx, dy) in [(-1, -1), (1, -1), (-1, 1), (1, 1)] {
            let (x, y) = (q.x as i32 + dx, q.y as i32 + dy);
            let inside =
                x >= 0 && y >= 0 && (x as usize) < light.width && (y as usize) < light.height;
            let depth = if inside {
                light.depth[y as usize * light.width + x as usize]
            } else {
                f32::INFINITY
            };
            sunny += if q.z < depth + 0.012 { 0.25 } else { 0.0 };
        }
        let front = s.normal.dot(sun);
        let direct = s.albedo * front.max(0.0) + s.transmittance * (-front).max(0.0);
        let sky =
            s.albedo * (0.65 + 0.35 * s.normal.z) * (0.55 + 0.45 * (s.at.z * 3.0).clamp(0.0, 1.0));
        direct * sunny * 4.2 + sky * 1.1 + s.transmittance * 0.2
    };
    let (w, h) = (view.width / 2, view.height / 2);
    RgbImage::from_fn(w as u32, h as u32, |x, y| {
        let mut sum = Vec3::ZERO;
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let i = (2 * y as usize + dy) * view.width + 2 * x as usize + dx;
            sum += seen[i].as_ref().map_or(Vec3::new(0.62, 0.72, 0.85), lit) / 4.0;
        }
        let tone = |c: f32| (255.0 * (1.0 - (-0.75 * c).exp()).powf(1.0 / 2.2)) as u8;
        Rgb(sum.to_array().map(tone))
    })
}
