//! The guarantees of a terrain for any parameters.

use nemoral_scene::Surface;
use nemoral_scene::glam::DVec2;
use nemoral_seed::Key;
use nemoral_terrain::{ErodedSurface, ErosionParams, NoiseTerrain, PerlinTerrain, TerrainParams};
use proptest::prelude::*;

fn params() -> impl Strategy<Value = TerrainParams> {
    (
        1_u32..=6,
        1.0_f64..500.0,
        1.01_f64..4.0,
        0.0_f64..=1.0,
        0.0_f64..500.0,
    )
        .prop_map(
            |(octaves, scale_m, lacunarity, persistence, max_height_m)| TerrainParams {
                octaves,
                scale_m,
                lacunarity,
                persistence,
                max_height_m,
            },
        )
}

fn both(params: TerrainParams, seed: u64) -> [Box<dyn Surface>; 2] {
    let key = Key::world(seed);
    [
        Box::new(NoiseTerrain::new(params, key).expect("valid")),
        Box::new(PerlinTerrain::new(params, key).expect("valid")),
    ]
}

/// The shortest wavelength, metres.
fn finest(p: &TerrainParams) -> f64 {
    p.scale_m / p.lacunarity.powi(p.octaves as i32 - 1)
}

proptest! {
    #[test]
    fn heights_are_in_range(p in params(), seed: u64, x in -5e7_f64..5e7, y in -5e7_f64..5e7) {
        for t in both(p, seed) {
            let s = t.sample(DVec2::new(x, y));
            prop_assert!(
                (0.0..=p.max_height_m).contains(&s.height_m),
                "{}",
                s.height_m
            );
            prop_assert!(s.gradient.is_finite());
        }
    }

    #[test]
    fn gradients_are_difference_quotients(
        p in params(),
        seed: u64,
        x in -1e4_f64..1e4,
        y in -1e4_f64..1e4,
    ) {
        let t = NoiseTerrain::new(p, Key::world(seed)).expect("valid");
        let at = DVec2::new(x, y);
        let step = finest(&p) * 1e-4;
        let difference =
            |d: DVec2| (t.height_m(at + d * step) - t.height_m(at - d * step)) / (2.0 * step);
        let expected = DVec2::new(difference(DVec2::X), difference(DVec2::Y));
        let scale = p.max_height_m / finest(&p);
        prop_assert!((t.sample(at).gradient - expected).length() <= 1e-4 * scale + 1e-6);
    }

    #[test]
    fn the_ground_is_continuous(
        p in params(),
        seed: u64,
        x in -1e4_f64..1e4,
        y in -1e4_f64..1e4,
        angle in 0.0_f64..6.3,
    ) {
        // A millionth of a wavelength away, height and gradient are practically the same. (Few of
        // these steps cross a line of the lattice; `gradient_noise` has a test of those.)
        let t = NoiseTerrain::new(p, Key::world(seed)).expect("valid");
        let step = finest(&p) * 1e-6;
        let a = t.sample(DVec2::new(x, y));
        let b = t.sample(DVec2::new(x, y) + DVec2::from_angle(angle) * step);
        prop_assert!((a.height_m - b.height_m).abs() <= 1e-4 * p.max_height_m);
        prop_assert!(
            (a.gradient - b.gradient).length() <= 1e-3 * p.max_height_m / finest(&p) + 1e-9
        );
    }
}

fn fig3(persistence: f64, lacunarity: f64) -> TerrainParams {
    TerrainParams {
        octaves: 5,
        scale_m: 40.0,
        lacunarity,
        persistence,
        max_height_m: 50.0,
    }
}

/// Root mean square slope over many points and worlds.
fn slope(p: TerrainParams) -> f64 {
    let mut sum = 0.0;
    for seed in 0..10 {
        let t = NoiseTerrain::new(p, Key::world(seed)).expect("valid");
        for i in 0..1000 {
            let at = DVec2::new(f64::from(i % 40) * 17.3, f64::from(i / 40) * 23.9);
            sum += t.sample(at).gradient.length_squared();
        }
    }
    f64::sqrt(sum / 1e4)
}

#[test]
fn roughness_rises_with_persistence_and_lacunarity() {
    for lacunarity in [1.5, 2.0, 3.0] {
        let slopes = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0].map(|p| slope(fig3(p, lacunarity)));
        assert!(slopes.is_sorted_by(|a, b| a < b), "{slopes:?}");
    }
    for persistence in [0.2, 0.5, 0.8] {
        let slopes = [1.2, 1.6, 2.0, 3.0, 4.0].map(|l| slope(fig3(persistence, l)));
        assert!(slopes.is_sorted_by(|a, b| a < b), "{slopes:?}");
    }
}

