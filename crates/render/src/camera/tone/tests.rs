//! The curve against formulas and a camera's, and its noise.

use proptest::prelude::*;

use super::*;
use crate::camera::exposure::Exposure;
use crate::camera::metering::log_mean_luminance;

/// Code values of a perfect sensor.
fn shown(linear: &Image<Vec3>, ev100: f64, tone: ToneCurve) -> Image<[u8; 3]> {
    develop(
        linear,
        ev100,
        tone,
        None,
        &Processing::default(),
        Key::world(1),
    )
}

const TONES: [ToneCurve; 3] = [ToneCurve::Standard, ToneCurve::Filmic, ToneCurve::Linear];

fn curve(tone: ToneCurve, contrast: f64) -> Curve {
    Curve { tone, contrast }
}

fn any_tone() -> impl Strategy<Value = ToneCurve> {
    proptest::sample::select(TONES.to_vec())
}

#[test]
fn white_is_where_the_curve_ends() {
    for tone in TONES {
        for contrast in [0.6, 1.0, 1.7] {
            let curve = curve(tone, contrast);
            let (at, below) = (
                curve.apply(curve.white()),
                curve.apply(0.99 * curve.white()),
            );
            assert!(at > 1.0 - 1e-9 && below < 1.0, "{curve:?}");
            assert!(curve.white() < 64.0, "within the table");
        }
    }
}

proptest! {
    #[test]
    fn the_table_is_the_formula(
        exponent in -16.0_f32..4.0, tone in any_tone(), lift in 0.0..1.0,
    ) {
        let x = exponent.exp2();
        let contrast = if lift < 0.3 { 1.0 } else { 0.6 + 1.4 * lift };
        let curve = curve(tone, contrast);
        let encoder = Encoder::new(curve);
        let got = encoder.encode(Vec3::splat(x))[1];
        let exact = 255.0 * srgb_oetf(curve.apply(f64::from(x)));
        prop_assert!((f64::from(got) - exact).abs() <= 0.501, "{got} for {exact}");
        let level = f64::from(encoder.levels(Vec3::splat(x)).y);
        // The darkest code's part of the curve is not straight.
        let bend = if exact < 0.5 { 0.25 } else { 0.12 };
        prop_assert!((level - exact).abs() <= bend, "{level} for {exact}");
    }

    #[test]
    fn contrast_turns_about_middle_grey(contrast in 0.6..2.0, stops in -3.0..1.0) {
        let curve = curve(ToneCurve::Linear, contrast);
        prop_assert!((curve.apply(MIDDLE_GREY) - MIDDLE_GREY).abs() < 1e-12);
        let x = MIDDLE_GREY * libm::exp2(stops);
        let shown = libm::log2(curve.apply(x) / MIDDLE_GREY);
        prop_assert!((shown - contrast * stops).abs() < 1e-9);
    }

    #[test]
    fn more_light_is_never_darker(
        x in 0.0_f32..20.0, more in 0.0_f32..2.0, tone in any_tone(),
    ) {
        let e = Encoder::new(curve(tone, 1.0));
        prop_assert!(e.encode(Vec3::splat(x + more))[0] >= e.encode(Vec3::splat(x))[0]);
    }

    #[test]
    fn auto_exposure_cancels_the_strength_of_the_light(scale in 0.001_f32..1000.0) {
        let pixels: Vec<Vec3> = (1..200).map(|i| Vec3::new(1.0, 0.5, 0.2) * i as f32).collect();
        let dim: Vec<Vec3> = pixels.iter().map(|&p| p * scale).collect();
        let shot = |p: Vec<Vec3>| {
            let ev = Exposure::default().ev100(log_mean_luminance(&p));
            shown(&Image::new(p.len(), 1, p), ev, ToneCurve::Standard)
        };
        for (a, b) in shot(pixels).pixels().iter().zip(shot(dim).pixels()) {
            for i in 0..3 { prop_assert!(a[i].abs_diff(b[i]) <= 1); }
        }
    }
}

