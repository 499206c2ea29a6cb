//! Visibility of the tile that ground is textured with.

use nemoral_render::{
    CameraRenderer, Lens, Lighting, OpenSky, RayCastCamera, RayCastParams, SceneView, View,
};
use nemoral_scene::glam::{DVec2, DVec3, Vec2, Vec3};
use nemoral_scene::{
    Hit, Image, Intrinsics, Material, MaterialId, MaterialLibrary, Ray, RayCaster, RigidTransform,
};
use nemoral_seed::Key;

use super::picture::luminance_of_light;

/// Side of a tile, pixels.
const TILE: usize = 32;

/// Side of the picture, tiles.
const TILES: usize = 16;

/// Level ground at height 0 of the first material.
struct Level {
    /// Unit of texture coordinates, metres.
    unit_m: f32,
}

impl RayCaster for Level {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let distance_m = -ray.origin.z / ray.direction.z;
        let at = ray.at(distance_m).truncate();
        ray.reaches(distance_m).then(|| {
            let mut hit = Hit::new(distance_m, Vec3::Z, MaterialId(0));
            hit.shading.uv = at.rem_euclid(Vec2::splat(1024.0)) / self.unit_m;
            hit.shading.uv_per_m = 1.0 / self.unit_m;
            hit.shading.variation = 0.5;
            hit
        })
    }
}

/// The repetition of ground of this material: the greatest correlation of its brightness with that
/// at the distance of a tile's width, in sixteen directions. It is 1 for a plain tiled picture.
/// Differences over more than a tile are removed before.
#[must_use]
pub fn ground_repetition(material: &Material) -> f64 {
    let unit_m = if material.ground {
        1.0
    } else {
        material.tile_m
    };
    repetition(&from_above(material, unit_m), TILE)
}

/// The brightness of the material from straight above in even light.
fn from_above(material: &Material, unit_m: f32) -> Image<f64> {
    let mut materials = MaterialLibrary::new();
    materials.add(material.clone());
    let pixels = (TILE * TILES) as u32;
    let height_m = f64::from(material.tile_m) * TILES as f64 / 2.0;
    let intrinsics = Intrinsics::from_fov(pixels, pixels, 90_f64.to_radians()).expect("a pinhole");
    let above = DVec3::new(300.0, 300.0, height_m);
    let down = RigidTransform::from_xyz_rpy(above, 0.0, std::f64::consts::FRAC_PI_2, 0.0);
    let view = View::new(intrinsics, down * RigidTransform::body_from_optical());
    let params = RayCastParams {
        lens: Lens::default(),
        keep_linear: true,
        max_range_m: 1e5,
        ..RayCastParams::draft()
    };
    let camera = RayCastCamera::new(params, Lighting::uniform(Vec3::ONE)).expect("valid");
    let scene = SceneView {
        caster: &Level { unit_m },
        instances: None,
        materials: &materials,
        sky_visibility: &OpenSky,
        lamps: &[],
    };
    let images = camera.render(&scene, &view, Key::world(1));
    let images = images.expect("renders");
    luminance_of_light(&images.linear.expect("asked for"), images.ev100)
}

/// The greatest autocorrelation at the distance `lag_px`, of differences from the mean of a square
/// of that side.
fn repetition(image: &Image<f64>, lag_px: usize) -> f64 {
    let (w, h) = (image.width() as i64, image.height() as i64);
    // These are the sums over all pixels left of and above each pixel.
    let mut sums = vec![0.0; ((w + 1) * (h + 1)) as usize];
    let at = |x: i64, y: i64| (y * (w + 1) + x) as usize;
    for y in 0..h {
        for x in 0..w {
            sums[at(x + 1, y + 1)] =
                image.at(x as usize, y as usize) + sums[at(x, y + 1)] + sums[at(x + 1, y)]
                    - sums[at(x, y)];
        }
    }
    let half = lag_px as i64 / 2;
    let fine = |x: i64, y: i64| {
        let (left, right, top, bottom) = (x - half, x + half, y - half, y + half);
        let sum = sums[at(right, bottom)] - sums[at(left, bottom)] - sums[at(right, top)]
            + sums[at(left, top)];
        image.at(x as usize, y as usize) - sum / ((2 * half) * (2 * half)) as f64
    };
    let fine: Vec<f64> = (half..h - half)
        .flat_map(|y| (half..w - half).map(move |x| (x, y)))
        .map(|(x, y)| fine(x, y))
        .collect();
    let (w, h) = (w - 2 * half, h - 2 * half);
    (0..16)
        .map(|i| {
            let lag = DVec2::from_angle(f64::from(i) * std::f64::consts::TAU / 16.0);
            let lag = (lag * lag_px as f64).round();
            let (dx, dy) = (lag.x as i64, lag.y as i64);
            let (mut product, mut square) = (0.0, 0.0);
            for y in lag_px as i64..h - lag_px as i64 {
                for x in lag_px as i64..w - lag_px as i64 {
                    let (a, b) = (y * w + x, (y + dy) * w + x + dx);
                    product += fine[a as usize] * fine[b as usize];
                    square += fine[a as usize] * fine[a as usize];
                }
            }
            product / square
        })
        .fold(-1.0, f64::max)
}