#[test]
fn most_of_the_range_is_used_and_there_are_no_plateaus() {
    let p = fig3(0.5, 2.0);
    let t = NoiseTerrain::new(p, Key::world(4)).expect("valid");
    let (mut low, mut high, mut flat) = (f64::INFINITY, 0.0_f64, 0);
    for i in 0..200_000 {
        let at = DVec2::new(f64::from(i % 500) * 3.71, f64::from(i / 500) * 5.13);
        let s = t.sample(at);
        (low, high) = (low.min(s.height_m), high.max(s.height_m));
        flat += u32::from(s.gradient.length() < 1e-3);
    }
    assert!(low < 5.0 && high > 45.0, "{low}..{high}");
    // Where the slope is about 1, such a small one occurs only by chance.
    assert!(flat < 20, "{flat} flat points of 200000");
}

#[test]
fn heights_do_not_repeat_after_256_cells() {
    let p = TerrainParams {
        octaves: 1,
        ..fig3(0.5, 2.0)
    };
    let [ours, noise] = both(p, 3);
    let repeats = |t: &dyn Surface| {
        (0..1000)
            .filter(|&i| {
                let at = DVec2::new(f64::from(i) * 1.7, f64::from(i) * 0.9);
                let there = at + DVec2::new(256.0 * p.scale_m, 0.0);
                (t.height_m(at) - t.height_m(there)).abs() < 1e-6
            })
            .count()
    };
    assert!(repeats(&*ours) < 5);
    // The test detects a period, that of the permutation table.
    assert_eq!(repeats(&*noise), 1000);
}

#[test]
fn places_without_a_lattice_are_no_panic() {
    let base = NoiseTerrain::new(TerrainParams::default(), Key::world(5)).expect("valid");
    let eroded = ErodedSurface::new(ErosionParams::default(), Key::world(5), &base).expect("valid");
    for far in [1e19, 1e300, f64::INFINITY, f64::NAN] {
        for p in [DVec2::splat(far), DVec2::splat(-far), DVec2::new(-far, 0.0)] {
            base.sample(p);
            eroded.sample(p);
        }
    }
}

#[test]
fn worlds_differ() {
    let p = fig3(0.5, 2.0);
    let at = DVec2::new(12.3, 45.6);
    for k in 0..2 {
        assert_ne!(both(p, 1)[k].height_m(at), both(p, 2)[k].height_m(at));
    }
}

#[test]
fn impossible_terrains_are_refused() {
    let good = fig3(0.5, 2.0);
    let refused = |p: TerrainParams| {
        NoiseTerrain::new(p, Key::world(0))
            .expect_err("refused")
            .field
    };
    assert_eq!(refused(TerrainParams { octaves: 0, ..good }), "octaves");
    assert_eq!(
        refused(TerrainParams {
            scale_m: f64::NAN,
            ..good
        }),
        "scale_m"
    );
    assert_eq!(
        refused(TerrainParams {
            lacunarity: 1.0,
            ..good
        }),
        "lacunarity"
    );
    assert_eq!(
        refused(TerrainParams {
            persistence: 1.1,
            ..good
        }),
        "persistence"
    );
    assert_eq!(
        refused(TerrainParams {
            max_height_m: -1.0,
            ..good
        }),
        "max_height_m"
    );
    assert_eq!(
        refused(TerrainParams {
            octaves: 16,
            lacunarity: 8.0,
            ..good
        }),
        "octaves"
    );
    let e = PerlinTerrain::new(
        TerrainParams {
            scale_m: 0.0,
            ..good
        },
        Key::world(0),
    );
    assert_eq!(
        e.expect_err("refused").to_string(),
        "scale_m = 0: must be 1..=100000 m"
    );
}

#[test]
fn value_stability() {
    let [ours, noise] = both(fig3(0.5, 2.0), 7);
    let at = |t: &dyn Surface, x, y| format!("{:?}", t.sample(DVec2::new(x, y)));
    let got = [
        at(&*ours, 1.5, -2.25),
        at(&*ours, 5e7, -5e7),
        format!("{:?}", noise.height_m(DVec2::new(1.5, -2.25))),
    ];
    assert_eq!(got, VALUES);
}
const VALUES: [&str; 3] = [
    "SurfaceSample { height_m: 34.66023365579892, gradient: DVec2(0.6495679173498661, \
     -1.6797607591707246) }",
    "SurfaceSample { height_m: 8.99957260790524, gradient: DVec2(0.31937862127806815, \
     -0.27254237605901627) }",
    "21.55326547107623",
];
