//! Properties that every noise model must have for any echo.

use nemoral_lidar_noise::{
    CombinedMeanError, ConstantSigma, DetectedRange, Detection, EchoObservation, GaussianRange,
    IncidenceLaw, IncidenceLawParams, LaconteDevice, LaconteForm, LinearSigma, LinearSigmaParams,
    MeanError, NoMeanError, RangeEquation, RangeNoise, RangeNoiseSampler, Sigma, SnrSigma,
    SoftThreshold,
};
use proptest::prelude::*;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

const DEVICES: [LaconteDevice; 2] = [LaconteDevice::SickLms1xx, LaconteDevice::VelodyneHdl32e];

fn observation(range_m: f64, incidence_deg: f64, reflectance: f64) -> EchoObservation {
    EchoObservation::at_angle(range_m, incidence_deg.to_radians(), reflectance)
}

fn observations() -> impl Strategy<Value = EchoObservation> {
    (0.0_f64..300.0, 0.0_f64..90.0, 0.0_f64..=1.0)
        .prop_map(|(range_m, deg, reflectance)| observation(range_m, deg, reflectance))
}

/// Mean and standard deviation of `n` measurements minus the true range.
fn moments<M: MeanError, S: Sigma>(
    sensor: &GaussianRange<M, S>,
    o: &EchoObservation,
    n: u32,
) -> (f64, f64) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let errors: Vec<f64> = (0..n)
        .map(|_| sensor.measure(o, &mut rng) - o.range_m)
        .collect();
    let mean = errors.iter().sum::<f64>() / f64::from(n);
    let variance = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / f64::from(n);
    (mean, variance.sqrt())
}

/// The mean of 10⁵ draws is within 4 σ/√n of the mean function and their spread within 4 σ/√(2n) of
/// sigma; the offsets that are looked for (millimetres) are far larger than both.
#[test]
fn measurements_have_the_mean_and_the_spread_of_their_model() {
    let n = 100_000;
    let check = |mean_m: f64, sigma_m: f64, (mean, std): (f64, f64), o: &EchoObservation| {
        let n = f64::from(n);
        assert!(
            (mean - mean_m).abs() < 4.0 * sigma_m / n.sqrt(),
            "{o:?}: {mean} {mean_m}"
        );
        assert!(
            (std - sigma_m).abs() < 4.0 * sigma_m / (2.0 * n).sqrt(),
            "{o:?}: {std} {sigma_m}"
        );
    };
    for o in [
        observation(8.0, 0.0, 0.5),
        observation(25.0, 75.0, 0.2),
        observation(60.0, 40.0, 0.9),
    ] {
        let paper = GaussianRange {
            mean: CombinedMeanError::default(),
            sigma: ConstantSigma::new(0.02).unwrap(),
        };
        check(
            paper.mean.mean_error_m(&o),
            0.02,
            moments(&paper, &o, n),
            &o,
        );
        let laconte = GaussianRange {
            mean: LaconteDevice::SickLms1xx.closed_form(),
            sigma: LinearSigma::new(LinearSigmaParams::HOKUYO_UTM30LX).unwrap(),
        };
        check(
            laconte.mean.mean_error_m(&o),
            laconte.sigma.sigma_m(&o),
            moments(&laconte, &o, n),
            &o,
        );
        let livox = GaussianRange {
            mean: |_: &EchoObservation| 0.003,
            sigma: SnrSigma::default(),
        };
        check(0.003, livox.sigma.sigma_m(&o), moments(&livox, &o, n), &o);
    }
}

