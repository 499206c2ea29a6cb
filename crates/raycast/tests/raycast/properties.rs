//! The tree against the linear oracle, and the guarantees of every caster.

use std::sync::Arc;

use crate::common::{self, Groups, cube, direction, place, ray, rng, scene, soup};
use glam::{Mat3, Vec2, Vec3};
use nemoral_raycast::{Blas, BruteForce, Group, RayScene};
use nemoral_scene::{
    AlphaMask, Blend, Card, GroundMixture, Hit, Material, MaterialId, MaterialLibrary, Mesh,
    ObjectId, Prototype, Ray, RayCaster, Semantic, SurfaceHit,
};
use nemoral_seed::Draw;
use proptest::prelude::*;

fn all(caster: &impl RayCaster, rays: &[Ray]) -> Vec<Option<Hit>> {
    rays.iter().map(|r| caster.closest_hit(r)).collect()
}

/// Equal to the bit, the sign of zero included.
fn bits(hits: &[Option<Hit>]) -> Vec<String> {
    hits.iter().map(|h| format!("{h:?}")).collect()
}

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

/// A library of one opaque material.
fn plain() -> MaterialLibrary {
    let mut library = MaterialLibrary::new();
    library.add(nemoral_scene::Material::plain(
        "plain",
        nemoral_scene::Semantic::Rock,
        Vec3::ONE,
    ));
    library
}

const OPAQUE: MaterialId = MaterialId(0);

fn square() -> Card {
    Card {
        corner: Vec3::new(-0.5, -0.5, 0.0),
        edge_u: Vec3::X,
        edge_v: Vec3::Y,
        material: OPAQUE,
    }
}

fn alone(blas: &Arc<Blas>, linear: Mat3) -> Groups {
    vec![(
        Vec3::ZERO,
        Arc::new(Group::build(vec![place(blas, Vec3::ZERO, linear, 1)])),
    )]
}

#[test]
fn colours_pass_over_between_the_corners() {
    let corners = [Vec3::ZERO, 4.0 * Vec3::X, 4.0 * Vec3::Y];
    let uvs = corners.map(Vec3::truncate);
    let mut mesh = soup([
        (corners, uvs, OPAQUE),
        (corners.map(|p| p - Vec3::X * 9.0), uvs, OPAQUE),
    ]);
    let mut library = plain();
    let other = library.add(Material::plain("other", Semantic::Soil, Vec3::ONE));
    let corners = [[OPAQUE, OPAQUE], [OPAQUE, other], [other, other]];
    mesh.blends = vec![Blend { corners }, Blend::uniform(OPAQUE)];
    let forest = RayScene::new(alone(
        &common::blas(mesh, Vec::new(), &library),
        Mat3::IDENTITY,
    ));
    let seen = |x: f32, y: f32| {
        let ray = Ray::new(Vec3::new(x, y, 3.0), -Vec3::Z);
        forest.closest_hit(&ray).expect("a hit").shading.mixture
    };
    let mixture = |share: f32| {
        Some(GroundMixture {
            materials: [OPAQUE, other, other],
            shares: [1.0 - share, share, 0.0],
        })
    };
    assert_eq!(seen(2.0, 1.0), mixture(0.5));
    assert_eq!(seen(1.0, 2.5), mixture(0.75));
    assert_eq!(seen(0.0, 0.0), mixture(0.0));
    assert_eq!(seen(-8.0, 1.0), None);
}

#[test]
fn a_shape_alone_has_the_colour_of_its_materials() {
    let shape = Prototype::new("card", Mesh::default(), vec![square()], &plain()).expect("sound");
    let scene = RayScene::of_shape(Arc::new(shape), &plain());
    let hit = scene
        .closest_hit(&Ray::new(Vec3::Z, Vec3::NEG_Z))
        .expect("a hit");
    assert_eq!(hit.shading.variation, 0.5);
}

