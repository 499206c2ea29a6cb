//! Fuzzed scenes: every kernel of this machine against the linear oracle, to the bit, and leaves as
//! cards against the same leaves as triangles.

use std::sync::Arc;

use crate::common::{self, Groups, cube, direction, place, ray, rng};
use glam::{Mat3, Vec2, Vec3};
use nemoral_raycast::{BruteForce, Group, HitRecord, Primitive, RayScene};
use nemoral_scene::{
    AlphaMask, Card, MaterialId, MaterialLibrary, Mesh, Prototype, Ray, RayCaster, SurfaceHit,
    TextureWindow, Triangle,
};
use nemoral_seed::{Draw, PhiloxRng};
use proptest::prelude::*;

/// The materials of the other tests, twice, so that each has one that looks like it; among them
/// masks of more than 256 texels a side.
fn library(seed: u64) -> MaterialLibrary {
    let mut library = common::library(seed);
    let mut rng = rng(seed, "atlas");
    let salt = rng.below(u32::MAX) as usize;
    let atlas = AlphaMask::from_fn(700, 301, |c, r| {
        ((c / 5) * 7 + (r / 3) * 13 + salt) % 11 < 6
    });
    common::add_masked(&mut library, atlas.expect("valid by construction"));
    for material in library.materials().to_vec() {
        library.add(material);
    }
    library
}

const MATERIALS: u16 = 8;

/// A material that looks the same.
fn twin(material: MaterialId) -> MaterialId {
    MaterialId(material.0 + MATERIALS)
}

/// A part of a texture, turned and flipped, sometimes whole and sometimes reaching beyond.
fn window(rng: &mut PhiloxRng) -> TextureWindow {
    let mut window = TextureWindow::WHOLE;
    if rng.chance(0.7) {
        let min = Vec2::new(rng.range_f32(0.0, 0.9), rng.range_f32(0.0, 0.9));
        let size = Vec2::new(rng.range_f32(0.01, 0.6), rng.range_f32(0.01, 0.6));
        let reach = if rng.chance(0.2) { 2.0 } else { 1.0 };
        window = TextureWindow::rectangle(min, (min + size * reach).min(Vec2::splat(reach)));
    }
    if rng.chance(0.2) {
        let turn = Vec2::from_angle(rng.range_f32(0.0, 6.3));
        window.along_u = turn.rotate(window.along_u);
        window.along_v = turn.rotate(window.along_v);
    }
    for _ in 0..rng.below(4) {
        window = window.turned();
    }
    if rng.chance(0.5) {
        window = window.flipped();
    }
    window
}

fn card(rng: &mut PhiloxRng, half: f32) -> Card {
    let size = rng.range_f32(0.01, 1.0) * half;
    let flat = f32::from(u8::from(!rng.chance(0.05)));
    Card {
        corner: cube(rng, half),
        edge_u: cube(rng, size),
        edge_v: cube(rng, size) * flat,
        material: MaterialId(rng.below(MATERIALS.into()) as u16),
    }
}

/// Adds a card as the two triangles that an exporter makes of it.
fn add_leaf(mesh: &mut Mesh, card: &Card, window: &TextureWindow, rng: &mut PhiloxRng) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(card.corners());
    let places = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let uv = |p: Vec2| window.origin + window.along_u * p.x + window.along_v * p.y;
    mesh.uvs.extend(places.map(uv));
    mesh.normals.extend([0; 4].map(|_| direction(rng)));
    let from = rng.below(4);
    for corners in [[0, 1, 2], [0, 2, 3]] {
        let corners = corners.map(|k| first + (k + from) % 4);
        mesh.triangles.push(Triangle {
            corners,
            material: card.material,
        });
    }
}

/// A shape of all kinds of primitives.
fn shape(rng: &mut PhiloxRng, library: &MaterialLibrary, half: f32) -> Prototype {
    let (triangles, cards, leaves) = (rng.below(12), rng.below(12), rng.below(12));
    let (mut mesh, mut all) = common::clutter(rng, triangles, 0, half);
    for _ in 0..leaves {
        let (card, window) = (card(rng, half), window(rng));
        add_leaf(&mut mesh, &card, &window, rng);
    }
    let least = u32::from(triangles + leaves == 0);
    all.extend((0..cards.max(least)).map(|_| card(rng, half)));
    let windows = all.iter().map(|_| window(rng)).collect();
    let shape = Prototype::new("shape", mesh, all, library).expect("valid by construction");
    if rng.chance(0.7) {
        shape.with_card_windows(windows).expect("one of each")
    } else {
        shape
    }
}

