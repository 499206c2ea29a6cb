//! Colour textures with mips, sampled on the CPU.

use std::fmt;

use glam::{Vec2, Vec3};

use crate::CodeTable;

/// An sRGB-encoded albedo texture that repeats, with box-filtered mips of its opaque texels. Row 0
/// is at v = 0.
///
/// Linear light is clamped to 0..=1 when it is encoded, and NaN becomes 0.
///
/// It holds colour alone: what is opaque is decided by [`AlphaMask`](crate::AlphaMask)s.
#[derive(Clone)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Deserialize),
    serde(try_from = "stored::ReadTexture")
)]
pub struct Texture {
    /// Level 0 first, each half the size of the one before, down to 1 × 1.
    levels: Vec<Level>,
}

#[derive(Clone)]
struct Level {
    width: u32,
    height: u32,
    /// sRGB-encoded; the fourth byte pads to a word.
    texels: Vec<[u8; 4]>,
}

/// A texture's sides are not powers of two, or its data has another size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureError {
    /// Width asked for.
    pub width: usize,
    /// Height asked for.
    pub height: usize,
    /// Texels given.
    pub texels: usize,
}

impl fmt::Display for TextureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "texture of {} x {} with {} texels: sides must be powers of two up to 8192, texels \
             width x height",
            self.width, self.height, self.texels
        )
    }
}

impl std::error::Error for TextureError {}

impl Texture {
    /// A texture from linear-light RGB, row by row.
    ///
    /// # Errors
    /// If a side is not a power of two up to 8192 or `linear` has another length.
    pub fn from_linear(width: usize, height: usize, linear: &[Vec3]) -> Result<Self, TextureError> {
        Self::from_linear_where(width, height, linear, |_, _| true)
    }

    /// The same for a texture that is visible only where `opaque(column, row)` is true. A texel of
    /// a mip is the mean of the visible texels under it, so that a distant leaf has its own colour.
    /// Where no texel under it is visible, it is the mean of all.
    ///
    /// # Errors
    /// As [`Self::from_linear`].
    pub fn from_linear_where(
        width: usize,
        height: usize,
        linear: &[Vec3],
        opaque: impl Fn(usize, usize) -> bool,
    ) -> Result<Self, TextureError> {
        let side = |n: usize| n.is_power_of_two() && n <= 8192;
        if !side(width) || !side(height) || linear.len() != width * height {
            return Err(TextureError {
                width,
                height,
                texels: linear.len(),
            });
        }
        let mut levels = Vec::new();
        let (mut w, mut h) = (width, height);
        // Colours, and how many opaque texels of level 0 each stands for.
        let mut data: Vec<Seen> = linear
            .iter()
            .enumerate()
            .map(|(i, &c)| (c, f32::from(u8::from(opaque(i % width, i / width)))))
            .collect();
        loop {
            levels.push(Level {
                width: w as u32,
                height: h as u32,
                texels: data.iter().map(|&(c, _)| encode(c)).collect(),
            });
            if w == 1 && h == 1 {
                return Ok(Self { levels });
            }
            let (nw, nh) = ((w / 2).max(1), (h / 2).max(1));
            data = halved(&data, (w, h), (nw, nh));
            (w, h) = (nw, nh);
        }
    }

    /// A 1 × 1 texture of one linear colour.
    #[must_use]
    pub fn plain(linear: Vec3) -> Self {
        Self {
            levels: vec![Level {
                width: 1,
                height: 1,
                texels: vec![encode(linear)],
            }],
        }
    }

    /// The texture with a curve over each linear channel, in all mips.
    #[must_use]
    pub fn with_curve(&self, curve: impl Fn(f32) -> f32) -> Self {
        let codes: [u8; 256] = std::array::from_fn(|code| {
            let linear = decode([code as u8; 4]).x;
            encode(Vec3::splat(curve(linear)))[0]
        });
        let mut curved = self.clone();
        for texel in curved.levels.iter_mut().flat_map(|level| &mut level.texels) {
            for channel in &mut texel[..3] {
                *channel = codes[usize::from(*channel)];
            }
        }
        curved
    }

    /// Width of level 0.
    #[must_use]
    pub fn width(&self) -> usize {
        self.levels[0].width as usize
    }

    /// Height of level 0.
    #[must_use]
    pub fn height(&self) -> usize {
        self.levels[0].height as usize
    }

    /// sRGB bytes of level 0, row by row (the fourth byte is 255).
    #[must_use]
    pub fn srgb(&self) -> &[[u8; 4]] {
        &self.levels[0].texels
    }

    /// How many mips there are, level 0 included.
    #[must_use]
    pub fn levels(&self) -> usize {
        self.levels.len()
    }

    /// sRGB bytes of a mip, row by row; each side is half of the one before, at least 1.
    ///
    /// # Panics
    /// If there is no such level.
    #[must_use]
    pub fn level(&self, level: usize) -> &[[u8; 4]] {
        &self.levels[level].texels
    }

