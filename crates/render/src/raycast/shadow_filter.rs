//! Soft shadows by one shadow ray per pixel, filtered over the neighbours on the same surface.

use glam::Vec3;
use rayon::prelude::*;

use super::frame_buffer::{DirectLight, FrameBuffer, SAME_DEPTH, SAME_NORMAL, filled};
use super::penumbra::penumbrae;

/// Rows that are processed together, as they share the rows around them.
const ROWS: usize = 16;
/// The greatest distance of pixels that contribute to a pixel's shadow, pixels.
const REACH: usize = 2;
/// The weight of a pixel by its distance along a row or a column: the mean of three, taken twice.
const WEIGHTS: [f32; 2 * REACH + 1] = [1.0, 2.0, 3.0, 2.0, 1.0];

/// Adds the light of sun and lamps, by the share of their discs that is visible to the surrounding
/// pixels on the same surface; for the sun as far around as the penumbra is wide there.
pub(super) fn add_filtered_light(frame: &mut FrameBuffer, focal_px: f32) {
    let shares = fractions(frame, &frame.sun);
    frame.sun.share = penumbrae(frame, &shares, focal_px);
    add_light(&mut frame.linear, &frame.sun);
    for number in 0..frame.lamps.len() {
        frame.lamps[number].share = fractions(frame, &frame.lamps[number]);
        add_light(&mut frame.linear, &frame.lamps[number]);
    }
}

/// The visible share of a source's disc for each pixel.
fn fractions(frame: &FrameBuffer, source: &DirectLight) -> Vec<f32> {
    let width = frame.width;
    let mut shares = filled(0.0, source.radiance.len());
    shares
        .par_chunks_mut(width * ROWS)
        .enumerate()
        .for_each(|(strip, shares)| {
            let rows = shares.len() / width;
            shares.copy_from_slice(&fractions_of_rows(frame, source, strip * ROWS, rows));
        });
    shares
}

/// Adds a source's light by the shares of its disc.
fn add_light(linear: &mut [Vec3], source: &DirectLight) {
    let light = source.radiance.par_iter().zip(&source.share);
    (linear.par_iter_mut().zip(light)).for_each(|(out, (light, share))| *out += *light * *share);
}

/// The visible share of a source's disc for each pixel of `rows` rows from the `first` on: the
/// weighted mean over those of the surrounding 5 × 5 pixels that lie on the same surface, with the
/// weights of a mean over 3 × 3 taken twice.
///
/// The shadow rays of any 3 × 3 pixels go to nine different parts of the disc (see `SunDisc`), all
/// of which have the same weight, so one ray per pixel gives smooth penumbrae. So would a mean over
/// 3 × 3, but where light comes through needles it would show each ray that arrives as a square.
fn fractions_of_rows(
    frame: &FrameBuffer,
    source: &DirectLight,
    first: usize,
    rows: usize,
) -> Vec<f32> {
    let width = frame.width;
    let strip = Strip::new(frame, source, first, rows);
    let (mut seen, mut all) = (vec![0.0; width], vec![0.0; width]);
    let mut shares = Vec::with_capacity(width * rows);
    for row in 0..rows {
        seen.fill(0.0);
        all.fill(0.0);
        let here = strip.pixels(row + REACH, REACH);
        for (v, down) in WEIGHTS.iter().enumerate() {
            for (u, right) in WEIGHTS.iter().enumerate() {
                let there = strip.pixels(row + v, u);
                add(&here, &there, down * right, &mut seen, &mut all);
            }
        }
        // A pixel for which the source does not matter has no neighbours on the same surface, not
        // even itself.
        shares.extend(seen.iter().zip(&all).map(|(s, a)| s / a.max(1.0)));
    }
    shares
}

/// Adds `weight` to `all` for each pixel of `here` whose counterpart in `there` lies on the same
/// surface, and to `seen` if that is in the source's light. It is one pass over plain rows
/// without a branch, which compilers can vectorise.
fn add(here: &Pixels, there: &Pixels, weight: f32, seen: &mut [f32], all: &mut [f32]) {
    let n = seen.len();
    let (a, b) = (here.cut(n), there.cut(n));
    let all = &mut all[..n];
    for i in 0..n {
        let cosine = a.normal[0][i] * b.normal[0][i]
            + a.normal[1][i] * b.normal[1][i]
            + a.normal[2][i] * b.normal[2][i];
        let same = (a.object[0][i] == b.object[0][i])
            & (a.object[1][i] == b.object[1][i])
            & ((a.depth_m[i] - b.depth_m[i]).abs() < SAME_DEPTH * a.depth_m[i])
            & (cosine > SAME_NORMAL);
        let weight = if same { weight } else { 0.0 };
        all[i] += weight;
        seen[i] += weight * b.lit[i];
    }
}

/// Some rows of a picture, with a margin of [`REACH`] pixels on all sides, which are empty outside
/// of the picture.
struct Strip {
    stride: usize,
    /// Low and high bits of the id.
    object: [Vec<u32>; 2],
    /// NaN, which is near nothing, where the source does not matter.
    depth_m: Vec<f32>,
    normal: [Vec<f32>; 3],
    lit: Vec<f32>,
}

