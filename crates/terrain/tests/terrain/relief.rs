//! Terrain beyond plain octaves: ridges, winding valleys, terraces and gullies.

use std::thread;

use nemoral_scene::glam::DVec2;
use nemoral_scene::{FlatSurface, Surface};
use nemoral_seed::Key;
use nemoral_terrain::{
    ErodedSurface, ErosionParams, NoiseTerrain, PerlinTerrain, ReliefParams, TerrainParams,
};
use proptest::prelude::*;

const HILLS: TerrainParams = TerrainParams {
    octaves: 4,
    scale_m: 160.0,
    lacunarity: 2.1,
    persistence: 0.35,
    max_height_m: 50.0,
};

fn relief() -> impl Strategy<Value = ReliefParams> {
    (
        0.0_f64..=1.0,
        0.0_f64..=0.25,
        0.0_f64..=1.0,
        0.0_f64..=1.0,
        2.0_f64..=25.0,
    )
        .prop_map(
            |(ridges, warp, terraces, cliffs, terrace_step_m)| ReliefParams {
                ridges,
                warp,
                terraces,
                cliffs,
                terrace_step_m,
            },
        )
}

fn erosion() -> impl Strategy<Value = ErosionParams> {
    (2.0_f64..=60.0, 0.0_f64..=0.4, 1_u32..=6).prop_map(|(spacing_m, depth, generations)| {
        ErosionParams {
            spacing_m,
            depth_m: depth * spacing_m,
            generations,
        }
    })
}

fn eroded(relief: ReliefParams, erosion: ErosionParams, seed: u64) -> ErodedSurface<NoiseTerrain> {
    let key = Key::world(seed);
    let base = NoiseTerrain::shaped(HILLS, relief, key).expect("valid");
    ErodedSurface::new(erosion, key, base).expect("valid")
}

/// The distance between the gullies of the last generation, metres.
fn finest_m(erosion: &ErosionParams) -> f64 {
    erosion.spacing_m / f64::from(1_u32 << (erosion.generations - 1))
}

/// The gradient by differences of height alone over a small step, of fourth order.
fn difference(ground: &dyn Surface, at: DVec2, step_m: f64) -> DVec2 {
    let along = |way: DVec2| {
        let wide = |k: f64| {
            let step = k * step_m * way;
            (ground.height_m(at + step) - ground.height_m(at - step)) / (2.0 * k * step_m)
        };
        (4.0 * wide(1.0) - wide(2.0)) / 3.0
    };
    DVec2::new(along(DVec2::X), along(DVec2::Y))
}

proptest! {
    #[test]
    fn gradients_are_difference_quotients(
        relief in relief(),
        erosion in erosion(),
        seed: u64,
        x in -1e4_f64..1e4,
        y in -1e4_f64..1e4,
    ) {
        let ground = eroded(relief, erosion, seed);
        let at = DVec2::new(x, y);
        let sample = ground.sample(at);
        let step_m = (1e-3 * finest_m(&erosion)).min(2e-3);
        let off = (sample.gradient - difference(&ground, at, step_m)).length();
        prop_assert!(off < 1e-5 * (1.0 + sample.gradient.length()), "{off} {sample:?}");
    }

    #[test]
    fn heights_are_in_range(
        relief in relief(),
        erosion in erosion(),
        seed: u64,
        x in -5e7_f64..5e7,
        y in -5e7_f64..5e7,
    ) {
        let sample = eroded(relief, erosion, seed).sample(DVec2::new(x, y));
        prop_assert!((0.0..=50.0).contains(&sample.height_m), "{sample:?}");
        prop_assert!(sample.gradient.is_finite());
    }

    #[test]
    fn height_and_gradient_are_continuous(
        relief in relief(),
        erosion in erosion(),
        seed: u64,
        cell in -500_i32..500,
        along in -1e3_f64..1e3,
        angle in 0.0_f64..6.3,
    ) {
        // Across borders of chunks and of cells of gullies, too.
        let borders = [f64::from(cell) * 50.0, f64::from(cell) * 1.2 * erosion.spacing_m];
        let ground = eroded(relief, erosion, seed);
        for border in borders {
            let at = DVec2::new(border, along);
            let step = 1e-6 * finest_m(&erosion).min(1.0) * DVec2::from_angle(angle);
            let (a, b) = (ground.sample(at - step), ground.sample(at + step));
            let steep = 1.0 + a.gradient.length();
            prop_assert!((a.height_m - b.height_m).abs() < 3e-6 * steep);
            prop_assert!((a.gradient - b.gradient).length() < 1e-4 * steep);
        }
    }
}