#[test]
fn a_card_is_hit_where_and_as_it_is() {
    let blas = common::blas(Mesh::default(), vec![square()], &plain());
    // An instance that is twice as wide and mirrored in x, on which the normal stays on the shape's
    // side.
    let linear = Mat3::from_diagonal(Vec3::new(-2.0, 2.0, 5.0));
    let forest = RayScene::new(alone(&blas, linear));
    let hit = forest
        .closest_hit(&Ray::new(Vec3::new(0.5, 0.25, 3.0), -Vec3::Z))
        .unwrap();
    assert_eq!(hit.surface.distance_m, 3.0);
    assert_eq!(
        (hit.surface.geometric_normal, hit.shading.normal),
        (Vec3::Z, Vec3::Z)
    );
    assert_eq!(hit.shading.uv, Vec2::new(0.25, 0.625));
    assert_eq!(hit.shading.uv_per_m, 0.5);
    assert_eq!(
        (
            hit.surface.material,
            hit.surface.object.item(),
            hit.shading.variation
        ),
        (OPAQUE, 1, 1.0 / 16.0)
    );
    // The border belongs to the card, points beyond it do not, and both sides are hit.
    for (x, is_hit) in [(1.0, true), (1.0_f32.next_up(), false)] {
        let below = Ray::new(Vec3::new(x, 0.0, -1.0), Vec3::Z);
        assert_eq!(forest.closest_hit(&below).is_some(), is_hit);
    }
    assert!(
        forest
            .closest_hit(&Ray::new(Vec3::new(-5.0, 0.0, 0.0), Vec3::X))
            .is_none()
    );
}

#[test]
fn a_triangle_interpolates_and_shades_on_its_own_side() {
    let uvs = [Vec2::ZERO, Vec2::X * 4.0, Vec2::Y * 4.0];
    let mut mesh = soup([([Vec3::ZERO, Vec3::X * 2.0, Vec3::Y * 2.0], uvs, OPAQUE)]);
    let tilted = Vec3::new(0.6, 0.0, 0.8);
    mesh.normals = vec![tilted, tilted, -tilted];
    let forest = RayScene::new(alone(
        &common::blas(mesh, Vec::new(), &plain()),
        Mat3::IDENTITY,
    ));
    let at = |x: f32, y: f32| forest.closest_hit(&Ray::new(Vec3::new(x, y, 1.0), -Vec3::Z));
    let hit = at(0.5, 0.25).unwrap();
    assert_eq!(
        (hit.shading.uv, hit.shading.uv_per_m),
        (Vec2::new(1.0, 0.5), 2.0)
    );
    assert!(hit.shading.normal.distance(tilted) < 1e-6);
    // Near the third corner the vertex normals point downwards, so the shading normal is reversed.
    let hit = at(0.1, 1.8).unwrap();
    assert_eq!(hit.surface.geometric_normal, Vec3::Z);
    assert!(hit.shading.normal.distance(tilted) < 1e-6);
    assert!(at(1.2, 0.9).is_none());
}

