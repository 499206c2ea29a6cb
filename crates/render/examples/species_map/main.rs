//! A user's own pass: the species at each pixel, drawn by the GPU beside the truth.
//!
//! `cargo run -p nemoral-render --features gpu --example species_map` writes `species_map.png`.

mod avenue;

use avenue::Avenue;
use nemoral_render::{AcceptedGpus, Gpu};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let gpu = Gpu::open(AcceptedGpus::Any)?;
    let images = Avenue::new()?.draw(&gpu, &Avenue::view(640, 360)?)?;

    let colours = [
        [230, 230, 235],
        [120, 190, 90],
        [210, 150, 60],
        [40, 110, 120],
    ];
    let map = images.passes[0].map(|texel| colours[texel[0] as usize]);
    let pixels = map.pixels().as_flattened();
    image::save_buffer("species_map.png", pixels, 640, 360, image::ColorType::Rgb8)?;
    Ok(())
}
