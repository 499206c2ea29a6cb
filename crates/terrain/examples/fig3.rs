//! Draws the six terrains of the paper's Fig. 3 (240 m side, scale 40, 5 octaves, up to 50 m):
//! persistence by lacunarity, as lit reliefs seen from the south-west, and from above.
//!
//! `cargo run --release -p nemoral-terrain --example fig3 -- fig3.png`

use std::error::Error;

use image::{Rgb, RgbImage};
use nemoral_scene::Surface;
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_seed::Key;
use nemoral_terrain::{NoiseTerrain, TerrainParams};

const SIDE_M: f64 = 240.0;
const WIDTH: u32 = 560;
const HEIGHT: u32 = 380;
/// Row of the nearest corner at height 0.
const BASE: f64 = HEIGHT as f64 - 12.0;
const PERSISTENCES: [f64; 2] = [0.25, 0.5];
const LACUNARITIES: [f64; 3] = [1.5, 2.0, 3.0];

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: fig3 FILE.png")?;
    let mut image = RgbImage::from_pixel(3 * WIDTH, 2 * HEIGHT, Rgb([250; 3]));
    for (row, persistence) in PERSISTENCES.into_iter().enumerate() {
        for (column, lacunarity) in LACUNARITIES.into_iter().enumerate() {
            let params = TerrainParams {
                octaves: 5,
                scale_m: 40.0,
                lacunarity,
                persistence,
                max_height_m: 50.0,
            };
            let terrain = NoiseTerrain::new(params, Key::world(1))?;
            let (left, top) = (column as u32 * WIDTH, row as u32 * HEIGHT);
            relief(&mut image, left, top, &terrain);
            let label = format!("PERSISTENCE {persistence} LACUNARITY {lacunarity}");
            write(&mut image, left + 12, top + 10, &label);
        }
    }
    image.save(path)?;
    Ok(())
}

/// An axonometric view from the south-west. Each column of the image goes from the nearest point of
/// the ground to the farthest, and draws only what is above what was drawn before.
fn relief(image: &mut RgbImage, left: u32, top: u32, surface: &dyn Surface) {
    let light = DVec3::new(-0.5, 0.25, 0.6);
    let light = light / light.length();
    let scale = (f64::from(WIDTH) - 20.0) / (SIDE_M * std::f64::consts::SQRT_2);
    for column in 0..WIDTH {
        let across = (f64::from(column) + 0.5 - f64::from(WIDTH) / 2.0) / scale;
        let near = across.abs();
        let ground = |depth: f64| {
            DVec2::new(depth + across, depth - across) * std::f64::consts::FRAC_1_SQRT_2
        };
        let project = |depth: f64, height_m: f64| BASE - scale * (0.5 * depth + 0.85 * height_m);
        // The cut at the front, down to height 0.
        let mut horizon = project(near, surface.height_m(ground(near))).ceil();
        for y in horizon as u32..=project(near, 0.0) as u32 {
            image.put_pixel(left + column, top + y, Rgb([120, 112, 104]));
        }
        let far = SIDE_M * std::f64::consts::SQRT_2 - near;
        let mut depth = near;
        while depth < far {
            let s = surface.sample(ground(depth));
            let y = project(depth, s.height_m);
            let lit = s.normal().as_dvec3().dot(light).max(0.0);
            let t = s.height_m / 50.0;
            let colour = DVec3::new(90.0, 120.0, 70.0).lerp(DVec3::new(215.0, 205.0, 190.0), t)
                * (0.25 + 0.95 * lit);
            let colour = Rgb(colour.to_array().map(|c| c.min(255.0) as u8));
            while horizon > y.max(0.0) {
                horizon -= 1.0;
                image.put_pixel(left + column, top + horizon.max(0.0) as u32, colour);
            }
            depth += 0.25;
        }
    }
}

/// Writes capitals, digits and dots in a font of 3 x 5 dots, each of which is three pixels wide.
fn write(image: &mut RgbImage, left: u32, top: u32, text: &str) {
    for (i, c) in text.chars().enumerate() {
        let rows: [u8; 5] = match c {
            'A' => [2, 5, 7, 5, 5],
            'C' => [3, 4, 4, 4, 3],
            'E' => [7, 4, 6, 4, 7],
            'I' => [7, 2, 2, 2, 7],
            'L' => [4, 4, 4, 4, 7],
            'N' => [6, 5, 5, 5, 5],
            'P' => [6, 5, 6, 4, 4],
            'R' => [6, 5, 6, 5, 5],
            'S' => [3, 4, 2, 1, 6],
            'T' => [7, 2, 2, 2, 2],
            'U' => [5, 5, 5, 5, 7],
            'Y' => [5, 5, 2, 2, 2],
            '0' => [7, 5, 5, 5, 7],
            '1' => [2, 6, 2, 2, 7],
            '2' => [7, 1, 7, 4, 7],
            '3' => [7, 1, 3, 1, 7],
            '5' => [7, 4, 7, 1, 7],
            '.' => [0, 0, 0, 0, 2],
            _ => [0; 5],
        };
        for (y, bits) in rows.into_iter().enumerate() {
            for x in (0..3).filter(|x| bits >> (2 - x) & 1 == 1) {
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let (x, y) = (8 * i as u32 + 2 * x + dx, 2 * y as u32 + dy);
                    image.put_pixel(left + x, top + y, Rgb([20; 3]));
                }
            }
        }
    }
}
