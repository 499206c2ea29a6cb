//! Labels and ranges of the echoes of wide beams: many surfaces in one beam, and one surface that
//! slants away.

use nemoral_lidar::{
    Beam, EchoObservation, ExactRange, Pulse, RangeModel, ReturnMode, ScanRequest, Scanner,
    ScannerParams,
};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{
    ChunkCoord, Hit, LidarPoint, Material, MaterialId, MaterialLibrary, ObjectId, PointFlags, Ray,
    RayCaster, RigidTransform, Semantic,
};
use nemoral_seed::Key;

/// Materials by their numbers: two leaves and a stem that are as bright, and the ground.
const SEMANTICS: [Semantic; 4] = [
    Semantic::Leaf,
    Semantic::Stem,
    Semantic::Leaf,
    Semantic::Litter,
];
const REFLECTANCE: f64 = 0.5;

fn materials() -> MaterialLibrary {
    let mut library = MaterialLibrary::new();
    for semantic in SEMANTICS {
        let mut material = Material::plain("one", semantic, Vec3::splat(0.2));
        material.optics.nm905.reflectance = REFLECTANCE as f32;
        library.add(material);
    }
    library
}

fn object(item: u16) -> ObjectId {
    ObjectId::new(ChunkCoord::new(0, 0), item).expect("in range")
}

/// The points of pulses in these directions, from a height above the origin.
fn scan(
    params: ScannerParams,
    directions: Vec<DVec3>,
    height_m: f64,
    caster: &dyn RayCaster,
    range_model: &dyn RangeModel,
) -> Vec<LidarPoint> {
    let params = ScannerParams {
        pulses_per_scan: directions.len() as u32,
        returns: ReturnMode::All(15),
        ..params
    };
    let pattern = move |number: u64| Pulse {
        time_s: number as f64 * 1e-5,
        direction: directions[number as usize % directions.len()],
        ring: 0,
    };
    let pose = RigidTransform {
        translation_m: DVec3::Z * height_m,
        ..RigidTransform::IDENTITY
    };
    let scanner = Scanner::new(params, Box::new(pattern)).expect("valid");
    scanner.scan(&ScanRequest {
        first_pulse: 0,
        caster,
        materials: &materials(),
        scene_from_lidar_at: &|_| pose,
        range_model,
        key: Key::world(7),
    })
}

/// Walls side by side: the second one in the middle, `half` wide to each side at 1 m.
struct Bands {
    half: f32,
    ranges_m: [f32; 3],
}

impl RayCaster for Bands {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let aside = ray.direction.y / ray.direction.x;
        let band = u16::from(aside >= -self.half) + u16::from(aside > self.half);
        let range_m = self.ranges_m[usize::from(band)] / ray.direction.x;
        let hit = Hit::new(range_m, Vec3::NEG_X, MaterialId(band)).with_object(object(band + 1));
        ray.reaches(range_m).then_some(hit)
    }
}

/// Standard deviation of the beam, which is round, radians.
const SIGMA_RAD: f64 = 0.008;

fn fine_beam() -> ScannerParams {
    ScannerParams {
        beam: Beam {
            horizontal_fwhm_rad: SIGMA_RAD * 2.354_820_045,
            vertical_fwhm_rad: SIGMA_RAD * 2.354_820_045,
            rings: 8,
            ..Beam::default()
        },
        ..ScannerParams::default()
    }
}