#[test]
fn ends_and_order() {
    for tone in TONES {
        let e = Encoder::new(curve(tone, 1.0));
        assert_eq!(e.encode(Vec3::ZERO), [0; 3]);
        assert_eq!(e.encode(Vec3::splat(6.0)), [255; 3]);
        assert!(
            e.table.least().windows(2).all(|w| w[0] < w[1]),
            "each code is reached"
        );
    }
    // A well-known pair of sRGB values.
    assert_eq!(
        Encoder::new(curve(ToneCurve::Linear, 1.0)).encode(Vec3::splat(0.2140)),
        [127; 3]
    );
}

#[test]
fn middle_grey_has_its_place() {
    let ev = 12.0;
    let grey = Vec3::splat(0.125 * 4096.0);
    let shot = |tone| *shown(&Image::new(1, 1, vec![grey]), ev, tone).at(0, 0);
    assert_eq!(shot(ToneCurve::Linear), [118; 3]);
    assert_eq!(shot(ToneCurve::Filmic), [125; 3]);
    assert_eq!(shot(ToneCurve::Standard), [118; 3]);
    let auto = Exposure::default().ev100(log_mean_luminance(&[grey; 9]));
    assert!((auto - ev).abs() < 1e-5, "{auto}");
}

#[test]
fn the_standard_curve_is_that_of_a_camera() {
    // What Adobe's default curve shows of greys, in stops from the one it shows as 18 %.
    let of_adobe = [
        (-5.0, 8.0),
        (-4.0, 15.0),
        (-3.0, 26.0),
        (-2.0, 45.0),
        (-1.0, 75.0),
        (0.0, 118.0),
        (1.0, 171.0),
        (2.0, 217.0),
        (3.0, 248.0),
    ];
    for (stops, code) in of_adobe {
        let x = MIDDLE_GREY * libm::exp2(stops);
        let got = 255.0 * srgb_oetf(ToneCurve::Standard.apply(x));
        assert!((got - code).abs() <= 3.0, "{got} at {stops} stops");
    }
    let stops = libm::log2(ToneCurve::Standard.white() / MIDDLE_GREY);
    assert!((stops - 3.41).abs() < 0.02, "{stops}");
}

/// Shot noise is that of the electrons of a light, however the picture shows it.
#[test]
fn noise_is_that_of_the_light_behind_any_curve_and_contrast() {
    const PIXELS: usize = 20_000;
    let noise = SensorNoise {
        full_well_e: 4000.0,
        read_noise_e: 0.0,
        gain: 1.0,
        gain_below_ev: -20.0,
        prnu: 0.0,
        dsnu_e: 0.0,
        bits: 16,
        serial: Key::world(5),
    };
    let ev100 = 12.0;
    let linear = Image::new(PIXELS, 1, vec![Vec3::splat(0.125 * 4096.0); PIXELS]);
    let electrons = MIDDLE_GREY / ToneCurve::Standard.white() * noise.full_well_e;
    for tone in TONES {
        for contrast in [0.7, 1.0, 1.6] {
            let processing = Processing {
                contrast,
                ..Processing::default()
            };
            let key = Key::world(1);
            let shot = develop(&linear, ev100, tone, Some(noise), &processing, key);
            // The light in the middle of each code, by bisection.
            let curve = curve(tone, contrast);
            let light = |code: u8| {
                let (mut low, mut high) = (0.0, curve.white());
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if 255.0 * srgb_oetf(curve.apply(middle)) < f64::from(code) {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                low
            };
            let of_codes: Vec<f64> = (0..=255).map(light).collect();
            let lights = shot.pixels().iter().map(|c| of_codes[usize::from(c[1])]);
            let lights: Vec<f64> = lights.collect();
            let mean = lights.iter().sum::<f64>() / PIXELS as f64;
            let squares: f64 = lights.iter().map(|l| (l - mean).powi(2)).sum();
            let relative = (squares / PIXELS as f64).sqrt() / mean;
            let exact = electrons.sqrt().recip();
            assert!(
                (relative / exact - 1.0).abs() < 0.05,
                "{tone:?} {contrast}: {relative} for {exact}"
            );
        }
    }
}