/// The errors of 10⁵ measurements by a named model, with the mean and the spread that its parts
/// give.
fn errors_of(noise: RangeNoise, o: &EchoObservation) -> (Vec<f64>, f64, f64) {
    use LaconteForm::{Closed, Waveform};
    let waveform = |d: LaconteDevice| d.waveform().mean_error_m(o);
    let (mean_m, sigma_m) = match noise {
        RangeNoise::Off => (0.0, 0.0),
        RangeNoise::Paper { sigma_m } => (CombinedMeanError::default().mean_error_m(o), sigma_m),
        RangeNoise::Laconte {
            device,
            form,
            sigma_m,
        } => match form {
            Waveform => (waveform(device), sigma_m),
            Closed => (device.closed_form().mean_error_m(o), sigma_m),
        },
        RangeNoise::Incidence(law) => (0.0, IncidenceLaw::new(law).expect("in range").sigma_m(o)),
        RangeNoise::Linear(line) => (0.0, LinearSigma::new(line).expect("in range").sigma_m(o)),
        RangeNoise::SignalToNoise { range, sigma, .. } => {
            let equation = RangeEquation::new(range).expect("in range");
            (
                0.0,
                SnrSigma::new(sigma, equation).expect("in range").sigma_m(o),
            )
        }
    };
    let mut seeds = 0..100_000;
    let rngs = std::iter::from_fn(|| seeds.next().map(Xoshiro256PlusPlus::seed_from_u64));
    let mut measured = vec![None; 100_000];
    let os = vec![*o; measured.len()];
    let sampler = RangeNoiseSampler::new(noise).expect("in range");
    sampler.measure_each(&os, rngs, &mut measured);
    let error = |m: Option<f64>| m.expect("near enough to be seen") - o.range_m;
    (measured.into_iter().map(error).collect(), mean_m, sigma_m)
}

/// Every named model draws errors as its parts say: the mean within 4 σ/√n, the spread within 4
/// σ/√(2n), and symmetrically about the mean.
#[test]
fn every_named_model_draws_around_its_mean_evenly() {
    let laconte = |device, form| RangeNoise::Laconte {
        device,
        form,
        sigma_m: 0.01,
    };
    let mut models = vec![
        RangeNoise::default(),
        RangeNoise::Incidence(IncidenceLawParams::default()),
        RangeNoise::Linear(LinearSigmaParams::SICK_LMS1XX),
        RangeNoise::Linear(LinearSigmaParams::HOKUYO_UTM30LX),
        RangeNoise::livox(),
    ];
    for device in DEVICES {
        models.extend([LaconteForm::Waveform, LaconteForm::Closed].map(|f| laconte(device, f)));
    }
    for noise in models {
        for o in [observation(8.0, 30.0, 0.5), observation(25.0, 75.0, 0.9)] {
            let (errors, mean_m, sigma_m) = errors_of(noise, &o);
            let n = errors.len() as f64;
            let moment = |k| errors.iter().map(|e| (e - mean_m).powi(k)).sum::<f64>() / n;
            assert!(sigma_m > 0.0, "{noise:?}");
            let bound_m = 4.0 * sigma_m / n.sqrt();
            assert!(moment(1).abs() < bound_m, "{noise:?} {o:?}");
            let spread_m = moment(2).sqrt();
            assert!(
                (spread_m - sigma_m).abs() < bound_m / 2.0_f64.sqrt(),
                "{noise:?} {o:?}"
            );
            // For n normal numbers about their known mean, it has a standard deviation of √(15/n).
            let lean = moment(3) / sigma_m.powi(3);
            assert!(
                lean.abs() < 4.0 * (15.0 / n).sqrt(),
                "{noise:?} {o:?}: {lean}"
            );
            let below = errors.iter().filter(|&&e| e < mean_m).count() as f64;
            assert!(
                (below - n / 2.0).abs() < 2.0 * n.sqrt(),
                "{noise:?} {o:?}: {below}"
            );
        }
    }
    let (exact, ..) = errors_of(RangeNoise::Off, &observation(8.0, 30.0, 0.5));
    assert!(exact.iter().all(|&e| e == 0.0));
}

