//! A forest for comparisons that does not change with the assets: 250 m x 250 m of ground in
//! 125,000 triangles, six trees of 2,600 to 6,300 triangles and 5,000 to 15,000 leaf cards, three
//! shrubs of 500 cards; 2,500 trees and 4,000 shrubs stand at random.

use std::error::Error;
use std::f32::consts::TAU;
use std::sync::Arc;

use nemoral_raycast::{Blas, BuildQuality, Group};
use nemoral_scene::glam::{Mat3, Vec2, Vec3};
use nemoral_scene::{
    AlphaMask, Card, ChunkCoord, Instance, InstancePlace, Material, MaterialId, MaterialLibrary,
    Mesh, ObjectId, Prototype, Semantic, Triangle,
};
use nemoral_seed::{Domain, Draw, Key, PhiloxRng};

const STAGE: Domain = Domain::new("bench.casters");
const CHUNK_M: f32 = 50.0;
const CHUNKS: i32 = 5;

/// Numbers of branches and leaves of the trees.
const TREES: [(u32, u32); 6] = [
    (44, 10_000),
    (28, 7000),
    (56, 13_000),
    (20, 5000),
    (64, 15_000),
    (36, 9000),
];

pub(crate) type Forest = (Vec<(Vec3, Arc<Group>)>, MaterialLibrary);

/// Grows the forest. Leaves are cards, each with a mask of its shape, or, as an OBJ has them, two
/// triangles whose texture coordinates are a window of one atlas.
pub(crate) fn grow(leaves_are_triangles: bool) -> Result<Forest, Box<dyn Error>> {
    let key = Key::world(7).domain(STAGE);
    let mut library = MaterialLibrary::new();
    library.add(Material::plain("soil", Semantic::Soil, Vec3::splat(0.2)));
    library.add(Material::plain("bark", Semantic::Stem, Vec3::splat(0.3)));
    for shape in 0..4 {
        let mask = AlphaMask::from_fn(128, 128, |c, r| leaf_shape(shape, c, r))?;
        library.add(Material {
            mask: Some(Arc::new(mask)),
            ..Material::plain("leaf", Semantic::Leaf, Vec3::splat(0.1))
        });
    }
    let atlas = AlphaMask::from_fn(256, 256, |c, r| {
        leaf_shape(c / 128 + 2 * (r / 128), c % 128, r % 128)
    })?;
    let atlas = library.add(Material {
        mask: Some(Arc::new(atlas)),
        ..Material::plain("leaves", Semantic::Leaf, Vec3::splat(0.1))
    });
    let blas = |name: &str, mut mesh: Mesh, mut cards: Vec<Card>| {
        if leaves_are_triangles {
            for (i, card) in cards.drain(..).enumerate() {
                add_leaf(&mut mesh, &card, atlas, i);
            }
        }
        let shape = Prototype::new(name, mesh, cards, &library)?;
        Ok::<_, Box<dyn Error>>(Arc::new(Blas::with_quality(
            Arc::new(shape),
            &library,
            BuildQuality::High,
        )))
    };
    let mut trees = Vec::new();
    for (i, (branches, leaves)) in (0..).zip(TREES) {
        let (mesh, cards) = tree(&mut key.item(i).rng(), branches, leaves);
        trees.push(blas("tree", mesh, cards)?);
    }
    let mut shrubs = Vec::new();
    for i in 100..103 {
        let cards = shrub(&mut key.item(i).rng());
        shrubs.push(blas("shrub", Mesh::default(), cards)?);
    }
    let mut groups = Vec::new();
    for (cx, cy) in (0..CHUNKS).flat_map(|x| (0..CHUNKS).map(move |y| (x, y))) {
        let chunk = ChunkCoord::new(cx, cy);
        let corner = Vec3::new(cx as f32, cy as f32, 0.0) * CHUNK_M;
        let ground = blas("ground", ground(corner), Vec::new())?;
        let still = place(Vec3::ZERO, Mat3::IDENTITY, ObjectId::NONE);
        let mut rng = key.chunk(chunk).rng();
        let mut instances = vec![(still, ground)];
        for item in 0..260_u16 {
            let kinds = if item < 100 { &trees } else { &shrubs };
            let blas = rng.choose(kinds);
            let (x, y) = (rng.range_f32(0.0, CHUNK_M), rng.range_f32(0.0, CHUNK_M));
            let foot = Vec3::new(x, y, height(corner.x + x, corner.y + y));
            let (yaw, scale) = (rng.range_f32(0.0, TAU), rng.range_f32(0.8, 1.25));
            let linear = Instance::upright(yaw, scale, Vec2::ZERO);
            let object = ObjectId::new(chunk, item + 1).unwrap_or(ObjectId::NONE);
            instances.push((place(foot, linear, object), Arc::clone(blas)));
        }
        groups.push((corner, Arc::new(Group::build(instances))));
    }
    Ok((groups, library))
}

