//! Draws the pulses that each device fires in a tenth of a second: azimuth by elevation with a line
//! at each 10°, blue at the start and orange at the end. Of a whole turn the quarter straight ahead
//! is shown, but all of what a motor turns. For a scanner that looks down it is the angle to
//! straight down across the flight, left on the left, and time runs down, with a line at each
//! 10 ms.
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
/// Height of the picture of a scanner that looks down, and the margin above and below.
const DOWN_HEIGHT: u32 = 480;
const DOWN_MARGIN: u32 = 12;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".".into());
    std::fs::create_dir_all(&folder)?;
    for &device in Device::ALL {
        let file = Path::new(&folder).join(format!("{}.png", device.name()));
        draw(device)?.save(file)?;
    }
    Ok(())
}

/// Where a picture shows what.
struct View {
    height: u32,
    /// What is at half its height: an elevation, degrees, or minus a time, seconds.
    middle: f64,
    /// Pixels of a degree across, and of a degree or second upwards.
    pixels: [f64; 2],
}

impl View {
    /// The pixel of an angle to the left and of what is upwards.
    fn at(&self, left_deg: f64, up: f64) -> Option<(u32, u32)> {
        let x = 0.5 * f64::from(WIDTH) - left_deg * self.pixels[0];
        let y = 0.5 * f64::from(self.height) - (up - self.middle) * self.pixels[1];
        let inside = x >= 0.0 && y >= 0.0 && x < WIDTH.into() && y < self.height.into();
        inside.then_some((x as u32, y as u32))
    }
}

fn draw(device: Device) -> Result<RgbImage, nemoral_lidar::ParamError> {
    let scanner = Scanner::new(device.params(), device.pattern())?;
    let looks_down = scanner.field_of_view().axis.z < -0.5;
    let [wide_deg, tall_deg] = device.sheet().field_of_view_deg;
    let sees_all = tall_deg >= 180.0;
    let half_deg = if looks_down || sees_all {
        0.5 * wide_deg + MARGIN_DEG
    } else {
        (0.5 * wide_deg + MARGIN_DEG).min(WINDOW_DEG)
    };
    let pixels_per_deg = 0.5 * f64::from(WIDTH) / half_deg;
    let view = if looks_down {
        let pixels_per_s = f64::from(DOWN_HEIGHT - 2 * DOWN_MARGIN) / scanner.duration_s();
        View {
            height: DOWN_HEIGHT,
            middle: -0.5 * scanner.duration_s(),
            pixels: [pixels_per_deg, pixels_per_s],
        }
    } else {
        // The field of view of the HDL-64E is not centred.
        let middle_deg = if device == Device::Hdl64e { -11.2 } else { 0.0 };
        View {
            height: ((tall_deg + 2.0 * MARGIN_DEG) * pixels_per_deg) as u32,
            middle: middle_deg,
            pixels: [pixels_per_deg; 2],
        }
    };
    let mut picture = RgbImage::from_pixel(WIDTH, view.height, Rgb([12, 14, 20]));
    for tens in -18..=18 {
        let deg = 10.0 * f64::from(tens);
        let grey = Rgb([if tens == 0 { 90 } else { 42 }; 3]);
        if let Some((x, _)) = view.at(deg, view.middle) {
            (0..view.height).for_each(|y| picture.put_pixel(x, y, grey));
        }
        let up = if looks_down { 1e-3 * deg } else { deg };
        if let Some((_, y)) = view.at(0.0, up) {
            (0..WIDTH).for_each(|x| picture.put_pixel(x, y, grey));
        }
    }
    for pulse in scanner.pulses(0) {
        let d = pulse.direction;
        let (left_deg, up) = if looks_down {
            (d.y.atan2(-d.z).to_degrees(), -pulse.time_s)
        } else {
            (d.y.atan2(d.x).to_degrees(), d.z.asin().to_degrees())
        };
        let share = pulse.time_s / scanner.duration_s();
        let colour = [
            120.0 + 135.0 * share,
            190.0 - 60.0 * share,
            255.0 - 200.0 * share,
        ];
        if let Some((x, y)) = view.at(left_deg, up) {
            picture.put_pixel(x, y, Rgb(colour.map(|c| c as u8)));
        }
    }
    Ok(picture)
}
