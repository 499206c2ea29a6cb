//! Draws the sites of a few chunks from above.
//!
//! `cargo run --release -p nemoral-placement --example draw -- FOLDER`

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::collections::HashMap;
use std::path::PathBuf;

use glam::DVec2;
use image::{Rgb, RgbImage};
use nemoral_placement::{
    DiskKind, GroundCover, GroundCoverParams, Placement, PlacementParams, Site,
};
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;

const CHUNKS: i32 = 3;
const PIXELS_PER_M: f64 = 7.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("which folder?")?);
    std::fs::create_dir_all(&folder)?;
    for (name, trees) in [("low", 31.0), ("medium", 96.0), ("high", 210.0)] {
        let mut params = PlacementParams {
            allowed_fraction: 0.9,
            ..PlacementParams::default()
        };
        params.layers[0].per_chunk = trees;
        params.layers[0].varieties = [(3.0, 0.08, 0.15), (2.0, 0.15, 0.3), (1.0, 0.3, 0.5)]
            .map(|(weight, low, high)| DiskKind {
                weight,
                radius_m: (low, high),
            })
            .to_vec();
        draw(params)?.save(folder.join(format!("{name}.png")))?;
    }
    Ok(())
}

/// A trail, on which sites are left out.
fn beside_trail(p: DVec2, radius_m: f64) -> bool {
    (p.y - 75.0 - 15.0 * (p.x / 30.0).sin()).abs() > 1.8 + radius_m
}

fn draw(params: PlacementParams) -> Result<RgbImage, Box<dyn std::error::Error>> {
    let size_m = params.chunk_size_m;
    let placement = Placement::new(params, Key::world(11))?;
    let cover = GroundCover::new(GroundCoverParams::default(), Key::world(11))?;
    let edge = (f64::from(CHUNKS) * size_m * PIXELS_PER_M) as u32;
    let mut picture = RgbImage::from_pixel(edge, edge, Rgb([226, 215, 190]));
    for (x, y, pixel) in picture.enumerate_pixels_mut() {
        let p = DVec2::new(f64::from(x), f64::from(edge - 1 - y)) / PIXELS_PER_M;
        let border = (p.rem_euclid(DVec2::splat(size_m))).min_element() < 1.0 / PIXELS_PER_M;
        if border {
            *pixel = Rgb([250, 250, 250]);
        } else if !beside_trail(p, 0.0) {
            *pixel = Rgb([180, 150, 110]);
        }
    }
    let mut rocks: HashMap<ChunkCoord, Vec<Site>> = HashMap::new();
    // In the order of phases, so that each chunk comes after those that it must see.
    for phase in 0..4 {
        for coord in square(-1 - 3, CHUNKS + 1 + 3) {
            if Placement::phase(coord) == phase {
                let seen = Placement::lower_phase_neighbours(coord);
                let seen: Vec<&[Site]> = seen
                    .iter()
                    .filter_map(|c| rocks.get(c).map(Vec::as_slice))
                    .collect();
                let here = placement.rocks(coord, &beside_trail, &seen);
                rocks.insert(coord, here);
            }
        }
    }
    for coord in square(0, CHUNKS) {
        for point in cover.points(coord, &beside_trail, &|p| 0.3 + 0.3 * (p.x / 20.0).cos()) {
            disk(
                &mut picture,
                point.position_m,
                0.2 * point.scale,
                [168, 190, 110],
            );
        }
        let near: Vec<Site> = square(-1, 2)
            .flat_map(|d| &rocks[&coord.offset(d.x, d.y)])
            .copied()
            .collect();
        for rock in &rocks[&coord] {
            disk(
                &mut picture,
                rock.position_m,
                rock.radius_m,
                [120, 120, 125],
            );
        }
        for site in placement.woody(coord, &beside_trail, &near) {
            let colour = [[70, 45, 20], [190, 110, 40], [60, 130, 60]][usize::from(site.layer)];
            disk(&mut picture, site.position_m, site.radius_m, colour);
        }
    }
    Ok(picture)
}

fn square(from: i32, to: i32) -> impl Iterator<Item = ChunkCoord> {
    (from..to).flat_map(move |y| (from..to).map(move |x| ChunkCoord::new(x, y)))
}

fn disk(picture: &mut RgbImage, centre_m: DVec2, radius_m: f64, colour: [u8; 3]) {
    let height = f64::from(picture.height());
    let centre = centre_m * PIXELS_PER_M;
    let radius = (radius_m * PIXELS_PER_M).max(1.0);
    let reach = radius.ceil() as i64;
    for dy in -reach..=reach {
        for dx in -reach..=reach {
            if ((dx * dx + dy * dy) as f64) <= radius * radius {
                let x = centre.x as i64 + dx;
                let y = (height - 1.0 - centre.y) as i64 + dy;
                if let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y))
                    && let Some(pixel) = picture.get_pixel_mut_checked(x, y)
                {
                    *pixel = Rgb(colour);
                }
            }
        }
    }
}
