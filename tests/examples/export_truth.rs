//! A region of a small forest in every format of `nemoral export`, and all its triangles as rays
//! meet them, for the clients in `tests/clients/export`.
//!
//! ```text
//! cargo run --release -p nemoral-tests --example export_truth -- OUT
//! ```
//!
//! `truth.f32` has nine numbers a triangle, its corners in the scene's axes (metres, z up);
//! `truth.u64`, the id of its object and the number of its fine semantic.
#![allow(
    clippy::disallowed_methods,
    clippy::print_stdout,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::error::Error;
use std::fs;
use std::path::PathBuf;

use nemoral_export::{
    ExportScene, GltfParams, Instancing, UsdParams, write_glb, write_height_map, write_sdf,
    write_usd,
};
use nemoral_pipeline::config::ConfigLayers;
use nemoral_pipeline::{Backend, ExportArea, Recorder};
use nemoral_scene::glam::{DVec2, Vec3};

/// The region, metres.
const LOW_M: DVec2 = DVec2::new(-13.0, 8.0);
const HIGH_M: DVec2 = DVec2::new(9.5, 27.25);

fn main() -> Result<(), Box<dyn Error>> {
    let out = PathBuf::from(std::env::args_os().nth(1).ok_or("say where to write")?);
    fs::create_dir_all(&out)?;
    let layers = ConfigLayers {
        preset: Some("demo".to_owned()),
        settings: ["deadwood.volume_m3_ha=60", "terrain.max_height_m=12"]
            .map(str::to_owned)
            .to_vec(),
        ..ConfigLayers::default()
    };
    let recorder = Recorder::new(layers.sequences()?.get(0)?, Backend::Cpu, None, 2)?;
    let area = ExportArea::Region {
        low_m: LOW_M,
        high_m: HIGH_M,
    };
    let scene = recorder.export_scene(area)?;
    for (name, instancing) in [
        ("instanced", Instancing::Extension),
        ("nodes", Instancing::Nodes),
    ] {
        let params = GltfParams {
            instancing,
            z_up: false,
        };
        write_glb(&scene, &out.join(format!("{name}.glb")), params)?;
        let folder = out.join(format!("usd-{name}"));
        write_usd(&scene, &folder, UsdParams { instancing })?;
    }
    write_sdf(&scene, &out.join("sdf"))?;
    let grid = recorder.export_heights(area, 0.25)?;
    write_height_map(&grid, &out.join("ground.png"))?;
    let (corners, labels) = truth(&scene);
    let bytes = |numbers: Vec<f32>| numbers.into_iter().flat_map(f32::to_le_bytes).collect();
    let heights: Vec<u8> = bytes(grid.heights_m.iter().map(|&h| h as f32).collect());
    fs::write(out.join("heights.f32"), heights)?;
    let corners: Vec<u8> = bytes(corners);
    fs::write(out.join("truth.f32"), corners)?;
    let labels: Vec<u8> = labels.into_iter().flat_map(u64::to_le_bytes).collect();
    fs::write(out.join("truth.u64"), labels)?;
    println!(
        "{} instances, {} objects, {} trees",
        scene.instances.len(),
        scene.objects.len(),
        scene.trees.len()
    );
    Ok(())
}

/// The corners of all triangles, and the object and semantic of each.
fn truth(scene: &ExportScene) -> (Vec<f32>, Vec<u64>) {
    let (mut corners, mut labels) = (Vec::new(), Vec::new());
    for instance in &scene.instances {
        let shape = &instance.prototype;
        let linear = instance.linear.as_dmat3();
        let mut add = |triangle: [Vec3; 3], material| {
            for p in triangle {
                let p = linear * p.as_dvec3() + instance.position_m.as_dvec3();
                corners.extend(p.as_vec3().to_array());
            }
            let semantic = scene.materials.get(material).semantic;
            labels.extend([instance.object.to_u64(), semantic as u64]);
        };
        let mesh = shape.mesh();
        for t in &mesh.triangles {
            add(t.corners.map(|c| mesh.positions[c as usize]), t.material);
        }
        for card in shape.cards() {
            let [a, b, c, d] = card.corners();
            add([a, b, c], card.material);
            add([a, c, d], card.material);
        }
    }
    (corners, labels)
}
