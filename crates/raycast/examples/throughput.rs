//! Rays per second on a synthetic forest: 2,500 trees (about 5,000 triangles and 3,000 cards each) and
//! 4,000 shrubs on a ground of 125,000 triangles, 250 m square, in 25 groups; single threaded.
//!
//! `cargo run --release -p nemoral-raycast --example throughput [ROUNDS]`
#![allow(clippy::print_stdout, reason = "an example reports to its user")]

use std::f32::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;
use std::time::Instant;

use glam::{Mat3, Vec2, Vec3};
use nemoral_raycast::{Blas, Forest, Group};
use nemoral_scene::{
    AlphaMask, Card, ChunkCoord, Hit, Instance, Material, MaterialId, MaterialLibrary, Mesh,
    ObjectId, Prototype, Ray, RayCaster, Semantic, Triangle,
};
use nemoral_seed::{Draw, Key, PhiloxRng, Stage};

const STAGE: Stage = Stage::new("raycast.throughput");
const CHUNK_M: f32 = 50.0;
const CHUNKS: i32 = 5;

fn main() {
    let rounds = std::env::args()
        .nth(1)
        .and_then(|a| a.parse().ok())
        .unwrap_or(3);
    let only: Option<String> = std::env::args().nth(2);
    let scene = scene();
    let workloads = [
        ("lidar (rectangular, unsorted)", lidar(8, 50_000)),
        ("spinning, 64 rings", spinning(4, 100_000)),
        ("camera 1280 x 720, rows", camera(1280, 720)),
    ];
    let portable = scene.clone().portable();
    for (name, rays) in &workloads {
        if only.as_ref().is_some_and(|o| !name.contains(o.as_str())) {
            continue;
        }
        let mut hits = vec![None; rays.len()];
        let report = |what: &str, seconds: f64, n: usize| {
            println!(
                "{name:32} {what:28} {:6.3} Mrays/s",
                n as f64 / seconds / 1e6
            );
        };
        let best = |work: &mut dyn FnMut()| {
            (0..rounds)
                .map(|_| {
                    let clock = Clock::start();
                    work();
                    clock.seconds()
                })
                .fold(f64::INFINITY, f64::min)
        };
        for (level, forest) in [("detected", &scene), ("portable", &portable)] {
            if only.is_some() && level == "portable" {
                continue;
            }
            let s = best(&mut || {
                for (ray, hit) in rays.iter().zip(&mut hits) {
                    *hit = forest.closest_hit(ray);
                }
            });
            report(&format!("closest_hit, {level}"), s, rays.len());
            let single = hits.clone();
            let s = best(&mut || {
                for (rays, hits) in rays.chunks(50_000).zip(hits.chunks_mut(50_000)) {
                    forest.closest_hits(rays, hits);
                }
            });
            report(&format!("closest_hits, {level}"), s, rays.len());
            assert!(single == hits, "a batch gives what single rays give");
            let shadow: Vec<Ray> = rays.iter().zip(&hits).filter_map(to_sun).collect();
            let mut dark = 0;
            let s = best(&mut || dark = shadow.iter().filter(|r| forest.is_occluded(r)).count());
            report(&format!("is_occluded, {level}"), s, shadow.len());
            let found = hits.iter().flatten();
            let share = |n: usize| 100.0 * n as f64 / rays.len() as f64;
            let leaves = found.clone().filter(|h| h.material.0 >= 2).count();
            let sum: f64 = found.clone().map(|h| f64::from(h.distance_m)).sum();
            println!(
                "{:32} hit {:.1} %, leaves {:.1} %, in shade {:.1} %, sum of distances {sum}",
                "",
                share(found.count()),
                share(leaves),
                100.0 * dark as f64 / shadow.len() as f64,
            );
        }
    }
}

/// Time of this thread on a processor where the system tells (Linux), of the wall elsewhere.
struct Clock(Instant, Option<u64>);

impl Clock {
    fn start() -> Self {
        Self(Instant::now(), cpu_ns())
    }

    fn seconds(&self) -> f64 {
        match (self.1, cpu_ns()) {
            (Some(from), Some(to)) => (to - from) as f64 * 1e-9,
            _ => self.0.elapsed().as_secs_f64(),
        }
    }
}

