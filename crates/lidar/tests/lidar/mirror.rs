//! Echoes by way of still water, against closed forms.

use nemoral_lidar::{
    Beam, EchoObservation, ExactRange, Pulse, RangeModel, RepeatingLines, RepeatingLinesParams,
    ReturnMode, ScanRequest, Scanner, ScannerParams,
};
use nemoral_scene::glam::{DQuat, DVec3, Vec3};
use nemoral_scene::{
    ChunkCoord, Hit, LidarPoint, Liquid, Material, MaterialId, MaterialLibrary, ObjectId,
    PointFlags, Ray, RayCaster, RigidTransform, Semantic,
};
use nemoral_seed::{Domain, Key};

const KEY: Key = Key::world(7).domain(Domain::new("lidar.mirror"));

/// Height of the LiDAR above the water, and its distance from the wall, metres.
const HEIGHT_M: f64 = 1.2;
const WALL_M: f64 = 9.0;
const WALL_REFLECTANCE: f64 = 0.4;

/// Water, and the wall on its far side.
fn materials(slope: f32) -> MaterialLibrary {
    let mut library = MaterialLibrary::new();
    let mut water = Material::plain("water", Semantic::Water, Vec3::splat(0.01));
    water.optics.nm905.reflectance = 0.002;
    water.liquid = Some(Liquid {
        refractive_index: 1.33,
        absorption_per_m: Vec3::ONE,
        ripple_slope: slope,
        ripple_m: 0.5,
    });
    library.add(water);
    let mut wall = Material::plain("wall", Semantic::Stem, Vec3::splat(0.2));
    wall.optics.nm905.reflectance = WALL_REFLECTANCE as f32;
    library.add(wall);
    library
}

/// Water at height 0 up to a wall.
struct Shore;

impl RayCaster for Shore {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let object = ObjectId::new(ChunkCoord::new(0, 0), 1).expect("in range");
        let water = -ray.origin.z / ray.direction.z;
        let wall = (WALL_M as f32 - ray.origin.x) / ray.direction.x;
        let water = ray
            .reaches(water)
            .then(|| Hit::new(water, Vec3::Z, MaterialId(0)));
        let wall = ray
            .reaches(wall)
            .then(|| Hit::new(wall, Vec3::NEG_X, MaterialId(1)).with_object(object));
        let nearer = |a: Hit, b: Hit| {
            if a.surface.distance_m <= b.surface.distance_m {
                a
            } else {
                b
            }
        };
        match (water, wall) {
            (Some(a), Some(b)) => Some(nearer(a, b)),
            (a, b) => a.or(b),
        }
    }
}

/// A scan from above the water, with the direction of each pulse.
fn scan(slope: f32, returns: ReturnMode, beam: Beam) -> Vec<(DVec3, LidarPoint)> {
    let pattern = RepeatingLines::new(RepeatingLinesParams {
        horizontal_fov_rad: 1.0,
        bottom_rad: -0.6,
        top_rad: 0.1,
        ..RepeatingLinesParams::default()
    })
    .expect("valid");
    let params = ScannerParams {
        pulses_per_scan: 4000,
        returns,
        beam,
        ..ScannerParams::default()
    };
    let scanner = Scanner::new(params, Box::new(pattern)).expect("valid");
    let pose = RigidTransform {
        rotation: DQuat::IDENTITY,
        translation_m: DVec3::Z * HEIGHT_M,
    };
    let points = scanner.scan(&ScanRequest {
        first_pulse: 0,
        caster: &Shore,
        materials: &materials(slope),
        scene_from_lidar_at: &|_| pose,
        range_model: &ExactRange,
        key: KEY,
    });
    let pulses: Vec<DVec3> = scanner.pulses(0).map(|p| p.direction).collect();
    points
        .into_iter()
        .map(|point| (pulses[point.pulse as usize], point))
        .collect()
}

/// Fresnel's share of unpolarised light at an angle by its cosine, by Snell's law and sines and
/// tangents of the two angles.
fn fresnel(cos: f64) -> f64 {
    let one = cos.acos();
    let other = (one.sin() / 1.33).asin();
    let across = (one - other).sin() / (one + other).sin();
    let along = (one - other).tan() / (one + other).tan();
    0.5 * (across * across + along * along)
}

#[test]
fn an_echo_of_the_mirror_image_has_the_range_of_the_whole_path() {
    let (mut mirrored, mut of_water) = (0, 0);
    for (d, p) in scan(0.0, ReturnMode::All(4), Beam::default()) {
        let on_water_m = -HEIGHT_M / d.z;
        let hits_water = d.z < 0.0 && on_water_m * d.x < WALL_M;
        if !p.flags.has(PointFlags::MIRRORED) {
            assert_eq!(p.semantic == Semantic::Water, hits_water);
            of_water += u32::from(hits_water);
            continue;
        }
        assert!(hits_water);
        mirrored += 1;
        // The mirror image of the wall is where the pulse would meet it under water.
        let range_m = WALL_M / d.x;
        assert!((f64::from(p.true_range_m) - range_m).abs() < 2e-4);
        let expected = d * range_m;
        assert!((p.position_m.as_dvec3() - expected).length() < 2e-3);
        assert!(f64::from(p.position_m.z) < -HEIGHT_M);
        assert_eq!((p.semantic, p.object.item()), (Semantic::Stem, 1));
        assert!((f64::from(p.incidence_cos) - d.x).abs() < 1e-5);
        assert!((p.normal - Vec3::NEG_X).length() < 1e-5);
        let once = fresnel(-d.z);
        let sent_back = once * once * WALL_REFLECTANCE * d.x;
        assert!((f64::from(p.intensity) - sent_back).abs() < 1e-3 * sent_back.max(1e-3));
        assert!(!p.flags.has(PointFlags::MIXED));
    }
    assert!(
        mirrored > 1000 && of_water >= mirrored,
        "{mirrored} {of_water}"
    );
}

