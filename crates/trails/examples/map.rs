//! Draws trails from above: the carved ground's hillshade with trail surfaces, ruts, strips,
//! slopes, grass and stones; then a close-up of a chunk with contour lines every half metre.
//!
//! `cargo run --release -p nemoral-trails --example map -- FOLDER`

use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;

use image::{Rgb, RgbImage};
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{ChunkCoord, Surface, SurfaceSample};
use nemoral_seed::Key;
use nemoral_trails::{DressingKind, TrailParams, TrailSurfaceKind, TrailZone, Trails};

const SIZE_M: f64 = 50.0;

/// Rolling hills of a few sines, which are enough for a map.
struct Hills;

impl Surface for Hills {
    fn sample(&self, p: DVec2) -> SurfaceSample {
        let mut sample = SurfaceSample {
            height_m: 30.0,
            gradient: DVec2::ZERO,
        };
        for (amplitude, k, phase) in [
            (9.0, DVec2::new(0.021, 0.013), 0.3),
            (5.0, DVec2::new(-0.017, 0.038), 1.1),
            (2.0, DVec2::new(0.081, 0.035), 2.0),
            (0.8, DVec2::new(-0.11, 0.17), 4.0),
        ] {
            let angle: f64 = k.dot(p) + phase;
            sample.height_m += amplitude * angle.sin();
            sample.gradient += amplitude * angle.cos() * k;
        }
        sample
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("usage: map FOLDER")?);
    let trails = Trails::new(
        TrailParams::default(),
        SIZE_M,
        Key::world(1),
        Arc::new(Hills),
    )?;
    draw(&trails, ChunkCoord::new(0, 0), 10, 100, 0.0).save(folder.join("map.png"))?;
    let busiest = (0..100)
        .map(|i| ChunkCoord::new(i % 10, i / 10))
        .max_by_key(|&c| trails.in_chunk(c).len())
        .ok_or("no chunk")?;
    draw(&trails, busiest, 1, 1000, 0.5).save(folder.join("chunk.png"))?;
    Ok(())
}

/// A square of `side` chunks from its south-west one, each `pixels` wide.
fn draw(trails: &Trails, corner: ChunkCoord, side: u32, pixels: u32, contour_m: f64) -> RgbImage {
    let mut image = RgbImage::new(side * pixels, side * pixels);
    let step = SIZE_M / f64::from(pixels);
    for (cx, cy) in (0..side).flat_map(|x| (0..side).map(move |y| (x, y))) {
        let chunk = corner.offset(cx as i32, cy as i32);
        let ground = trails.ground_near(chunk, 1.0);
        let row = |y: u32| (side - cy) * pixels - 1 - y;
        for (x, y) in (0..pixels).flat_map(|x| (0..pixels).map(move |y| (x, y))) {
            let at = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) * step;
            let p = chunk.origin_m(SIZE_M) + at;
            let s = ground.sample(p);
            let light = DVec3::new(-0.5, 0.5, 0.7);
            let lit = s.normal().as_dvec3().dot(light).max(0.0);
            let albedo = match ground.zone(p) {
                TrailZone::Off => DVec3::new(110.0, 140.0, 90.0),
                TrailZone::CutSlope => DVec3::new(160.0, 120.0, 80.0),
                TrailZone::Rut => 0.7 * colour(ground.kind(p)),
                TrailZone::Strip => colour(ground.kind(p)).lerp(DVec3::new(90.0, 150.0, 60.0), 0.4),
                TrailZone::Surface => colour(ground.kind(p)),
            };
            let line = contour_m > 0.0
                && (s.height_m / contour_m).floor()
                    != (ground.height_m(p + DVec2::splat(step)) / contour_m).floor();
            let pixel = if line { 0.6 } else { 1.0 } * albedo * (0.2 + 0.95 * lit);
            let pixel = pixel.to_array().map(|c| c.clamp(0.0, 255.0) as u8);
            image.put_pixel(cx * pixels + x, row(y), Rgb(pixel));
        }
        for thing in trails.dressing(chunk) {
            let at = (thing.position_m - chunk.origin_m(SIZE_M)) / step;
            let (x, y) = (at.x as u32, at.y as u32);
            let colour = match thing.kind {
                DressingKind::Grass | DressingKind::Verge | DressingKind::Strip => {
                    Rgb([20, 110, 20])
                }
                DressingKind::Stone | DressingKind::Bed => Rgb([240, 240, 240]),
                DressingKind::Root | DressingKind::Step | DressingKind::Culvert => {
                    Rgb([120, 70, 30])
                }
            };
            let size = (pixels / 300).max(1);
            for (dx, dy) in (0..size).flat_map(|x| (0..size).map(move |y| (x, y))) {
                let (x, y) = ((x + dx).min(pixels - 1), (y + dy).min(pixels - 1));
                image.put_pixel(cx * pixels + x, row(y), colour);
            }
        }
    }
    image
}

fn colour(kind: Option<TrailSurfaceKind>) -> DVec3 {
    let [r, g, b] = match kind {
        Some(TrailSurfaceKind::Gravel) => [190.0, 190.0, 190.0],
        Some(TrailSurfaceKind::DryEarth) => [200.0, 165.0, 120.0],
        Some(TrailSurfaceKind::Mud) => [95.0, 75.0, 60.0],
        Some(TrailSurfaceKind::Grassy) => [130.0, 190.0, 80.0],
        Some(TrailSurfaceKind::LeafLitter) => [185.0, 120.0, 60.0],
        Some(TrailSurfaceKind::Needles) => [165.0, 95.0, 60.0],
        Some(TrailSurfaceKind::Sand) => [230.0, 215.0, 160.0],
        _ => [150.0, 155.0, 170.0],
    };
    DVec3::new(r, g, b)
}