/// A scene of one size, from a thousandth of a millimetre to a thousand kilometres, and points
/// worth aiming at.
fn scene(seed: u64, size: f32) -> (Groups, Vec<Vec3>) {
    let library = library(seed);
    let mut rng = rng(seed, "fuzzed scene");
    let shapes: Vec<_> = (0..rng.between(1, 4))
        .map(|_| {
            // Shapes of one scene differ in size by up to a million, too. The far end of a card at
            // a corner is at three times this.
            let half = size * 10.0_f32.powf(rng.range_f32(-3.0, 3.0));
            let half = half.min(Prototype::FARTHEST_M / 4.0);
            let shape = Arc::new(shape(&mut rng, &library, half));
            (half, common::blas_of(shape, &library))
        })
        .collect();
    let mut targets = vec![Vec3::ZERO];
    let groups = (0..rng.between(1, 4))
        .map(|_| {
            let offset = cube(&mut rng, 20.0 * size);
            let instances = (0..rng.below(12))
                .map(|_| {
                    let (half, shape) = rng.choose(&shapes);
                    let position = cube(&mut rng, 4.0 * size);
                    // To about the size of the scene, or as it is.
                    let scale = if rng.chance(0.7) { size / half } else { 1.0 };
                    let mut linear = common::linear(&mut rng) * scale;
                    if rng.chance(0.05) {
                        linear = Mat3::from_diagonal(Vec3::new(scale, scale, 0.0));
                    }
                    targets.push(offset + position);
                    place(shape, position, linear, rng.below(4) as u16)
                })
                .collect();
            (offset, Arc::new(Group::build(instances)))
        })
        .collect();
    (groups, targets)
}

/// Rays of a scene of this size: alone, in fans that make bundles, along axes, with ranges.
fn rays(seed: u64, targets: &[Vec3], size: f32) -> Vec<Ray> {
    let mut rng = rng(seed, "fuzzed rays");
    let mut rays = Vec::new();
    for fan in 0..12 {
        let target = *rng.choose(targets) + cube(&mut rng, size);
        let away = size * [0.5, 5.0, 50.0][fan % 3];
        let origin = target + direction(&mut rng) * away;
        let spread = size * [1e-3, 0.1, 1.0, 4.0][fan % 4];
        for i in 0..16 {
            let mut r = ray(origin, target + cube(&mut rng, spread));
            if i % 5 == 0 {
                r.direction = [Vec3::X, -Vec3::Y, -Vec3::Z][i % 3];
                r.origin = target - r.direction * away;
            }
            if i % 7 == 0 {
                r.t_min_m = rng.range_f32(0.0, 1.5 * away);
                r.t_max_m = r.t_min_m + rng.range_f32(0.0, away);
            }
            if i == 9 {
                r.t_min_m = [-0.0, -away][fan % 2];
            }
            rays.push(r);
        }
    }
    rays
}