/// Pixels of a row, from some column on.
struct Pixels<'a> {
    object: [&'a [u32]; 2],
    depth_m: &'a [f32],
    normal: [&'a [f32]; 3],
    lit: &'a [f32],
}

impl Strip {
    fn new(frame: &FrameBuffer, source: &DirectLight, first: usize, rows: usize) -> Self {
        let (width, height) = (frame.width, frame.semantic.len() / frame.width);
        let stride = width + 2 * REACH;
        let n = stride * (rows + 2 * REACH);
        let mut strip = Self {
            stride,
            object: [(); 2].map(|()| vec![0; n]),
            depth_m: vec![f32::NAN; n],
            normal: [(); 3].map(|()| vec![0.0; n]),
            lit: vec![0.0; n],
        };
        for y in first.saturating_sub(REACH)..(first + rows + REACH).min(height) {
            let (from, to) = (y * width, (y + REACH - first) * stride + REACH);
            for x in 0..width {
                let (i, o) = (from + x, to + x);
                let id = frame.object[i].to_u64();
                strip.object[0][o] = id as u32;
                strip.object[1][o] = (id >> 32) as u32;
                if source.radiance[i] != Vec3::ZERO {
                    strip.depth_m[o] = frame.depth_m[i];
                }
                for (axis, out) in strip.normal.iter_mut().enumerate() {
                    out[o] = frame.normal[i][axis];
                }
                strip.lit[o] = f32::from(u8::from(source.lit[i]));
            }
        }
        strip
    }

    fn pixels(&self, row: usize, column: usize) -> Pixels<'_> {
        let from = row * self.stride + column;
        Pixels {
            object: [0, 1].map(|half| &self.object[half][from..]),
            depth_m: &self.depth_m[from..],
            normal: [0, 1, 2].map(|axis| &self.normal[axis][from..]),
            lit: &self.lit[from..],
        }
    }
}

impl<'a> Pixels<'a> {
    /// The first `n`, which tells the compiler their number.
    fn cut(&self, n: usize) -> Pixels<'a> {
        Pixels {
            object: self.object.map(|half| &half[..n]),
            depth_m: &self.depth_m[..n],
            normal: self.normal.map(|axis| &axis[..n]),
            lit: &self.lit[..n],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::{ChunkCoord, ObjectId};
    use proptest::prelude::*;

    #[test]
    fn a_ray_that_arrives_alone_is_a_soft_spot() {
        let mut frame = FrameBuffer::new(9, 9);
        frame.depth_m.fill(3.0);
        frame.normal.fill(Vec3::Z);
        frame.sun.radiance.fill(Vec3::ONE);
        frame.sun.lit[4 * 9 + 4] = true;
        add_filtered_light(&mut frame, 500.0);
        let at = |x: usize, y: usize| frame.linear[y * 9 + x].x * 81.0;
        let along: Vec<f32> = (0..9).map(|x| at(x, 4).round()).collect();
        assert_eq!(along, [0.0, 0.0, 3.0, 6.0, 9.0, 6.0, 3.0, 0.0, 0.0]);
        assert!((at(2, 2) - 1.0).abs() < 1e-5 && (at(3, 5) - 4.0).abs() < 1e-5);
        // No light is lost.
        let sum: Vec3 = frame.linear.iter().sum();
        assert!((sum - Vec3::ONE).length() < 1e-5, "{sum}");
    }

    /// The oracle, pixel by pixel as the documentation says.
    fn share(frame: &FrameBuffer, x: usize, y: usize) -> f32 {
        let (width, height) = (frame.width, frame.semantic.len() / frame.width);
        let i = y * width + x;
        if frame.sun.radiance[i] == Vec3::ZERO {
            return 0.0;
        }
        let (mut seen, mut all) = (0.0, 0.0);
        for v in y.saturating_sub(2)..(y + 3).min(height) {
            for u in x.saturating_sub(2)..(x + 3).min(width) {
                let j = v * width + u;
                let same = frame.object[i] == frame.object[j]
                    && frame.sun.radiance[j] != Vec3::ZERO
                    && (frame.depth_m[i] - frame.depth_m[j]).abs() < 0.03 * frame.depth_m[i]
                    && frame.normal[i].dot(frame.normal[j]) > 0.8;
                if same {
                    let weight = ((3 - u.abs_diff(x)) * (3 - v.abs_diff(y))) as f32;
                    all += weight;
                    seen += if frame.sun.lit[j] { weight } else { 0.0 };
                }
            }
        }
        seen / all
    }

    proptest! {
        #[test]
        fn shares_are_what_the_words_say(
            width in 1_usize..9,
            pixels in prop::collection::vec(
                (0_u32..2, 0_u8..4, 0_usize..3, any::<bool>(), 0_u8..8),
                1..300,
            ),
        ) {
            let height = pixels.len().div_ceil(width);
            let mut frame = FrameBuffer::new(width, height);
            for (i, (object, depth, normal, lit, sun)) in pixels.into_iter().enumerate() {
                frame.object[i] = ObjectId::new(ChunkCoord::new(object as i32, 0), 1).unwrap();
                frame.depth_m[i] = 10.0 + 0.2 * f32::from(depth);
                frame.normal[i] = [
                    Vec3::Z,
                    Vec3::new(0.6, 0.0, 0.8).normalize_or(Vec3::Z),
                    Vec3::X,
                ][normal];
                frame.sun.lit[i] = lit;
                frame.sun.radiance[i] = Vec3::splat(f32::from(sun.min(1)));
            }
            add_filtered_light(&mut frame, 500.0);
            for i in 0..width * height {
                let expected = frame.sun.radiance[i] * share(&frame, i % width, i / width);
                prop_assert_eq!(frame.linear[i], expected, "pixel {}", i);
            }
        }
    }
}
