//! What samples of a picture's colour buy: the error of the displayed picture against one of 256
//! samples a pixel, and the processor time that it takes, for frame 0 of a preset.
//!
//! ```text
//! cargo bench -p nemoral-benches --bench antialiasing -- [PRESET] [TIMES] [KEY=VALUE ...]
//! ```
//!
//! Each line is a choice of `camera.samples` and `camera.edge_samples` with a lens that spreads
//! light by `camera.spread_px`. The reference has the same lens, so what a lens takes from
//! sharpness is no error. Errors are those of the middle of the picture, the times those of the
//! whole one.

#![allow(clippy::print_stdout, reason = "a report for its user")]

use cpu_time::ProcessTime;
use nemoral_benches::settings;
use nemoral_pipeline::ForestPlan;
use nemoral_pipeline::plan::{Runner, Store};
use nemoral_render::CameraImages;

/// Samples of every pixel, and of pixels on silhouettes.
const CHOICES: [(u32, u32); 7] = [(1, 1), (1, 2), (1, 3), (1, 4), (2, 2), (4, 4), (8, 8)];

const SPREADS: [f64; 3] = [0.0, 0.5, 0.7];

/// The middle of a picture of 1280 × 720 pixels and 80 degrees.
const MIDDLE: [&str; 6] = [
    "camera.width_px=320",
    "camera.height_px=180",
    "camera.calibration.fx_px=762.72",
    "camera.calibration.fy_px=762.72",
    "camera.calibration.cx_px=160",
    "camera.calibration.cy_px=90",
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words = std::env::args().skip(1).filter(|w| !w.starts_with("--"));
    let (keys, words): (Vec<_>, Vec<_>) = words.partition(|w| w.contains('='));
    let mut words = words.into_iter();
    let preset = words.next().unwrap_or_else(|| "medium".to_owned());
    let times = words.next().map_or(Ok(3), |w| w.parse())?;
    let store = Store::unlimited();
    let threads = std::thread::available_parallelism().map_or(1, Into::into);
    let taken = |asked: &[String]| {
        let asked = [asked, &keys].concat();
        let forest = ForestPlan::new(&settings(&preset, &asked)?)?;
        let runner = Runner::new(forest.plan(), &store, threads);
        runner.get(forest.camera_scene, 0)?;
        runner.get(forest.cameras, ())?;
        store.retain(|id, _| id != "frame.images");
        let start = ProcessTime::now();
        let images = runner.get(forest.images, 0)?;
        let took = start.elapsed().as_secs_f64();
        Ok::<_, nemoral_pipeline::Error>((images[0].clone(), took))
    };
    let asked = |(samples, edges): (u32, u32), spread: f64| {
        vec![
            format!("camera.samples={samples}"),
            format!("camera.edge_samples={edges}"),
            format!("camera.spread_px={spread}"),
        ]
    };
    let middle = |mut asked: Vec<String>| {
        asked.extend(MIDDLE.map(str::to_owned));
        // All pictures have one exposure.
        asked.push("camera.exposure=fixed".to_owned());
        Ok::<_, nemoral_pipeline::Error>(taken(&asked)?.0)
    };
    println!("{preset}, error in code values by spread in pixels: {SPREADS:?}");
    let references = SPREADS.map(|spread| middle(asked((256, 256), spread)));
    for choice in CHOICES {
        let (samples, edges) = choice;
        let mut errors = Vec::new();
        for (spread, reference) in SPREADS.into_iter().zip(&references) {
            let reference = reference.as_ref().map_err(ToString::to_string)?;
            let error = error(&middle(asked(choice, spread))?, reference);
            errors.push(format!("{error:.2}"));
        }
        let mut best = f64::MAX;
        for _ in 0..times {
            best = best.min(taken(&asked(choice, 0.7))?.1);
        }
        println!(
            "samples {samples}, {edges} on edges: {best:.3} s of processor, errors {}",
            errors.join(" ")
        );
    }
    Ok(())
}

/// The root mean square of differences between displayed pictures, code values.
fn error(picture: &CameraImages, reference: &CameraImages) -> f64 {
    let pairs = picture.rgb.pixels().iter().zip(reference.rgb.pixels());
    let squares: f64 = pairs
        .flat_map(|(a, b)| a.iter().zip(b))
        .map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2))
        .sum();
    (squares / (3 * picture.rgb.pixels().len()) as f64).sqrt()
}
