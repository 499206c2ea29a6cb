//! What imported foliage costs: rays through a grove of grown trees, and through the same grove of
//! the same trees after an export to glTF and an import, in turn, by processor time.
//!
//! `cargo bench -p nemoral-benches --bench imported -- [ROUNDS]`
#![allow(clippy::print_stdout, reason = "a report for its user")]

use std::error::Error;
use std::sync::Arc;

use cpu_time::ProcessTime;
use nemoral_export::{GltfParams, to_glb};
use nemoral_import::{Model, ModelFiles, ModelKind};
use nemoral_pipeline::tree_scene;
use nemoral_raycast::{Blas, Group, RayScene};
use nemoral_scene::glam::{Quat, Vec3};
use nemoral_scene::{InstancePlace, MaterialLibrary, Prototype, Ray, RayCaster};
use rayon::ThreadPoolBuilder;

/// Trees along each side of the grove.
const SIDE: u32 = 9;
/// The distance between trees, metres.
const APART_M: f32 = 4.0;
const RAYS: u32 = 200_000;

fn main() -> Result<(), Box<dyn Error>> {
    ThreadPoolBuilder::new().num_threads(1).build_global()?;
    let rounds = std::env::args().skip(1).find_map(|word| word.parse().ok());
    let rounds: usize = rounds.unwrap_or(15);
    for species in ["beech", "english_oak", "norway_spruce"] {
        let scene = tree_scene(species, Some(0.3), true, 1)?;
        let grown = grove(&scene.instances[0].prototype, &scene.materials);
        let files = ModelFiles::single("tree.glb", to_glb(&scene, GltfParams::default())?);
        let model = Model::read(&files, ModelKind::Tree)?;
        let mut materials = MaterialLibrary::new();
        let shape = Arc::new(model.prototype(species, &mut materials)?);
        let imported = grove(&shape, &materials);
        let rays: Vec<Ray> = (0..RAYS).map(ray).collect();
        let (mut ratios, mut hits) = (Vec::new(), [0; 2]);
        for round in 0..=rounds {
            let [a, b] = if round % 2 == 0 { [0, 1] } else { [1, 0] };
            let mut seconds = [0.0; 2];
            for which in [a, b] {
                let start = ProcessTime::now();
                hits[which] = count([&grown, &imported][which], &rays);
                seconds[which] = start.elapsed().as_secs_f64();
            }
            // The first round warms caches.
            if round > 0 {
                ratios.push(seconds[1] / seconds[0]);
            }
        }
        ratios.sort_by(f64::total_cmp);
        println!(
            "{species}: {} cards; imported / grown = {:.3} (median of {rounds} pairs; {:.3} to \
             {:.3}); {} and {} hits of {RAYS}",
            shape.quads().len(),
            ratios[ratios.len() / 2],
            ratios[0],
            ratios[ratios.len() - 1],
            hits[0],
            hits[1],
        );
    }
    Ok(())
}

fn grove(shape: &Arc<Prototype>, materials: &MaterialLibrary) -> RayScene {
    let blas = Arc::new(Blas::build(Arc::clone(shape), materials));
    let place = |i: u32| {
        let (column, row) = ((i % SIDE) as f32, (i / SIDE) as f32);
        let at = Vec3::new(column * APART_M, row * APART_M, 0.0);
        let place = InstancePlace::new(Quat::from_rotation_z(i as f32), Vec3::ONE, at);
        (place.expect("a turn"), Arc::clone(&blas))
    };
    let group = Group::build((0..SIDE * SIDE).map(place).collect());
    RayScene::new(vec![(Vec3::ZERO, Arc::new(group))])
}

/// Rays in all directions from eye height in the middle, on a Fibonacci lattice.
fn ray(i: u32) -> Ray {
    let middle = APART_M * (SIDE - 1) as f32 / 2.0;
    let z = 1.0 - (2 * i + 1) as f32 / RAYS as f32;
    let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
    let flat = (1.0 - z * z).sqrt();
    let at = Vec3::new(middle + 1.7, middle + 2.1, 1.6);
    Ray::new(at, Vec3::new(flat * cos, flat * sin, z))
}

fn count(scene: &RayScene, rays: &[Ray]) -> usize {
    let hits = rays.chunks(4096).map(|batch| {
        let mut found = vec![None; batch.len()];
        scene.closest_hits(batch, &mut found);
        found.iter().flatten().count()
    });
    hits.sum()
}