/// The stem has the brightest sub-ray, that of the middle, but leaves on both sides have most of
/// the light: 53 % of what is within two standard deviations. The nearer leaf has more of it.
#[test]
fn the_label_is_what_gave_most_of_the_light() {
    for (half_sigmas, expected) in [(0.5, (Semantic::Leaf, 1)), (1.0, (Semantic::Stem, 2))] {
        let bands = Bands {
            half: (half_sigmas * SIGMA_RAD) as f32,
            ranges_m: [8.0, 8.1, 8.2],
        };
        let points = scan(fine_beam(), vec![DVec3::X], 0.0, &bands, &ExactRange);
        assert_eq!(points.len(), 1);
        let p = &points[0];
        assert_eq!((p.semantic, p.object.item()), expected, "{half_sigmas}");
        assert!(p.flags.has(PointFlags::MIXED));
        assert!((p.range_m - 8.1).abs() < 0.01, "{}", p.range_m);
    }
    // The far leaf, if it is the wider one.
    let aside = DVec3::new(1.0, 0.3 * SIGMA_RAD, 0.0).normalize();
    let bands = Bands {
        half: (0.4 * SIGMA_RAD) as f32,
        ranges_m: [8.0, 8.1, 8.2],
    };
    let points = scan(fine_beam(), vec![aside], 0.0, &bands, &ExactRange);
    assert_eq!(
        (points[0].semantic, points[0].object.item()),
        (Semantic::Leaf, 3)
    );
}

/// The level ground.
struct Floor;

impl RayCaster for Floor {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let range_m = -ray.origin.z / ray.direction.z;
        let hit = Hit::new(range_m, Vec3::Z, MaterialId(3));
        ray.reaches(range_m).then_some(hit)
    }
}

/// Height of the scanner above the ground, metres.
const HEIGHT_M: f64 = 1.35;

/// The direction to the ground at a range.
fn to_ground(range_m: f64) -> DVec3 {
    let down = HEIGHT_M / range_m;
    DVec3::new((1.0 - down * down).sqrt(), 0.0, -down)
}

fn of_width(wide_deg: f64, tall_deg: f64, resolution_m: f64) -> ScannerParams {
    ScannerParams {
        beam: Beam {
            horizontal_fwhm_rad: wide_deg.to_radians(),
            vertical_fwhm_rad: tall_deg.to_radians(),
            rings: 2,
            resolution_m,
            ..Beam::default()
        },
        ..ScannerParams::default()
    }
}

/// The footprint of a beam on the ground is metres long at 20 m: the receiver sees one long echo,
/// whose middle is where the beam's is.
#[test]
fn the_ground_is_one_echo_however_it_slants() {
    for params in [
        of_width(0.03, 0.28, 0.6),
        of_width(0.35, 0.35, 0.75),
        of_width(0.18, 0.18, 0.75),
    ] {
        let ranges_m: Vec<f64> = (6..=88).map(|i| 0.25 * f64::from(i)).collect();
        let directions = ranges_m.iter().map(|m| to_ground(*m)).collect();
        let points = scan(params, directions, HEIGHT_M, &Floor, &ExactRange);
        assert_eq!(points.len(), ranges_m.len(), "{:?}", params.beam);
        for (p, range_m) in points.iter().zip(ranges_m) {
            let error_m = f64::from(p.range_m) - range_m;
            assert!((-0.06..0.001).contains(&error_m), "{range_m}: {error_m}");
            assert!(!p.flags.has(PointFlags::MIXED), "{range_m}");
            let sent_back = REFLECTANCE * HEIGHT_M / range_m;
            assert!((f64::from(p.intensity) / sent_back - 1.0).abs() < 0.01);
        }
    }
}

/// What the receiver compares with its threshold is the greatest power that comes back at once, in
/// a pulse of 0.6 m. Its model measures that as a range here.
#[test]
fn a_long_echo_is_as_weak_as_its_strongest_moment() {
    let strength = |o: &EchoObservation, _: Key| Some(o.reflectance * o.incidence_cos);
    let params = of_width(0.03, 0.28, 0.6);
    let ranges_m = [5.0, 10.0, 15.0, 18.0, 20.0, 22.0];
    let directions = ranges_m.iter().map(|m| to_ground(*m)).collect();
    let points = scan(params, directions, HEIGHT_M, &Floor, &strength);
    for (p, range_m) in points.iter().zip(ranges_m) {
        let share = p.range_m / p.intensity;
        // The footprint is a Gaussian on the ground, and the pulse another; their sum is as wide as
        // both squared.
        let footprint_m = 0.28_f64.to_radians() * range_m * range_m / HEIGHT_M;
        let expected = if range_m > 12.0 {
            0.6 / f64::hypot(0.6, footprint_m)
        } else {
            1.0
        };
        let within = if range_m > 12.0 { 0.1 } else { 1e-6 };
        assert!(
            (f64::from(share) - expected).abs() < within,
            "{range_m}: {share} {expected}"
        );
    }
}

