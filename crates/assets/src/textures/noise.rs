//! Periodic noise: everything repeats with the unit square, so every texture tiles.
//!
//! A frequency is the number of lattice cells along each side of the unit square; octaves double
//! it, so sums of octaves keep the period, and so does warping the position by a periodic noise.
//! Lattice values are integer hashes (`lowbias32`, C. Wellons 2018), never `sin`, so that every
//! platform gets the same bits.

use glam::{IVec2, Vec2};

/// 32 well-mixed bits for a lattice point.
#[inline]
pub(crate) fn hash(cell: IVec2, seed: u32) -> u32 {
    scramble(mix(cell, seed))
}

/// A lattice point and a seed in one word, not yet mixed.
#[inline]
fn mix(cell: IVec2, seed: u32) -> u32 {
    (cell.x as u32)
        .wrapping_mul(0x9E37_79B1)
        .wrapping_add((cell.y as u32).wrapping_mul(0x85EB_CA77))
        .wrapping_add(seed.wrapping_mul(0xC2B2_AE3D))
}

/// One of 16 values for a lattice point: the first half of [`scramble`], after which the upper bits
/// are mixed well enough.
#[inline]
fn sixteenth(cell: IVec2, seed: u32) -> usize {
    let mut h = mix(cell, seed);
    h ^= h >> 16;
    h = h.wrapping_mul(0x7FEB_352D);
    ((h ^ (h >> 15)).wrapping_mul(0x846C_A68B) >> 28) as usize
}

/// The finaliser of `lowbias32`: a bijection.
#[inline]
pub(crate) fn scramble(mut h: u32) -> u32 {
    h ^= h >> 16;
    h = h.wrapping_mul(0x7FEB_352D);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846C_A68B);
    h ^ (h >> 16)
}

/// A hash as a number in 0..1.
#[inline]
pub(crate) fn unit(h: u32) -> f32 {
    (h >> 8) as f32 * (1.0 / (1_u32 << 24) as f32)
}

/// Hermite step from 0 at `low` to 1 at `high` (which may be the smaller).
#[inline]
pub(crate) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// `i` modulo `period`, 0..period; it divides only where `i` is far outside the tile.
#[inline]
fn wrap(i: i32, period: i32) -> i32 {
    if i < 0 {
        let once = i + period;
        if once >= 0 {
            return once;
        }
    } else if i < period {
        return i;
    } else if i < 2 * period {
        return i - period;
    }
    i.rem_euclid(period)
}

/// The largest integer not above x, for |x| < 2³¹; `f32::floor` is a call on baseline x86-64.
#[inline]
fn floor(x: f32) -> i32 {
    let i = x as i32;
    i - i32::from(x < i as f32)
}

/// The cell of a point in lattice units and the position inside it.
#[inline]
fn cell(q: Vec2) -> (IVec2, Vec2) {
    let c = IVec2::new(floor(q.x), floor(q.y));
    (c, q - c.as_vec2())
}

/// The cell of a point, its position inside it, and the quintic fade of that position.
#[inline]
fn locate(p: Vec2, frequency: IVec2) -> (IVec2, Vec2, Vec2) {
    let (cell, r) = cell(p * frequency.as_vec2());
    let fade = r * r * r * (r * (r * 6.0 - Vec2::splat(15.0)) + Vec2::splat(10.0));
    (cell, r, fade)
}

#[inline]
fn corners<T>(cell: IVec2, frequency: IVec2, at: impl Fn(IVec2) -> T) -> [T; 4] {
    let (x0, y0) = (wrap(cell.x, frequency.x), wrap(cell.y, frequency.y));
    let x1 = if x0 + 1 == frequency.x { 0 } else { x0 + 1 };
    let y1 = if y0 + 1 == frequency.y { 0 } else { y0 + 1 };
    [
        at(IVec2::new(x0, y0)),
        at(IVec2::new(x1, y0)),
        at(IVec2::new(x0, y1)),
        at(IVec2::new(x1, y1)),
    ]
}

#[inline]
fn bilinear([a, b, c, d]: [f32; 4], t: Vec2) -> f32 {
    let low = a + (b - a) * t.x;
    let high = c + (d - c) * t.x;
    low + (high - low) * t.y
}

/// Value noise, 0..1.
#[inline]
pub(crate) fn value(p: Vec2, frequency: IVec2, seed: u32) -> f32 {
    let (cell, _, fade) = locate(p, frequency);
    bilinear(corners(cell, frequency, |c| unit(hash(c, seed))), fade)
}

