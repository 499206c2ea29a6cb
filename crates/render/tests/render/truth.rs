//! The truth of pictures against closed forms.

use crate::analytic::{Shape, World, camera, object};
use crate::still_life::{KEY, plain, renderer, still_life};
use glam::{DVec2, DVec3, Vec3};
use nemoral_render::{CameraRenderer, Lighting, View};
use nemoral_scene::{AlphaMask, Card, Material, ObjectId, RigidTransform, Semantic};
use proptest::prelude::*;
use std::sync::Arc;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Depth, normal, class and object of a plane and a sphere, from any pose and at any image
    /// position, against f64.
    #[test]
    fn truth_is_the_closed_form(
        x in -40.0_f64..0.0,
        y in -20.0_f64..20.0,
        z in 0.5_f64..5.0,
        roll in -0.5_f64..0.5,
        pitch in -0.2_f64..0.6,
        yaw in -0.8_f64..0.8,
        fov in 0.4_f64..2.4,
        column in 0.0_f64..64.0,
        row in 0.0_f64..36.0,
    ) {
        let world = still_life();
        let pose = RigidTransform::from_xyz_rpy(DVec3::new(x, y, z), roll, pitch, yaw)
            * RigidTransform::body_from_optical();
        let intrinsics = nemoral_scene::Intrinsics::from_fov(64, 36, fov).expect("valid");
        let view = View::new(intrinsics, pose);
        let pixel = DVec2::new(column, row);
        let got =
            renderer(plain(), Lighting::uniform(Vec3::ONE)).truth_at(&world.view(), &view, pixel);

        // Everything is computed again in f64, without Ray.
        let d = pose.transform_vector(intrinsics.direction(pixel));
        let o = pose.translation_m;
        let ground = (d.z < 0.0).then(|| (-o.z / d.z, DVec3::Z, Semantic::Soil, ObjectId::NONE));
        let m = o - DVec3::new(5.0, 0.5, 1.0);
        let (b, c) = (m.dot(d), m.length_squared() - 1.0);
        // Rays very close to a silhouette may hit or miss.
        prop_assume!((b * b - c).abs() > 1e-4 && d.z.abs() > 1e-4);
        let ball = (b * b > c && b < 0.0).then(|| {
            let t = -b - (b * b - c).sqrt();
            (t, m + d * t, Semantic::Rock, object(1))
        });
        // The card is not part of this oracle.
        prop_assume!(got.semantic != Semantic::Leaf);
        let nearest = ground
            .into_iter()
            .chain(ball)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match nearest.filter(|n| n.0 < 9e4) {
            None => prop_assert_eq!((got.semantic, got.depth_m), (Semantic::Sky, 0.0)),
            Some((t, normal, semantic, id)) => {
                prop_assert_eq!((got.semantic, got.object), (semantic, id));
                let depth = pose.inverse().transform_point(o + d * t).z;
                prop_assert!(
                    (f64::from(got.depth_m) / depth - 1.0).abs() < 1e-4,
                    "{} for {depth}",
                    got.depth_m
                );
                let optical = pose.rotation.inverse() * normal;
                prop_assert!(
                    got.normal.as_dvec3().distance(optical) < 1e-2,
                    "{} for {optical}",
                    got.normal
                );
                prop_assert!(
                    got.normal.as_dvec3().dot(intrinsics.direction(pixel)) <= 1e-6,
                    "towards the camera"
                );
            }
        }
    }
}

#[test]
fn images_hold_the_truth_of_pixel_centres() {
    let world = still_life();
    let view = camera(
        67,
        41,
        90.0,
        DVec3::new(0.0, 0.0, 1.2),
        DVec3::new(5.0, -0.5, 1.0),
    );
    let camera = renderer(plain(), Lighting::uniform(Vec3::ONE));
    let images = camera.render(&world.view(), &view, KEY).expect("renders");
    let alone = camera.truth(&world.view(), &view).expect("casts");
    assert_eq!(alone, images.truth);
    let mut classes = std::collections::BTreeSet::new();
    for (row, column) in (0..41).flat_map(|r| (0..67).map(move |c| (r, c))) {
        let centre = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
        let exact = camera.truth_at(&world.view(), &view, centre);
        let t = &images.truth;
        assert_eq!(*t.semantic.at(column, row), exact.semantic);
        assert_eq!(*t.object.at(column, row), exact.object);
        assert_eq!(*t.depth_m.at(column, row), exact.depth_m);
        assert_eq!(*t.normal.at(column, row), exact.normal);
        classes.insert(exact.semantic);
    }
    assert_eq!(
        classes.len(),
        4,
        "sky, soil, ball and card are seen: {classes:?}"
    );
}

/// Seen from its front (edge_u × edge_v points at the camera), the card's u runs to the right and v
/// upwards, so the mask's row 0 is at the bottom.
#[test]
fn a_letter_f_is_not_mirrored() {
    const PICTURE: [&str; 7] = [
        "#####", "#....", "#....", "###..", "#....", "#....", "#....",
    ];
    let mask = AlphaMask::from_fn(5, 7, |c, r| PICTURE[6 - r].as_bytes()[c] == b'#').expect("size");
    let mut world = World::default();
    let paper = Material {
        mask: Some(Arc::new(mask)),
        ..Material::plain("f", Semantic::Leaf, Vec3::ONE)
    };
    // The camera looks east, so right is south: u runs towards −y.
    let card = Card {
        corner: Vec3::new(10.0, 2.5, 0.0),
        edge_u: Vec3::new(0.0, -5.0, 0.0),
        edge_v: Vec3::new(0.0, 0.0, 7.0),
        material: nemoral_scene::MaterialId(0),
    };
    world.add(Shape::Card(card), paper, 1);
    // 10 pixels per metre at 10 m: one mask texel is 10 × 10 pixels.
    let mut view = camera(
        50,
        70,
        28.0,
        DVec3::new(0.0, 0.0, 3.5),
        DVec3::new(10.0, 0.0, 3.5),
    );
    (view.intrinsics.fx, view.intrinsics.fy) = (100.0, 100.0);
    let images = renderer(plain(), Lighting::uniform(Vec3::ONE))
        .render(&world.view(), &view, KEY)
        .expect("renders");
    for (row, line) in PICTURE.iter().enumerate() {
        for (column, ink) in line.bytes().enumerate() {
            let seen = *images.truth.semantic.at(column * 10 + 5, row * 10 + 5) == Semantic::Leaf;
            assert_eq!(seen, ink == b'#', "column {column}, row {row}");
        }
    }
}
