//! One-bit alpha masks, which decide where a card or a triangle is opaque.

use std::fmt;

/// Where a card or triangle is opaque: one bit for each texel, decided once when the asset is made.
/// Every camera and every laser reads this mask, nearest texel, on every backend.
///
/// Sides are any numbers from 1 to 65,535, powers of two or not. Small masks stay in a processor's
/// cache, so our own cards keep to 256 × 256.
///
/// Row 0 is at v = 0. A texel is `min(floor(u · width), width − 1)`; u and v outside 0..1 clamp.
#[derive(Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "stored::StoredMask"))]
pub struct AlphaMask {
    width: u16,
    height: u16,
    /// Columns of `height` words. 16 rows of 32 texels are one cache line of a processor, in which
    /// neighbouring rays find their texels. Least significant bit first.
    words: Vec<u32>,
}

/// A side of a mask is not 1..=65,535.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaskError {
    /// The width asked for.
    pub width: usize,
    /// The height asked for.
    pub height: usize,
}

impl fmt::Display for MaskError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "mask of {} x {} texels: 1..=65535 by 1..=65535 are allowed",
            self.width, self.height
        )
    }
}

impl std::error::Error for MaskError {}

impl AlphaMask {
    /// A mask from a function of (column, row).
    ///
    /// # Errors
    /// If a side is not 1..=65,535.
    pub fn from_fn(
        width: usize,
        height: usize,
        opaque: impl Fn(usize, usize) -> bool,
    ) -> Result<Self, MaskError> {
        let side = |n: usize| u16::try_from(n).ok().filter(|&n| n > 0);
        let (Some(columns), Some(rows)) = (side(width), side(height)) else {
            return Err(MaskError { width, height });
        };
        let mut words = vec![0; width.div_ceil(32) * height];
        for row in 0..height {
            for column in (0..width).filter(|&column| opaque(column, row)) {
                words[column / 32 * height + row] |= 1 << (column % 32);
            }
        }
        Ok(Self {
            width: columns,
            height: rows,
            words,
        })
    }

    /// Texels in a row.
    #[must_use]
    pub fn width(&self) -> usize {
        usize::from(self.width)
    }

    /// The number of rows.
    #[must_use]
    pub fn height(&self) -> usize {
        usize::from(self.height)
    }

    /// The bits: `width().div_ceil(32)` columns of `height()` words, each of 32 texels of a row,
    /// least significant bit first.
    #[must_use]
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Whether the texel at (column, row) is opaque.
    #[inline]
    #[must_use]
    pub fn texel(&self, column: usize, row: usize) -> bool {
        let word = self.words[column / 32 * self.height() + row];
        word >> (column % 32) & 1 == 1
    }

    /// Whether the texel nearest to (u, v) is opaque.
    #[inline]
    #[must_use]
    pub fn is_opaque(&self, u: f32, v: f32) -> bool {
        // `as` saturates at 0, and sends NaN there.
        let column = ((u * f32::from(self.width)) as usize).min(self.width() - 1);
        let row = ((v * f32::from(self.height)) as usize).min(self.height() - 1);
        self.texel(column, row)
    }

    /// The first and the last opaque texel of a row among some of its columns; `None` if there is
    /// none.
    ///
    /// # Panics
    /// If the row or a column is out of range.
    #[must_use]
    pub fn opaque_span(
        &self,
        row: usize,
        columns: std::ops::RangeInclusive<usize>,
    ) -> Option<(usize, usize)> {
        let (from, to) = columns.into_inner();
        let mut span = None;
        for block in from / 32..=to / 32 {
            let mut word = self.words[block * self.height() + row];
            if block == from / 32 {
                word &= u32::MAX << (from % 32);
            }
            if block == to / 32 {
                word &= u32::MAX >> (31 - to % 32);
            }
            if word != 0 {
                let first = block * 32 + word.trailing_zeros() as usize;
                let last = block * 32 + 31 - word.leading_zeros() as usize;
                span = Some((span.map_or(first, |(first, _)| first), last));
            }
        }
        span
    }

    /// The memory that the mask takes, bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>() + size_of_val(self.words.as_slice())
    }

    /// The opaque share of all texels, 0..=1.
    #[must_use]
    pub fn opaque_fraction(&self) -> f64 {
        let opaque: u32 = self.words.iter().map(|w| w.count_ones()).sum();
        f64::from(opaque) / (self.width() * self.height()) as f64
    }
}

impl fmt::Debug for AlphaMask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "AlphaMask({} x {}, {:.1} % opaque)",
            self.width,
            self.height,
            100.0 * self.opaque_fraction()
        )
    }
}

#[cfg(feature = "serde")]
mod stored {
    use super::{AlphaMask, MaskError};

    /// A mask as it is read from a file, before its size is checked.
    #[derive(serde::Deserialize)]
    pub(super) struct StoredMask {
        width: u16,
        height: u16,
        words: Vec<u32>,
    }

    impl TryFrom<StoredMask> for AlphaMask {
        type Error = MaskError;

        fn try_from(stored: StoredMask) -> Result<Self, MaskError> {
            let (width, height) = (usize::from(stored.width), usize::from(stored.height));
            let fits = width > 0 && height > 0 && stored.words.len() == width.div_ceil(32) * height;
            fits.then_some(Self {
                width: stored.width,
                height: stored.height,
                words: stored.words,
            })
            .ok_or(MaskError { width, height })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn nearest_texel_and_clamp() {
        let m = AlphaMask::from_fn(4, 2, |c, r| (c, r) == (3, 0)).expect("size");
        assert!(m.is_opaque(0.75, 0.0) && m.is_opaque(0.99, 0.49) && m.is_opaque(7.0, -1.0));
        assert!(!m.is_opaque(0.74, 0.0) && !m.is_opaque(0.9, 0.5) && !m.is_opaque(f32::NAN, 0.0));
        assert!((m.opaque_fraction() - 0.125).abs() < 1e-12);
    }

    #[test]
    fn sizes_are_checked() {
        assert!(AlphaMask::from_fn(0, 4, |_, _| true).is_err());
        assert!(AlphaMask::from_fn(4, 65_536, |_, _| true).is_err());
        let tall = AlphaMask::from_fn(3, 65_535, |c, r| (c, r) == (2, 65_534)).expect("size");
        assert!(tall.is_opaque(1.0, 1.0) && !tall.is_opaque(1.0, 0.9999));
    }

    proptest! {
        #[test]
        fn bits_are_kept(w in 1_usize..=256, h in 1_usize..=40, salt: u64) {
            let f = |c: usize, r: usize| {
                (c * 31 + r * 17) as u64 ^ salt.rotate_left((c + r) as u32 % 64) & 1 == 0
            };
            let m = AlphaMask::from_fn(w, h, f).expect("size");
            for r in 0..h {
                for c in 0..w {
                    prop_assert_eq!(m.texel(c, r), f(c, r));
                }
            }
            let (from, to) = (salt as usize % w, w - 1 - (salt as usize % w) / 2);
            let opaque = |&c: &usize| f(c, 0);
            let span = (from..=to).find(opaque).zip((from..=to).rev().find(opaque));
            prop_assert_eq!(if from > to { None } else { m.opaque_span(0, from..=to) }, span);
        }
    }
}
