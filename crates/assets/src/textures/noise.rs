//! Periodic noise: everything repeats with the unit square, so every texture tiles.
//!
//! A frequency is the number of lattice cells along each side of the unit square; octaves double
//! it, so sums of octaves keep the period, and so does warping the position by a periodic noise.
//! Lattice values are integer hashes (`lowbias32`, C. Wellons 2018), never `sin`, so that every
//! platform gets the same bits. Positions are at most some hundred tiles from the first.
//!
//! Eight points are computed side by side ([`crate::lanes`]) by code that is compiled several
//! times, for the vector registers of older and of newer processors; the bits are the same. [`at`]
//! has the noise of single points.

use glam::IVec2;

use crate::lanes::{F32x8, U32x8, Vec2x8, for_each_instruction_set};

/// The part of a lattice point's hash that comes from its x coordinate.
#[inline(always)]
fn mix_x(x: U32x8) -> U32x8 {
    x * 0x9E37_79B1
}

/// The part of a lattice point's hash that comes from its y coordinate and a seed.
#[inline(always)]
fn mix_y(y: U32x8, seed: u32) -> U32x8 {
    y * 0x85EB_CA77 + seed.wrapping_mul(0xC2B2_AE3D)
}

/// The finaliser of `lowbias32`: a bijection.
#[inline(always)]
pub(crate) fn scramble(h: U32x8) -> U32x8 {
    let h = h ^ (h >> 16);
    let h = h * 0x7FEB_352D;
    let h = h ^ (h >> 15);
    let h = h * 0x846C_A68B;
    h ^ (h >> 16)
}

/// One of 16 values for a lattice point: the first half of [`scramble`], after which the upper bits
/// are mixed well enough.
#[inline(always)]
fn sixteenth(h: U32x8) -> U32x8 {
    let h = h ^ (h >> 16);
    let h = h * 0x7FEB_352D;
    ((h ^ (h >> 15)) * 0x846C_A68B) >> 28
}

/// A hash as a number in 0..1.
#[inline(always)]
pub(crate) fn unit(h: U32x8) -> F32x8 {
    (h >> 8).to_f32() * (1.0 / (1_u32 << 24) as f32)
}

