//! What rays meet of single shapes: cards, triangles, points, masks, and what has no area.

use std::sync::Arc;

use crate::common::{
    self, OPAQUE, all, alone, cube, direction, place, plain, ray, rng, soup, square,
};
use glam::{Mat3, Vec2, Vec3};
use nemoral_raycast::{BruteForce, Group, RayScene};
use nemoral_scene::{
    AlphaMask, Blend, Card, GroundMixture, Material, MaterialId, Mesh, Prototype, Ray, RayCaster,
    Semantic,
};
use nemoral_seed::Draw;

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