/// Any mean error, any spread and any detection can be combined, and none changes another.
#[test]
fn mean_spread_and_detection_compose() {
    let detection = SoftThreshold::new(RangeEquation::default(), 1e-4).unwrap();
    let range = GaussianRange {
        mean: LaconteDevice::SickLms1xx.waveform(),
        sigma: SnrSigma::default(),
    };
    let receiver = DetectedRange { detection, range };
    let n = 100_000;
    for o in [
        observation(85.0, 0.0, 0.1),
        observation(60.0, 50.0, 0.08),
        observation(70.0, 75.0, 0.25),
    ] {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let seen: Vec<f64> = (0..n)
            .filter_map(|_| receiver.measure(&o, &mut rng))
            .collect();
        let (share, many) = (detection.probability(&o), seen.len() as f64);
        assert!((0.05..0.95).contains(&share), "{o:?}: {share}");
        let missed = (share * (1.0 - share) * f64::from(n)).sqrt();
        assert!((many - share * f64::from(n)).abs() < 4.0 * missed, "{o:?}");
        let (mean_m, sigma_m) = (range.mean.mean_error_m(&o), range.sigma.sigma_m(&o));
        let mean = seen.iter().map(|m| m - o.range_m).sum::<f64>() / many;
        assert!((mean - mean_m).abs() < 4.0 * sigma_m / many.sqrt(), "{o:?}");
        let square = |m: &f64| (m - o.range_m - mean).powi(2);
        let spread = (seen.iter().map(square).sum::<f64>() / many).sqrt();
        assert!(
            (spread - sigma_m).abs() < 4.0 * sigma_m / (2.0 * many).sqrt(),
            "{o:?}"
        );
    }
    let exact = DetectedRange {
        detection: |_: &EchoObservation| 1.0,
        range: GaussianRange {
            mean: NoMeanError,
            sigma: ConstantSigma::default(),
        },
    };
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let o = observation(300.0, 80.0, 0.01);
    assert_eq!(exact.measure(&o, &mut rng), Some(300.0));
}

#[test]
fn soft_detection_happens_with_its_probability() {
    let soft = SoftThreshold::new(RangeEquation::default(), 1e-4).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let n = 20_000;
    for range_m in [70.0, 85.0, 90.0, 100.0, 130.0] {
        let o = observation(range_m, 0.0, 0.1);
        let p = soft.probability(&o);
        let seen = f64::from((0..n).filter(|_| soft.detects(&o, &mut rng)).count() as u32);
        let spread = (p * (1.0 - p) * f64::from(n)).sqrt();
        assert!(
            (seen - p * f64::from(n)).abs() < 4.0 * spread + 1.0,
            "{range_m} {p} {seen}"
        );
    }
}