#[test]
fn nothing_changes_without_being_asked_for() {
    let key = Key::world(5);
    let plain = NoiseTerrain::new(HILLS, key).expect("valid");
    let none = ErosionParams {
        depth_m: 0.0,
        ..ErosionParams::default()
    };
    let same = eroded(ReliefParams::default(), none, 5);
    for i in 0..500 {
        let at = DVec2::new(f64::from(i) * 7.3, f64::from(i) * -3.1);
        assert_eq!(plain.sample(at), same.sample(at));
    }
}

/// Places 2.7 m apart, 300 times 300 of them.
fn places() -> impl Iterator<Item = DVec2> {
    (0..90_000).map(|i| DVec2::new(f64::from(i % 300), f64::from(i / 300)) * 2.7)
}

#[test]
fn a_place_is_the_same_whichever_was_asked_for_before() {
    let params = ErosionParams::default();
    let ground = eroded(ReliefParams::default(), params, 8);
    // More cells than a thread remembers.
    let forwards: Vec<_> = places().step_by(7).map(|p| ground.sample(p)).collect();
    let other = eroded(ReliefParams::default(), params, 8);
    let backwards: Vec<_> = thread::spawn(move || {
        let places: Vec<DVec2> = places().step_by(7).collect();
        places.into_iter().rev().map(|p| other.sample(p)).collect()
    })
    .join()
    .expect("no panic");
    assert!(forwards.into_iter().rev().eq(backwards));
}

#[test]
fn ridges_are_sharper_than_valleys() {
    // The mean curvature over 4 m of the highest and of the lowest eighth of the ground.
    let bends = |ridges| {
        let relief = ReliefParams {
            ridges,
            ..ReliefParams::default()
        };
        let ground = NoiseTerrain::shaped(HILLS, relief, Key::world(3)).expect("valid");
        let mut found: Vec<(f64, f64)> = places()
            .map(|p| {
                let here = ground.height_m(p);
                let ways = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y];
                let around: f64 = ways.iter().map(|w| ground.height_m(p + 4.0 * w)).sum();
                (here, around / 4.0 - here)
            })
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mean = |of: &[(f64, f64)]| of.iter().map(|f| f.1).sum::<f64>() / of.len() as f64;
        [mean(&found[..11_000]), -mean(&found[79_000..])]
    };
    let [valley, crest] = bends(1.0);
    assert!(crest > 2.0 * valley, "{crest} {valley}");
    let [valley, crest] = bends(0.0);
    assert!((0.7..1.4).contains(&(crest / valley)), "{crest} {valley}");
}

#[test]
fn terraces_have_level_treads_and_steep_risers() {
    let slopes = |terraces| {
        let relief = ReliefParams {
            terraces,
            terrace_step_m: 5.0,
            ..ReliefParams::default()
        };
        let ground = NoiseTerrain::shaped(HILLS, relief, Key::world(3)).expect("valid");
        let mut slopes: Vec<f64> = places()
            .map(|p| ground.sample(p).gradient.length())
            .collect();
        slopes.sort_by(f64::total_cmp);
        [slopes[22_500], slopes[88_000]]
    };
    let ([level, steep], [calm, steepest]) = (slopes(0.0), slopes(1.0));
    assert!(calm < 0.75 * level, "{calm} {level}");
    assert!(steepest > 1.5 * steep, "{steepest} {steep}");
}

#[test]
fn cliffs_are_sheer() {
    let steepest = |cliffs| {
        let relief = ReliefParams {
            terraces: 1.0,
            cliffs,
            terrace_step_m: 5.0,
            ..ReliefParams::default()
        };
        let ground = NoiseTerrain::shaped(HILLS, relief, Key::world(3)).expect("valid");
        let slopes = places().map(|p| ground.sample(p).gradient.length());
        slopes.fold(0.0_f64, f64::max)
    };
    let (rises, cliffs) = (steepest(0.0), steepest(1.0));
    // More than 60 degrees.
    assert!(cliffs > 1.6 * rises && cliffs > 1.73, "{cliffs} {rises}");
}

