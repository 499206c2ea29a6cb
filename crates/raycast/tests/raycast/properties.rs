//! The tree against the linear oracle, and the guarantees of every caster.

use std::sync::Arc;

use crate::common::{
    self, Groups, all, alone, bits, cube, direction, place, plain, rng, scene, square,
};
use glam::{Mat3, Vec3};
use nemoral_raycast::{Blas, BruteForce, Group, RayScene};
use nemoral_scene::{Mesh, ObjectId, Ray, RayCaster, SurfaceHit};
use nemoral_seed::Draw;
use proptest::prelude::*;

/// Large batches are cast in parts.
#[test]
fn a_batch_of_any_size_is_its_rays() {
    let (groups, targets) = scene(5);
    let few = common::rays(5, &targets, 150);
    let forest = RayScene::new(groups);
    let each: Vec<Option<SurfaceHit>> = all(&forest, &few)
        .into_iter()
        .map(|hit| hit.map(SurfaceHit::from))
        .collect();
    assert!(each.iter().any(Option::is_some) && each.iter().any(Option::is_none));
    let rays: Vec<Ray> = few.iter().cycle().take(110_000).copied().collect();
    let mut batch = vec![None; rays.len()];
    forest.closest_surfaces(&rays, &mut batch);
    assert!(batch.iter().eq(each.iter().cycle().take(rays.len())));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn the_tree_is_the_linear_loop_to_the_bit(seed: u64) {
        let (groups, targets) = scene(seed);
        let rays = common::rays(seed, &targets, 150);
        let brute = all(&BruteForce::new(groups.clone()), &rays);
        let forest = RayScene::new(groups);
        let found = all(&forest, &rays);
        prop_assert_eq!(bits(&found), bits(&brute));
        // The same without special instructions, in a batch, and for any hit instead of the
        // nearest.
        let portable = forest.clone().portable();
        prop_assert_eq!(bits(&all(&portable, &rays)), bits(&brute));
        let mut batch = vec![None; rays.len()];
        forest.closest_hits(&rays, &mut batch);
        prop_assert_eq!(bits(&batch), bits(&brute));
        let mut surfaces = vec![None; rays.len()];
        forest.closest_surfaces(&rays, &mut surfaces);
        let expected: Vec<_> = brute.iter().map(|h| h.map(SurfaceHit::from)).collect();
        prop_assert_eq!(format!("{surfaces:?}"), format!("{expected:?}"));
        let mut occluded = vec![false; rays.len()];
        forest.are_occluded(&rays, &mut occluded);
        let expected: Vec<bool> = brute.iter().map(Option::is_some).collect();
        prop_assert_eq!(occluded, expected);
        for (ray, hit) in rays.iter().zip(&brute) {
            prop_assert_eq!(forest.is_occluded(ray), hit.is_some());
            prop_assert_eq!(portable.is_occluded(ray), hit.is_some());
        }
    }

    #[test]
    fn rays_that_look_alike_share_nothing_but_steps(seed: u64) {
        let (groups, targets) = scene(seed);
        let mut rng = rng(seed, "alike");
        // Fans of rays from one place: narrow and wide, along axes and not, some of them from a
        // moving origin.
        let rays: Vec<Ray> = (0..6)
            .flat_map(|fan| {
                let target = *rng.choose(&targets);
                let away = [0.5, 4.0, 40.0][fan % 3];
                let towards = [direction(&mut rng), Vec3::X, -Vec3::Y][fan % 3];
                let origin = target - towards * away;
                (0..40)
                    .map(|i| {
                        let spread = [0.004, 0.04, 0.3][i % 3];
                        let drift = cube(&mut rng, [0.0, 0.3][fan % 2]);
                        let direction = (towards + cube(&mut rng, spread)).normalize_or(towards);
                        let mut ray = Ray::new(origin + drift, direction);
                        if i % 5 == 0 {
                            ray.t_min_m = rng.range_f32(0.0, 1.2 * away);
                            ray.t_max_m = ray.t_min_m + rng.range_f32(0.0, away);
                        }
                        ray
                    })
                    .collect::<Vec<_>>()
            })
            .collect();
        let brute = all(&BruteForce::new(groups.clone()), &rays);
        let forest = RayScene::new(groups);
        for forest in [forest.clone(), forest.portable()] {
            let mut batch = vec![None; rays.len()];
            forest.closest_hits(&rays, &mut batch);
            prop_assert_eq!(bits(&batch), bits(&brute));
        }
    }

    #[test]
    fn rays_that_are_no_numbers_leave_their_neighbours_alone(seed: u64) {
        let (groups, targets) = scene(seed);
        let mut rng = rng(seed, "spoiled");
        let target = *rng.choose(&targets);
        let mut rays: Vec<Ray> = (0..120)
            .map(|_| {
                let direction = (Vec3::X + cube(&mut rng, 0.04)).normalize_or(Vec3::X);
                Ray::new(target - 4.0 * Vec3::X + cube(&mut rng, 0.3), direction)
            })
            .collect();
        for ray in rays.iter_mut().skip(1).step_by(3) {
            match rng.below(8) {
                6 => ray.t_min_m = f32::NAN,
                7 => ray.t_max_m = f32::NAN,
                i if i < 3 => ray.origin[i as usize] = f32::NAN,
                i => ray.direction[i as usize - 3] = f32::NAN,
            }
        }
        let mut brute = all(&BruteForce::new(groups.clone()), &rays);
        brute.iter_mut().skip(1).step_by(3).for_each(|hit| *hit = None);
        let forest = RayScene::new(groups);
        for forest in [forest.clone(), forest.portable()] {
            let mut batch = vec![None; rays.len()];
            forest.closest_hits(&rays, &mut batch);
            prop_assert_eq!(bits(&batch), bits(&brute));
            let mut occluded = vec![false; rays.len()];
            forest.are_occluded(&rays, &mut occluded);
            let expected: Vec<bool> = brute.iter().map(Option::is_some).collect();
            prop_assert_eq!(occluded, expected);
        }
    }

    #[test]
    fn ranges_are_closed_and_exact(seed: u64) {
        let (groups, targets) = scene(seed);
        let (brute, forest) = (BruteForce::new(groups.clone()), RayScene::new(groups));
        for ray in common::rays(seed, &targets, 40) {
            let Some(hit) = forest.closest_hit(&ray) else {
                continue;
            };
            let t = hit.surface.distance_m;
            prop_assert!(t >= ray.t_min_m && t <= ray.t_max_m);
            for exact in [
                Ray { t_max_m: t, ..ray },
                Ray { t_min_m: t, ..ray },
                Ray {
                    t_min_m: t,
                    t_max_m: t,
                    ..ray
                },
            ] {
                prop_assert_eq!(forest.closest_hit(&exact), Some(hit));
            }
            prop_assert_eq!(
                forest.closest_hit(&Ray {
                    t_max_m: t.next_down(),
                    ..ray
                }),
                None
            );
            let beyond = Ray {
                t_min_m: t.next_up(),
                ..ray
            };
            let next = forest.closest_hit(&beyond);
            prop_assert_eq!(&next, &brute.closest_hit(&beyond));
            prop_assert!(next.is_none_or(|n| n.surface.distance_m > t));
        }
    }

    #[test]
    fn normals_face_as_the_shape_does(seed: u64) {
        let (groups, targets) = scene(seed);
        let forest = RayScene::new(groups);
        for ray in common::rays(seed, &targets, 60) {
            let Some(hit) = forest.closest_hit(&ray) else {
                continue;
            };
            let (g, s) = (hit.surface.geometric_normal, hit.shading.normal);
            prop_assert!((g.length() - 1.0).abs() < 1e-5 && (s.length() - 1.0).abs() < 1e-5);
            prop_assert!(g.dot(s) >= -1e-6);
            prop_assert!(hit.shading.uv_per_m.is_finite() && hit.shading.uv_per_m >= 0.0);
        }
    }
}

