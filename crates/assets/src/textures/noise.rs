//! Periodic noise: everything repeats with the unit square, so every texture tiles.
//!
//! A frequency is the number of lattice cells along each side of the unit square; octaves double
//! it, so sums of octaves keep the period, and so does warping the position by a periodic noise.
//! Lattice values are integer hashes (`lowbias32`, C. Wellons 2018), never `sin`, so that every
//! platform gets the same bits. Positions are at most some hundred tiles from the first.
//!
//! Sixteen points are computed side by side ([`crate::lanes`]) by code that is compiled several
//! times, for the vector registers of older and of newer processors; the bits are the same. (Eight
//! would fill a register, but would wait for each other's results, and calls would cost more.)
//! [`at`] has the noise of single points.

use glam::IVec2;

use crate::lanes::{F32x16, U32x16, Vec2x16, for_each_instruction_set};

/// The part of a lattice point's hash that comes from its x coordinate.
#[inline(always)]
fn mix_x(x: U32x16) -> U32x16 {
    x * 0x9E37_79B1
}

/// The part of a lattice point's hash that comes from its y coordinate and a seed.
#[inline(always)]
fn mix_y(y: U32x16, seed: u32) -> U32x16 {
    y * 0x85EB_CA77 + seed.wrapping_mul(0xC2B2_AE3D)
}

/// The finaliser of `lowbias32`: a bijection.
#[inline(always)]
pub(crate) fn scramble(h: U32x16) -> U32x16 {
    let h = h ^ (h >> 16);
    let h = h * 0x7FEB_352D;
    let h = h ^ (h >> 15);
    let h = h * 0x846C_A68B;
    h ^ (h >> 16)
}

/// One of 16 values for a lattice point: the first half of [`scramble`], after which the upper bits
/// are mixed well enough.
#[inline(always)]
fn sixteenth(h: U32x16) -> U32x16 {
    let h = h ^ (h >> 16);
    let h = h * 0x7FEB_352D;
    ((h ^ (h >> 15)) * 0x846C_A68B) >> 28
}

/// A hash as a number in 0..1.
#[inline(always)]
pub(crate) fn unit(h: U32x16) -> F32x16 {
    (h >> 8).to_f32() * (1.0 / (1_u32 << 24) as f32)
}

