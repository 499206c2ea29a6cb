//! What JPEG's compression does to a picture.

use glam::Vec3;
use rayon::prelude::*;

use super::luma::luma;
use crate::error::{ParamError, check};

/// Baseline JPEG (ITU-T T.81, JFIF) with the tables of its Annex K, scaled by quality as the
/// Independent JPEG Group's library does. All of it that loses something is done here: YCbCr,
/// subsampling, cosine transform, quantisation, and the way back. (Entropy coding, which loses
/// nothing, is left out. Libraries take other shortcuts on each processor, so that their pictures
/// differ between machines.)
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Jpeg {
    /// 1..=100.
    pub quality: u32,
    /// Whether colours have half the resolution along both axes (4:2:0), as in most cameras.
    pub subsampled: bool,
}

const LUMA_STEPS: [u16; 64] = [
    16, 11, 10, 16, 24, 40, 51, 61, 12, 12, 14, 19, 26, 58, 60, 55, 14, 13, 16, 24, 40, 57, 69, 56,
    14, 17, 22, 29, 51, 87, 80, 62, 18, 22, 37, 56, 68, 109, 103, 77, 24, 35, 55, 64, 81, 104, 113,
    92, 49, 64, 78, 87, 103, 121, 120, 101, 72, 92, 95, 98, 112, 100, 103, 99,
];
const CHROMA_STEPS: [u16; 64] = [
    17, 18, 24, 47, 99, 99, 99, 99, 18, 21, 26, 66, 99, 99, 99, 99, 24, 26, 56, 99, 99, 99, 99, 99,
    47, 66, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99,
    99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99,
];

/// The side of a block.
const N: usize = 8;

impl Jpeg {
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        check(
            "processing.jpeg_quality",
            self.quality.into(),
            1.0,
            100.0,
            "1..=100",
        )
    }

    /// Compresses and decompresses a picture, row by row.
    pub(super) fn bake(&self, picture: &mut [[u8; 3]], width: usize) {
        let dct = Dct::new();
        let [mut y, mut cb, mut cr] = planes(picture, width);
        y.code(&dct, &self.steps(&LUMA_STEPS));
        let chroma = self.steps(&CHROMA_STEPS);
        for plane in [&mut cb, &mut cr] {
            if self.subsampled {
                let mut half = plane.halved();
                half.code(&dct, &chroma);
                *plane = half.doubled(plane.width, plane.height());
            } else {
                plane.code(&dct, &chroma);
            }
        }
        picture.par_iter_mut().enumerate().for_each(|(i, c)| {
            let (y, cb, cr) = (y.values[i], cb.values[i] - 128.0, cr.values[i] - 128.0);
            let rgb = [
                y + 1.402 * cr,
                y - 0.344_136 * cb - 0.714_136 * cr,
                y + 1.772 * cb,
            ];
            *c = rgb.map(|x| x.round() as u8);
        });
    }

    fn steps(&self, table: &[u16; 64]) -> [f32; 64] {
        let quality = self.quality.clamp(1, 100);
        let percent = if quality < 50 {
            5000 / quality
        } else {
            200 - 2 * quality
        };
        table.map(|step| ((u32::from(step) * percent + 50) / 100).clamp(1, 255) as f32)
    }
}

/// One component, with whole numbers of 0 to 255.
struct Plane {
    width: usize,
    values: Vec<f32>,
}

fn planes(picture: &[[u8; 3]], width: usize) -> [Plane; 3] {
    let plane = |of: fn(Vec3) -> f32| {
        let code = |c: &[u8; 3]| {
            of(Vec3::from_array(c.map(f32::from)))
                .round()
                .clamp(0.0, 255.0)
        };
        let values = picture.par_iter().map(code).collect();
        Plane { width, values }
    };
    [
        plane(luma),
        plane(|c| 128.0 - 0.168_736 * c.x - 0.331_264 * c.y + 0.5 * c.z),
        plane(|c| 128.0 + 0.5 * c.x - 0.418_688 * c.y - 0.081_312 * c.z),
    ]
}

impl Plane {
    fn height(&self) -> usize {
        self.values.len() / self.width
    }