#[test]
fn a_mesh_of_points_alone_is_shaded_flat() {
    let corners = [Vec3::ZERO, Vec3::X * 2.0, Vec3::new(0.0, 2.0, 2.0)];
    let mut mesh = soup([(corners, [Vec2::ONE; 3], OPAQUE)]);
    (mesh.normals, mesh.uvs) = (Vec::new(), Vec::new());
    let forest = RayScene::new(alone(
        &common::blas(mesh, Vec::new(), &plain()),
        Mat3::IDENTITY,
    ));
    let hit = (forest.closest_hit(&Ray::new(Vec3::new(0.5, 0.5, 3.0), -Vec3::Z))).expect("a hit");
    assert!(
        hit.shading
            .normal
            .distance(Vec3::new(0.0, -0.5, 0.5) * 2.0_f32.sqrt())
            < 1e-6
    );
    assert_eq!(hit.shading.normal, hit.surface.geometric_normal);
    assert_eq!((hit.shading.uv, hit.shading.uv_per_m), (Vec2::ZERO, 0.0));
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
fn a_card_lets_through_what_its_mask_says() {
    type Opaque = fn(usize, usize) -> bool;
    let shapes: [(usize, usize, Opaque); 5] = [
        (1, 1, |_, _| true),
        (3, 2, |c, r| (c + r) % 2 == 0),
        (64, 64, |c, r| {
            (c as f32 - 31.5).hypot(r as f32 - 20.0) < 15.0
        }),
        (256, 256, |c, r| (c * 7 + r * 13) % 11 < 4),
        (37, 90, |c, r| c > 20 && r % 3 != 0),
    ];
    let mut rng = rng(3, "pass rate");
    for (width, height, opaque) in shapes {
        let mask = AlphaMask::from_fn(width, height, opaque).unwrap();
        let fraction = mask.opaque_fraction();
        let mut library = plain();
        let material = common::add_masked(&mut library, mask);
        let card = Card {
            corner: cube(&mut rng, 10.0),
            edge_u: cube(&mut rng, 0.3),
            edge_v: cube(&mut rng, 0.3),
            material,
        };
        let forest = RayScene::new(alone(
            &common::blas(Mesh::default(), vec![card], &library),
            Mat3::IDENTITY,
        ));
        let n = 20_000;
        let hits = (0..n)
            .filter(|_| {
                let target =
                    card.corner + card.edge_u * rng.unit_f32() + card.edge_v * rng.unit_f32();
                let origin = target + direction(&mut rng) * 5.0;
                forest.is_occluded(&ray(origin, target))
            })
            .count();
        let expected = fraction * f64::from(n);
        let sigma = (expected * (1.0 - fraction)).sqrt();
        // A few rays in the plane of the card miss it.
        assert!(
            (hits as f64 - expected).abs() <= 4.0 * sigma + 2.0,
            "{hits} of {n}, {fraction} opaque"
        );
    }
}

#[test]
fn what_has_no_area_is_never_hit_and_never_breaks_anything() {
    let library = common::library(1);
    let a = Vec3::new(0.1, 0.2, 0.3);
    let zero = [Vec2::ZERO; 3];
    let degenerate = || {
        soup([
            ([a; 3], zero, OPAQUE),
            ([a, a, Vec3::ONE], zero, OPAQUE),
            ([Vec3::ZERO, Vec3::ONE, Vec3::splat(2.0)], zero, OPAQUE),
        ])
    };
    let card = |edge_u, edge_v, material| Card {
        corner: -Vec3::ONE,
        edge_u,
        edge_v,
        material,
    };
    let cards = || {
        vec![
            card(Vec3::X, Vec3::X * 3.0, OPAQUE),
            card(Vec3::ZERO, Vec3::ZERO, OPAQUE),
            // A valid card without an opaque texel.
            card(Vec3::X * 3.0, Vec3::Y * 3.0, MaterialId(6)),
        ]
    };
    let rays = common::rays(1, &[Vec3::ZERO, a, -Vec3::ONE, Vec3::ONE], 2000);
    let nothing = RayScene::new(alone(
        &common::blas(degenerate(), cards(), &library),
        Mat3::IDENTITY,
    ));
    assert!(all(&nothing, &rays).iter().all(Option::is_none));

    // Among valid primitives they change nothing.
    let blas = |mesh, cards| common::blas(mesh, cards, &library);
    let only = RayScene::new(alone(
        &blas(Mesh::default(), vec![square()]),
        Mat3::IDENTITY,
    ));
    let mut mixed_cards = cards();
    mixed_cards.push(square());
    let mixed = RayScene::new(alone(&blas(degenerate(), mixed_cards), Mat3::IDENTITY));
    let expected = all(&only, &rays);
    assert!(expected.iter().flatten().count() > 50);
    assert_eq!(all(&mixed, &rays), expected);

    // Instances that are flat or not finite, and empty groups and scenes.
    let sound = blas(Mesh::default(), vec![square()]);
    let flat = Mat3::from_diagonal(Vec3::new(1.0, 1.0, 0.0));
    let mut lost = place(&sound, Vec3::NAN, Mat3::IDENTITY, 1);
    lost.0.linear.x_axis.y = f32::INFINITY;
    let instances = vec![
        place(&sound, Vec3::ZERO, flat, 1),
        place(&sound, Vec3::ZERO, Mat3::ZERO, 1),
        lost,
    ];
    let group = Arc::new(Group::build(instances));
    let empty = Arc::new(Group::build(Vec::new()));
    for groups in [vec![(Vec3::ZERO, group), (Vec3::ZERO, empty)], Vec::new()] {
        assert!(
            all(&RayScene::new(groups), &rays)
                .iter()
                .all(Option::is_none)
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
fn sizes_over_many_decades_still_find_everything() {
    // Each shape is twice as large and twice as far as the one before, so that no split is
    // balanced. The largest is nearly as large as shapes may be.
    let shapes = (-20..29).map(|k| {
        let s = 2.0_f32.powi(k);
        let at = Vec3::new(s, 0.3 * s, 0.1 * s);
        (
            [at, at + Vec3::Y * s * 0.4, at + Vec3::Z * s * 0.4],
            [Vec2::ZERO; 3],
            OPAQUE,
        )
    });
    let groups = alone(
        &common::blas(soup(shapes), Vec::new(), &plain()),
        Mat3::IDENTITY,
    );
    let (brute, forest) = (BruteForce::new(groups.clone()), RayScene::new(groups));
    let mut rng = rng(8, "decades");
    let mut found = 0;
    for k in (-20..29).flat_map(|k| [k; 60]) {
        let target = Vec3::new(1.0, 0.3 + 0.4 * rng.unit_f32(), 0.1 + 0.4 * rng.unit_f32())
            * 2.0_f32.powi(k);
        let r = ray(target + direction(&mut rng) * target.length(), target);
        let hit = brute.closest_hit(&r);
        found += u32::from(hit.is_some());
        assert_eq!(forest.closest_hit(&r), hit);
    }
    assert!(found > 500, "{found}");
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