/// Hermite step from 0 at `low` to 1 at `high` (which may be the smaller).
#[inline(always)]
pub(crate) fn smoothstep(low: impl Into<F32x16>, high: impl Into<F32x16>, x: F32x16) -> F32x16 {
    let low = low.into();
    let t = ((x - low) / (high.into() - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The lattice coordinates of integers, 0..`frequency`.
#[inline(always)]
fn wrap(cell: F32x16, frequency: f32) -> F32x16 {
    cell - (cell / frequency).floor() * frequency
}

/// A point along one axis of the lattice.
#[derive(Clone, Copy)]
struct Place {
    /// The lattice coordinates before it and after it.
    around: [U32x16; 2],
    /// The distances from these, in cells: 0..1 and -1..0.
    offset: [F32x16; 2],
    /// The quintic fade of the first distance.
    fade: F32x16,
}

#[inline(always)]
fn locate(x: F32x16, frequency: i32) -> Place {
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

/// A point in a cell of the lattice.
#[derive(Clone, Copy)]
struct InCell {
    x: Place,
    y: Place,
    /// The corners' hashes, not yet mixed.
    corners: [U32x16; 4],
}

impl InCell {
    #[inline(always)]
    fn new(p: Vec2x16, frequency: IVec2, seed: u32) -> Self {
        let (x, y) = (locate(p.x, frequency.x), locate(p.y, frequency.y));
        let [x0, x1] = [mix_x(x.around[0]), mix_x(x.around[1])];
        let [y0, y1] = [mix_y(y.around[0], seed), mix_y(y.around[1], seed)];
        let corners = [x0 + y0, x1 + y0, x0 + y1, x1 + y1];
        Self { x, y, corners }
    }

    /// The mean of the values at the corners, weighted by the fades.
    #[inline(always)]
    fn bilinear(&self, [a, b, c, d]: [F32x16; 4]) -> F32x16 {
        let low = a + (b - a) * self.x.fade;
        let high = c + (d - c) * self.x.fade;
        low + (high - low) * self.y.fade
    }
}

/// The value at the index whose lower bit `odd` has in all bits, and whose upper bit `half`.
#[inline(always)]
fn one_of_four([a, b, c, d]: [u32; 4], odd: U32x16, half: U32x16) -> U32x16 {
    let first = (odd & (a ^ b)) ^ a;
    let second = (odd & (c ^ d)) ^ c;
    first ^ (half & (first ^ second))
}

/// The scalar product of one of sixteen unit vectors, 22.5° apart, with (x, y).
#[inline(always)]
fn dot_direction(sixteenth: U32x16, x: F32x16, y: F32x16) -> F32x16 {
    const ONE: u32 = 1.0_f32.to_bits();
    const COS_1: u32 = 0.923_879_5_f32.to_bits();
    const COS_2: u32 = std::f32::consts::FRAC_1_SQRT_2.to_bits();
    const COS_3: u32 = 0.382_683_43_f32.to_bits();
    // Within a quarter turn the vector is (1, 0), (cos 1, cos 3), (cos 2, cos 2) or (cos 3, cos 1).
    // Quarters exchange the two and turn signs. All of it by bits: processors are slow at looking
    // up things lane by lane.
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
fn inline_gradient(p: Vec2x16, frequency: IVec2, seed: u32) -> F32x16 {
    let cell = InCell::new(p, frequency, seed);
    let [a, b, c, d] = cell.corners;
    let ([x0, x1], [y0, y1]) = (cell.x.offset, cell.y.offset);
    let dots = [
        dot_direction(sixteenth(a), x0, y0),
        dot_direction(sixteenth(b), x1, y0),
        dot_direction(sixteenth(c), x0, y1),
        dot_direction(sixteenth(d), x1, y1),
    ];
    1.5 * cell.bilinear(dots)
}

/// The mean of octaves, each twice as fine and `gain` as strong; of (1 - |octave|)² if `RIDGED`.
#[inline(always)]
fn octave_sum<const RIDGED: bool>(
    p: Vec2x16,
    frequency: IVec2,
    octaves: u32,
    gain: f32,
    seed: u32,
) -> F32x16 {
    let (mut sum, mut total, mut amplitude) = (F32x16::splat(0.0), 0.0, 1.0);
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
fn feature(sixteen_bits: U32x16, jitter: f32) -> F32x16 {
    0.5 + jitter * (sixteen_bits.to_f32() / 65536.0 - 0.5)
}

for_each_instruction_set! {
    /// Value noise, 0..1.
    pub(crate) fn value(p: Vec2x16, frequency: IVec2, seed: u32) -> F32x16 {
        let cell = InCell::new(p, frequency, seed);
        let [a, b, c, d] = cell.corners;
        let values = [
            unit(scramble(a)),
            unit(scramble(b)),
            unit(scramble(c)),
            unit(scramble(d)),
        ];
        cell.bilinear(values)
    }

    /// Gradient noise (Perlin 2002), about -1..1, 0 at lattice points.
    pub(crate) fn gradient(p: Vec2x16, frequency: IVec2, seed: u32) -> F32x16 {
        inline_gradient(p, frequency, seed)
    }

    /// Octaves of gradient noise, each twice as fine and `gain` as strong; about -1..1.
    pub(crate) fn fbm(
        p: Vec2x16,
        frequency: IVec2,
        octaves: u32,
        gain: f32,
        seed: u32,
    ) -> F32x16 {
        octave_sum::<false>(p, frequency, octaves, gain, seed)
    }

    /// Octaves of (1 - |gradient noise|)²: sharp ridges; 0..1.
    pub(crate) fn ridged(
        p: Vec2x16,
        frequency: IVec2,
        octaves: u32,
        gain: f32,
        seed: u32,
    ) -> F32x16 {
        octave_sum::<true>(p, frequency, octaves, gain, seed)
    }

    /// Worley noise (1996) with one feature point a cell, `jitter` (0..1) off its centre.
    pub(crate) fn worley(p: Vec2x16, frequency: IVec2, jitter: f32, seed: u32) -> Worley {
        let (fx, fy) = (frequency.x as f32, frequency.y as f32);
        let (qx, qy) = (p.x * fx, p.y * fy);
        let (cell_x, cell_y) = (qx.floor(), qy.floor());
        let (rx, ry) = (qx - cell_x, qy - cell_y);
        let mut nearest = Worley {
            f1: F32x16::splat(f32::MAX),
            f2: F32x16::splat(f32::MAX),
            offset: Vec2x16::new(0.0, 0.0),
            id: U32x16::splat(0),
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
                    offset: Vec2x16 {
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
pub(crate) fn warp(p: Vec2x16, frequency: IVec2, (x, y): (f32, f32), seed: u32) -> Vec2x16 {
    Vec2x16 {
        x: p.x + x * fbm(p, frequency, 2, 0.5, seed),
        y: p.y + y * fbm(p, frequency, 2, 0.5, seed.wrapping_add(0x51)),
    }
}

/// What Worley noise knows of a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Worley {
    /// Distance to the nearest feature point, in cells.
    pub(crate) f1: F32x16,
    /// Distance to the second nearest.
    pub(crate) f2: F32x16,
    /// The vector from the nearest feature point to here, in cells.
    pub(crate) offset: Vec2x16,
    /// A hash of the nearest feature point.
    pub(crate) id: U32x16,
}

impl Worley {
    /// Distance to the border between the two nearest cells, in cells (exact along the line between
    /// their points, elsewhere a little less).
    #[inline]
    pub(crate) fn border(&self) -> F32x16 {
        0.5 * (self.f2 - self.f1)
    }
}

/// The noise of single points, for shapes.
pub(crate) mod at {
    use glam::{IVec2, Vec2};

    use super::{F32x16, U32x16, Vec2x16};

    fn first(lanes: F32x16) -> f32 {
        lanes.to_array()[0]
    }

    /// See [`super::fbm`].
    pub(crate) fn fbm(p: Vec2, frequency: IVec2, octaves: u32, gain: f32, seed: u32) -> f32 {
        let p = Vec2x16::new(p.x, p.y);
        first(super::fbm(p, frequency, octaves, gain, seed))
    }

    /// See [`super::smoothstep`].
    pub(crate) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
        first(super::smoothstep(low, high, F32x16::splat(x)))
    }

    /// See [`super::scramble`].
    pub(crate) fn scramble(h: u32) -> u32 {
        super::scramble(U32x16::splat(h)).to_array()[0]
    }

    /// See [`super::unit`].
    pub(crate) fn unit(h: u32) -> f32 {
        first(super::unit(U32x16::splat(h)))
    }
}

#[cfg(test)]
mod tests;
