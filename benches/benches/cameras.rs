//! The cost of pictures by density, resolution, quality and renderer; the share of the truth in it
//! (class, instance, depth and normals, which come from one hit or one pass and cannot be
//! separated); the cost of each further kind of truth, which is cast after the picture; the cost of
//! a lens, a shutter and noise; and the cost of each map's file. Costs are processor time, as
//! wall-clock time also depends on what else the machine does.
//!
//! ```text
//! cargo bench -p nemoral-benches [--features gpu] --bench cameras -- \
//!     [cpu|gpu|auto] [TIMES] [PART OF A NAME] [KEY=VALUE ...]
//! ```

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]
#![allow(clippy::print_stdout, reason = "a report for its user")]

use std::time::Instant;

use cpu_time::ProcessTime;
use nemoral_benches::settings;
use nemoral_dataset::{CameraData, CameraFile};
use nemoral_pipeline::config::Sequences;
use nemoral_pipeline::plan::{Runner, Store};
use nemoral_pipeline::{Backend, BackendChoice, Error, ForestPlan};
use nemoral_render::{OpenSky, SceneView, View};

const RESOLUTIONS: [[u32; 2]; 3] = [[640, 360], [1280, 720], [1920, 1080]];

/// Names of sampling qualities: samples of every pixel, and of pixels on silhouettes.
const QUALITIES: [(&str, u32, u32); 3] = [("draft", 1, 1), ("edges", 1, 2), ("standard", 4, 4)];

/// Options beyond a picture and its truth that change the picture or how it is made.
const FURTHER: [(&str, &str); 5] = [
    ("radiance", "camera.radiance=true"),
    ("sensor noise", "camera.noise.enabled=true"),
    ("a lens that bends", "camera.brown_conrady.k1=-0.2"),
    ("rolling shutter of 20 ms", "camera.shutter.readout_ms=20"),
    (
        "exposure of 10 ms, 9 samples",
        "camera.shutter.exposure_ms=10",
    ),
];

