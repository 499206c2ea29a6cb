//! The sampler on its own, tested for what its documentation promises.

use glam::DVec2;
use nemoral_placement::{Disk, DiskKind, PoissonDiskParams, PoissonDisks, SampleKey};
use nemoral_seed::{Key, PhiloxRng};
use proptest::prelude::*;

fn params(rounds: u32) -> PoissonDiskParams {
    let variety = |weight, low, high| DiskKind {
        weight,
        radius_m: (low, high),
    };
    PoissonDiskParams {
        tile_m: 20.0,
        varieties: vec![variety(3.0, 0.3, 0.5), variety(1.0, 0.8, 1.6)],
        rounds,
    }
}

fn in_rect<K: SampleKey>(key: K, low: [f64; 2], high: [f64; 2]) -> Vec<Disk<K>> {
    let sampler = PoissonDisks::new(params(2), key).expect("valid");
    sampler.in_rect(low.into(), high.into())
}

#[test]
fn disks_do_not_overlap_and_have_their_radii() {
    let disks = in_rect(Key::world(3), [-31.0, 7.0], [30.0, 52.0]);
    assert!(disks.len() > 400, "{}", disks.len());
    for (i, a) in disks.iter().enumerate() {
        let (low, high) = params(2).varieties[usize::from(a.variety)].radius_m;
        assert!((low - 1e-9..=high + 1e-9).contains(&a.radius_m), "{a:?}");
        for b in &disks[..i] {
            let apart_m = a.position_m.distance(b.position_m);
            assert!(apart_m > a.radius_m + b.radius_m - 1e-6, "{a:?} {b:?}");
        }
    }
    assert!([0, 1].map(|v| disks.iter().any(|d| d.variety == v)) == [true; 2]);
}

#[test]
fn more_rounds_are_denser() {
    let count = |rounds| {
        let sampler = PoissonDisks::new(params(rounds), Key::world(3)).expect("valid");
        sampler.in_rect(DVec2::ZERO, DVec2::splat(60.0)).len()
    };
    let counts = [1, 2].map(count);
    assert!(counts[0] < counts[1], "{counts:?}");
}

#[test]
fn densities_are_those_of_the_documentation() {
    let edge_m = 200.0;
    for (rounds, band) in [(1, 0.79..0.82), (2, 0.86..0.885)] {
        let params = PoissonDiskParams {
            rounds,
            ..PoissonDiskParams::default()
        };
        let sampler = PoissonDisks::new(params, Key::world(3)).expect("valid");
        let disks = sampler.in_rect(DVec2::ZERO, DVec2::splat(edge_m)).len();
        // Disks are 2 m apart.
        let density = disks as f64 * (2.0 / edge_m) * (2.0 / edge_m) / 0.6966;
        assert!(band.contains(&density), "{rounds} rounds: {density}");
    }
}

#[test]
fn tiles_share_out_the_plane() {
    let sampler = PoissonDisks::new(params(2), Key::world(9)).expect("valid");
    let mut tiles: Vec<_> = (-2..1)
        .flat_map(|x| (4..6).map(move |y| [x, y]))
        .flat_map(|tile| sampler.in_tile(tile))
        .collect();
    tiles.sort_by_key(|d| d.key);
    assert_eq!(
        tiles,
        sampler.in_rect(DVec2::new(-40.0, 80.0), DVec2::new(20.0, 120.0))
    );
}

#[test]
fn refused() {
    let refused = |change: &dyn Fn(&mut PoissonDiskParams)| {
        let mut params = params(2);
        change(&mut params);
        PoissonDisks::new(params, Key::world(0)).is_err()
    };
    assert!(!refused(&|_| ()));
    assert!(refused(&|p| p.tile_m = f64::NAN));
    assert!(refused(&|p| p.rounds = 0));
    assert!(refused(&|p| p.varieties.clear()));
    assert!(refused(&|p| p.varieties[0].radius_m = (0.0, 1.0)));
    assert!(refused(&|p| p.varieties[0].radius_m = (1.0, 21.0)));
    assert!(refused(&|p| p.varieties[1].weight = -1.0));
    // Millions of small disks would lie around a large one.
    let far_apart = |p: &mut PoissonDiskParams| {
        p.rounds = 3;
        p.varieties[0].radius_m = (0.01, 0.01);
        p.varieties[1].radius_m = (10.0, 10.0);
    };
    assert!(refused(&far_apart));
    // None of them is drawn.
    assert!(!refused(&|p| {
        far_apart(p);
        p.varieties[0].weight = 0.0;
    }));
    let nothing = in_rect(Key::world(0), [3.0, 3.0], [3.0, 9.0]);
    assert!(nothing.is_empty());
}

/// A user's own type of key: 64 bits, derived by SplitMix64's finaliser.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Mixed(u64);

impl Mixed {
    fn with(self, word: u64) -> Self {
        let mut x = self.0 ^ word.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        Self(x ^ (x >> 31))
    }
}

impl SampleKey for Mixed {
    type Rng = PhiloxRng;

    fn seed_cell(self, [x, y]: [i32; 2]) -> Self {
        self.with(1).with(x as u64).with(y as u64)
    }

    fn child(self, index: u64) -> Self {
        self.with(2).with(index)
    }

    fn seed_rng(self) -> PhiloxRng {
        Key::world(self.with(3).0).rng()
    }

    fn dart_rng(self) -> PhiloxRng {
        Key::world(self.with(4).0).rng()
    }

    fn priority(self) -> u64 {
        self.0
    }
}

#[test]
fn any_key_will_do() {
    let disks = in_rect(Mixed(5), [0.0, 0.0], [50.0, 50.0]);
    let others = in_rect(Mixed(6), [0.0, 0.0], [50.0, 50.0]);
    assert!(disks.len().abs_diff(others.len()) < disks.len() / 5);
    assert_ne!(disks, in_rect(Mixed(7), [0.0, 0.0], [50.0, 50.0]));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn every_view_shows_the_same_disks(
        seed: u64, x in -1e6_f64..1e6, y in -1e6_f64..1e6, w in 1.0_f64..40.0, h in 1.0_f64..40.0,
    ) {
        let key = Key::world(seed);
        let small = in_rect(key, [x, y], [x + w, y + h]);
        let mut large = in_rect(key, [x - 17.0, y - 3.0], [x + w + 5.0, y + h + 29.0]);
        let (low, high) = (DVec2::new(x, y), DVec2::new(x + w, y + h));
        large.retain(|d| d.position_m.cmpge(low).all() && d.position_m.cmplt(high).all());
        prop_assert_eq!(small, large);
    }
}