/// The first of two lists of results in which they differ by a bit, with its ray.
fn difference<T: std::fmt::Debug>(rays: &[Ray], found: &[T], expected: &[T]) -> Option<String> {
    assert_eq!(found.len(), expected.len());
    let each = rays.iter().zip(found).zip(expected);
    let mut each = each.map(|((ray, a), b)| (ray, format!("{a:?}"), format!("{b:?}")));
    let (ray, found, expected) = each.find(|(_, a, b)| a != b)?;
    Some(format!("{ray:?}: found {found}, expected {expected}"))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn every_kernel_gives_the_bits_of_the_loop(seed: u64, decade in -6_i32..=6) {
        let size = 10.0_f32.powi(decade);
        let (groups, targets) = scene(seed, size);
        let rays = rays(seed, &targets, size);
        let oracle = BruteForce::new(groups.clone());
        let hits: Vec<_> = rays.iter().map(|r| oracle.closest_hit(r)).collect();
        let surfaces: Vec<_> = hits.iter().map(|h| h.map(SurfaceHit::from)).collect();
        let met: Vec<bool> = hits.iter().map(Option::is_some).collect();
        let fastest = RayScene::new(groups);
        for caster in [fastest.clone(), fastest.portable()] {
            // One ray alone.
            let one: Vec<_> = rays.iter().map(|r| caster.closest_hit(r)).collect();
            prop_assert_eq!(difference(&rays, &one, &hits), None);
            let one: Vec<_> = rays.iter().map(|r| caster.closest_surface(r)).collect();
            prop_assert_eq!(difference(&rays, &one, &surfaces), None);
            let one: Vec<bool> = rays.iter().map(|r| caster.is_occluded(r)).collect();
            prop_assert_eq!(&one, &met);
            // Bundles and packets.
            let mut many = vec![None; rays.len()];
            caster.closest_hits(&rays, &mut many);
            prop_assert_eq!(difference(&rays, &many, &hits), None);
            let mut many = vec![None; rays.len()];
            caster.closest_surfaces(&rays, &mut many);
            prop_assert_eq!(difference(&rays, &many, &surfaces), None);
            let mut many = vec![false; rays.len()];
            caster.are_occluded(&rays, &mut many);
            prop_assert_eq!(&many, &met);
            // What was hit, by name.
            let one: Vec<_> = rays.iter().map(|r| caster.closest_record(r)).collect();
            let mut records = vec![None; rays.len()];
            caster.closest_records(&rays, &mut records);
            prop_assert_eq!(difference(&rays, &one, &records), None);
            let mut handed = vec![None; rays.len()];
            let mut count = 0;
            caster.for_each_closest_record(&rays, |ray, record| {
                handed[ray] = record;
                count += 1;
            });
            prop_assert_eq!(difference(&rays, &one, &handed), None);
            prop_assert_eq!(count, rays.len());
            for (record, hit) in records.iter().zip(&hits) {
                let said = record.map(|r: HitRecord| (r.distance_m, r.object, r.geometric_normal));
                let expected = hit.map(|h| {
                    let SurfaceHit { distance_m, object, geometric_normal, .. } = h.surface;
                    (distance_m, object, geometric_normal)
                });
                prop_assert_eq!(said, expected);
                let Some(record) = record else { continue };
                let (_, group) = &caster.groups()[record.group as usize];
                let (instance, _) = &group.instances()[record.instance as usize];
                let shape = &instance.prototype;
                let of_it = match record.primitive {
                    Primitive::Triangle(k) => shape.mesh().triangles[k as usize].material,
                    Primitive::Card(k) => shape.cards()[k as usize].material,
                };
                prop_assert_eq!(Some(of_it), hit.map(|h| h.surface.material));
            }
        }
    }

    /// The second triangle of each pair has a material of its own that looks the same, so that
    /// pairs stay triangles.
    #[test]
    fn leaves_as_cards_are_their_triangles(seed: u64, decade in -3_i32..=3) {
        let size = 10.0_f32.powi(decade);
        let (library, mut rng) = (library(seed), rng(seed, "leaves"));
        let mut mesh = Mesh::default();
        for _ in 0..20 {
            let (mut card, mut window) = (card(&mut rng, size), window(&mut rng));
            card.material = MaterialId(2 + card.material.0 % 6);
            if rng.chance(0.5) { window = TextureWindow::WHOLE; }
            add_leaf(&mut mesh, &card, &window, &mut rng);
        }
        let mut apart = mesh.clone();
        for t in apart.triangles.iter_mut().skip(1).step_by(2) {
            t.material = twin(t.material);
        }
        let forest = |mesh: Mesh| {
            let shape = Prototype::new("leaves", mesh, Vec::new(), &library).expect("sound");
            (shape.quads().len(), RayScene::of_shape(Arc::new(shape), &library))
        };
        let ((quads, cards), (none, triangles)) = (forest(mesh.clone()), forest(apart));
        prop_assert!(quads >= 8 && none == 0, "{quads} {none}");
        let rays: Vec<Ray> = (0..400).map(|_| {
            let target = cube(&mut rng, size);
            ray(target + direction(&mut rng) * (3.0 * size), target)
        }).collect();
        let mut differ = 0;
        for r in &rays {
            let (a, b) = (cards.closest_record(r), triangles.closest_record(r));
            let same = match (a, b) {
                (Some(a), Some(b)) => a.primitive == b.primitive
                    && (a.distance_m - b.distance_m).abs() <= 1e-3 * size
                    && (a.geometric_normal - b.geometric_normal).length() < 1e-2
                    && (0..2).all(|k| (a.place[k] - b.place[k]).abs() < 1e-3),
                (None, None) => true,
                _ => false,
            };
            differ += u32::from(!same);
            let hits = (cards.closest_hit(r), triangles.closest_hit(r));
            if let (true, (Some(a), Some(b))) = (same, hits) {
                prop_assert!((a.shading.normal - b.shading.normal).length() < 1e-2);
                prop_assert!((a.shading.uv - b.shading.uv).length() < 1e-3);
                let (a, b) = (a.shading.uv_per_m, b.shading.uv_per_m);
                prop_assert!((a - b).abs() <= 1e-2 * b, "{a} {b}");
            }
        }
        // At borders of leaves and texels alone.
        prop_assert!(differ <= 4, "{differ} of {} rays differ", rays.len());
    }
}

#[test]
fn memory_is_said() {
    let library = library(3);
    let mut rng = rng(3, "memory");
    let shape = Arc::new(shape(&mut rng, &library, 1.0));
    let blas = common::blas_of(Arc::clone(&shape), &library);
    let places = (0..50_u16).map(|i| place(&blas, cube(&mut rng, 9.0), Mat3::IDENTITY, i));
    let group = Arc::new(Group::build(places.collect()));
    let bytes = |copies: usize| {
        RayScene::new(vec![(Vec3::ZERO, Arc::clone(&group)); copies]).memory_bytes()
    };
    let parts = shape.memory_bytes() + blas.memory_bytes() + group.memory_bytes();
    assert!(bytes(1) > parts, "masks are the rest");
    assert!(bytes(1) < parts + 100_000);
    // What is shared counts once.
    assert!(bytes(2) - bytes(1) < 1000);
}
