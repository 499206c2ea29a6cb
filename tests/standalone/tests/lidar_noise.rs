//! Use of `nemoral-lidar-noise` alone: errors for another scanner.

use nemoral_lidar_noise::{EchoObservation, GaussianRange, RangeNoise, RangeNoiseSampler};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

/// Mean and standard deviation.
fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    (mean, variance.sqrt())
}

#[test]
fn a_livox_sees_a_leaf() {
    let sampler = RangeNoiseSampler::new(RangeNoise::livox()).expect("a model");
    let leaf = EchoObservation::at_angle(20.0, 0.5, 0.45);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let measure = |o: &EchoObservation, rng: &mut _| -> Vec<f64> {
        (0..1000).filter_map(|_| sampler.measure(o, rng)).collect()
    };
    let ranges = measure(&leaf, &mut rng);
    assert!(ranges.len() > 950, "{} echoes", ranges.len());
    let (mean, spread) = moments(&ranges);
    assert!((mean - 20.0).abs() < 0.1, "{mean} m");
    assert!((0.001..0.1).contains(&spread), "{spread} m");
    // A dark and distant surface gives no return.
    let coal = EchoObservation::at_angle(500.0, 1.2, 0.03);
    assert!(measure(&coal, &mut rng).len() < 50);
}

#[test]
fn a_model_of_ones_own_is_two_closures() {
    let sensor = GaussianRange {
        mean: |o: &EchoObservation| 0.001 * o.range_m,
        sigma: |o: &EchoObservation| 0.01 / o.reflectance,
    };
    let grey = EchoObservation {
        range_m: 50.0,
        incidence_cos: 1.0,
        reflectance: 0.5,
    };
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let ranges: Vec<f64> = (0..4000).map(|_| sensor.measure(&grey, &mut rng)).collect();
    let (mean, spread) = moments(&ranges);
    assert!((mean - 50.05).abs() < 0.002, "{mean} m");
    assert!((spread - 0.02).abs() < 0.001, "{spread} m");
}