fn cpu_ns() -> Option<u64> {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    stat.split_whitespace().next()?.parse().ok()
}

fn to_sun((ray, hit): (&Ray, &Option<Hit>)) -> Option<Ray> {
    let hit = hit.as_ref()?;
    Some(Ray {
        t_min_m: 1e-3,
        ..Ray::new(
            ray.at(hit.distance_m),
            Vec3::new(0.4, 0.3, 0.866).normalize_or(Vec3::Z),
        )
    })
}

fn scene() -> Forest {
    let key = Key::world(7).stage(STAGE);
    let mut library = MaterialLibrary::new();
    library.add(Material::plain("soil", Semantic::Soil, Vec3::splat(0.2)));
    library.add(Material::plain("bark", Semantic::Stem, Vec3::splat(0.3)));
    for shape in 0..4 {
        let mask =
            AlphaMask::from_fn(128, 128, |c, r| leaf_shape(shape, c, r)).expect("a valid size");
        library.add(Material {
            mask: Some(Arc::new(mask)),
            ..Material::plain("leaf", Semantic::Leaf, Vec3::splat(0.1))
        });
    }

    let start = Instant::now();
    let blas = |name: &str, mesh: Mesh, cards: Vec<Card>| {
        let shape = Prototype::new(name, mesh, cards, &library).expect("a valid shape");
        Arc::new(Blas::build(Arc::new(shape), &library))
    };
    let trees: Vec<Arc<Blas>> = (0..6)
        .map(|i| {
            let (mesh, cards) = tree(&mut key.item(i).rng());
            blas("tree", mesh, cards)
        })
        .collect();
    let shrubs: Vec<Arc<Blas>> = (0..3)
        .map(|i| {
            blas(
                "shrub",
                Mesh::default(),
                shrub(&mut key.item(100 + i).rng()),
            )
        })
        .collect();
    let shapes_s = start.elapsed().as_secs_f64();
    let tree_triangles = trees[0].prototype().mesh().triangles.len();
    let tree_cards = trees[0].prototype().cards().len();

    let mut groups = Vec::new();
    let (mut ground_s, mut group_s) = (0.0, 0.0);
    for (cx, cy) in (0..CHUNKS).flat_map(|x| (0..CHUNKS).map(move |y| (x, y))) {
        let chunk = ChunkCoord::new(cx, cy);
        let corner = Vec3::new(cx as f32, cy as f32, 0.0) * CHUNK_M;
        let start = Instant::now();
        let ground = blas("ground", ground(corner), Vec::new());
        ground_s += start.elapsed().as_secs_f64();
        let mut rng = key.chunk(chunk).rng();
        let mut instances = vec![(
            place(&ground, Vec3::ZERO, Mat3::IDENTITY, ObjectId::NONE),
            ground,
        )];
        for item in 0..260_u16 {
            let kinds = if item < 100 { &trees } else { &shrubs };
            let blas = &kinds[rng.below(kinds.len() as u32) as usize];
            let (x, y) = (rng.range_f32(0.0, CHUNK_M), rng.range_f32(0.0, CHUNK_M));
            let foot = Vec3::new(x, y, height(corner.x + x, corner.y + y));
            let linear = Instance::upright(
                rng.range_f32(0.0, TAU),
                rng.range_f32(0.8, 1.25),
                Vec2::ZERO,
            );
            let object = ObjectId::new(chunk, item + 1).expect("a valid id");
            instances.push((place(blas, foot, linear, object), Arc::clone(blas)));
        }
        let start = Instant::now();
        groups.push((corner, Arc::new(Group::build(instances))));
        group_s += start.elapsed().as_secs_f64();
    }
    let start = Instant::now();
    let forest = Forest::new(groups.clone());
    println!(
        "tree 0: {tree_triangles} triangles, {tree_cards} cards; built 9 shapes in {:.1} ms, 25 grounds in {:.1} ms, 25 groups in {:.2} ms, forest in {:.3} ms",
        shapes_s * 1e3,
        ground_s * 1e3,
        group_s * 1e3,
        start.elapsed().as_secs_f64() * 1e3,
    );
    let many: Vec<_> = groups.iter().cycle().take(200).cloned().collect();
    let ms = quickest_ms(|| drop(Forest::new(many.clone())));
    println!("forest of 200 groups in {ms:.3} ms");
    let instances = groups[0].1.instances();
    let thousand: Vec<_> = instances.iter().cycle().take(1000).cloned().collect();
    let ms = quickest_ms(|| drop(Group::build(thousand.clone())));
    println!("group of 1,000 instances in {ms:.3} ms");
    forest
}