/// Hermite step from 0 at `low` to 1 at `high` (which may be the smaller).
#[inline(always)]
pub(crate) fn smoothstep(low: impl Into<F32x8>, high: impl Into<F32x8>, x: F32x8) -> F32x8 {
    let low = low.into();
    let t = ((x - low) / (high.into() - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The lattice coordinates of integers, 0..`frequency`.
#[inline(always)]
fn wrap(cell: F32x8, frequency: f32) -> F32x8 {
    cell - (cell / frequency).floor() * frequency
}

/// A point along one axis of the lattice.
#[derive(Clone, Copy)]
struct Place {
    /// The lattice coordinates before it and after it.
    around: [U32x8; 2],
    /// The distances from these, in cells: 0..1 and -1..0.
    offset: [F32x8; 2],
    /// The quintic fade of the first distance.
    fade: F32x8,
}

#[inline(always)]
fn locate(x: F32x8, frequency: i32) -> Place {
    let frequency = frequency as f32;
    let q = x * frequency;
    let cell = q.floor();
    let r = q - cell;
    let before = wrap(cell, frequency);
    let next = before + 1.0;
    let after = next.lt(frequency).select(next, 0.0);
    Place {
        around: [before.to_u32(), after.to_u32()],
        offset: [r, r - 1.0],
        fade: r * r * r * (r * (r * 6.0 - 15.0) + 10.0),
    }
}

/// The mean of the values of a cell's corners, weighted by the fades of a point in it.
#[inline(always)]
fn bilinear([a, b, c, d]: [F32x8; 4], x: F32x8, y: F32x8) -> F32x8 {
    let low = a + (b - a) * x;
    let high = c + (d - c) * x;
    low + (high - low) * y
}

/// The value at the index whose lower bit `odd` has in all bits, and whose upper bit `half`.
#[inline(always)]
fn one_of_four([a, b, c, d]: [u32; 4], odd: U32x8, half: U32x8) -> U32x8 {
    let first = (odd & (a ^ b)) ^ a;
    let second = (odd & (c ^ d)) ^ c;
    first ^ (half & (first ^ second))
}

/// The scalar product of one of sixteen unit vectors, 22.5° apart, with (x, y).
#[inline(always)]
fn dot_direction(sixteenth: U32x8, x: F32x8, y: F32x8) -> F32x8 {
    const ONE: u32 = 1.0_f32.to_bits();
    const COS_1: u32 = 0.923_879_5_f32.to_bits();
    const COS_2: u32 = std::f32::consts::FRAC_1_SQRT_2.to_bits();
    const COS_3: u32 = 0.382_683_43_f32.to_bits();
    // Within a quarter turn the vector is (1, 0), (cos 1, cos 3), (cos 2, cos 2) or (cos 3, cos 1).
    // Quarters exchange the two and turn signs. All of it by bits: processors are slow at looking
    // up eight things.
    let (odd, half) = (sixteenth.has_bit(0), sixteenth.has_bit(1));
    let cos = one_of_four([ONE, COS_1, COS_2, COS_3], odd, half);
    let sin = one_of_four([0, COS_3, COS_2, COS_1], odd, half);
    let exchanged = (cos ^ sin) & sixteenth.has_bit(2);
    const SIGN: u32 = 1 << 31;
    let below = sixteenth.has_bit(3) & SIGN;
    let left = below ^ (sixteenth.has_bit(2) & SIGN);
    (cos ^ exchanged ^ left).bits_to_f32() * x + (sin ^ exchanged ^ below).bits_to_f32() * y
}

#[inline(always)]
fn inline_gradient(p: Vec2x8, frequency: IVec2, seed: u32) -> F32x8 {
    let (at_x, at_y) = (locate(p.x, frequency.x), locate(p.y, frequency.y));
    let [x0, x1] = [mix_x(at_x.around[0]), mix_x(at_x.around[1])];
    let [y0, y1] = [mix_y(at_y.around[0], seed), mix_y(at_y.around[1], seed)];
    let ([dx0, dx1], [dy0, dy1]) = (at_x.offset, at_y.offset);
    let dots = [
        dot_direction(sixteenth(x0 + y0), dx0, dy0),
        dot_direction(sixteenth(x1 + y0), dx1, dy0),
        dot_direction(sixteenth(x0 + y1), dx0, dy1),
        dot_direction(sixteenth(x1 + y1), dx1, dy1),
    ];
    1.5 * bilinear(dots, at_x.fade, at_y.fade)
}

/// The mean of octaves, each twice as fine and `gain` as strong; of (1 - |octave|)² if `RIDGED`.
#[inline(always)]
fn octave_sum<const RIDGED: bool>(
    p: Vec2x8,
    frequency: IVec2,
    octaves: u32,
    gain: f32,
    seed: u32,
) -> F32x8 {
    let (mut sum, mut total, mut amplitude) = (F32x8::splat(0.0), 0.0, 1.0);
    for o in 0..octaves {
        let mut octave = inline_gradient(p, frequency * (1 << o), seed.wrapping_add(o));
        if RIDGED {
            let r = 1.0 - octave.abs().min(1.0);
            octave = r * r;
        }
        sum += amplitude * octave;
        total += amplitude;
        amplitude *= gain;
    }
    sum / total
}

/// A coordinate of a feature point in its cell, from 16 bits.
#[inline(always)]
fn feature(sixteen_bits: U32x8, jitter: f32) -> F32x8 {
    0.5 + jitter * (sixteen_bits.to_f32() / 65536.0 - 0.5)
}

for_each_instruction_set! {
    /// Value noise, 0..1.
    pub(crate) fn value(p: Vec2x8, frequency: IVec2, seed: u32) -> F32x8 {
        let (at_x, at_y) = (locate(p.x, frequency.x), locate(p.y, frequency.y));
        let [x0, x1] = [mix_x(at_x.around[0]), mix_x(at_x.around[1])];
        let [y0, y1] = [mix_y(at_y.around[0], seed), mix_y(at_y.around[1], seed)];
        let corners = [
            unit(scramble(x0 + y0)),
            unit(scramble(x1 + y0)),
            unit(scramble(x0 + y1)),
            unit(scramble(x1 + y1)),
        ];
        bilinear(corners, at_x.fade, at_y.fade)
    }

    /// Gradient noise (Perlin 2002), about -1..1, 0 at lattice points.
    pub(crate) fn gradient(p: Vec2x8, frequency: IVec2, seed: u32) -> F32x8 {
        inline_gradient(p, frequency, seed)
    }

    /// Octaves of gradient noise, each twice as fine and `gain` as strong; about -1..1.
    pub(crate) fn fbm(
        p: Vec2x8,
        frequency: IVec2,
        octaves: u32,
        gain: f32,
        seed: u32,
    ) -> F32x8 {
        octave_sum::<false>(p, frequency, octaves, gain, seed)
    }

    /// Octaves of (1 - |gradient noise|)²: sharp ridges; 0..1.
    pub(crate) fn ridged(
        p: Vec2x8,
        frequency: IVec2,
        octaves: u32,
        gain: f32,
        seed: u32,
    ) -> F32x8 {
        octave_sum::<true>(p, frequency, octaves, gain, seed)
    }

    /// Worley noise (1996) with one feature point a cell, `jitter` (0..1) off its centre.
    pub(crate) fn worley(p: Vec2x8, frequency: IVec2, jitter: f32, seed: u32) -> Worley {
        let (fx, fy) = (frequency.x as f32, frequency.y as f32);
        let (qx, qy) = (p.x * fx, p.y * fy);
        let (cell_x, cell_y) = (qx.floor(), qy.floor());
        let (rx, ry) = (qx - cell_x, qy - cell_y);
        let mut nearest = Worley {
            f1: F32x8::splat(f32::MAX),
            f2: F32x8::splat(f32::MAX),
            offset: Vec2x8::new(0.0, 0.0),
            id: U32x8::splat(0),
        };
        for dy in [-1.0, 0.0, 1.0] {
            let row = mix_y(wrap(cell_y + dy, fy).to_u32(), seed);
            for dx in [-1.0, 0.0, 1.0] {
                let h = scramble(mix_x(wrap(cell_x + dx, fx).to_u32()) + row);
                let x = rx - feature(h & 0xFFFF, jitter) - dx;
                let y = ry - feature(h >> 16, jitter) - dy;
                let d2 = x * x + y * y;
                let (is_first, is_second) = (d2.lt(nearest.f1), d2.lt(nearest.f2));
                let second = is_second.select(d2, nearest.f2);
                nearest = Worley {
                    f1: is_first.select(d2, nearest.f1),
                    f2: is_first.select(nearest.f1, second),
                    offset: Vec2x8 {
                        x: is_first.select(x, nearest.offset.x),
                        y: is_first.select(y, nearest.offset.y),
                    },
                    id: is_first.select_word(h, nearest.id),
                };
            }
        }
        Worley {
            f1: nearest.f1.sqrt(),
            f2: nearest.f2.sqrt(),
            id: scramble(nearest.id),
            ..nearest
        }
    }
}

/// Moves a point by two octaves of noise, at most about `x` and `y` (in units of the tile).
pub(crate) fn warp(p: Vec2x8, frequency: IVec2, (x, y): (f32, f32), seed: u32) -> Vec2x8 {
    Vec2x8 {
        x: p.x + x * fbm(p, frequency, 2, 0.5, seed),
        y: p.y + y * fbm(p, frequency, 2, 0.5, seed.wrapping_add(0x51)),
    }
}

/// What Worley noise knows of a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Worley {
    /// Distance to the nearest feature point, in cells.
    pub(crate) f1: F32x8,
    /// Distance to the second nearest.
    pub(crate) f2: F32x8,
    /// The vector from the nearest feature point to here, in cells.
    pub(crate) offset: Vec2x8,
    /// A hash of the nearest feature point.
    pub(crate) id: U32x8,
}

impl Worley {
    /// Distance to the border between the two nearest cells, in cells (exact along the line between
    /// their points, elsewhere a little less).
    #[inline]
    pub(crate) fn border(&self) -> F32x8 {
        0.5 * (self.f2 - self.f1)
    }
}

/// The noise of single points, for shapes.
pub(crate) mod at {
    use glam::{IVec2, Vec2};

    use super::{F32x8, U32x8, Vec2x8};

    fn first(lanes: F32x8) -> f32 {
        lanes.to_array()[0]
    }

    /// See [`super::fbm`].
    pub(crate) fn fbm(p: Vec2, frequency: IVec2, octaves: u32, gain: f32, seed: u32) -> f32 {
        let p = Vec2x8::new(p.x, p.y);
        first(super::fbm(p, frequency, octaves, gain, seed))
    }

    /// See [`super::smoothstep`].
    pub(crate) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
        first(super::smoothstep(low, high, F32x8::splat(x)))
    }

    /// See [`super::scramble`].
    pub(crate) fn scramble(h: u32) -> u32 {
        super::scramble(U32x8::splat(h)).to_array()[0]
    }

    /// See [`super::unit`].
    pub(crate) fn unit(h: u32) -> f32 {
        first(super::unit(U32x8::splat(h)))
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use proptest::prelude::*;

    use super::*;
    use crate::lanes::LANES;

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

    /// Eight points in a row from `p`, and each of them.
    fn eight(p: Vec2) -> (Vec2x8, [Vec2; LANES]) {
        let points = std::array::from_fn(|i| p + i as f32 * Vec2::new(0.113, 0.071));
        let lanes = |of: fn(Vec2) -> f32| F32x8::new(points.map(of));
        (Vec2x8::new(lanes(|p| p.x), lanes(|p| p.y)), points)
    }

    proptest! {
        /// Bit for bit: instruction sets, bits of directions and masks change nothing.
        #[test]
        fn eight_points_have_the_noise_of_each(
            x in -3.0_f32..3.0,
            y in -3.0_f32..3.0,
            (fx, fy) in (1_i32..300, 1_i32..300),
            seed: u32,
        ) {
            let (eight, points) = eight(Vec2::new(x, y));
            let f = IVec2::new(fx, fy);
            let got = value(eight, f, seed).to_array();
            prop_assert_eq!(got, points.map(|p| reference::value(p, f, seed)));
            let got = gradient(eight, f, seed).to_array();
            prop_assert_eq!(got, points.map(|p| reference::gradient(p, f, seed)));
            let got = worley(eight, f, 1.0, seed);
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
            let (p, _) = eight(Vec2::new(x, y));
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
            let got = ridged(Vec2x8::new(x, y), F, 2, 0.5, seed).to_array()[0];
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
            let p = Vec2x8::new(x, y);
            let q = Vec2x8::new(x + i as f32, y + j as f32);
            let differ = |noise: fn(Vec2x8, u32) -> F32x8| {
                (noise(p, seed) - noise(q, seed)).to_array()[0].abs()
            };
            prop_assert!(differ(|p, seed| value(p, F, seed)) < 1e-3);
            prop_assert!(differ(|p, seed| fbm(p, F, 4, 0.5, seed)) < 2e-3);
            prop_assert!(differ(|p, seed| ridged(p, F, 3, 0.5, seed)) < 4e-3);
            prop_assert!(differ(|p, seed| worley(p, F, 0.9, seed).f1) < 1e-3);
        }

        #[test]
        fn ranges_hold(x in -3.0_f32..3.0, y in -3.0_f32..3.0, seed: u32) {
            let p = Vec2x8::new(x, y);
            let first = |lanes: F32x8| lanes.to_array()[0];
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
                    let (mx, my) = (U32x8::splat(lattice.0), U32x8::splat(lattice.1));
                    let h = scramble(mix_x(mx) + mix_y(my, seed)).to_array()[0];
                    let j = Vec2::new((h & 0xFFFF) as f32, (h >> 16) as f32) / 65536.0;
                    d.push(p.distance(Vec2::new(cx as f32, cy as f32) + 0.5 + 0.5 * (j - 0.5)));
                }
            }
            d.sort_by(f32::total_cmp);
            let got = worley(Vec2x8::new(x, y), F, 0.5, seed).f1.to_array()[0];
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
        let corner = Vec2x8::new(0.25, 0.75);
        assert_eq!(gradient(corner, IVec2::splat(4), 3), F32x8::splat(0.0));
    }

    #[test]
    fn value_stability() {
        let p = Vec2x8::new(0.37, 0.81);
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
}
