//! Range errors of the whole scanner: pattern, rays, echoes and receiver.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use nemoral_lidar::{
    Beam, EchoObservation, Laser, Mid40, Pulse, PulseErrors, RangeModel, ReturnMode, ScanPattern,
    ScanRequest, Scanner, ScannerParams, SpinningPattern,
};
use nemoral_lidar_noise::{
    CombinedMeanError, LaconteDevice, LaconteForm, MeanError, RangeNoise, RangeNoiseSampler,
};
use nemoral_raycast::RayScene;
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{
    Card, LaserBand, LidarPoint, Material, MaterialLibrary, Mesh, Optics, PointFlags, Prototype,
    RigidTransform, Semantic,
};
use nemoral_seed::Key;

/// A plate: its centre, normal, half width and reflectance.
type Plate = (DVec3, DVec3, f64, f32);

fn plates(plates: &[Plate]) -> (RayScene, MaterialLibrary) {
    let mut materials = MaterialLibrary::new();
    let mut cards = Vec::new();
    for &(middle, normal, half_m, reflectance) in plates {
        let band = LaserBand {
            reflectance,
            transmittance: 0.0,
        };
        let material = materials.add(Material {
            optics: Optics {
                nm905: band,
                nm1550: band,
            },
            ..Material::plain(&format!("{reflectance}"), Semantic::Rock, Vec3::splat(0.4))
        });
        let (a, b) = normal.any_orthonormal_pair();
        cards.push(Card {
            corner: (middle - half_m * (a + b)).as_vec3(),
            edge_u: (2.0 * half_m * a).as_vec3(),
            edge_v: (2.0 * half_m * b).as_vec3(),
            material,
        });
    }
    let shape = Prototype::new("plates", Mesh::default(), cards, &materials).expect("sound");
    (RayScene::of_shape(Arc::new(shape), &materials), materials)
}

fn receiver(noise: RangeNoise) -> impl RangeModel {
    let sampler = RangeNoiseSampler::new(noise).expect("in range");
    move |o: &EchoObservation, key: Key| sampler.measure(o, &mut key.rng())
}

fn scan(
    pattern: Box<dyn ScanPattern>,
    pulses: u32,
    (forest, materials): &(RayScene, MaterialLibrary),
    noise: RangeNoise,
) -> Vec<LidarPoint> {
    let params = ScannerParams {
        max_range_m: 400.0,
        ..ScannerParams::default()
    };
    scan_by(params, pattern, pulses, (forest, materials), noise)
}

fn scan_by(
    params: ScannerParams,
    pattern: Box<dyn ScanPattern>,
    pulses: u32,
    (forest, materials): (&RayScene, &MaterialLibrary),
    noise: RangeNoise,
) -> Vec<LidarPoint> {
    let params = ScannerParams {
        pulses_per_scan: pulses,
        ..params
    };
    let scanner = Scanner::new(params, pattern).expect("in range");
    let still = |_: f64| RigidTransform::IDENTITY;
    scanner.scan(&ScanRequest {
        first_pulse: 0,
        caster: forest,
        materials,
        scene_from_lidar_at: &still,
        range_model: &receiver(noise),
        key: Key::world(11),
    })
}

/// A pulse straight ahead.
fn ahead(number: u64) -> Pulse {
    Pulse {
        time_s: number as f64 * 1e-5,
        direction: DVec3::X,
        ring: 0,
    }
}

/// A normal with this angle of incidence for beams along x.
fn tilted(incidence_deg: f64) -> DVec3 {
    let (sin, cos) = incidence_deg.to_radians().sin_cos();
    DVec3::new(-cos, 0.6 * sin, 0.8 * sin)
}

const N: u32 = 100_000;
const SIGMA_M: f64 = 0.01;

