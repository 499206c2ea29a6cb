//! A user's mesh scanned from a tripod, as in other LiDAR simulators: ground and 20 trees of some
//! 300,000 opaque triangles in a window of 100° by 360°, with one ray per pulse, and with 19
//! sub-rays and echo detection.
//!
//! `cargo bench -p nemoral-benches --bench plot_scan -- [PULSES] [PLOT.obj]` writes the plot if it
//! is not there, and scans it if it is; `benches/helios/pyhelios_scan.py` scans the same.
//! `docs/measurements/speed.md` has the results.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]
#![allow(clippy::print_stdout, reason = "a report for its user")]

#[path = "casters/reference.rs"]
#[allow(dead_code, reason = "places of other sensors")]
mod reference;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use cpu_time::ProcessTime;
use nemoral_lidar::{
    Beam, ExactRange, Panorama, PanoramaParams, ReturnMode, ScanRequest, Scanner, ScannerParams,
};
use nemoral_raycast::{Blas, Group, RayScene};
use nemoral_scene::glam::{DVec3, Mat3, Vec3};
use nemoral_scene::{
    InstancePlace, Material, MaterialId, MaterialLibrary, Mesh, ObjectId, Prototype,
    RigidTransform, Semantic, Triangle,
};
use nemoral_seed::Key;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1).filter(|w| !w.starts_with("--"));
    let pulses: u32 = words.next().map_or(Ok(500_000), |w| w.parse())?;
    let mut materials = MaterialLibrary::new();
    materials.add(Material::plain("obj", Semantic::Leaf, Vec3::splat(0.3)));
    let path = words.next().map_or_else(
        || std::env::temp_dir().join("nemoral-plot.obj"),
        PathBuf::from,
    );
    if !path.exists() {
        std::fs::write(&path, obj(&plot()?))?;
        println!("wrote {}; its growing counts below", path.display());
    }
    let start = Instant::now();
    let mesh = read(&path)?;
    let read_s = start.elapsed().as_secs_f64();
    println!("{} triangles", mesh.triangles.len());
    let prototype = Arc::new(Prototype::new("plot", mesh, Vec::new(), &materials)?);
    let blas = Arc::new(Blas::build(Arc::clone(&prototype), &materials));
    let instance = InstancePlace {
        position_m: Vec3::ZERO,
        linear: Mat3::IDENTITY,
        object: ObjectId::NONE,
        variation: 0.0,
    };
    let group = Arc::new(Group::build(vec![(instance, blas)]));
    let forest = RayScene::new(vec![(Vec3::ZERO, group)]);
    let start_s = start.elapsed().as_secs_f64();
    println!("start: {start_s:.2} s, {read_s:.2} of it reading");
    say_peak();

    let rows = (f64::from(pulses) / 3.6).sqrt() as u32;
    let pattern = PanoramaParams {
        rows,
        columns: pulses / rows,
        bottom_rad: -40_f64.to_radians(),
        top_rad: 60_f64.to_radians(),
        rate_hz: 1.2e6,
    };
    let pose = |_: f64| RigidTransform::from_xyz_rpy(DVec3::new(0.0, 0.0, 1.7), 0.0, 0.0, 0.0);
    for (name, rings, returns) in [
        ("1 ray", 0, ReturnMode::Strongest),
        ("19 sub-rays, all echoes", 2, ReturnMode::All(8)),
    ] {
        let params = ScannerParams {
            pulses_per_scan: rows * (pulses / rows),
            min_range_m: 0.5,
            max_range_m: 200.0,
            beam: Beam {
                horizontal_fwhm_rad: 0.3e-3,
                vertical_fwhm_rad: 0.3e-3,
                rings,
                resolution_m: 0.1,
                exit_m: 0.0,
            },
            returns,
            ..ScannerParams::default()
        };
        let scanner = Scanner::new(params, Box::new(Panorama::new(pattern)?))?;
        for _ in 0..3 {
            let (start, used) = (Instant::now(), ProcessTime::now());
            let points = scanner.scan(&ScanRequest {
                first_pulse: 0,
                caster: &forest,
                materials: &materials,
                scene_from_lidar_at: &pose,
                range_model: &ExactRange,
                key: Key::world(1),
            });
            let (wall, processor) = (start.elapsed().as_secs_f64(), used.elapsed().as_secs_f64());
            println!(
                "{name}: {:.0} k pulses/s by the wall, {:.0} k per second of processor, {} points",
                f64::from(params.pulses_per_scan) / wall / 1e3,
                f64::from(params.pulses_per_scan) / processor / 1e3,
                points.len()
            );
        }
    }
    say_peak();
    Ok(())
}

