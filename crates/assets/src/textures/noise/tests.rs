use glam::Vec2;
use proptest::prelude::*;

use super::*;

const LANES: usize = F32x16::LANES;

const F: IVec2 = IVec2::new(5, 7);

/// One point after the other, as in the papers: the oracle.
mod reference {
    use glam::{IVec2, Vec2};

    fn scramble(mut h: u32) -> u32 {
        h ^= h >> 16;
        h = h.wrapping_mul(0x7FEB_352D);
        h ^= h >> 15;
        h = h.wrapping_mul(0x846C_A68B);
        h ^ (h >> 16)
    }

    fn hash(cell: IVec2, frequency: IVec2, seed: u32) -> u32 {
        let (x, y) = (
            cell.x.rem_euclid(frequency.x),
            cell.y.rem_euclid(frequency.y),
        );
        let x = (x as u32).wrapping_mul(0x9E37_79B1);
        let y = (y as u32).wrapping_mul(0x85EB_CA77);
        scramble(
            x.wrapping_add(y)
                .wrapping_add(seed.wrapping_mul(0xC2B2_AE3D)),
        )
    }

    fn unit(h: u32) -> f32 {
        (h >> 8) as f32 / (1 << 24) as f32
    }

    fn corners(q: Vec2, of: impl Fn(IVec2, Vec2) -> f32) -> f32 {
        let (cell, r) = (q.floor(), q - q.floor());
        let f = r * r * r * (r * (r * 6.0 - 15.0) + 10.0);
        let at = |x: i32, y: i32| {
            let corner = IVec2::new(x, y);
            of(cell.as_ivec2() + corner, r - corner.as_vec2())
        };
        let low = at(0, 0) + (at(1, 0) - at(0, 0)) * f.x;
        let high = at(0, 1) + (at(1, 1) - at(0, 1)) * f.x;
        low + (high - low) * f.y
    }

    pub(super) fn value(p: Vec2, frequency: IVec2, seed: u32) -> f32 {
        let q = p * frequency.as_vec2();
        corners(q, |cell, _| unit(hash(cell, frequency, seed)))
    }

    const A: f32 = 0.923_879_5;
    const B: f32 = 0.382_683_43;
    const C: f32 = std::f32::consts::FRAC_1_SQRT_2;
    const QUARTER: [Vec2; 4] = [
        Vec2::new(1.0, 0.0),
        Vec2::new(A, B),
        Vec2::new(C, C),
        Vec2::new(B, A),
    ];

    pub(super) fn gradient(p: Vec2, frequency: IVec2, seed: u32) -> f32 {
        let q = p * frequency.as_vec2();
        let sum = corners(q, |cell, offset| {
            let k = hash(cell, frequency, seed) >> 28;
            let turned = (0..k / 4).fold(QUARTER[k as usize % 4], |v, _| v.perp());
            turned.dot(offset)
        });
        1.5 * sum
    }

    /// F1, F2, the offset and the identity.
    pub(super) fn worley(p: Vec2, frequency: IVec2, seed: u32) -> (f32, f32, Vec2, u32) {
        let q = p * frequency.as_vec2();
        let mut points: Vec<(f32, Vec2, u32)> = Vec::new();
        for dy in -1..=1 {
            for dx in -1..=1 {
                let step = IVec2::new(dx, dy);
                let h = hash(q.floor().as_ivec2() + step, frequency, seed);
                let point = Vec2::new((h & 0xFFFF) as f32, (h >> 16) as f32) / 65536.0;
                let point = 0.5 + 1.0 * (point - 0.5);
                let offset = q - q.floor() - point - step.as_vec2();
                points.push((offset.length_squared(), offset, scramble(h)));
            }
        }
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (f1, offset, id) = points[0];
        (f1.sqrt(), points[1].0.sqrt(), offset, id)
    }
}

/// Points in a row from `p`, and each of them.
fn side_by_side(p: Vec2) -> (Vec2x16, [Vec2; LANES]) {
    let points = std::array::from_fn(|i| p + i as f32 * Vec2::new(0.113, 0.071));
    let lanes = |of: fn(Vec2) -> f32| F32x16::new(points.map(of));
    (Vec2x16::new(lanes(|p| p.x), lanes(|p| p.y)), points)
}