/// The biases are those of the published filter, computed outside of this project.
#[test]
fn the_mean_error_off_a_tilted_plane_is_the_published_one() {
    use LaconteDevice::{SickLms1xx, VelodyneHdl32e};
    for (device, range_m, incidence_deg, bias_m) in [
        (SickLms1xx, 10.0, 60.0, -0.009_146_833),
        (SickLms1xx, 20.0, 75.0, -0.064_841_498),
        (VelodyneHdl32e, 10.0, 80.0, -0.037_938_187),
    ] {
        let scene = plates(&[(DVec3::X * range_m, tilted(incidence_deg), 5.0, 0.5)]);
        let noise = RangeNoise::Laconte {
            device,
            form: LaconteForm::Waveform,
            sigma_m: SIGMA_M,
        };
        let points = scan(Box::new(ahead), N, &scene, noise);
        assert_eq!(points.len(), N as usize);
        let errors = points.iter().map(|p| f64::from(p.range_m) - range_m);
        let mean_m = errors.clone().sum::<f64>() / f64::from(N);
        let variance = errors.map(|e| (e - mean_m).powi(2)).sum::<f64>() / f64::from(N);
        let off = (mean_m - bias_m) / (SIGMA_M / f64::from(N).sqrt());
        println!("{device:?}: mean {mean_m:.6} m, published {bias_m} m: {off:.2} standard errors");
        assert!(off.abs() < 4.0, "{device:?}: {mean_m} {bias_m} {off}");
        // The standard error of a standard deviation is σ / √(2 n).
        let spread = variance.sqrt() / SIGMA_M - 1.0;
        assert!(spread.abs() < 4.0 / f64::from(2 * N).sqrt(), "{spread}");
    }
}

/// The mean error over a whole field of view, where each pulse has its own range and incidence.
#[test]
fn the_mean_error_over_a_field_of_view_is_the_models() {
    let (middle, normal) = (DVec3::X * 12.0, tilted(50.0));
    let scene = plates(&[(middle, normal, 60.0, 0.5)]);
    let points = scan(
        Box::new(Mid40),
        N,
        &scene,
        RangeNoise::Paper { sigma_m: SIGMA_M },
    );
    assert_eq!(points.len(), N as usize);
    let model = CombinedMeanError::default();
    let (mut sum_m, mut expected_m) = (0.0, 0.0);
    for p in &points {
        let direction = Mid40.pulse(p.pulse.into()).direction;
        let truth = EchoObservation {
            range_m: middle.dot(normal) / direction.dot(normal),
            incidence_cos: direction.dot(-normal),
            reflectance: 0.5,
        };
        sum_m += f64::from(p.range_m) - truth.range_m;
        expected_m += model.mean_error_m(&truth);
    }
    let off = (sum_m - expected_m) / (SIGMA_M * f64::from(N).sqrt());
    println!(
        "mean {:.6} m, model {:.6} m: {off:.2} standard errors",
        sum_m / f64::from(N),
        expected_m / f64::from(N)
    );
    assert!(off.abs() < 4.0, "{sum_m} {expected_m} {off}");
    assert!(
        (expected_m / f64::from(N)).abs() > 1e-3,
        "there is an error to find"
    );
}

/// The data sheet's ranges of 90, 127 and 255 m at 10, 20 and 80 % follow from one of them.
#[test]
fn the_ladder_of_ranges_holds_through_the_scanner() {
    let ladder = [(0.1, 90.0), (0.2, 127.3), (0.8, 254.6)];
    let steps: Vec<(f32, f64, bool)> = ladder
        .iter()
        .flat_map(|&(reflectance, range_m)| {
            [(-0.2, true), (0.2, false)].map(|(d, seen)| (reflectance, range_m + d, seen))
        })
        .collect();
    let direction = |i: usize| DVec3::new(1.0, 0.2 * (i as f64 - 2.5), 0.1).normalize();
    let all: Vec<Plate> = (0..)
        .zip(&steps)
        .map(|(i, s)| (direction(i) * s.1, -direction(i), 1.0, s.0))
        .collect();
    let scene = plates(&all);
    let raster = move |n: u64| Pulse {
        direction: direction(n as usize % 6),
        ..ahead(n)
    };
    let rounds = 200;
    let points = scan(Box::new(raster), 6 * rounds, &scene, RangeNoise::livox());
    for (i, (reflectance, range_m, seen)) in (0..).zip(steps) {
        let returns = points.iter().filter(|p| p.pulse % 6 == i).count();
        let expected = if seen { rounds as usize } else { 0 };
        assert_eq!(returns, expected, "{reflectance} at {range_m} m");
    }
}