    /// A value; beyond the right and the lower border the last ones are repeated.
    fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y.min(self.height() - 1) * self.width + x.min(self.width - 1)]
    }

    /// Quantises each block's cosine transform, and transforms back.
    fn code(&mut self, dct: &Dct, steps: &[f32; 64]) {
        let (width, height) = (self.width, self.height());
        let bands: Vec<Vec<f32>> = (0..height.div_ceil(N))
            .into_par_iter()
            .map(|band| {
                let mut out = vec![0.0; N * width];
                for left in (0..width).step_by(N) {
                    let block: [f32; 64] =
                        std::array::from_fn(|i| self.at(left + i % N, band * N + i / N) - 128.0);
                    let mut coefficients = dct.forward(&block);
                    for (c, step) in coefficients.iter_mut().zip(steps) {
                        *c = (*c / step).round() * step;
                    }
                    let block = dct.backward(&coefficients);
                    for (i, value) in block.into_iter().enumerate() {
                        if left + i % N < width {
                            out[i / N * width + left + i % N] =
                                (value + 128.0).round().clamp(0.0, 255.0);
                        }
                    }
                }
                out
            })
            .collect();
        let rows = bands.into_iter().flatten().take(width * height);
        self.values = rows.collect();
    }

    /// The rounded means of 2 × 2 values.
    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height().div_ceil(2));
        let mean = |i: usize| {
            let (x, y) = (i % width * 2, i / width * 2);
            let sum = self.at(x, y) + self.at(x + 1, y) + self.at(x, y + 1) + self.at(x + 1, y + 1);
            (0.25 * sum).round()
        };
        let values = (0..width * height).into_par_iter().map(mean).collect();
        Self { width, values }
    }

    /// Three quarters of the nearest value and a quarter of the next one, along both axes, as the
    /// Independent JPEG Group's library does.
    fn doubled(&self, width: usize, height: usize) -> Self {
        let next = |i: usize| {
            if i.is_multiple_of(2) {
                (i / 2).saturating_sub(1)
            } else {
                i / 2 + 1
            }
        };
        let value = |i: usize| {
            let (x, y) = (i % width, i / width);
            let row = |y: usize| 0.75 * self.at(x / 2, y) + 0.25 * self.at(next(x), y);
            (0.75 * row(y / 2) + 0.25 * row(next(y))).round()
        };
        let values = (0..width * height).into_par_iter().map(value).collect();
        Self { width, values }
    }
}

/// The orthonormal cosine transform of blocks.
struct Dct([[f32; N]; N]);

impl Dct {
    fn new() -> Self {
        Self(std::array::from_fn(|k| {
            std::array::from_fn(|n| {
                let angle = std::f64::consts::PI * ((2 * n + 1) * k) as f64 / 16.0;
                let scale = if k == 0 { libm::sqrt(0.125) } else { 0.5 };
                (scale * libm::cos(angle)) as f32
            })
        }))
    }

    fn forward(&self, block: &[f32; 64]) -> [f32; 64] {
        let rows = product(block, |x, u| self.0[u][x]);
        let columns = product(&transposed(&rows), |y, v| self.0[v][y]);
        transposed(&columns)
    }

    fn backward(&self, coefficients: &[f32; 64]) -> [f32; 64] {
        let rows = product(coefficients, |u, x| self.0[u][x]);
        let columns = product(&transposed(&rows), |v, y| self.0[v][y]);
        transposed(&columns)
    }
}

/// Each row times a matrix.
fn product(block: &[f32; 64], matrix: impl Fn(usize, usize) -> f32) -> [f32; 64] {
    std::array::from_fn(|i| {
        let row = &block[i / N * N..][..N];
        (0..N).map(|k| row[k] * matrix(k, i % N)).sum()
    })
}

fn transposed(block: &[f32; 64]) -> [f32; 64] {
    std::array::from_fn(|i| block[i % N * N + i / N])
}

#[cfg(test)]
mod tests {
    use image::codecs::jpeg::JpegEncoder;

    use super::*;

    /// Stripes, a ramp and coloured spots, whose sides are no multiples of 16.
    fn picture(width: usize, height: usize) -> Vec<[u8; 3]> {
        let wave = |t: f64| (127.0 + 100.0 * t.sin()) as u8;
        (0..width * height)
            .map(|i| {
                let (x, y) = ((i % width) as f64, (i / width) as f64);
                [
                    wave(0.31 * x + 0.002 * y * y),
                    (255.0 * x / width as f64) as u8,
                    wave(0.07 * x * (1.0 + (0.05 * y).cos())),
                ]
            })
            .collect()
    }