#[test]
fn the_strongest_is_the_wall_where_light_grazes_the_water() {
    let strongest = scan(0.0, ReturnMode::Strongest, Beam::default());
    let by = |steep: bool| {
        let of = |(d, p): &&(DVec3, LidarPoint)| {
            let hits_water = d.z < 0.0 && -HEIGHT_M / d.z * d.x < WALL_M;
            hits_water && (d.z < -0.32) == steep && p.returns == 1
        };
        let all: Vec<_> = strongest.iter().filter(of).collect();
        let mirrored = all
            .iter()
            .filter(|(_, p)| p.flags.has(PointFlags::MIRRORED));
        mirrored.count() as f64 / all.len() as f64
    };
    // At 19 degrees the water mirrors 0.4, twice; its own echo is the stronger one from above.
    assert!(by(false) > 0.99, "{}", by(false));
    assert!(by(true) < 1.0);
}

#[test]
fn rough_water_scatters_the_mirrored_beam() {
    let mirrored = |slope| {
        let points = scan(slope, ReturnMode::All(4), Beam::default());
        let mirrored = points
            .iter()
            .filter(|(_, p)| p.flags.has(PointFlags::MIRRORED));
        mirrored.map(|(_, p)| f64::from(p.intensity)).sum::<f64>()
    };
    let (still, calm, rough) = (mirrored(0.0), mirrored(0.01), mirrored(0.1));
    assert!(calm < still && calm > 0.7 * still, "{still} {calm}");
    // A stream has no echoes under water at all.
    assert_eq!(rough, 0.0);
    let points = scan(0.1, ReturnMode::Last, Beam::default());
    assert!(
        points
            .iter()
            .all(|(_, p)| p.position_m.z > -1e-3 - HEIGHT_M as f32)
    );
}

/// Pulses from 30 m above the water, each a tenth of a degree farther off straight down.
#[test]
fn water_glints_where_its_ripples_face_the_scanner() {
    const ABOVE_M: f64 = 30.0;
    let aside = |number: u64| f64::to_radians(0.1 * number as f64);
    let pattern = move |number: u64| Pulse {
        time_s: number as f64 * 1e-5,
        direction: DVec3::new(0.0, aside(number).sin(), -aside(number).cos()),
        ring: 0,
    };
    let seen = |slope: f32, range_model: &dyn RangeModel| {
        let params = ScannerParams {
            pulses_per_scan: 300,
            ..ScannerParams::default()
        };
        let scanner = Scanner::new(params, Box::new(pattern)).expect("valid");
        let pose = RigidTransform {
            rotation: DQuat::IDENTITY,
            translation_m: DVec3::Z * ABOVE_M,
        };
        scanner.scan(&ScanRequest {
            first_pulse: 0,
            caster: &Shore,
            materials: &materials(slope),
            scene_from_lidar_at: &|_| pose,
            range_model,
            key: KEY,
        })
    };
    for slope in [0.1_f32, 0.02] {
        let points = seen(slope, &ExactRange);
        assert_eq!(points.len(), 300);
        let variance = f64::from(slope).powi(2);
        for p in &points {
            let angle = aside(p.pulse.into());
            let (cos, tan) = (angle.cos(), angle.tan());
            let facets = (-tan * tan / variance).exp() / (4.0 * variance * cos.powi(5));
            let sent_back = 0.002 * cos + fresnel(1e-6_f64.cos()) * facets;
            let found = f64::from(p.intensity);
            assert!(
                (found / sent_back - 1.0).abs() < 1e-3,
                "{angle}: {found} {sent_back}"
            );
            assert!(p.semantic == Semantic::Water && p.flags == PointFlags::default());
        }
    }
    // A scanner that sees 10 % at 90 m sees what sends back 1.1 % from here: a stream as far as 11
    // degrees off straight down, a pond as far as 1 degree.
    let livox = |o: &EchoObservation, _: Key| {
        let power = o.reflectance * o.incidence_cos / (o.range_m * o.range_m);
        (power >= 0.1 / (90.0 * 90.0)).then_some(o.range_m)
    };
    let widest_deg = |slope: f32| 0.1 * seen(slope, &livox).len() as f64;
    let (stream, pond) = (widest_deg(0.1), widest_deg(0.006));
    assert!(
        (11.0..11.8).contains(&stream) && (0.9..1.3).contains(&pond),
        "{stream} {pond}"
    );
}

#[test]
fn wide_beams_mix_what_is_mirrored_with_what_is_not() {
    let beam = Beam {
        horizontal_fwhm_rad: 0.01,
        vertical_fwhm_rad: 0.01,
        rings: 3,
        ..Beam::default()
    };
    let points = scan(0.0, ReturnMode::All(4), beam);
    let has = |flags: u8| {
        points
            .iter()
            .filter(|(_, p)| p.flags.0 & flags == flags)
            .count()
    };
    assert!(has(PointFlags::MIRRORED) > 500);
    // Where the water ends at the wall, the same echo has light of both.
    assert!(has(PointFlags::MIRRORED | PointFlags::MIXED) > 10);
}

#[test]
fn value_stability() {
    let points = scan(0.0, ReturnMode::All(4), Beam::default());
    let mirrored: Vec<_> = points
        .iter()
        .filter(|(_, p)| p.flags.has(PointFlags::MIRRORED))
        .map(|(_, p)| (p.pulse, (1e3 * p.true_range_m).round() as u32))
        .collect();
    let middle = mirrored[mirrored.len() / 2];
    assert_eq!((mirrored.len(), middle), (2750, (2000, 12_015)));
}