/// Eight places about the middle, 1.5 m above the ground.
pub(crate) fn eye(k: usize) -> Vec3 {
    let a = 2.4 * k as f32;
    let p = Vec2::new(125.0, 125.0) + Vec2::new(a.cos(), a.sin()) * (6.0 * k as f32);
    p.extend(height(p.x, p.y) + 1.5)
}

fn place(position_m: Vec3, linear: Mat3, object: ObjectId) -> InstancePlace {
    InstancePlace {
        position_m,
        linear,
        object,
        variation: 0.5,
    }
}

fn height(x: f32, y: f32) -> f32 {
    3.0 * (x * 0.035).sin() * (y * 0.027).cos() + 0.4 * (x * 0.31 + y * 0.22).sin()
}

/// A chunk's ground: 50 x 50 cells of two triangles.
fn ground(corner: Vec3) -> Mesh {
    let n = 50_u32;
    let mut mesh = Mesh::default();
    for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
        let p = Vec2::new(i as f32, j as f32) * (CHUNK_M / n as f32);
        push(
            &mut mesh,
            p.extend(height(corner.x + p.x, corner.y + p.y)),
            Vec3::Z,
        );
    }
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let at = |di: u32, dj: u32| (i + di) * (n + 1) + j + dj;
        quad(
            &mut mesh,
            [at(0, 0), at(1, 0), at(1, 1), at(0, 1)],
            MaterialId(0),
        );
    }
    mesh
}

fn push(mesh: &mut Mesh, p: Vec3, n: Vec3) {
    mesh.positions.push(p);
    mesh.normals.push(n);
    mesh.uvs.push(Vec2::new(p.x, p.y));
}

fn quad(mesh: &mut Mesh, [a, b, c, d]: [u32; 4], material: MaterialId) {
    mesh.triangles.push(Triangle {
        corners: [a, b, c],
        material,
    });
    mesh.triangles.push(Triangle {
        corners: [a, c, d],
        material,
    });
}

/// A tapered, bent tube.
fn tube(mesh: &mut Mesh, from: Vec3, to: Vec3, radii: [f32; 2], rings: u32, sides: u32) {
    let axis = (to - from).normalize_or(Vec3::Z);
    let (u, v) = axis.any_orthonormal_pair();
    let first = mesh.positions.len() as u32;
    for k in 0..=rings {
        let s = k as f32 / rings as f32;
        let centre = from.lerp(to, s) + u * (0.15 * (s * 5.0).sin() * radii[0]);
        for i in 0..sides {
            let a = TAU * i as f32 / sides as f32;
            let n = u * a.cos() + v * a.sin();
            push(mesh, centre + n * (radii[0] + (radii[1] - radii[0]) * s), n);
        }
    }
    for (k, i) in (0..rings).flat_map(|k| (0..sides).map(move |i| (k, i))) {
        let at = |dk: u32, di: u32| first + (k + dk) * sides + (i + di) % sides;
        quad(
            mesh,
            [at(0, 0), at(0, 1), at(1, 1), at(1, 0)],
            MaterialId(1),
        );
    }
}