proptest! {
    #[test]
    fn laconte_is_too_short_and_monotone(
        range_m in 0.0_f64..300.0,
        deg in 0.0_f64..90.0,
        farther_m in 0.0_f64..100.0,
        steeper_deg in 0.0_f64..30.0,
    ) {
        for device in DEVICES {
            let models: [&dyn MeanError; 2] = [&device.waveform(), &device.closed_form()];
            for model in models {
                let bias = |range_m: f64, incidence_deg: f64| {
                    let bias_m = model.mean_error_m(&observation(range_m, incidence_deg, 0.5));
                    assert!(bias_m.is_finite());
                    bias_m
                };
                let here = bias(range_m, deg);
                // Rounding of the waveform's coefficients leaves a few 1e-15 of a metre.
                prop_assert!(here <= 1e-14);
                prop_assert!(bias(range_m, 0.0).abs() <= 1e-14);
                prop_assert!(bias(range_m + farther_m, deg) <= here + 1e-12);
                prop_assert!(bias(range_m, (deg + steeper_deg).min(90.0)) <= here + 1e-12);
            }
        }
    }

    #[test]
    fn laconte_is_continuous(range_m in 0.0_f64..300.0, rad in 0.0_f64..1.57) {
        for device in DEVICES {
            let model = device.waveform();
            let step = |rad: f64| model.mean_error_m(&EchoObservation::at_angle(range_m, rad, 0.5));
            let near = (step(rad) - step(rad + 1e-9)).abs();
            // The steepest slope, at 85° and 400 m, is below 1e4 m per radian.
            prop_assert!(near < 1e-5, "{near}");
        }
    }

    #[test]
    fn the_closed_form_is_the_waveform(range_m in 0.5_f64..50.0, deg in 1.0_f64..85.0) {
        for (device, tolerance) in DEVICES.into_iter().zip([0.15, 0.02]) {
            let o = observation(range_m, deg, 0.5);
            let (full, closed) = (
                device.waveform().mean_error_m(&o),
                device.closed_form().mean_error_m(&o),
            );
            prop_assert!(
                (closed / full - 1.0).abs() < tolerance,
                "{device:?} {o:?} {full} {closed}"
            );
        }
    }

    #[test]
    fn spreads_grow_as_the_echo_weakens(o in observations(), farther_m in 0.0_f64..100.0) {
        let spreads: [&dyn Sigma; 3] = [
            &SnrSigma::default(),
            &IncidenceLaw::default(),
            &LinearSigma::new(LinearSigmaParams::SICK_LMS1XX).unwrap(),
        ];
        let farther = EchoObservation {
            range_m: o.range_m + farther_m,
            ..o
        };
        let grazing = EchoObservation {
            incidence_cos: 0.9 * o.incidence_cos,
            ..o
        };
        for sigma in spreads {
            let here = sigma.sigma_m(&o);
            prop_assert!(here.is_finite() && here >= 0.0);
            prop_assert!(sigma.sigma_m(&farther) >= here);
            prop_assert!(sigma.sigma_m(&grazing) >= here);
        }
    }

    #[test]
    fn detection_fades_with_range_and_grows_with_reflectance(
        o in observations(),
        farther_m in 0.0_f64..100.0,
        false_alarm in 1e-8_f64..0.4,
    ) {
        let hard = RangeEquation::default();
        let soft = SoftThreshold::new(hard, false_alarm).unwrap();
        let farther = EchoObservation {
            range_m: o.range_m + farther_m,
            ..o
        };
        let darker = EchoObservation {
            reflectance: o.reflectance / 2.0,
            ..o
        };
        let receivers: [&dyn Fn(&EchoObservation) -> f64; 2] =
            [&|o| hard.probability(o), &|o| soft.probability(o)];
        for receiver in receivers {
            let here = receiver(&o);
            prop_assert!((0.0..=1.0).contains(&here));
            prop_assert!(receiver(&farther) <= here);
            prop_assert!(receiver(&darker) <= here);
        }
        // The threshold's own ladder: R_max grows with the square root of reflectance.
        let ladder = 90.0 * (o.reflectance * o.incidence_cos / 0.1).sqrt();
        if (o.range_m - ladder).abs() > 1e-6 {
            prop_assert_eq!(hard.probability(&o) == 1.0, o.range_m < ladder);
        }
    }

    #[test]
    fn measured_ranges_are_sane(o in observations(), sigma_m in 0.0_f64..10.0, seed: u64) {
        for noise in [
            RangeNoise::Off,
            RangeNoise::Paper { sigma_m },
            RangeNoise::Laconte {
                device: LaconteDevice::SickLms1xx,
                form: LaconteForm::Waveform,
                sigma_m,
            },
            RangeNoise::Laconte {
                device: LaconteDevice::VelodyneHdl32e,
                form: LaconteForm::Closed,
                sigma_m,
            },
            RangeNoise::Incidence(nemoral_lidar_noise::IncidenceLawParams::default()),
            RangeNoise::Linear(nemoral_lidar_noise::LinearSigmaParams::SICK_LMS1XX),
            RangeNoise::livox(),
            RangeNoise::SignalToNoise {
                range: nemoral_lidar_noise::RangeEquationParams::default(),
                sigma: nemoral_lidar_noise::SnrSigmaParams::default(),
                false_alarm_probability: 1e-4,
            },
        ] {
            let sampler = RangeNoiseSampler::new(noise).unwrap();
            let measure = || sampler.measure(&o, &mut Xoshiro256PlusPlus::seed_from_u64(seed));
            if let Some(range_m) = measure() {
                prop_assert!(range_m.is_finite() && range_m >= 0.0);
            }
            prop_assert_eq!(measure(), measure());
        }
        let off = RangeNoiseSampler::new(RangeNoise::Off).unwrap();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        prop_assert_eq!(off.measure(&o, &mut rng), Some(o.range_m));
    }
}