#[test]
fn gullies_run_down_slopes_and_spare_level_ground() {
    let plane = |slope| FlatSurface {
        height_m: 1e4,
        gradient: DVec2::new(slope, 0.0),
    };
    let params = ErosionParams {
        generations: 1,
        ..ErosionParams::default()
    };
    let carve = |slope| {
        let (base, key) = (plane(slope), Key::world(2));
        let ground = ErodedSurface::new(params, key, base).expect("valid");
        let depth = |p| base.height_m(p) - ground.height_m(p);
        let (mut deepest, mut along, mut across) = (0.0_f64, 0.0, 0.0);
        for p in places() {
            let change = ground.sample(p).gradient - base.gradient;
            deepest = deepest.max(depth(p));
            (along, across) = (along + change.x.abs(), across + change.y.abs());
        }
        (deepest, across / along)
    };
    let (deepest, elongated) = carve(0.5);
    let most_m = params.depth_m * 0.25 / (0.25 + 0.04);
    assert!((0.75 * most_m..=most_m).contains(&deepest), "{deepest}");
    assert!(elongated > 3.0, "{elongated}");
    assert_eq!(carve(0.0).0, 0.0);
}

#[test]
fn water_gathers_in_gullies() {
    // Drops start every half metre along a contour of a plane that only gullies change.
    let base = FlatSurface {
        height_m: 1e4,
        gradient: DVec2::new(0.35, 0.0),
    };
    let ground = ErodedSurface::new(ErosionParams::default(), Key::world(6), base).expect("valid");
    let mut ends: Vec<f64> = (0..600)
        .map(|i| {
            let mut at = DVec2::new(0.0, 0.5 * f64::from(i));
            while at.x > -60.0 {
                let down = -ground.sample(at).gradient;
                // Momentum carries a drop over the pools that gullies have.
                at += 0.25 * (down.normalize_or_zero() + DVec2::NEG_X).normalize_or_zero();
            }
            at.y
        })
        .collect();
    ends.sort_by(f64::total_cmp);
    let joined = ends.windows(2).filter(|pair| pair[1] - pair[0] < 0.1);
    let share = joined.count() as f64 / 599.0;
    assert!(share > 0.6, "{share}");
}

#[test]
fn other_grounds_can_be_eroded_too() {
    let base = PerlinTerrain::new(HILLS, Key::world(1)).expect("valid");
    let ground = ErodedSurface::new(ErosionParams::default(), Key::world(1), base).expect("valid");
    let carved = places().step_by(50).filter(|p| {
        let base = PerlinTerrain::new(HILLS, Key::world(1)).expect("valid");
        ground.height_m(*p) < base.height_m(*p) - 0.1
    });
    assert!(carved.count() > 200);
}

#[test]
fn impossible_reliefs_are_refused() {
    let relief = |change: fn(&mut ReliefParams)| {
        let mut params = ReliefParams::default();
        change(&mut params);
        let refused = NoiseTerrain::shaped(HILLS, params, Key::world(0));
        refused.expect_err("refused").field
    };
    assert_eq!(relief(|p| p.ridges = 1.1), "ridges");
    assert_eq!(relief(|p| p.warp = f64::NAN), "warp");
    assert_eq!(relief(|p| p.terraces = -0.1), "terraces");
    let too_high = |p: &mut ReliefParams| (p.terraces, p.terrace_step_m) = (0.5, 26.0);
    assert_eq!(relief(too_high), "terrace_step_m");
    let erosion = |change: fn(&mut ErosionParams)| {
        let mut params = ErosionParams::default();
        change(&mut params);
        let refused = ErodedSurface::new(params, Key::world(0), FlatSurface::default());
        refused.expect_err("refused").field
    };
    assert_eq!(erosion(|p| p.spacing_m = 1.0), "spacing_m");
    assert_eq!(erosion(|p| p.depth_m = 12.1), "depth_m");
    assert_eq!(erosion(|p| p.generations = 7), "generations");
}

#[test]
fn value_stability() {
    let relief = ReliefParams {
        ridges: 0.6,
        warp: 0.12,
        terraces: 0.5,
        cliffs: 0.0,
        terrace_step_m: 6.0,
    };
    let ground = eroded(relief, ErosionParams::default(), 7);
    let got =
        [(1.5, -2.25), (5e7, -5e7)].map(|(x, y)| format!("{:?}", ground.sample([x, y].into())));
    assert_eq!(got, VALUES);
}
const VALUES: [&str; 2] = [
    "SurfaceSample { height_m: 37.12098125919021, gradient: DVec2(0.3434593810282084, \
     -0.05857664768823643) }",
    "SurfaceSample { height_m: 30.729544535179482, gradient: DVec2(-0.2515898720392999, \
     -0.7316555217078909) }",
];