fn tree(rng: &mut PhiloxRng, branches: u32, leaves: u32) -> (Mesh, Vec<Card>) {
    let (mut mesh, mut cards) = (Mesh::default(), Vec::new());
    let height = rng.range_f32(11.0, 17.0);
    let base = height * rng.range_f32(0.3, 0.5);
    tube(
        &mut mesh,
        Vec3::ZERO,
        Vec3::Z * height,
        [0.22, 0.03],
        40,
        12,
    );
    for _ in 0..branches {
        let s = rng.unit_f32();
        let z = base + (height - base) * s;
        let azimuth = rng.range_f32(0.0, TAU);
        let out = Vec3::new(azimuth.cos(), azimuth.sin(), rng.range_f32(0.1, 0.6));
        let length = (3.2 * (1.0 - 0.75 * s)) * rng.range_f32(0.7, 1.1);
        let (from, to) = (Vec3::Z * z, Vec3::Z * z + out * length);
        tube(&mut mesh, from, to, [0.05, 0.012], 7, 6);
        for _ in 0..leaves / branches {
            let at = from.lerp(to, rng.range_f32(0.25, 1.05)) + scatter(rng, 0.35);
            cards.push(leaf(rng, at, 0.12));
        }
    }
    (mesh, cards)
}

fn shrub(rng: &mut PhiloxRng) -> Vec<Card> {
    (0..500)
        .map(|_| {
            let at = scatter(rng, 0.5) * Vec3::new(1.0, 1.0, 0.9) + Vec3::Z * 0.5;
            leaf(rng, at, 0.09)
        })
        .collect()
}

/// Adds a leaf as two triangles, its corners in one of four orders.
fn add_leaf(mesh: &mut Mesh, card: &Card, atlas: MaterialId, order: usize) {
    let shape = card.material.0 - 2;
    let from = Vec2::new(f32::from(shape % 2), f32::from(shape / 2)) * 0.5;
    let to = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y].map(|p| from + p * 0.5);
    let first = mesh.positions.len() as u32;
    let normal = card.edge_u.cross(card.edge_v).normalize_or(Vec3::Z);
    for k in 0..4 {
        let k = (k + order) % 4;
        mesh.positions.push(card.corners()[k]);
        mesh.normals.push(normal);
        mesh.uvs.push(to[k]);
    }
    quad(mesh, [first, first + 1, first + 2, first + 3], atlas);
}

fn scatter(rng: &mut PhiloxRng, radius: f32) -> Vec3 {
    let mut axis = || rng.range_f32(-1.0, 1.0) * radius;
    Vec3::new(axis(), axis(), axis())
}

fn leaf(rng: &mut PhiloxRng, at: Vec3, size: f32) -> Card {
    let u = scatter(rng, 1.0).normalize_or(Vec3::X);
    let v = u
        .cross(scatter(rng, 1.0))
        .normalize_or(u.any_orthonormal_vector());
    let size = size * rng.range_f32(0.7, 1.3);
    Card {
        corner: at - (u + v) * (size / 2.0),
        edge_u: u * size,
        edge_v: v * size,
        material: MaterialId(2 + rng.below(4) as u16),
    }
}

/// Four leaf shapes, about 45 % opaque.
fn leaf_shape(shape: usize, column: usize, row: usize) -> bool {
    let p = (Vec2::new(column as f32, row as f32) + 0.5) / 64.0 - 1.0;
    let angle = p.y.atan2(p.x);
    match shape {
        0 => (p.x / 0.62).powi(2) + (p.y / 0.97).powi(2) < 1.0,
        1 => p.length() < 0.77 + 0.2 * (5.0 * angle).cos(),
        2 => p.x.abs() < 0.8 * (1.0 - p.y * p.y) * (0.85 + 0.2 * (20.0 * p.y).sin()),
        _ => (p.x.abs() - 0.42).abs() < 0.34 * (1.0 - p.y * p.y).max(0.0).sqrt(),
    }
}