#[test]
fn ties_go_to_the_lowest_id_whatever_the_order() {
    let mut rng = rng(5, "ties");
    let (mesh, cards) = common::clutter(&mut rng, 20, 20, 1.0);
    let blas = common::blas(mesh, cards, &common::library(5));
    let linear = common::linear(&mut rng);
    let group = |items: &[u16]| {
        let instances = items.iter().map(|&i| place(&blas, Vec3::ZERO, linear, i));
        Arc::new(Group::build(instances.collect()))
    };
    let zero = Vec3::ZERO;
    let orders: [Groups; 4] = [
        vec![
            (zero, group(&[3])),
            (zero, group(&[9])),
            (zero, group(&[7])),
        ],
        vec![
            (zero, group(&[9])),
            (zero, group(&[7])),
            (zero, group(&[3])),
        ],
        vec![(zero, group(&[9, 7, 3]))],
        vec![(zero, group(&[7, 3])), (zero, group(&[9]))],
    ];
    let rays = common::rays(5, &[Vec3::ZERO], 2000);
    let expected = all(&BruteForce::new(orders[0].clone()), &rays);
    assert!(expected.iter().flatten().count() > 300);
    assert!(
        expected
            .iter()
            .flatten()
            .all(|h| h.surface.object.item() == 3)
    );
    for order in orders {
        assert_eq!(all(&RayScene::new(order), &rays), expected);
    }
    // Without ids, the first instance of the first group wins, which is identified by its variation
    // here.
    let unnamed = |variation: f32| {
        let (mut instance, blas) = place(&blas, Vec3::ZERO, linear, 0);
        instance.variation = variation;
        (instance, blas)
    };
    let groups = vec![
        (
            zero,
            Arc::new(Group::build(vec![unnamed(0.25), unnamed(0.5)])),
        ),
        (zero, Arc::new(Group::build(vec![unnamed(0.75)]))),
    ];
    let hits = all(&RayScene::new(groups), &rays);
    assert_eq!(
        hits.iter().flatten().count(),
        expected.iter().flatten().count()
    );
    for hit in hits.iter().flatten() {
        assert_eq!(
            (hit.surface.object, hit.shading.variation),
            (ObjectId::NONE, 0.25)
        );
    }
}

