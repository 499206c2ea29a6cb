//! Errors of intensity, and reflectances that differ between objects.

use nemoral_lidar::{
    AirParams, Beam, Device, EchoObservation, Pulse, PulseErrors, ReturnMode, ScanRequest, Scanner,
    ScannerParams, Wavelength,
};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{
    ChunkCoord, Hit, LidarPoint, Material, MaterialId, MaterialLibrary, ObjectId, Ray, RayCaster,
    RigidTransform, Semantic,
};
use nemoral_seed::{Domain, Draw, Key};

const REFLECTANCE: f64 = 0.4;

/// A trunk's half of a wall, and a rock's half 5 m behind it.
struct Halves {
    near_m: f32,
}

impl RayCaster for Halves {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let is_far = ray.direction.y < 0.0;
        let range_m = self.near_m + if is_far { 5.0 } else { 0.0 };
        let object = ObjectId::new(ChunkCoord::new(2, 1), 1 + u16::from(is_far)).expect("fits");
        ray.reaches(range_m).then(|| {
            Hit::new(range_m, -ray.direction, MaterialId(u16::from(is_far))).with_object(object)
        })
    }
}

fn materials() -> MaterialLibrary {
    let mut library = MaterialLibrary::new();
    for (name, semantic) in [("bark", Semantic::Stem), ("granite", Semantic::Rock)] {
        let mut material = Material::plain(name, semantic, Vec3::splat(0.2));
        material.optics.nm905.reflectance = REFLECTANCE as f32;
        library.add(material);
    }
    library
}

/// Ahead, with an edge between both halves in the middle of the beam.
fn ahead(number: u64) -> Pulse {
    Pulse {
        time_s: number as f64 * 1e-5,
        direction: DVec3::X,
        ring: 0,
    }
}

fn wide(errors: PulseErrors) -> ScannerParams {
    ScannerParams {
        pulses_per_scan: 20_000,
        returns: ReturnMode::All(4),
        beam: Beam {
            horizontal_fwhm_rad: 0.001,
            vertical_fwhm_rad: 0.001,
            rings: 2,
            ..Beam::default()
        },
        errors,
        ..ScannerParams::default()
    }
}

/// Measures with an error, and sees nine echoes of ten.
fn receiver(o: &EchoObservation, key: Key) -> Option<f64> {
    let mut rng = key.rng();
    rng.chance(0.9).then(|| o.range_m + 0.01 * rng.normal())
}

fn scan(params: ScannerParams, near_m: f32, key: Key) -> Vec<LidarPoint> {
    let scanner = Scanner::new(params, Box::new(ahead)).expect("valid");
    scanner.scan(&ScanRequest {
        first_pulse: 0,
        caster: &Halves { near_m },
        materials: &materials(),
        scene_from_lidar_at: &|_| RigidTransform::IDENTITY,
        range_model: &receiver,
        key,
    })
}

const KEY: Key = Key::world(7).domain(Domain::new("lidar.intensity.test"));

/// Mean, standard deviation and number.
fn moments(values: &[f64]) -> (f64, f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    (mean, variance.sqrt(), n)
}

/// The error of an echo's intensity is that of the weakest echo by the root of their powers'
/// ratio; those of a pulse's echoes are independent; and nothing else of a point changes.
#[test]
fn intensities_have_errors_by_signal_to_noise() {
    let spread = 0.27;
    let errors = PulseErrors {
        intensity_at_threshold: spread,
        ..PulseErrors::default()
    };
    for near_m in [10.0_f32, 30.0, 45.0] {
        let exact = scan(wide(PulseErrors::default()), near_m, KEY);
        let noisy = scan(wide(errors), near_m, KEY);
        assert_eq!(exact.len(), noisy.len());
        let mut of_return = [Vec::new(), Vec::new()];
        for (a, b) in exact.iter().zip(&noisy) {
            let same = LidarPoint {
                intensity: a.intensity,
                reflectivity: a.reflectivity,
                ..*b
            };
            assert_eq!(*a, same);
            let ratio = f64::from(b.intensity) / f64::from(a.intensity);
            of_return[usize::from(a.object.item() - 1)].push(ratio);
            let expected = (150.0 * b.intensity).round();
            assert!((f32::from(b.reflectivity) - expected).abs() <= 1.0);
        }
        for (i, ratios) in of_return.iter().enumerate() {
            let range_m = f64::from(near_m) + [0.0, 5.0][i];
            let of_echo = |p: &&LidarPoint| usize::from(p.object.item()) == i + 1;
            let sent_back = f64::from(exact.iter().find(of_echo).expect("seen").intensity);
            // The receiver's weakest echo is 10 % at 90 m.
            let snr = sent_back / (range_m * range_m) / (0.1 / (90.0 * 90.0));
            let sigma = spread / snr.sqrt();
            let (mean, found, n) = moments(ratios);
            assert!(n > 15_000.0 && sigma < 0.27);
            assert!(
                (mean - 1.0).abs() < 4.0 * sigma / n.sqrt(),
                "{near_m}: {mean}"
            );
            assert!(
                (found / sigma - 1.0).abs() < 0.03,
                "{near_m}: {found} {sigma}"
            );
        }
        // Both echoes of the pulses that have two.
        let pairs = noisy.windows(2).filter(|w| w[0].pulse == w[1].pulse);
        let (means, mut products) = (of_return.map(|ratios| moments(&ratios)), Vec::new());
        let two = exact.windows(2).filter(|w| w[0].pulse == w[1].pulse);
        for (pair, exact) in pairs.zip(two) {
            let error = |i: usize| {
                let ratio = f64::from(pair[i].intensity) / f64::from(exact[i].intensity);
                (ratio - means[i].0) / means[i].1
            };
            products.push(error(0) * error(1));
        }
        let (correlation, _, n) = moments(&products);
        assert!(
            n > 10_000.0 && correlation.abs() < 4.0 / n.sqrt(),
            "{correlation}"
        );
    }
}