    fn rms(a: &[[u8; 3]], b: &[[u8; 3]]) -> f64 {
        let pairs = a.as_flattened().iter().zip(b.as_flattened());
        let squares = pairs.map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2));
        (squares.sum::<f64>() / (3 * a.len()) as f64).sqrt()
    }

    #[test]
    fn pictures_are_those_of_another_encoder_and_decoder() {
        let (width, height) = (117, 75);
        let original = picture(width, height);
        for quality in [10, 30, 60] {
            let mut file = Vec::new();
            JpegEncoder::new_with_quality(&mut file, quality)
                .encode(
                    original.as_flattened(),
                    width as u32,
                    height as u32,
                    image::ExtendedColorType::Rgb8,
                )
                .expect("encodes");
            let theirs = image::load_from_memory(&file).expect("decodes").into_rgb8();
            let theirs = theirs.into_raw().as_chunks::<3>().0.to_vec();
            let mut ours = original.clone();
            let jpeg = Jpeg {
                quality: quality.into(),
                subsampled: false,
            };
            jpeg.bake(&mut ours, width);
            // This encoder truncates coefficients before it divides them, so that more of them
            // fall on the other side of a step than with libjpeg.
            let (artefacts, apart) = (rms(&original, &theirs), rms(&ours, &theirs));
            assert!(artefacts > 3.0, "{quality}: {artefacts}");
            assert!(
                apart < 0.25 * artefacts + 0.6,
                "{quality}: {apart} of {artefacts}"
            );
        }
    }

    /// A grey cosine has one coefficient, 4 √2 times its amplitude, in steps of the table: 11 at
    /// quality 50, 55 at 10.
    #[test]
    fn a_cosine_keeps_the_nearest_step_of_its_amplitude() {
        let wave = |n: usize| (std::f64::consts::PI * (2 * (n % 8) + 1) as f64 / 16.0).cos();
        let per_amplitude = 4.0 * 2.0_f64.sqrt();
        for (quality, step, amplitude) in [(50, 11.0, 20.0), (10, 55.0, 25.0), (10, 55.0, 4.0)] {
            let mut picture: Vec<[u8; 3]> = (0..16 * 8)
                .map(|i| [(128.0 + amplitude * wave(i % 16)).round() as u8; 3])
                .collect();
            Jpeg {
                quality,
                subsampled: true,
            }
            .bake(&mut picture, 16);
            let kept = (per_amplitude * amplitude / step).round() * step / per_amplitude;
            for (i, c) in picture.iter().enumerate() {
                let exact = 128.0 + kept * wave(i % 16);
                assert!((f64::from(c[1]) - exact).abs() < 1.0, "{c:?} for {exact}");
            }
        }
    }

    #[test]
    fn colours_of_half_resolution_keep_luma_and_lose_fine_colour() {
        let (width, height) = (64, 48);
        // Columns of equal luma and alternating colour.
        let original: Vec<[u8; 3]> = (0..width * height)
            .map(|i: usize| {
                if i.is_multiple_of(2) {
                    [180, 100, 100]
                } else {
                    [80, 150, 110]
                }
            })
            .collect();
        let spread = |subsampled| {
            let mut picture = original.clone();
            Jpeg {
                quality: 95,
                subsampled,
            }
            .bake(&mut picture, width);
            let luma_of = |c: &[u8; 3]| luma(Vec3::from_array(c.map(f32::from)));
            let off = original
                .iter()
                .zip(&picture)
                .map(|(a, b)| (luma_of(a) - luma_of(b)).abs());
            assert!(off.fold(0.0, f32::max) < 4.0);
            f32::from(picture[width * 20 + 20][0]) - f32::from(picture[width * 20 + 21][0])
        };
        assert!(spread(false) > 90.0, "{}", spread(false));
        assert!(spread(true).abs() < 8.0, "{}", spread(true));
    }

    #[test]
    fn the_best_quality_is_nearly_the_picture_and_worse_is_worse() {
        let original = picture(96, 64);
        let off = |quality| {
            let mut picture = original.clone();
            Jpeg {
                quality,
                subsampled: false,
            }
            .bake(&mut picture, 96);
            rms(&original, &picture)
        };
        assert!(off(100) < 1.0, "{}", off(100));
        assert!(
            [90, 70, 40, 15, 3]
                .windows(2)
                .all(|w| off(w[0]) < off(w[1]))
        );
    }
}
