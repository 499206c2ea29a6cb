//! Walks through a forest without a browser, and says how long its pictures take:
//! `walk [PRESET [WIDTH HEIGHT]]`.

#![allow(clippy::print_stdout, reason = "this is a program")]

use std::time::{Duration, Instant};

use nemoral_pipeline::Backend;
use nemoral_pipeline::config::ConfigLayers;
use nemoral_scene::glam::DVec2;
use nemoral_view::{ForestParams, ImageKind, LiveForest, ViewRequest, Viewpoint};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let preset = arguments.next();
    let mut side = |default: u32| arguments.next().map_or(Ok(default), |a| a.parse());
    let size_px = (side(480)?, side(270)?);
    let layers = ConfigLayers {
        preset,
        ..ConfigLayers::default()
    };
    let forest = LiveForest::new(ForestParams {
        sequence: layers.sequences()?.get(0)?,
        backend: Backend::Cpu,
        threads: std::thread::available_parallelism().map_or(1, Into::into),
        cache: None,
    })?;
    let began = Instant::now();
    let start = loop {
        let status = forest.status();
        if let Some(error) = status.error {
            return Err(error.into());
        }
        if let Some(start) = status.start {
            break start;
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    println!("first sight after {:.1} s", began.elapsed().as_secs_f64());
    let mut request = ViewRequest {
        viewpoint: Viewpoint {
            position_m: DVec2::new(start.0, start.1),
            heading_deg: start.2,
            pitch_deg: 0.0,
            eye_m: 1.7,
        },
        kind: ImageKind::Colour,
        size_px,
        still: true,
        viewer: 1,
    };
    while !forest.picture(&request)?.is_some_and(|p| p.is_final) {
        std::thread::sleep(Duration::from_millis(20));
    }
    println!(
        "all that is visible after {:.1} s",
        began.elapsed().as_secs_f64()
    );
    for (kind, name) in ImageKind::ALL {
        for still in [false, true] {
            (request.kind, request.still) = (kind, still);
            let (mut times, mut bytes) = (Vec::new(), 0);
            for step in 0..if still { 5 } else { 40 } {
                if !still {
                    let (sin, cos) = request.viewpoint.heading_deg.to_radians().sin_cos();
                    request.viewpoint.position_m += 0.15 * DVec2::new(sin, cos);
                    request.viewpoint.heading_deg += if step < 20 { 1.0 } else { -1.0 };
                }
                let began = Instant::now();
                let picture = forest.picture(&request)?.ok_or("nobody else looks")?;
                bytes = picture.rendered.encode().1.len();
                request.viewpoint = picture.viewpoint;
                times.push(began.elapsed().as_secs_f64() * 1e3);
            }
            times.sort_by(f64::total_cmp);
            let median = times[times.len() / 2];
            let worst = times[times.len() - 1];
            let manner = if still { "still" } else { "moving" };
            println!("{name:9} {manner:6} {median:6.1} ms (worst {worst:.1}), {bytes} bytes");
        }
    }
    Ok(())
}