proptest! {
    /// Bit for bit: instruction sets, bits of directions and masks change nothing.
    #[test]
    fn points_side_by_side_have_the_noise_of_each(
        x in -3.0_f32..3.0,
        y in -3.0_f32..3.0,
        (fx, fy) in (1_i32..300, 1_i32..300),
        seed: u32,
    ) {
        let (lanes, points) = side_by_side(Vec2::new(x, y));
        let f = IVec2::new(fx, fy);
        let got = value(lanes, f, seed).to_array();
        prop_assert_eq!(got, points.map(|p| reference::value(p, f, seed)));
        let got = gradient(lanes, f, seed).to_array();
        prop_assert_eq!(got, points.map(|p| reference::gradient(p, f, seed)));
        let got = worley(lanes, f, 1.0, seed);
        let want = points.map(|p| reference::worley(p, f, seed));
        prop_assert_eq!(got.f1.to_array(), want.map(|w| w.0));
        prop_assert_eq!(got.f2.to_array(), want.map(|w| w.1));
        prop_assert_eq!(got.offset.x.to_array(), want.map(|w| w.2.x));
        prop_assert_eq!(got.offset.y.to_array(), want.map(|w| w.2.y));
        prop_assert_eq!(got.id.to_array(), want.map(|w| w.3));
    }

    /// The code for older processors, which this one would not choose.
    #[test]
    fn every_instruction_set_has_the_same_bits(
        x in -3.0_f32..3.0,
        y in -3.0_f32..3.0,
        seed: u32,
    ) {
        let (p, _) = side_by_side(Vec2::new(x, y));
        prop_assert_eq!(inline_gradient(p, F, seed), gradient(p, F, seed));
        prop_assert_eq!(octave_sum::<false>(p, F, 4, 0.6, seed), fbm(p, F, 4, 0.6, seed));
        prop_assert_eq!(octave_sum::<true>(p, F, 3, 0.6, seed), ridged(p, F, 3, 0.6, seed));
    }

    #[test]
    fn octaves_are_the_weighted_mean_of_gradient_noise(
        x in 0.0_f32..1.0,
        y in 0.0_f32..1.0,
        seed: u32,
    ) {
        let p = Vec2::new(x, y);
        let octave = |o: u32| reference::gradient(p, F * (1 << o), seed.wrapping_add(o));
        let want = (octave(0) + 0.5 * octave(1) + 0.25 * octave(2)) / 1.75;
        prop_assert!((at::fbm(p, F, 3, 0.5, seed) - want).abs() < 1e-6);
        let ridge = |o: u32| (1.0 - octave(o).abs().min(1.0)).powi(2);
        let want = (ridge(0) + 0.5 * ridge(1)) / 1.5;
        let got = ridged(Vec2x16::new(x, y), F, 2, 0.5, seed).to_array()[0];
        prop_assert!((got - want).abs() < 1e-6);
    }

    #[test]
    fn everything_repeats(
        x in 0.0_f32..1.0,
        y in 0.0_f32..1.0,
        i in -2_i32..3,
        j in -2_i32..3,
        seed: u32,
    ) {
        let p = Vec2x16::new(x, y);
        let q = Vec2x16::new(x + i as f32, y + j as f32);
        let differ = |noise: fn(Vec2x16, u32) -> F32x16| {
            (noise(p, seed) - noise(q, seed)).to_array()[0].abs()
        };
        prop_assert!(differ(|p, seed| value(p, F, seed)) < 1e-3);
        prop_assert!(differ(|p, seed| fbm(p, F, 4, 0.5, seed)) < 2e-3);
        prop_assert!(differ(|p, seed| ridged(p, F, 3, 0.5, seed)) < 4e-3);
        prop_assert!(differ(|p, seed| worley(p, F, 0.9, seed).f1) < 1e-3);
    }

    #[test]
    fn ranges_hold(x in -3.0_f32..3.0, y in -3.0_f32..3.0, seed: u32) {
        let p = Vec2x16::new(x, y);
        let first = |lanes: F32x16| lanes.to_array()[0];
        prop_assert!((0.0..=1.0).contains(&first(value(p, F, seed))));
        prop_assert!(first(gradient(p, F, seed)).abs() <= 1.1);
        prop_assert!((0.0..=1.0).contains(&first(ridged(p, F, 4, 0.5, seed))));
        let w = worley(p, F, 1.0, seed);
        let (f1, f2) = (first(w.f1), first(w.f2));
        prop_assert!(f1 <= f2 && f1 < 1.5 && (first(w.offset.length()) - f1).abs() < 1e-5);
    }

    /// The oracle: all feature points of a 5 x 5 neighbourhood, sorted. With one point in each
    /// cell and a jitter of at most 1/2, a point outside the 3 x 3 neighbourhood can be nearer
    /// than F2, but never nearer than F1.
    #[test]
    fn worley_finds_the_nearest_point(x in 0.0_f32..1.0, y in 0.0_f32..1.0, seed: u32) {
        let p = Vec2::new(x, y) * F.as_vec2();
        let mut d: Vec<f32> = Vec::new();
        for cy in -2..9_i32 {
            for cx in -2..8_i32 {
                let lattice = (cx.rem_euclid(F.x) as u32, cy.rem_euclid(F.y) as u32);
                let (mx, my) = (U32x16::splat(lattice.0), U32x16::splat(lattice.1));
                let h = scramble(mix_x(mx) + mix_y(my, seed)).to_array()[0];
                let j = Vec2::new((h & 0xFFFF) as f32, (h >> 16) as f32) / 65536.0;
                d.push(p.distance(Vec2::new(cx as f32, cy as f32) + 0.5 + 0.5 * (j - 0.5)));
            }
        }
        d.sort_by(f32::total_cmp);
        let got = worley(Vec2x16::new(x, y), F, 0.5, seed).f1.to_array()[0];
        prop_assert!((got - d[0]).abs() < 1e-4);
    }
}

#[test]
fn noise_has_no_drift_and_the_lattice_shows() {
    let n = 200;
    let at = |i: i32| Vec2::new((i % n) as f32, (i / n) as f32) / n as f32;
    let sum: f32 = (0..n * n)
        .map(|i| at::fbm(at(i), IVec2::splat(16), 3, 0.5, 9))
        .sum();
    let mean = sum / (n * n) as f32;
    assert!(mean.abs() < 0.03, "{mean}");
    let corner = Vec2x16::new(0.25, 0.75);
    assert_eq!(gradient(corner, IVec2::splat(4), 3), F32x16::splat(0.0));
}

#[test]
fn value_stability() {
    let p = Vec2x16::new(0.37, 0.81);
    let got = [
        value(p, F, 7),
        fbm(p, F, 4, 0.5, 7),
        ridged(p, F, 3, 0.5, 7),
        worley(p, F, 1.0, 7).border(),
    ];
    let got = got.map(|lanes| lanes.to_array()[0]);
    assert_eq!(format!("{got:?}"), VALUES);
}
const VALUES: &str = "[0.2101686, -0.31349093, 0.55266714, 0.11242533]";