/// Two walls, seen half and half, are one surface up to the length of the pulse, and two beyond.
#[test]
fn walls_merge_up_to_the_resolution() {
    for (apart_m, echoes) in [(0.4, 1), (0.59, 1), (0.61, 2), (0.7, 2), (3.0, 2)] {
        let bands = Bands {
            half: 0.0,
            ranges_m: [10.0, 10.0, 10.0 + apart_m],
        };
        let points = scan(fine_beam(), vec![DVec3::X], 0.0, &bands, &ExactRange);
        assert_eq!(points.len(), echoes, "{apart_m}");
    }
}

/// A beam that does not widen is as wide as its exit at any range: it meets both walls of a step
/// while the step is within the outermost ring of sub-rays.
#[test]
fn a_beam_that_leaves_wide_meets_what_is_beside_its_middle() {
    /// A wall at 5 m before another at 5.3 m, from a place to the left on.
    struct Edge;
    impl RayCaster for Edge {
        fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
            let is_near = ray.at(5.0).y > 0.05;
            let range_m = if is_near { 5.0 } else { 5.3 } / ray.direction.x;
            let material = MaterialId(u16::from(is_near));
            ray.reaches(range_m)
                .then(|| Hit::new(range_m, Vec3::NEG_X, material))
        }
    }
    let at_edge = |exit_m| {
        let params = ScannerParams {
            beam: Beam {
                rings: 3,
                exit_m,
                ..Beam::default()
            },
            ..ScannerParams::default()
        };
        // Every tenth of a millimetre from the edge, at 5 m.
        let off_m = |i: i32| 1e-4 * (f64::from(i) + 0.5);
        let steps = -100..100;
        let aim = |i| DVec3::new(5.0, 0.05 + off_m(i), 0.0).normalize();
        let directions = steps.clone().map(aim).collect();
        let points = scan(params, directions, 0.0, &Edge, &ExactRange);
        let mixed = steps
            .zip(&points)
            .filter(|(_, p)| p.flags.has(PointFlags::MIXED));
        mixed.map(|(i, _)| off_m(i).abs()).collect::<Vec<f64>>()
    };
    // 10 mm out to 1/e² are 4 σ; the outermost ring is at 6/7 of 2 σ, with a ray each 20° from 10°
    // on.
    let reach_m = 0.005 * 6.0 / 7.0 * 10_f64.to_radians().cos();
    let mixed_m = at_edge(0.01);
    let widest_m = mixed_m.iter().copied().fold(0.0, f64::max);
    assert!((widest_m - reach_m).abs() < 1e-4, "{widest_m} {reach_m}");
    assert!((mixed_m.len() as f64 * 1e-4 - 2.0 * reach_m).abs() < 3e-4);
    assert!(at_edge(0.0).is_empty());
}

/// All sub-rays of a wide beam meet the same ground, which is no mixture.
#[test]
fn a_surface_is_pure_in_a_beam_that_leaves_wide() {
    let mut params = of_width(0.01, 0.01, 0.6);
    params.beam.exit_m = 0.1;
    // At 30° and more above the ground.
    let directions: Vec<DVec3> = (0..50)
        .map(|i| to_ground(1.4 + 0.025 * f64::from(i)))
        .collect();
    let points = scan(params, directions.clone(), HEIGHT_M, &Floor, &ExactRange);
    assert_eq!(points.len(), directions.len());
    for (p, direction) in points.iter().zip(directions) {
        assert!(!p.flags.has(PointFlags::MIXED), "{direction}");
        let range_m = HEIGHT_M / -direction.z;
        assert!(
            (f64::from(p.range_m) - range_m).abs() < 5e-3,
            "{}",
            p.range_m
        );
    }
}