/// The errors of each pulse are its own, with all errors enabled: one more laser changes no other
/// pulse.
#[test]
fn one_more_laser_changes_no_other_pulse() {
    let errors = PulseErrors {
        angular_sigma_rad: 2e-3,
        range_step_m: 0.001,
        dropout: 0.1,
        false_alarm: 0.3,
        intensity_at_threshold: 0.27,
        reflectance_spread: 0.1,
    };
    let all = ScannerParams {
        max_range_m: 9.0,
        beam: Beam {
            horizontal_fwhm_rad: 0.02,
            vertical_fwhm_rad: 0.02,
            rings: 1,
            resolution_m: 0.02,
            exit_m: 0.01,
        },
        returns: ReturnMode::All(4),
        errors,
        ..ScannerParams::default()
    };
    let ten = one_more_laser(&all);
    let flagged = |flag: u8| ten.iter().filter(|p| p.flags.0 & flag != 0).count();
    assert!(flagged(PointFlags::FALSE_ALARM) > 20, "false alarms");
    assert!(ten.iter().filter(|p| p.return_number == 2).count() > 20);
    let mut pulses: Vec<u32> = ten.iter().map(|p| p.pulse).collect();
    pulses.dedup();
    assert!(pulses.len() < 3400, "pulses are lost: {}", pulses.len());

    let ten = one_more_laser(&ScannerParams {
        max_range_m: 400.0,
        ..ScannerParams::default()
    });
    assert_eq!(ten.len(), 3600);
    // Errors differ between pulses of a laser, and between lasers.
    let errors_m = |ring: u8| -> Vec<f32> {
        let of_ring = ten.iter().filter(|p| p.ring == ring);
        of_ring.map(|p| p.range_m - p.true_range_m).collect()
    };
    assert_ne!(errors_m(3), errors_m(4));
    assert_ne!(errors_m(3)[0], errors_m(3)[1]);
}

/// The points of a turn of ten lasers, after asserting that they are the same with one more laser
/// on top or between them.
fn one_more_laser(params: &ScannerParams) -> Vec<LidarPoint> {
    let laser = |ring: u8| Laser {
        elevation_rad: f64::from(ring) * 0.02 - 0.1,
        azimuth_rad: 0.0,
        delay_s: f64::from(ring) * 2e-6,
        ring,
    };
    let (columns, rotation_hz) = (360.0, 10.0);
    let sequence_s = 1.0 / (columns * rotation_hz);
    let turn = |lasers: Vec<Laser>| {
        let pulses = lasers.len() as u32 * columns as u32;
        let head = SpinningPattern::new(lasers, sequence_s, rotation_hz).expect("in range");
        let walls: Vec<Plate> = (0..4)
            .map(|i| {
                let (sin, cos) = (f64::from(i) * FRAC_PI_2).sin_cos();
                let ahead = DVec3::new(cos, sin, 0.0);
                // The plates overlap at the corners.
                (8.0 * ahead, -ahead, 9.0, 0.5)
            })
            .collect();
        let (forest, materials) = plates(&walls);
        let noise = RangeNoise::default();
        scan_by(
            *params,
            Box::new(head),
            pulses,
            (&forest, &materials),
            noise,
        )
    };
    let ten = turn((0..10).map(laser).collect());
    // All fields but the number of the pulse are compared.
    let bytes = |p: &LidarPoint| format!("{:?}", LidarPoint { pulse: 0, ..*p });
    let expected: Vec<_> = ten.iter().map(bytes).collect();
    // The further laser is on top, where it fires last, or in the middle, where it fires between
    // the others.
    for extra in [
        laser(10),
        Laser {
            delay_s: 7e-6,
            ..laser(10)
        },
    ] {
        let eleven = turn((0..10).map(laser).chain([extra]).collect());
        assert!(eleven.iter().any(|p| p.ring == 10));
        let others: Vec<_> = eleven.iter().filter(|p| p.ring != 10).map(bytes).collect();
        assert!(others == expected, "the laser more changed another");
    }
    ten
}
