//! Use of `nemoral-scene` alone: ids, frames and projections for a user's labels.

use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{
    ChunkCoord, Intrinsics, ObjectId, Ontology, Ray, RigidTransform, Semantic, Surface,
    SurfaceSample,
};

#[test]
fn ids_go_into_images_and_labels() {
    let chunk = ChunkCoord::containing([-12.0, 130.0].into(), 50.0);
    assert_eq!(chunk, ChunkCoord::new(-1, 2));
    let tree = ObjectId::new(chunk, 17).expect("in range");
    assert_eq!((tree.chunk(), tree.item()), (chunk, 17));
    assert!(tree.to_image_id() < 1 << 24 && tree.to_image_id() > 0);
    let paper = Ontology::paper();
    assert_eq!(paper.class(Semantic::Needle).name, "Canopy");
    assert_eq!(
        paper.class(Semantic::Needle),
        paper.class(Semantic::Leaf),
        "one class in the paper's eyes"
    );
}

#[test]
fn what_is_ahead_is_in_the_middle_of_the_picture() {
    let camera = Intrinsics::from_fov(640, 480, 1.2).expect("a camera");
    let body_from_camera = RigidTransform::body_from_optical();
    let ahead = body_from_camera.inverse().transform_point(DVec3::X * 10.0);
    let at = camera.project(ahead).expect("before the camera");
    assert!((at - DVec2::new(320.0, 240.0)).length() <= 0.75, "{at}");
    assert_eq!(camera.project(-ahead), None, "behind it");
    let ray = Ray::new(Vec3::ZERO, Vec3::X);
    assert_eq!(ray.at(10.0), Vec3::X * 10.0);
}

/// A user's ground.
struct Dunes;

impl Surface for Dunes {
    fn sample(&self, world_m: DVec2) -> SurfaceSample {
        SurfaceSample {
            height_m: world_m.x.sin(),
            gradient: DVec2::new(world_m.x.cos(), 0.0),
        }
    }
}

#[test]
fn a_surface_of_ones_own() {
    let here = DVec2::new(0.0, 5.0);
    assert_eq!(Dunes.height_m(here), 0.0);
    let expected = Vec3::new(-1.0, 0.0, 1.0) * std::f32::consts::FRAC_1_SQRT_2;
    assert!(Dunes.sample(here).normal().distance(expected) < 1e-6);
}
