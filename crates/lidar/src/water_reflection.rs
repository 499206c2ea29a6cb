//! Echoes by way of smooth water: what a pulse meets after the surface of a liquid has mirrored it.

use nemoral_scene::glam::Vec3;
use nemoral_scene::{Liquid, MaterialLibrary, Ray, RayCaster, SurfaceHit};

/// Ripples whose slopes have this root mean square scatter a mirrored beam to 1 / e of its echo.
const CALM_SLOPE: f64 = 0.03;

/// A mirrored echo with less than this share of the light of what was met is lost in the noise of
/// every receiver.
const LEAST_SHARE: f64 = 1e-4;

/// What a ray met after the surface of a liquid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mirrored {
    /// The number of the ray in its batch.
    pub(crate) ray: usize,
    /// The mirrored ray.
    pub(crate) path: Ray,
    /// What it met.
    pub(crate) met: SurfaceHit,
    /// The way from the sensor to the surface and on to what was met, metres.
    pub(crate) range_m: f64,
    /// The share of the light that comes back, if all that is met does: it is mirrored twice.
    pub(crate) share: f64,
    /// The normal of the liquid's surface, towards the sensor.
    pub(crate) normal: Vec3,
}

/// What the rays of a batch met after surfaces of liquids, in the order of rays. Another surface of
/// a liquid mirrors no further, and rough ones mirror nothing that would be seen.
pub(crate) fn mirrored(
    rays: &[Ray],
    hits: &[Option<SurfaceHit>],
    caster: &dyn RayCaster,
    materials: &MaterialLibrary,
    (min_range_m, max_range_m): (f32, f32),
) -> Vec<Mirrored> {
    let mut on_liquids: Vec<OnLiquid> = Vec::new();
    for (i, (ray, hit)) in rays.iter().zip(hits).enumerate() {
        let Some(hit) = hit.filter(|hit| hit.distance_m >= min_range_m) else {
            continue;
        };
        let Some(liquid) = &materials.get(hit.material).liquid else {
            continue;
        };
        let (path, normal) = reflected(ray, &hit, max_range_m);
        let once = f64::from(liquid.mirrored(-normal.dot(ray.direction))) * calm(liquid);
        if once * once > LEAST_SHARE {
            on_liquids.push(OnLiquid {
                ray: i,
                path,
                normal,
                distance_m: hit.distance_m,
                share: once * once,
            });
        }
    }
    if on_liquids.is_empty() {
        return Vec::new();
    }
    let paths: Vec<Ray> = on_liquids.iter().map(|of| of.path).collect();
    let mut met = vec![None; paths.len()];
    caster.closest_surfaces(&paths, &mut met);
    let echo = |(of, met): (OnLiquid, Option<SurfaceHit>)| {
        let met = met?;
        Some(Mirrored {
            ray: of.ray,
            path: of.path,
            met,
            range_m: f64::from(of.distance_m) + f64::from(met.distance_m),
            share: of.share,
            normal: of.normal,
        })
    };
    on_liquids.into_iter().zip(met).filter_map(echo).collect()
}

/// A ray that met the surface of a liquid.
struct OnLiquid {
    /// The number of the ray in its batch.
    ray: usize,
    /// The mirrored ray.
    path: Ray,
    /// The normal of the surface, towards the sensor.
    normal: Vec3,
    /// The way to the surface, metres.
    distance_m: f32,
    /// The share of light that is left after the surface has mirrored it twice.
    share: f64,
}

/// A ray mirrored where it hit a surface, and the surface's normal towards its origin.
fn reflected(ray: &Ray, hit: &SurfaceHit, max_range_m: f32) -> (Ray, Vec3) {
    let facing = hit.geometric_normal.dot(ray.direction);
    let normal = if facing > 0.0 {
        -hit.geometric_normal
    } else {
        hit.geometric_normal
    };
    let point = ray.at(hit.distance_m);
    // The origin is off the surface by more than the rounding of distance and coordinates.
    let offset = 1e-4 * (1.0 + hit.distance_m) + 2e-6 * point.abs().max_element();
    let path = Ray {
        origin: point,
        direction: ray.direction - normal * (2.0 * normal.dot(ray.direction)),
        t_min_m: offset,
        t_max_m: max_range_m - hit.distance_m,
    };
    (path, normal)
}

/// The share of the mirrored light that ripples leave in the beam.
fn calm(liquid: &Liquid) -> f64 {
    let share = f64::from(liquid.ripple_slope) / CALM_SLOPE;
    libm::exp(-share * share)
}

impl Mirrored {
    /// A direction at what was met as it seems from the sensor: in the mirror image.
    pub(crate) fn image(&self, v: Vec3) -> Vec3 {
        v - self.normal * (2.0 * self.normal.dot(v))
    }
}
