//! Scans an OBJ (z up, metres) with a Livox Mid-40 from 10 m away; writes x y z of each point on a
//! line: `cargo run --release -p nemoral-pipeline --example scan_obj -- IN.obj OUT.xyz`

use nemoral_lidar::{Device, EchoObservation, ScanRequest, Scanner};
use nemoral_lidar_noise::{RangeNoise, RangeNoiseSampler};
use nemoral_raycast::RayScene;
use nemoral_scene::{glam::Vec3, *};
use nemoral_seed::Key;
use std::{env::args, error::Error, path::Path, sync::Arc};

fn main() -> Result<(), Box<dyn Error>> {
    let [from, to] = [1, 2].map(|i| args().nth(i).ok_or("usage: scan_obj IN.obj OUT.xyz"));
    let mut materials = MaterialLibrary::new();
    let material = materials.add(Material::plain("obj", Semantic::Rock, Vec3::splat(0.5)));
    let mut mesh = Mesh::default();
    for tobj::Model { mesh: part, .. } in tobj::load_obj(from?, &tobj::GPU_LOAD_OPTIONS)?.0 {
        let first = mesh.positions.len() as u32;
        let points = part.positions.chunks_exact(3).map(Vec3::from_slice);
        mesh.positions.extend(points);
        for c in part.indices.chunks_exact(3) {
            let corners = [c[0], c[1], c[2]].map(|i| first + i);
            mesh.triangles.push(Triangle { corners, material });
        }
    }
    let shape = Arc::new(Prototype::new("obj", mesh, vec![], &materials)?);
    let Bounds { min, max } = shape.bounds();
    let front = (0.5 * (min + max)).with_x(min.x - 10.0).as_dvec3();
    let sampler = RangeNoiseSampler::new(RangeNoise::livox())?;
    let mid40 = Scanner::new(Device::Mid40.params(), Device::Mid40.pattern())?;
    let points = mid40.scan(&ScanRequest {
        first_pulse: 0,
        caster: &RayScene::of_shape(shape, &materials),
        materials: &materials,
        scene_from_lidar_at: &|_| RigidTransform::from_xyz_rpy(front, 0.0, 0.0, 0.0),
        range_model: &|echo: &EchoObservation, key: Key| sampler.measure(echo, &mut key.rng()),
        key: Key::world(1),
    });
    let row = |p: &LidarPoint| p.position_m.to_array().map(|c| c.to_string()).join(" ") + "\n";
    let text: String = points.iter().map(row).collect();
    Ok(nemoral_files::write(Path::new(&to?), text.as_bytes())?)
}
