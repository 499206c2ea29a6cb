//! Use of `nemoral-render` alone: pictures of another scene.

use std::error::Error;

use nemoral_render::{
    CameraImages, CameraRenderer, Lighting, OpenSky, RayCastCamera, RayCastParams, SceneView,
    SkyParams, Sun, View,
};
use nemoral_scene::glam::Vec3;
use nemoral_scene::{
    ChunkCoord, Hit, Intrinsics, Material, MaterialId, MaterialLibrary, ObjectId, Ray, RayCaster,
    RigidTransform, Semantic,
};
use nemoral_seed::Key;

/// A sphere with a radius of 1 m, 5 m ahead of the origin.
struct Ball(MaterialId);

const CENTRE_M: Vec3 = Vec3::new(5.0, 0.0, 0.0);

impl RayCaster for Ball {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let from = ray.origin - CENTRE_M;
        let along = from.dot(ray.direction);
        let discriminant = along * along - from.length_squared() + 1.0;
        let distance_m = -along - discriminant.max(0.0).sqrt();
        if discriminant < 0.0 || !ray.reaches(distance_m) {
            return None;
        }
        let normal = ray.at(distance_m) - CENTRE_M;
        let ball = ObjectId::new(ChunkCoord::new(0, 0), 9).expect("in range");
        Some(Hit::new(distance_m, normal, self.0).with_object(ball))
    }
}

fn picture(azimuth_deg: f64) -> Result<CameraImages, Box<dyn Error>> {
    let mut materials = MaterialLibrary::new();
    let chalk = Material::plain("chalk", Semantic::Rock, Vec3::splat(0.5));
    let ball = Ball(materials.add(chalk));
    let sun = Sun::from_angles(azimuth_deg, 30.0)?;
    let lighting = Lighting::new(&sun, &SkyParams::default())?;
    let camera = RayCastCamera::new(RayCastParams::default(), lighting)?;
    let scene = SceneView {
        caster: &ball,
        instances: None,
        materials: &materials,
        sky_visibility: &OpenSky,
        lamps: &[],
    };
    let intrinsics = Intrinsics::from_fov(96, 64, 1.0)?;
    let view = View::new(intrinsics, RigidTransform::body_from_optical());
    Ok(camera.render(&scene, &view, Key::world(7))?)
}

#[test]
fn the_truth_is_what_was_hit() -> Result<(), Box<dyn Error>> {
    let images = picture(270.0)?;
    let truth = &images.truth;
    assert_eq!(*truth.semantic.at(48, 32), Semantic::Rock);
    assert_eq!(truth.object.at(48, 32).item(), 9);
    assert!((truth.depth_m.at(48, 32) - 4.0).abs() < 0.01);
    assert!(truth.normal.at(48, 32).distance(Vec3::NEG_Z) < 0.05);
    assert_eq!(*truth.semantic.at(2, 2), Semantic::Sky);
    assert!(truth.object.at(2, 2).is_none());
    // The sphere's outline has the radius tan(asin(1/5)) times the focal length.
    let seen = truth
        .object
        .pixels()
        .iter()
        .filter(|o| !o.is_none())
        .count() as f64;
    let focal_px = 48.0 / 0.5_f64.tan();
    let radius_px = focal_px * 0.2_f64.asin().tan();
    let expected = std::f64::consts::PI * radius_px * radius_px;
    assert!(
        (seen / expected - 1.0).abs() < 0.1,
        "{seen} of {expected} pixels"
    );
    Ok(())
}

#[test]
fn the_sun_lights_the_side_where_it_stands() -> Result<(), Box<dyn Error>> {
    // The camera looks east: north is left, south is right.
    let light = |images: &CameraImages, column| -> u32 {
        images
            .rgb
            .at(column, 32)
            .iter()
            .map(|&v| u32::from(v))
            .sum()
    };
    let north = picture(0.0)?;
    assert!(light(&north, 42) > light(&north, 54) + 30);
    let south = picture(180.0)?;
    assert!(light(&south, 54) > light(&south, 42) + 30);
    Ok(())
}