/// Sixteen unit vectors, 22.5° apart.
const DIRECTIONS: [Vec2; 16] = {
    const A: f32 = 0.923_879_5;
    const B: f32 = 0.382_683_43;
    const C: f32 = std::f32::consts::FRAC_1_SQRT_2;
    [
        Vec2::new(1.0, 0.0),
        Vec2::new(A, B),
        Vec2::new(C, C),
        Vec2::new(B, A),
        Vec2::new(0.0, 1.0),
        Vec2::new(-B, A),
        Vec2::new(-C, C),
        Vec2::new(-A, B),
        Vec2::new(-1.0, 0.0),
        Vec2::new(-A, -B),
        Vec2::new(-C, -C),
        Vec2::new(-B, -A),
        Vec2::new(0.0, -1.0),
        Vec2::new(B, -A),
        Vec2::new(C, -C),
        Vec2::new(A, -B),
    ]
};

/// Gradient noise (Perlin 2002), about -1..1, 0 at lattice points.
#[inline]
pub(crate) fn gradient(p: Vec2, frequency: IVec2, seed: u32) -> f32 {
    let (cell, r, fade) = locate(p, frequency);
    let g = corners(cell, frequency, |c| DIRECTIONS[sixteenth(c, seed)]);
    let dots = [
        g[0].dot(r),
        g[1].dot(r - Vec2::X),
        g[2].dot(r - Vec2::Y),
        g[3].dot(r - Vec2::ONE),
    ];
    1.5 * bilinear(dots, fade)
}

/// Octaves of gradient noise, each twice as fine and `gain` as strong; about -1..1.
#[inline]
pub(crate) fn fbm(p: Vec2, frequency: IVec2, octaves: u32, gain: f32, seed: u32) -> f32 {
    octave_sum(octaves, gain, |o| {
        gradient(p, frequency * (1 << o), seed.wrapping_add(o))
    })
}

/// Octaves of (1 - |gradient noise|)²: sharp ridges; 0..1.
#[inline]
pub(crate) fn ridged(p: Vec2, frequency: IVec2, octaves: u32, gain: f32, seed: u32) -> f32 {
    octave_sum(octaves, gain, |o| {
        let r = 1.0
            - gradient(p, frequency * (1 << o), seed.wrapping_add(o))
                .abs()
                .min(1.0);
        r * r
    })
}

#[inline]
fn octave_sum(octaves: u32, gain: f32, f: impl Fn(u32) -> f32) -> f32 {
    let (mut sum, mut total, mut amplitude) = (0.0, 0.0, 1.0);
    for o in 0..octaves {
        sum += amplitude * f(o);
        total += amplitude;
        amplitude *= gain;
    }
    sum / total
}

/// Moves a point by two octaves of noise, at most about `amount` (in units of the tile).
#[inline]
pub(crate) fn warp(p: Vec2, frequency: IVec2, amount: Vec2, seed: u32) -> Vec2 {
    let x = fbm(p, frequency, 2, 0.5, seed);
    let y = fbm(p, frequency, 2, 0.5, seed.wrapping_add(0x51));
    p + amount * Vec2::new(x, y)
}

/// What Worley noise knows of a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Worley {
    /// Distance to the nearest feature point, in cells.
    pub(crate) f1: f32,
    /// Distance to the second nearest.
    pub(crate) f2: f32,
    /// The vector from the nearest feature point to here, in cells.
    pub(crate) offset: Vec2,
    /// A hash of the nearest feature point.
    pub(crate) id: u32,
}

impl Worley {
    /// Distance to the border between the two nearest cells, in cells (exact along the line between
    /// their points, elsewhere a little less).
    #[inline]
    pub(crate) fn border(&self) -> f32 {
        0.5 * (self.f2 - self.f1)
    }
}