/// Prints the peak of memory use until now, if the system tells it.
fn say_peak() {
    if let Ok(status) = std::fs::read_to_string("/proc/self/status") {
        let mut lines = status.lines();
        if let Some(peak) = lines.find(|l| l.starts_with("VmHWM")) {
            println!("{peak}");
        }
    }
}

/// Reads the mesh of an OBJ file.
fn read(path: &Path) -> Result<Mesh, Box<dyn std::error::Error>> {
    // Only positions are read, so tobj need not search for equal corners.
    let options = tobj::LoadOptions {
        triangulate: true,
        ..Default::default()
    };
    let (models, _) = tobj::load_obj(path, &options)?;
    let mut mesh = Mesh::default();
    for model in &models {
        let points = model.mesh.positions.chunks_exact(3).map(Vec3::from_slice);
        let corners = model.mesh.indices.chunks_exact(3);
        add(&mut mesh, points, corners.map(|c| [c[0], c[1], c[2]]));
    }
    Ok(mesh)
}

/// Ground of 60 m by 60 m with 20 trees on it, each in a cell of 12 m by 15 m.
fn plot() -> Result<Mesh, Box<dyn std::error::Error>> {
    let mut mesh = Mesh::default();
    let height = |x: f32, y: f32| 0.4 * (0.13 * x).sin() * (0.11 * y).cos();
    let side = 121;
    let ground = (0..side * side).map(|k| {
        let (x, y) = (
            0.5 * (k % side) as f32 - 30.0,
            0.5 * (k / side) as f32 - 30.0,
        );
        Vec3::new(x, y, height(x, y))
    });
    let cells = (0..side - 1).flat_map(|j| (0..side - 1).map(move |i| j * side + i));
    let squares = cells.map(|k| [k, k + 1, k + side + 1, k + side]);
    add(&mut mesh, ground, squares.flat_map(halves));
    let (groups, _) = reference::grow(false)?;
    let instances = groups.iter().flat_map(|(_, group)| group.instances());
    let trees = instances.filter(|(i, _)| i.prototype.cards().len() > 1000);
    for (k, (tree, _)) in trees.take(20).enumerate() {
        let (x, y) = (12.0 * (k % 5) as f32 - 24.0, 15.0 * (k / 5) as f32 - 22.5);
        let foot = Vec3::new(x, y, height(x, y));
        let place = |p: Vec3| foot + tree.linear * p;
        let wood = tree.prototype.mesh();
        let corners = wood.triangles.iter().map(|t| t.corners);
        add(&mut mesh, wood.positions.iter().map(|&p| place(p)), corners);
        for card in tree.prototype.cards().iter().step_by(2) {
            let (u, v) = (card.edge_u, card.edge_v);
            let corners = [Vec3::ZERO, u, u + v, v].map(|edge| place(card.corner + edge));
            add(&mut mesh, corners, halves([0, 1, 2, 3]));
        }
    }
    Ok(mesh)
}

fn halves([a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

fn add(
    mesh: &mut Mesh,
    points: impl IntoIterator<Item = Vec3>,
    triangles: impl IntoIterator<Item = [u32; 3]>,
) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(points);
    // A LiDAR needs neither normals nor texture coordinates.
    let material = MaterialId(0);
    mesh.triangles
        .extend(triangles.into_iter().map(|corners| Triangle {
            corners: corners.map(|i| first + i),
            material,
        }));
}

fn obj(mesh: &Mesh) -> String {
    let mut text = String::new();
    for p in &mesh.positions {
        let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
    }
    for t in &mesh.triangles {
        let [a, b, c] = t.corners.map(|i| i + 1);
        let _ = writeln!(text, "f {a} {b} {c}");
    }
    text
}