/// An object's reflectance differs from its material's, and is the same for all scanners.
#[test]
fn objects_have_their_own_reflectance() {
    let errors = PulseErrors {
        reflectance_spread: 0.1,
        ..PulseErrors::default()
    };
    let ratios = |key: Key, near_m: f32| {
        let exact = scan(wide(PulseErrors::default()), near_m, key);
        let spread = scan(wide(errors), near_m, key);
        assert_eq!(exact.len(), spread.len());
        let mut of_object = [0.0_f32; 2];
        for (a, b) in exact.iter().zip(&spread) {
            assert_eq!(
                (a.range_m, a.object, a.pulse),
                (b.range_m, b.object, b.pulse)
            );
            let ratio = b.intensity / a.intensity;
            let of = &mut of_object[usize::from(a.object.item() - 1)];
            assert!(*of == 0.0 || (*of / ratio - 1.0).abs() < 1e-6);
            *of = ratio;
        }
        of_object
    };
    let [trunk, rock] = ratios(KEY, 10.0);
    assert!((trunk - 1.0).abs() > 1e-4 && (rock - trunk).abs() > 1e-4);
    assert!((0.6..1.6).contains(&trunk) && (0.6..1.6).contains(&rock));
    for (a, b) in [trunk, rock].into_iter().zip(ratios(KEY.item(5), 17.0)) {
        assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
    }
}

#[test]
fn devices_have_these_errors_and_others_do_not() {
    let none = PulseErrors::default();
    assert_eq!(
        (none.intensity_at_threshold, none.reflectance_spread),
        (0.0, 0.0)
    );
    assert_eq!(ScannerParams::default().errors, none);
    for device in Device::ALL {
        let (params, sheet) = (device.params(), device.sheet());
        let errors = params.errors;
        assert_eq!(
            (errors.intensity_at_threshold, errors.reflectance_spread),
            (0.27, 0.1)
        );
        // The receiver of the data sheet.
        let AirParams {
            reference_range_m,
            reference_reflectance,
            ..
        } = params.air;
        assert_eq!(reference_range_m, sheet.reference_range_m);
        assert_eq!(reference_reflectance, sheet.reference_reflectance);
    }
    for (field, errors) in [
        (
            "errors.intensity_at_threshold",
            PulseErrors {
                intensity_at_threshold: 1.5,
                ..none
            },
        ),
        (
            "errors.reflectance_spread",
            PulseErrors {
                reflectance_spread: f64::NAN,
                ..none
            },
        ),
    ] {
        let error = Scanner::new(wide(errors), Box::new(ahead)).expect_err("out of range");
        assert_eq!(error.field, field);
    }
}

#[test]
fn rain_is_darker_at_1550_nm() {
    let (near, far) = (Wavelength::Nm905, Wavelength::Nm1550);
    assert_eq!(
        near.drop_reflectance(),
        AirParams::default().drop_reflectance
    );
    // What goes through a drop of 1 mm or more, and back from its rear, loses four fifths.
    assert!(far.drop_reflectance() < 0.4 * near.drop_reflectance());
    for (device, wavelength) in [
        (Device::Mid40, near),
        (Device::Terrestrial, far),
        (Device::Vux1Uav, far),
    ] {
        let found = device.params().air.drop_reflectance;
        assert_eq!(found, wavelength.drop_reflectance(), "{device:?}");
    }
}