#[test]
fn rays_that_are_none_hit_nothing() {
    let forest = RayScene::new(alone(
        &common::blas(Mesh::default(), vec![square()], &plain()),
        Mat3::IDENTITY,
    ));
    let good = Ray::new(Vec3::Z, -Vec3::Z);
    assert!(forest.is_occluded(&good));
    let bad = [
        Ray {
            direction: Vec3::ZERO,
            ..good
        },
        Ray {
            direction: Vec3::NAN,
            ..good
        },
        Ray {
            origin: Vec3::NAN,
            ..good
        },
        Ray {
            origin: Vec3::INFINITY,
            ..good
        },
        Ray {
            t_min_m: f32::NAN,
            ..good
        },
        Ray {
            t_max_m: f32::NAN,
            ..good
        },
        Ray {
            t_min_m: 2.0,
            t_max_m: 0.0,
            ..good
        },
    ];
    assert!(all(&forest, &bad).iter().all(Option::is_none));
    let mut hits = vec![None; bad.len()];
    forest.closest_hits(&bad, &mut hits);
    assert!(hits.iter().all(Option::is_none));
}

#[test]
fn everything_may_be_shared_between_threads() {
    fn shared<T: Send + Sync>() {}
    shared::<Blas>();
    shared::<Group>();
    shared::<RayScene>();
    shared::<BruteForce>();
}

#[test]
fn a_scan_is_cast_alike_on_any_number_of_threads() {
    let (groups, targets) = scene(7);
    let forest = RayScene::new(groups);
    let rays = common::rays(7, &targets, 20_000);
    let one_by_one = all(&forest, &rays);
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let mut batch = vec![None; rays.len()];
        (pool.expect("threads")).install(|| forest.closest_hits(&rays, &mut batch));
        assert!(batch == one_by_one, "{threads} threads");
    }
}
