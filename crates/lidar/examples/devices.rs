//! Draws the pulses that each device fires in a tenth of a second: azimuth by elevation with a line
//! at each 10°, blue at the start and orange at the end. Of a whole turn the quarter straight ahead
//! is shown.
//!
//! `cargo run --release -p nemoral-lidar --example devices -- FOLDER` writes a PNG for each device.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::path::Path;

use image::{Rgb, RgbImage};
use nemoral_lidar::{Device, Scanner};

const WIDTH: u32 = 720;
/// Margin around the field of view, degrees.
const MARGIN_DEG: f64 = 4.0;
/// Extent to either side of straight ahead, degrees, as only a part of a whole turn is shown.
const WINDOW_DEG: f64 = 45.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".".into());
    std::fs::create_dir_all(&folder)?;
    for &device in Device::ALL {
        let file = Path::new(&folder).join(format!("{}.png", device.name()));
        draw(device)?.save(file)?;
    }
    Ok(())
}

fn draw(device: Device) -> Result<RgbImage, nemoral_lidar::ParamError> {
    let scanner = Scanner::new(device.params(), device.pattern())?;
    let [wide_deg, tall_deg] = device.sheet().field_of_view_deg;
    let half_deg = (0.5 * wide_deg + MARGIN_DEG).min(WINDOW_DEG);
    let pixels_per_deg = 0.5 * f64::from(WIDTH) / half_deg;
    let height = ((tall_deg + 2.0 * MARGIN_DEG) * pixels_per_deg) as u32;
    // The field of view of the HDL-64E is not centred.
    let middle_deg = if device == Device::Hdl64e { -11.2 } else { 0.0 };
    let at = |azimuth_deg: f64, elevation_deg: f64| {
        let x = 0.5 * f64::from(WIDTH) - azimuth_deg * pixels_per_deg;
        let y = 0.5 * f64::from(height) - (elevation_deg - middle_deg) * pixels_per_deg;
        let inside = x >= 0.0 && y >= 0.0 && x < WIDTH.into() && y < height.into();
        inside.then_some((x as u32, y as u32))
    };
    let mut picture = RgbImage::from_pixel(WIDTH, height, Rgb([12, 14, 20]));
    for tens in -18..=18 {
        let deg = 10.0 * f64::from(tens);
        let grey = Rgb([if tens == 0 { 90 } else { 42 }; 3]);
        if let Some((x, _)) = at(deg, middle_deg) {
            (0..height).for_each(|y| picture.put_pixel(x, y, grey));
        }
        if let Some((_, y)) = at(0.0, deg) {
            (0..WIDTH).for_each(|x| picture.put_pixel(x, y, grey));
        }
    }
    for pulse in scanner.pulses(0) {
        let d = pulse.direction;
        let (azimuth_deg, elevation_deg) = (d.y.atan2(d.x).to_degrees(), d.z.asin().to_degrees());
        let share = pulse.time_s / scanner.duration_s();
        let colour = [
            120.0 + 135.0 * share,
            190.0 - 60.0 * share,
            255.0 - 200.0 * share,
        ];
        if let Some((x, y)) = at(azimuth_deg, elevation_deg) {
            picture.put_pixel(x, y, Rgb(colour.map(|c| c as u8)));
        }
    }
    Ok(picture)
}