    /// The linear colours of the finest level, row by row.
    pub fn linear(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.srgb().iter().map(|texel| decode(*texel))
    }

    /// The mean linear colour.
    #[must_use]
    pub fn mean(&self) -> Vec3 {
        decode(self.levels[self.levels.len() - 1].texels[0])
    }

    /// Linear colour at (u, v) for a footprint of `footprint_uv` (the width, in uv, that one sample
    /// covers): bilinear in the nearest mip. The texture repeats.
    #[must_use]
    pub fn sample(&self, uv: Vec2, footprint_uv: f32) -> Vec3 {
        let texels = footprint_uv * self.levels[0].width.max(self.levels[0].height) as f32;
        // The level: the logarithm of the texels per sample, rounded to the nearest integer, which
        // is the exponent of that number times the square root of two.
        let lod = if texels > 1.0 {
            ((texels * std::f32::consts::SQRT_2).to_bits() >> 23) as usize - 127
        } else {
            0
        };
        let level = &self.levels[lod.min(self.levels.len() - 1)];
        let x = (uv.x - floor(uv.x)) * level.width as f32 - 0.5;
        let y = (uv.y - floor(uv.y)) * level.height as f32 - 0.5;
        let (x0, y0) = (floor(x), floor(y));
        let (fx, fy) = (x - x0, y - y0);
        let table = &*DECODE;
        let at = |dx: i32, dy: i32| {
            // Sides are powers of two, so wrapping is a mask.
            let column = (x0 as i32 + dx) as u32 & (level.width - 1);
            let row = (y0 as i32 + dy) as u32 & (level.height - 1);
            linear(level.texels[(row * level.width + column) as usize], table)
        };
        let low = at(0, 0).lerp(at(1, 0), fx);
        let high = at(0, 1).lerp(at(1, 1), fx);
        low.lerp(high, fy)
    }
}

impl fmt::Debug for Texture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "Texture({} x {}, mean {:.3})",
            self.width(),
            self.height(),
            self.mean()
        )
    }
}

#[cfg(feature = "serde")]
mod stored {
    use serde::{Serialize, Serializer};
    use serde_bytes::{ByteBuf, Bytes};

    use super::{Level, Texture, TextureError};

    /// A texture as it is stored in a file: the texels of its levels, the largest level first.
    #[derive(serde::Serialize, serde::Deserialize)]
    pub(super) struct StoredTexture<B> {
        width: u32,
        height: u32,
        levels: Vec<B>,
    }

    pub(super) type ReadTexture = StoredTexture<ByteBuf>;

    impl Serialize for Texture {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            let bytes = self.levels.iter().map(|l| l.texels.as_flattened());
            let stored = StoredTexture {
                width: self.levels[0].width,
                height: self.levels[0].height,
                levels: bytes.map(Bytes::new).collect(),
            };
            stored.serialize(serializer)
        }
    }

    impl TryFrom<ReadTexture> for Texture {
        type Error = TextureError;

        fn try_from(stored: ReadTexture) -> Result<Self, TextureError> {
            let (mut width, mut height) = (stored.width, stored.height);
            let mut levels = Vec::new();
            for bytes in &stored.levels {
                let (texels, rest) = bytes.as_chunks::<4>();
                let side = |n: u32| n.is_power_of_two() && n <= 8192;
                let fits = side(width) && side(height) && rest.is_empty();
                if !fits || texels.len() != (width * height) as usize {
                    break;
                }
                let texels = texels.to_vec();
                levels.push(Level {
                    width,
                    height,
                    texels,
                });
                (width, height) = ((width / 2).max(1), (height / 2).max(1));
            }
            let ends = levels.last().is_some_and(|l| l.width == 1 && l.height == 1);
            if ends && levels.len() == stored.levels.len() {
                return Ok(Self { levels });
            }
            Err(TextureError {
                width: stored.width as usize,
                height: stored.height as usize,
                texels: stored.levels.first().map_or(0, |bytes| bytes.len() / 4),
            })
        }
    }
}

/// A colour, and how many opaque texels of the finest level it stands for.
type Seen = (Vec3, f32);

/// The next level of a mip, `to` instead of `from` texels wide and high.
fn halved(data: &[Seen], from: (usize, usize), to: (usize, usize)) -> Vec<Seen> {
    let (across, down) = (from.0 / to.0, from.1 / to.1);
    let mut means = Vec::with_capacity(to.0 * to.1);
    for rows in data.chunks_exact(from.0 * down) {
        let (upper, lower) = rows.split_at(from.0);
        if across == 2 && down == 2 {
            let pairs = upper.chunks_exact(2).zip(lower.chunks_exact(2));
            means.extend(pairs.map(|(a, b)| mean_seen(&[a[0], a[1], b[0], b[1]])));
        } else if across == 2 {
            means.extend(upper.chunks_exact(2).map(mean_seen));
        } else {
            // One column.
            means.push(mean_seen(rows));
        }
    }
    means
}

