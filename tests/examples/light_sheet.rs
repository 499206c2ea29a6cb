//! The contact sheet of `docs/explanation/light.md`: three stands under five skies, at the eye
//! height of a robot.
//!
//! ```text
//! cargo run --release -p nemoral-tests --example light_sheet -- light.png [STAND...]
//! ```
//!
//! Columns are stands, rows are skies. The sun's azimuth is relative to the robot's heading, so
//! that it does not depend on the trail.
#![allow(clippy::print_stderr, reason = "progress for its user")]

use std::path::PathBuf;

use nemoral_pipeline::plan::{Runner, Store};
use nemoral_pipeline::{Error, ForestPlan, write_png};
use nemoral_scene::Image;
use nemoral_scene::glam::DVec3;
use nemoral_tests::config;

const STANDS: [&str; 3] = ["beech", "maritime-pine", "boreal-birch-pine"];

/// Number of the frame of the presets' drive.
const FRAME: u64 = 5;

/// Width and height of a picture on the sheet; it is taken twice as large.
const TILE: [usize; 2] = [480, 270];

/// Space between pictures, pixels.
const GAP: usize = 6;

/// A name, the sun's position (degrees right of the heading, and above the horizon), and settings
/// of the air.
type Sky = (&'static str, f64, f64, &'static [&'static str]);

const SKIES: [Sky; 5] = [
    (
        "dawn",
        60.0,
        4.0,
        &[
            "sky.turbidity=3.5",
            "weather.visibility_m=4000",
            "weather.fog_per_m=0.01",
            "weather.fog_height_m=6",
        ],
    ),
    ("noon", 125.0, 62.0, &["sky.turbidity=2.5"]),
    (
        "overcast",
        0.0,
        40.0,
        &["sky.overcast=1", "weather.visibility_m=8000"],
    ),
    (
        "haze",
        -75.0,
        25.0,
        &[
            "sky.turbidity=3",
            "sky.overcast=0.6",
            "weather.visibility_m=400",
            "weather.fog_per_m=0.03",
            "weather.fog_height_m=10",
        ],
    ),
    ("backlight", 0.0, 18.0, &[]),
];

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let out = PathBuf::from(arguments.next().unwrap_or_else(|| "light.png".to_owned()));
    let named: Vec<String> = arguments.collect();
    let stands: Vec<&str> = if named.is_empty() {
        STANDS.to_vec()
    } else {
        named.iter().map(String::as_str).collect()
    };
    let mut columns = Vec::new();
    for stand in stands {
        eprintln!("{stand} …");
        columns.push(under_all_skies(stand)?);
    }
    write_png(&sheet(&columns), &out)
}

fn under_all_skies(stand: &str) -> Result<Vec<Image<[u8; 3]>>, Error> {
    // The forest is the same under every sky: what was grown for one is reused for the next.
    let store = Store::unlimited();
    let shoot = |sky: &Sky, azimuth_deg: f64| {
        let (_, _, elevation_deg, air) = sky;
        let mut settings = vec![
            format!("camera.width_px={}", 2 * TILE[0]),
            format!("camera.height_px={}", 2 * TILE[1]),
            format!("sun.angles.azimuth_deg={azimuth_deg}"),
            format!("sun.angles.elevation_deg={elevation_deg}"),
        ];
        settings.extend(air.iter().map(|s| (*s).to_owned()));
        let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
        let config = config(stand, &settings);
        let forest = ForestPlan::new(&config)?;
        let runner = Runner::new(forest.plan(), &store, 2);
        let pose = runner.get(forest.pose, FRAME)?.world_from_body();
        let images = runner.get(forest.images, FRAME)?;
        let forward = pose.transform_vector(DVec3::X);
        let heading_deg = forward.x.atan2(forward.y).to_degrees();
        Ok::<_, Error>((heading_deg, images))
    };
    let (heading_deg, _) = shoot(&SKIES[1], 0.0)?;
    SKIES
        .iter()
        .map(|sky| {
            let azimuth = (heading_deg + sky.1 + 540.0).rem_euclid(360.0) - 180.0;
            let (_, images) = shoot(sky, azimuth)?;
            eprintln!("  {}: EV {:.1}", sky.0, images[0].ev100);
            Ok(halved(&images[0].rgb))
        })
        .collect()
}

/// The image at half the resolution: each pixel is the mean of four.
fn halved(image: &Image<[u8; 3]>) -> Image<[u8; 3]> {
    let (width, height) = (image.width() / 2, image.height() / 2);
    let mean = |i: usize| {
        let (x, y) = (i % width * 2, i / width * 2);
        std::array::from_fn(|k| {
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)];
            let sum: u32 = (four.iter())
                .map(|(dx, dy)| u32::from(image.at(x + dx, y + dy)[k]))
                .sum();
            ((sum + 2) / 4) as u8
        })
    };
    Image::new(width, height, (0..width * height).map(mean).collect())
}

fn sheet(columns: &[Vec<Image<[u8; 3]>>]) -> Image<[u8; 3]> {
    let [w, h] = TILE;
    let width = columns.len() * (w + GAP) + GAP;
    let height = SKIES.len() * (h + GAP) + GAP;
    let mut pixels = vec![[18, 20, 22]; width * height];
    for (c, column) in columns.iter().enumerate() {
        for (r, picture) in column.iter().enumerate() {
            for y in 0..h {
                let at = (GAP + r * (h + GAP) + y) * width + GAP + c * (w + GAP);
                pixels[at..at + w].copy_from_slice(&picture.pixels()[y * w..(y + 1) * w]);
            }
        }
    }
    Image::new(width, height, pixels)
}