/// The quickest of ten, too short for the processor's clock.
fn quickest_ms(work: impl Fn()) -> f64 {
    (0..10)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64() * 1e3
        })
        .fold(f64::INFINITY, f64::min)
}

fn place(blas: &Blas, position_m: Vec3, linear: Mat3, object: ObjectId) -> Instance {
    Instance {
        prototype: Arc::clone(blas.prototype()),
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

fn tree(rng: &mut PhiloxRng) -> (Mesh, Vec<Card>) {
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
    for _ in 0..42 {
        let s = rng.unit_f32();
        let z = base + (height - base) * s;
        let azimuth = rng.range_f32(0.0, TAU);
        let out = Vec3::new(azimuth.cos(), azimuth.sin(), rng.range_f32(0.1, 0.6));
        let length = (3.2 * (1.0 - 0.75 * s)) * rng.range_f32(0.7, 1.1);
        let (from, to) = (Vec3::Z * z, Vec3::Z * z + out * length);
        tube(&mut mesh, from, to, [0.05, 0.012], 7, 6);
        for _ in 0..72 {
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

fn eye(k: usize) -> Vec3 {
    let a = 2.4 * k as f32;
    let p = Vec2::new(125.0, 125.0) + Vec2::new(a.cos(), a.sin()) * (6.0 * k as f32);
    p.extend(height(p.x, p.y) + 1.5)
}

fn direction(azimuth: f32, elevation: f32) -> Vec3 {
    let d = Vec3::new(
        azimuth.cos() * elevation.cos(),
        azimuth.sin() * elevation.cos(),
        elevation.sin(),
    );
    d.normalize_or(Vec3::X)
}

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray {
        t_max_m: 300.0,
        ..Ray::new(origin, direction)
    }
}

/// A field of 81.7 x 25.1 degrees in Lissajous order.
fn lidar(poses: usize, n: usize) -> Vec<Ray> {
    let half = Vec2::new(81.7_f32.to_radians(), 25.1_f32.to_radians()) / 2.0;
    (0..poses)
        .flat_map(|k| {
            (0..n).map(move |i| {
                let t = i as f64 * 1e-5;
                let (a, e) = ((t * 2931.7).sin() as f32, (t * 7717.3 + 0.4).sin() as f32);
                ray(eye(k), direction(k as f32 + a * half.x, e * half.y))
            })
        })
        .collect()
}

/// A full turn, ring by ring within a column.
fn spinning(poses: usize, n: usize) -> Vec<Ray> {
    (0..poses)
        .flat_map(|k| {
            (0..n).map(move |i| {
                let elevation = (-15.0 + 30.0 * (i % 64) as f32 / 63.0).to_radians();
                ray(
                    eye(k),
                    direction(TAU * (i / 64) as f32 / (n / 64) as f32, elevation),
                )
            })
        })
        .collect()
}

/// 90 degrees, row by row.
fn camera(width: usize, height: usize) -> Vec<Ray> {
    let focal = width as f32 / 2.0 / (FRAC_PI_2 / 2.0).tan();
    let (forward, up) = (direction(PI / 3.0, 0.05), Vec3::Z);
    let right = forward.cross(up).normalize_or(Vec3::X);
    let down = forward.cross(right);
    (0..width * height)
        .map(|i| {
            let x = (i % width) as f32 + 0.5 - width as f32 / 2.0;
            let y = (i / width) as f32 + 0.5 - height as f32 / 2.0;
            let d = forward * focal + right * x + down * y;
            ray(eye(0), d.normalize_or(forward))
        })
        .collect()
}