/// The mean of colours weighted by the opaque texels that they stand for (the plain mean if there
/// are none), and the number of these texels.
#[inline]
fn mean_seen(parts: &[Seen]) -> Seen {
    let seen: f32 = parts.iter().map(|(_, n)| n).sum();
    let weight = |n: f32| if seen > 0.0 { n } else { 1.0 };
    let sum: Vec3 = parts.iter().map(|&(c, n)| c * weight(n)).sum();
    let all: f32 = parts.iter().map(|&(_, n)| weight(n)).sum();
    (sum / all, seen)
}

fn encode(linear: Vec3) -> [u8; 4] {
    let codes = &*ENCODE;
    let [r, g, b] = linear.to_array().map(|light| codes.code(light));
    [r, g, b, 255]
}

/// The inverse of IEC 61966-2-1.
static ENCODE: std::sync::LazyLock<CodeTable> = std::sync::LazyLock::new(|| {
    CodeTable::new(1.0, |c| {
        let s = if c <= 0.003_130_8 {
            12.92 * c
        } else {
            1.055 * libm::powf(c, 1.0 / 2.4) - 0.055
        };
        f64::from(s * 255.0 + 0.5)
    })
});

fn decode(texel: [u8; 4]) -> Vec3 {
    linear(texel, &DECODE)
}

/// `f32::floor`, which is a function call on processors without SSE 4.1.
#[inline]
fn floor(x: f32) -> f32 {
    // Larger numbers have no fraction.
    if x.abs() < 8_388_608.0 {
        let whole = x as i32 as f32;
        whole - f32::from(u8::from(whole > x))
    } else {
        x
    }
}

#[inline]
fn linear(texel: [u8; 4], table: &[f32; 256]) -> Vec3 {
    Vec3::new(
        table[usize::from(texel[0])],
        table[usize::from(texel[1])],
        table[usize::from(texel[2])],
    )
}

/// IEC 61966-2-1, the sRGB transfer function, for every byte.
static DECODE: std::sync::LazyLock<[f32; 256]> = std::sync::LazyLock::new(|| {
    std::array::from_fn(|i| {
        let s = i as f32 / 255.0;
        if s <= 0.040_45 {
            s / 12.92
        } else {
            libm::powf((s + 0.055) / 1.055, 2.4)
        }
    })
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plain_texture_is_its_colour_everywhere() {
        let colour = Vec3::new(0.067, 0.12, 0.033);
        let t = Texture::plain(colour);
        for footprint in [0.0, 0.1, 9.0] {
            let got = t.sample(Vec2::new(-3.3, 0.7), footprint);
            assert!((got - colour).abs().max_element() < 0.003, "{got}");
        }
    }

    #[test]
    fn mips_keep_the_mean_and_texel_centres_are_exact() {
        let data: Vec<Vec3> = (0..64)
            .map(|i| Vec3::splat(if i % 3 == 0 { 0.8 } else { 0.1 }))
            .collect();
        let t = Texture::from_linear(8, 8, &data).expect("size");
        let mean = data.iter().sum::<Vec3>() / 64.0;
        assert!((t.mean() - mean).abs().max_element() < 0.01);
        let centre = t.sample(Vec2::new(3.5 / 8.0, 0.5 / 8.0), 0.0);
        assert!((centre.x - 0.8).abs() < 0.01, "{centre}");
    }

    #[test]
    fn mips_are_of_what_is_seen() {
        let [seen, hidden] = [Vec3::new(0.1, 0.2, 0.05), Vec3::splat(0.9)];
        let opaque = |x: usize, y: usize| x < 5 && y == 2;
        let data: Vec<Vec3> = (0..64)
            .map(|i| {
                if opaque(i % 8, i / 8) {
                    // The texels have another colour at one end.
                    seen * (1.0 + f32::from(u8::from(i % 8 == 4)))
                } else {
                    hidden
                }
            })
            .collect();
        let t = Texture::from_linear_where(8, 8, &data, opaque).expect("size");
        let near = |got: Vec3, want: Vec3| (got / want - Vec3::ONE).abs().max_element() < 0.03;
        // The mean of five texels, of which the last counts twice.
        assert!(near(t.mean(), seen * 1.2), "{}", t.mean());
        let at = |x: f32, level: i32| t.sample(Vec2::new(x, 0.3), f32::exp2(level as f32) / 8.0);
        assert!(near(decode(t.level(2)[0]), seen) && near(decode(t.level(2)[1]), seen * 2.0));
        // Hidden texels keep their colour, and so do texels of mips under which all are hidden.
        assert!(near(at(7.5 / 8.0, 0), hidden) && near(decode(t.level(1)[3]), hidden));
    }

    #[test]
    fn sizes_are_checked() {
        assert!(Texture::from_linear(3, 4, &[Vec3::ZERO; 12]).is_err());
        assert!(Texture::from_linear(4, 4, &[Vec3::ZERO; 12]).is_err());
    }
}
