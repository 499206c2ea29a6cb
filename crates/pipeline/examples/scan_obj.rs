//! Scans an OBJ (z up, metres) with a Livox Mid-40 that stands 10 m before it; a pyramid if none is given.
//!
//! `cargo run --release -p nemoral-pipeline --example scan_obj -- OUT.ply [IN.obj]`

use std::{env::args, error::Error, fs, sync::Arc};

use nemoral_lidar::{Device, ExactRange, Scanner};
use nemoral_raycast::{Blas, Forest, Group};
use nemoral_scene::glam::{Mat3, Vec3};
use nemoral_scene::*;
use nemoral_seed::Key;

const PYRAMID: &str =
    "v -4 -4 0\nv 4 -4 0\nv 4 4 0\nv -4 4 0\nv 0 0 5\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5";
const HEAD: &str = "ply\nformat ascii 1.0\nelement vertex";
const FIELDS: &str = "property float x\nproperty float y\nproperty float z\nend_header";

fn main() -> Result<(), Box<dyn Error>> {
    let (out, obj) = (args().nth(1), args().nth(2));
    let obj = obj.map_or(Ok(PYRAMID.into()), fs::read_to_string)?;
    let plain = |_: &std::path::Path| Ok((vec![], Default::default()));
    let (models, _) = tobj::load_obj_buf(&mut obj.as_bytes(), &tobj::GPU_LOAD_OPTIONS, plain)?;

    let mut materials = MaterialLibrary::new();
    let material = materials.add(Material::plain("obj", Semantic::Rock, Vec3::splat(0.5)));
    let mut mesh = Mesh::default();
    for m in models.iter().map(|m| &m.mesh) {
        let first = mesh.positions.len() as u32;
        mesh.positions
            .extend(m.positions.chunks_exact(3).map(Vec3::from_slice));
        for c in m.indices.chunks_exact(3) {
            let corners = [c[0], c[1], c[2]].map(|i| first + i);
            mesh.triangles.push(Triangle { corners, material });
        }
    }
    let prototype = Arc::new(Prototype::new("obj", mesh, vec![], &materials)?);
    let Bounds { min, max } = prototype.bounds();
    let blas = Arc::new(Blas::build(Arc::clone(&prototype), &materials));
    #[rustfmt::skip]
    let instance = Instance { prototype, position_m: Vec3::ZERO, linear: Mat3::IDENTITY, object: ObjectId::NONE, variation: 0.0 };
    let forest = Forest::new(vec![(
        Vec3::ZERO,
        Arc::new(Group::build(vec![(instance, blas)])),
    )]);

    let stand = (0.5 * (min + max)).with_x(min.x - 10.0).as_dvec3();
    let pose = |_: f64| RigidTransform::from_xyz_rpy(stand, 0.0, 0.0, 0.0);
    let scanner = Scanner::new(Device::Mid40.params(), Device::Mid40.pattern())?;
    let points = scanner.scan(0, &forest, &materials, &pose, &ExactRange, Key::world(1));
    let xyz = |p: &LidarPoint| p.position_m.to_array().map(|c| c.to_string()).join(" ");
    let rows: Vec<String> = points.iter().map(xyz).collect();
    let ply = format!("{HEAD} {}\n{FIELDS}\n{}\n", rows.len(), rows.join("\n"));
    Ok(fs::write(
        out.ok_or("usage: scan_obj OUT.ply [IN.obj]")?,
        ply,
    )?)
}