/// Worley noise (1996) with one feature point a cell, `jitter` (0..1) off its centre.
#[inline]
pub(crate) fn worley(p: Vec2, frequency: IVec2, jitter: f32, seed: u32) -> Worley {
    let (cell, r) = cell(p * frequency.as_vec2());
    let (mut f1, mut f2) = (f32::MAX, f32::MAX);
    let (mut offset, mut id) = (Vec2::ZERO, 0);
    for dy in -1..=1 {
        let y = wrap(cell.y + dy, frequency.y);
        for dx in -1..=1 {
            let h = hash(IVec2::new(wrap(cell.x + dx, frequency.x), y), seed);
            let jittered = Vec2::new((h & 0xFFFF) as f32, (h >> 16) as f32) / 65536.0;
            let point = Vec2::splat(0.5) + jitter * (jittered - Vec2::splat(0.5));
            let d = r - point - Vec2::new(dx as f32, dy as f32);
            let d2 = d.length_squared();
            if d2 < f1 {
                f2 = f1;
                f1 = d2;
                offset = d;
                id = h;
            } else if d2 < f2 {
                f2 = d2;
            }
        }
    }
    Worley {
        f1: f1.sqrt(),
        f2: f2.sqrt(),
        offset,
        id: scramble(id),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const F: IVec2 = IVec2::new(5, 7);

    proptest! {
        #[test]
        fn everything_repeats(
            x in 0.0_f32..1.0,
            y in 0.0_f32..1.0,
            i in -2_i32..3,
            j in -2_i32..3,
            seed: u32,
        ) {
            let p = Vec2::new(x, y);
            let q = p + Vec2::new(i as f32, j as f32);
            prop_assert!((value(p, F, seed) - value(q, F, seed)).abs() < 1e-3);
            prop_assert!((fbm(p, F, 4, 0.5, seed) - fbm(q, F, 4, 0.5, seed)).abs() < 2e-3);
            prop_assert!((ridged(p, F, 3, 0.5, seed) - ridged(q, F, 3, 0.5, seed)).abs() < 4e-3);
            prop_assert!((worley(p, F, 0.9, seed).f1 - worley(q, F, 0.9, seed).f1).abs() < 1e-3);
        }

        #[test]
        fn ranges_hold(x in -3.0_f32..3.0, y in -3.0_f32..3.0, seed: u32) {
            let p = Vec2::new(x, y);
            prop_assert!((0.0..=1.0).contains(&value(p, F, seed)));
            prop_assert!(gradient(p, F, seed).abs() <= 1.1);
            prop_assert!((0.0..=1.0).contains(&ridged(p, F, 4, 0.5, seed)));
            let w = worley(p, F, 1.0, seed);
            prop_assert!(w.f1 <= w.f2 && w.f1 < 1.5 && (w.offset.length() - w.f1).abs() < 1e-5);
        }

        /// The oracle: all feature points of a 5 x 5 neighbourhood, sorted. With one point in each
        /// cell and a jitter of at most 1/2, a point outside the 3 x 3 neighbourhood can be nearer
        /// than F2, but never nearer than F1.
        #[test]
        fn worley_finds_the_nearest_point(x in 0.0_f32..1.0, y in 0.0_f32..1.0, seed: u32) {
            let p = Vec2::new(x, y) * F.as_vec2();
            let mut d: Vec<f32> = Vec::new();
            for cy in -2..9 {
                for cx in -2..8 {
                    let h = hash(IVec2::new(wrap(cx, F.x), wrap(cy, F.y)), seed);
                    let j = Vec2::new((h & 0xFFFF) as f32, (h >> 16) as f32) / 65536.0;
                    d.push(p.distance(Vec2::new(cx as f32, cy as f32) + 0.5 + 0.5 * (j - 0.5)));
                }
            }
            d.sort_by(f32::total_cmp);
            prop_assert!((worley(Vec2::new(x, y), F, 0.5, seed).f1 - d[0]).abs() < 1e-4);
        }
    }

    #[test]
    fn floors_and_wraps_are_the_usual_ones() {
        for i in -40..40 {
            let x = i as f32 * 0.37;
            assert_eq!(floor(x), x.floor() as i32);
            assert_eq!(wrap(i, 7), i.rem_euclid(7));
        }
    }

    #[test]
    fn noise_has_no_drift_and_the_lattice_shows() {
        let n = 200;
        let mean = (0..n * n)
            .map(|i| {
                fbm(
                    Vec2::new((i % n) as f32, (i / n) as f32) / n as f32,
                    IVec2::splat(16),
                    3,
                    0.5,
                    9,
                )
            })
            .sum::<f32>()
            / (n * n) as f32;
        assert!(mean.abs() < 0.03, "{mean}");
        assert_eq!(gradient(Vec2::new(0.25, 0.75), IVec2::splat(4), 3), 0.0);
    }

    #[test]
    fn value_stability() {
        let p = Vec2::new(0.37, 0.81);
        let got = (
            hash(IVec2::new(3, -4), 7),
            value(p, F, 7),
            fbm(p, F, 4, 0.5, 7),
            ridged(p, F, 3, 0.5, 7),
            worley(p, F, 1.0, 7).border(),
        );
        assert_eq!(format!("{got:?}"), VALUES);
    }
    const VALUES: &str = "(4194409564, 0.2101686, -0.31349093, 0.55266714, 0.11242533)";
}