/// Truth that is cast after a picture, whichever renderer took it. (A sky mask follows from depth
/// and is made when it is written.)
const CAST: [(&str, &str); 3] = [
    ("optical flow", "camera.flow=true"),
    ("trunks behind leaves", "camera.trunks=true"),
    ("boxes, 2-D and 3-D", "camera.boxes=true"),
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words = std::env::args().skip(1).filter(|w| !w.starts_with("--"));
    let (keys, words): (Vec<_>, Vec<_>) = words.partition(|w| w.contains('='));
    let mut words = words.into_iter();
    let choice = match words.next().as_deref() {
        None | Some("cpu") => BackendChoice::Cpu,
        Some("gpu") => BackendChoice::Gpu,
        Some("auto") => BackendChoice::Auto,
        Some(other) => return Err(format!("{other}: cpu, gpu or auto").into()),
    };
    let times = words.next().map_or(Ok(7), |w| w.parse())?;
    let wanted = words.next().unwrap_or_default();
    let (backend, note) = Backend::resolve(choice)?;
    println!("{note}\nbest and median of {times}, seconds: wall; processor");
    let report = |name: &str, reset: &dyn Fn(), once: &dyn Fn() -> Result<(), Error>| {
        once()?;
        let (mut wall, mut processor) = (Vec::new(), Vec::new());
        for _ in 0..times {
            reset();
            let (start, used) = (Instant::now(), ProcessTime::now());
            once()?;
            wall.push(start.elapsed().as_secs_f64());
            processor.push(used.elapsed().as_secs_f64());
        }
        let of = |mut seconds: Vec<f64>| {
            seconds.sort_by(f64::total_cmp);
            format!("{:.3} {:.3}", seconds[0], seconds[times / 2])
        };
        println!("{name}: {}; {}", of(wall), of(processor));
        Ok::<_, Error>(())
    };
    // The forest is grown once: what does not change is found in the store.
    let store = Store::unlimited();
    let threads = std::thread::available_parallelism().map_or(1, Into::into);
    let cost = |preset: &str, named: &str, asked: &[String]| {
        let name = format!("{preset}, {named}");
        if !name.contains(&wanted) {
            return Ok(());
        }
        let asked = [asked, &keys].concat();
        let forest = ForestPlan::on(&settings(preset, &asked)?, backend.clone())?;
        let runner = Runner::new(forest.plan(), &store, threads);
        let reset = || store.retain(|id, _| id != "frame.images");
        report(&name, &reset, &|| runner.get(forest.images, 0).map(drop))
    };
    // The share of the truth in the cost of a picture.
    let truth = |preset: &str, named: &str, asked: &[String]| {
        let name = format!("{preset}, {named}, truth alone");
        if !name.contains(&wanted) {
            return Ok(());
        }
        let asked = [asked, &keys].concat();
        let config = settings(preset, &asked)?;
        let forest = ForestPlan::on(&config, backend.clone())?;
        let runner = Runner::new(forest.plan(), &store, threads);
        let rig = &runner.get(forest.cameras, ())?[0];
        let (pose, scene) = (runner.get(forest.pose, 0)?, runner.get(forest.scene, 0)?);
        let assets = runner.get(forest.assets, ())?;
        let body = pose.track.relative_to(scene.origin_m).middle();
        let view = View::new(rig.intrinsics, body * rig.body_from_camera);
        let seen = SceneView {
            caster: &*scene.caster,
            instances: Some(&*scene),
            materials: &assets.library.materials,
            sky_visibility: &OpenSky,
            lamps: &[],
        };
        report(&name, &|| (), &|| {
            rig.renderer.truth(&seen, &view).map(drop)
        })
    };
    // The cost of further truth for a picture that is already taken.
    let cast = |named: &str, asked: &str| {
        let name = format!("medium, 1280 x 720, {named} alone");
        if !name.contains(&wanted) {
            return Ok(());
        }
        let asked = [&[asked.to_owned()], &*keys].concat();
        let forest = ForestPlan::on(&settings("medium", &asked)?, backend.clone())?;
        let runner = Runner::new(forest.plan(), &store, threads);
        let reset = || store.retain(|id, _| id != "frame.annotations");
        report(&name, &reset, &|| {
            runner.get(forest.annotations, 0).map(drop)
        })
    };
    // The cost of each file: it is encoded and written, without its checksum.
    let written = || {
        let name = |file: CameraFile| format!("medium, 1280 x 720, {file:?} written");
        if !CameraFile::ALL.iter().any(|f| name(*f).contains(&wanted)) {
            return Ok(());
        }
        let all = ["sky", "flow", "trunks", "boxes", "radiance"];
        let asked = all.map(|key| format!("camera.{key}=true"));
        let asked = [&asked, &*keys].concat();
        let config = settings("medium", &asked)?;
        let forest = ForestPlan::on(&config, backend.clone())?;
        let runner = Runner::new(forest.plan(), &store, threads);
        let (images, annotations) = (
            runner.get(forest.images, 0)?,
            runner.get(forest.annotations, 0)?,
        );
        let header = nemoral_pipeline::header(&Sequences::of(&config)?, &backend)?;
        let sequence = &header.sequences[0];
        let data = CameraData {
            name: &sequence.cameras[0].name,
            rgb: &images[0].rgb,
            radiance: images[0].linear.as_ref(),
            truth: &images[0].truth,
            annotations: &annotations[0],
        };
        let folder = tempfile::tempdir().expect("a temporary folder");
        for file in CameraFile::ALL
            .into_iter()
            .filter(|f| name(*f).contains(&wanted))
        {
            let bytes = || {
                let bytes = file.encode(sequence, &header.ontology, 0, &data);
                bytes.expect("asked for")
            };
            let name = format!("{}, {} kB", name(file), bytes().len() / 1000);
            report(&name, &|| (), &|| {
                std::fs::write(folder.path().join("file"), bytes()).expect("room for it");
                Ok(())
            })?;
        }
        Ok::<_, Error>(())
    };
    for preset in nemoral_benches::DENSITIES {
        for [width, height] in RESOLUTIONS {
            for (quality, samples, edges) in QUALITIES {
                let asked = [
                    format!("camera.width_px={width}"),
                    format!("camera.height_px={height}"),
                    format!("camera.samples={samples}"),
                    format!("camera.edge_samples={edges}"),
                ];
                cost(preset, &format!("{width} x {height}, {quality}"), &asked)?;
            }
        }
    }
    for [width, height] in RESOLUTIONS {
        let asked = [
            format!("camera.width_px={width}"),
            format!("camera.height_px={height}"),
        ];
        truth("medium", &format!("{width} x {height}"), &asked)?;
    }
    for (named, asked) in FURTHER {
        let asked = [asked.to_owned()];
        cost("medium", &format!("1280 x 720, draft, {named}"), &asked)?;
    }
    for (named, asked) in CAST {
        cast(named, asked)?;
    }
    written()?;
    Ok(())
}
