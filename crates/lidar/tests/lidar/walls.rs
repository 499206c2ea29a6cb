//! Two walls with known answers, and scanners that look at them.

use nemoral_lidar::{
    Beam, ExactRange, RepeatingLines, RepeatingLinesParams, ReturnMode, ScanRequest, Scanner,
    ScannerParams,
};
use nemoral_scene::glam::Vec3;
use nemoral_scene::{
    ChunkCoord, Hit, LidarPoint, Material, MaterialId, MaterialLibrary, ObjectId, Ray, RayCaster,
    RigidTransform, Semantic,
};
use nemoral_seed::{Domain, Key};

pub(crate) const KEY: Key = Key::world(7).domain(Domain::new("lidar.beams"));

pub(crate) fn materials() -> MaterialLibrary {
    let mut library = MaterialLibrary::new();
    for (name, semantic, reflectance) in [
        ("near", Semantic::Leaf, 0.5),
        ("far", Semantic::Stem, 0.5),
        ("sky", Semantic::Rock, 0.0),
    ] {
        let mut material = Material::plain(name, semantic, Vec3::splat(0.2));
        material.optics.nm905.reflectance = reflectance;
        library.add(material);
    }
    library
}

fn hit(ray: &Ray, distance_m: f32, material: u16) -> Option<Hit> {
    let object = ObjectId::new(ChunkCoord::new(0, 0), material + 1).expect("in range");
    (distance_m <= ray.t_max_m)
        .then(|| Hit::new(distance_m, Vec3::NEG_X, MaterialId(material)).with_object(object))
}

/// A wall at x = `far`; before it, where y > 0, another at x = `near`.
pub(crate) struct Step {
    pub(crate) near: f32,
    pub(crate) far: f32,
}

impl RayCaster for Step {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let at = |x: f32| (x - ray.origin.x) / ray.direction.x;
        if ray.direction.x <= 0.0 {
            return None;
        }
        let near = at(self.near);
        if near * ray.direction.y + ray.origin.y > 0.0 {
            hit(ray, near, 0)
        } else {
            hit(ray, at(self.far), 1)
        }
    }
}

/// An empty world.
pub(crate) struct Void;

impl RayCaster for Void {
    fn closest_hit(&self, _: &Ray) -> Option<Hit> {
        None
    }
}

/// 30° to each side, so that no light is grazing.
pub(crate) fn ahead() -> RepeatingLines {
    RepeatingLines::new(RepeatingLinesParams {
        horizontal_fov_rad: std::f64::consts::FRAC_PI_3,
        ..RepeatingLinesParams::default()
    })
    .expect("valid")
}

pub(crate) fn wide() -> Beam {
    Beam {
        horizontal_fwhm_rad: 0.02,
        vertical_fwhm_rad: 0.002,
        rings: 3,
        ..Beam::default()
    }
}

pub(crate) fn scan_with(params: ScannerParams, caster: &dyn RayCaster) -> Vec<LidarPoint> {
    let scanner = Scanner::new(params, Box::new(ahead())).expect("valid");
    let still = |_: f64| RigidTransform::IDENTITY;
    scanner.scan(&ScanRequest {
        first_pulse: 0,
        caster,
        materials: &materials(),
        scene_from_lidar_at: &still,
        range_model: &ExactRange,
        key: KEY,
    })
}

pub(crate) fn params(beam: Beam, returns: ReturnMode) -> ScannerParams {
    ScannerParams {
        pulses_per_scan: 30_000,
        beam,
        returns,
        ..ScannerParams::default()
    }
}
