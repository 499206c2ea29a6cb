//! Draws what shapes a terrain beyond octaves, from above and lit from the north-west: plain
//! octaves, ridges, winding valleys, terraces, gullies, and all of them (360 m side, up to 50 m).
//!
//! `cargo run --release -p nemoral-terrain --example relief -- relief.png`

use std::error::Error;

use image::{Rgb, RgbImage};
use nemoral_scene::Surface;
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_seed::Key;
use nemoral_terrain::{ErodedSurface, ErosionParams, NoiseTerrain, ReliefParams, TerrainParams};

const SIDE_M: f64 = 360.0;
const PIXELS: u32 = 540;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: relief FILE.png")?;
    let octaves = TerrainParams {
        octaves: 6,
        scale_m: 170.0,
        lacunarity: 2.1,
        persistence: 0.33,
        max_height_m: 50.0,
    };
    let plain = ReliefParams::default();
    let all = ReliefParams {
        ridges: 0.5,
        warp: 0.1,
        terraces: 0.4,
        cliffs: 0.0,
        terrace_step_m: 8.0,
    };
    let only = |change: fn(&mut ReliefParams, &ReliefParams)| {
        let mut relief = plain;
        change(&mut relief, &all);
        relief
    };
    let panels = [
        (plain, false),
        (only(|r, _| r.ridges = 1.0), false),
        (only(|r, _| r.warp = 0.12), false),
        (
            only(|r, all| (r.terraces, r.terrace_step_m) = (1.0, all.terrace_step_m)),
            false,
        ),
        (plain, true),
        (all, true),
    ];
    let mut image = RgbImage::new(3 * PIXELS, 2 * PIXELS);
    for (i, (relief, is_eroded)) in (0..).zip(panels) {
        let key = Key::world(3);
        let terrain = NoiseTerrain::shaped(octaves, relief, key)?;
        let (left, top) = (i % 3 * PIXELS, i / 3 * PIXELS);
        if is_eroded {
            let erosion = ErosionParams {
                spacing_m: 36.0,
                depth_m: 5.0,
                generations: 3,
            };
            shade(
                &mut image,
                left,
                top,
                &ErodedSurface::new(erosion, key, terrain)?,
            );
        } else {
            shade(&mut image, left, top, &terrain);
        }
    }
    image.save(path)?;
    Ok(())
}

fn shade(image: &mut RgbImage, left: u32, top: u32, ground: &dyn Surface) {
    let light = DVec3::new(-0.5, 0.5, 0.6).normalize();
    for y in 0..PIXELS {
        for x in 0..PIXELS {
            let at = DVec2::new(f64::from(x), f64::from(PIXELS - y)) * (SIDE_M / f64::from(PIXELS));
            let sample = ground.sample(at);
            let lit = sample.normal().as_dvec3().dot(light).max(0.0);
            let t = sample.height_m / 50.0;
            let colour = DVec3::new(96.0, 124.0, 82.0).lerp(DVec3::new(226.0, 214.0, 196.0), t);
            let colour = colour * (0.2 + 1.05 * lit);
            let colour = Rgb(colour.to_array().map(|c| c.min(255.0) as u8));
            image.put_pixel(left + x, top + y, colour);
        }
    }
}
