//! Statistics of light and colour in a picture.

use std::f64::consts::PI;

use nemoral_scene::glam::Vec3;
use nemoral_scene::{Image, Semantic};

/// The luminance of the light over that which an exposure maps to 1, row by row, without clipping.
#[must_use]
pub fn luminance_of_light(radiance: &Image<Vec3>, ev100: f64) -> Image<f64> {
    let white = 0.125 * ev100.exp2() / 0.18;
    radiance.map(|&c| of_linear(c.as_dvec3().to_array()) / white)
}

/// A picture's linear luminance, row by row.
#[must_use]
pub fn luminance(rgb: &Image<[u8; 3]>) -> Image<f64> {
    rgb.map(|rgb| of_linear(rgb.map(linear)))
}

/// Luminance by Rec. 709.
fn of_linear([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

fn linear(byte: u8) -> f64 {
    let v = f64::from(byte) / 255.0;
    if v <= 0.040_45 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

/// The amplitude spectrum of the middle square of a picture whose edge is a power of two, under a
/// Hann window: mean amplitude by whole cycles per square, from 0 to half its edge.
#[must_use]
pub fn spectrum(image: &Image<f64>) -> Vec<f64> {
    let (n, amplitudes) = amplitudes(image);
    let mut sums = vec![(0.0, 0_u32); n / 2 + 1];
    for (i, amplitude) in amplitudes.iter().enumerate() {
        let wave = |i: usize| i.min(n - i) as f64;
        let ring = wave(i % n).hypot(wave(i / n)).round() as usize;
        if let Some((sum, count)) = sums.get_mut(ring) {
            *sum += amplitude;
            *count += 1;
        }
    }
    sums.iter()
        .map(|(sum, count)| sum / f64::from(*count))
        .collect()
}

/// Mean amplitude of waves that run within 45° of the horizontal over that of the others, in the
/// band of
/// [`amplitude_slope`]: 1 if no direction is special, more with upright things.
#[must_use]
pub fn isotropy(image: &Image<f64>) -> f64 {
    let (n, amplitudes) = amplitudes(image);
    let mut sums = [(0.0, 0_u32); 2];
    for (i, amplitude) in amplitudes.iter().enumerate() {
        let wave = |i: usize| i.min(n - i) as f64;
        let (x, y) = (wave(i % n), wave(i / n));
        let ring = x.hypot(y).round() as usize;
        if (4..=n / 4).contains(&ring) && x != y {
            let (sum, count) = &mut sums[usize::from(x < y)];
            // Amplitudes of natural images fall like 1 / frequency, so this weights octaves
            // equally.
            (*sum, *count) = (*sum + amplitude * x.hypot(y), *count + 1);
        }
    }
    let [a, b] = sums.map(|(sum, count)| sum / f64::from(count));
    a / b
}

/// The square's edge, and the amplitudes of its waves, row by row.
fn amplitudes(image: &Image<f64>) -> (usize, Vec<f64>) {
    let shorter = image.width().min(image.height());
    let n = if shorter.is_power_of_two() {
        shorter
    } else {
        shorter.next_power_of_two() / 2
    };
    let (left, top) = ((image.width() - n) / 2, (image.height() - n) / 2);
    let texel = |x: usize, y: usize| image.pixels()[(top + y) * image.width() + left + x];
    let mean = (0..n * n).map(|i| texel(i % n, i / n)).sum::<f64>() / (n * n) as f64;
    let hann = |i: usize| 0.5 - 0.5 * (2.0 * PI * (i as f64 + 0.5) / n as f64).cos();
    let mut rows: Vec<Vec<(f64, f64)>> = (0..n)
        .map(|y| {
            (0..n)
                .map(|x| ((texel(x, y) - mean) * hann(x) * hann(y), 0.0))
                .collect()
        })
        .collect();
    for row in &mut rows {
        fourier(row);
    }
    let mut out = vec![0.0; n * n];
    for x in 0..n {
        let mut column: Vec<(f64, f64)> = rows.iter().map(|row| row[x]).collect();
        fourier(&mut column);
        for (y, (re, im)) in column.into_iter().enumerate() {
            out[y * n + x] = re.hypot(im);
        }
    }
    (n, out)
}

/// Statistics of a picture's luminance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tones {
    /// Standard deviation of the natural logarithm of luminance, which is at least one step of 8
    /// bits.
    pub log_sd: f64,
    /// Kurtosis of the differences of log-luminance between neighbours in a row: 3 for noise, more
    /// for flat regions with edges.
    pub gradient_kurtosis: f64,
}

/// The tones of a picture's linear luminance.
#[must_use]
pub fn tones(image: &Image<f64>) -> Tones {
    let logs: Vec<f64> = image.pixels().iter().map(|v| v.max(3e-4).ln()).collect();
    let moments = |v: &[f64], power: i32, about: f64| {
        v.iter().map(|x| (x - about).powi(power)).sum::<f64>() / v.len() as f64
    };
    let mean = moments(&logs, 1, 0.0);
    let rows = logs.chunks(image.width());
    let steps: Vec<f64> = rows
        .flat_map(|row| row.windows(2).map(|w| w[1] - w[0]))
        .collect();
    Tones {
        log_sd: moments(&logs, 2, mean).sqrt(),
        gradient_kurtosis: moments(&steps, 4, 0.0) / moments(&steps, 2, 0.0).powi(2),
    }
}

/// The transform of Cooley and Tukey (1965), radix 2, in place.
fn fourier(values: &mut [(f64, f64)]) {
    let n = values.len();
    let bits = n.trailing_zeros();
    for i in 0..n {
        let j = i.reverse_bits() >> (usize::BITS - bits);
        if i < j {
            values.swap(i, j);
        }
    }
    let mut length = 2;
    while length <= n {
        for start in (0..n).step_by(length) {
            for k in 0..length / 2 {
                let (sin, cos) = (-2.0 * PI * k as f64 / length as f64).sin_cos();
                let (a, b) = (values[start + k], values[start + k + length / 2]);
                let turned = (b.0 * cos - b.1 * sin, b.0 * sin + b.1 * cos);
                values[start + k] = (a.0 + turned.0, a.1 + turned.1);
                values[start + k + length / 2] = (a.0 - turned.0, a.1 - turned.1);
            }
        }
        length *= 2;
    }
}

/// The slope of a spectrum on logarithmic axes, from 4 cycles per picture to half of its
/// resolution, with equal weights of octaves. Photographs of nature have -0.8 to -1.5 (Tolhurst et
/// al. 1992).
#[must_use]
pub fn amplitude_slope(spectrum: &[f64]) -> f64 {
    let points: Vec<(f64, f64, f64)> = (4..=spectrum.len() / 2)
        .map(|k| ((k as f64).ln(), spectrum[k].ln(), 1.0 / k as f64))
        .collect();
    let weight: f64 = points.iter().map(|p| p.2).sum();
    let mean = |f: &dyn Fn(&(f64, f64, f64)) -> f64| {
        points.iter().map(|p| p.2 * f(p)).sum::<f64>() / weight
    };
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    mean(&|p| (p.0 - x) * (p.1 - y)) / mean(&|p| (p.0 - x).powi(2))
}

/// The colours of a picture's leaves and needles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour {
    /// Mean green chromatic coordinate, G / (R + G + B), of foliage.
    pub gcc: f64,
    /// The share of foliage that is vivid green: saturation over 0.7 and value over 0.6.
    pub glaring: f64,
    /// The median hue of foliage, degrees: 60 is yellow, 120 green.
    pub hue_deg: f64,
}

/// The colour of tree foliage; `None` if there is hardly any.
#[must_use]
pub fn colour(rgb: &Image<[u8; 3]>, semantic: &Image<Semantic>) -> Option<Colour> {
    let pixels = rgb.pixels().iter().zip(semantic.pixels());
    let foliage: Vec<[f64; 3]> = pixels
        .filter(|(_, s)| matches!(s, Semantic::Leaf | Semantic::Needle))
        .map(|(p, _)| p.map(f64::from))
        .filter(|p| p.iter().sum::<f64>() > 30.0)
        .collect();
    if foliage.len() < 200 {
        return None;
    }
    let n = foliage.len() as f64;
    let gcc = foliage.iter().map(|[r, g, b]| g / (r + g + b)).sum::<f64>() / n;
    let glares = |&&[r, g, b]: &&[f64; 3]| {
        let (most, least) = (r.max(g).max(b), r.min(g).min(b));
        g >= most && (most - least) / most > 0.7 && most / 255.0 > 0.6
    };
    let mut hues: Vec<f64> = foliage.iter().filter_map(hue_deg).collect();
    hues.sort_by(f64::total_cmp);
    Some(Colour {
        gcc,
        glaring: foliage.iter().filter(glares).count() as f64 / n,
        hue_deg: hues.get(hues.len() / 2).copied().unwrap_or(f64::NAN),
    })
}

/// Hue on the hexagon; `None` for grey.
fn hue_deg(&[r, g, b]: &[f64; 3]) -> Option<f64> {
    let most = r.max(g).max(b);
    let span = most - r.min(g).min(b);
    let sixth = if most == r {
        (g - b) / span
    } else if most == g {
        2.0 + (b - r) / span
    } else {
        4.0 + (r - g) / span
    };
    (span > 0.0).then(|| (60.0 * sixth).rem_euclid(360.0))
}

#[cfg(test)]
mod tests {
    use super::super::ranges::{ISOTROPY, KURTOSIS, Range, SLOPE};
    use super::*;
    use nemoral_seed::{Draw, Key};

    fn image<T>(edge: usize, mut of: impl FnMut(usize, usize) -> T) -> Image<T> {
        let pixels = (0..edge * edge).map(|i| of(i % edge, i / edge)).collect();
        Image::new(edge, edge, pixels)
    }

    fn noise() -> Image<f64> {
        let mut rng = Key::world(1).rng();
        image(128, |_, _| rng.unit_f64())
    }

    /// White noise has a flat spectrum and blur a steep one: neither looks like nature.
    #[test]
    fn the_slope_tells_noise_and_blur() {
        let flat = amplitude_slope(&spectrum(&noise()));
        assert!(flat.abs() < 0.25, "{flat}");
        // Discs of all sizes that hide each other, like objects in a forest, have about -1.
        let mut rng = Key::world(2).rng();
        let mut pixels = vec![0.0; 128 * 128];
        for _ in 0..4000 {
            let radius = 1.5 / (0.02 + rng.unit_f64()).sqrt();
            let (cx, cy) = (rng.range_f64(0.0, 128.0), rng.range_f64(0.0, 128.0));
            let value = rng.unit_f64();
            for (i, pixel) in pixels.iter_mut().enumerate() {
                let (x, y) = ((i % 128) as f64 - cx, (i / 128) as f64 - cy);
                if x * x + y * y < radius * radius {
                    *pixel = value;
                }
            }
        }
        let discs = image(128, |x, y| pixels[y * 128 + x]);
        let leaves = amplitude_slope(&spectrum(&discs));
        let within = |(low, high): Range, v: f64| (low..=high).contains(&v);
        assert!(within(SLOPE, leaves), "{leaves}");
        assert!(within(ISOTROPY, isotropy(&discs)), "{}", isotropy(&discs));
        // The discs have edges between flat regions and no direction, noise has no edges, and
        // stripes have a direction.
        assert!(
            within(KURTOSIS, tones(&discs).gradient_kurtosis),
            "{:?}",
            tones(&discs)
        );
        let mild = tones(&noise().map(|v| 0.5 + v));
        assert!(mild.gradient_kurtosis < 4.0, "{mild:?}");
        assert!(tones(&discs.map(|v| 0.4 + 0.1 * v)).log_sd < 0.3);
        let striped = isotropy(&image(128, |x, y| pixels[y * 128 + x] + (x / 3 % 2) as f64));
        assert!(!within(ISOTROPY, striped), "{striped}");
        let blurred = image(128, |x, y| {
            let at = |dx: usize, dy: usize| pixels[((y + dy) % 128) * 128 + (x + dx) % 128];
            (0..49).map(|i| at(i % 7, i / 7)).sum::<f64>() / 49.0
        });
        let steep = amplitude_slope(&spectrum(&blurred));
        assert!(!within(SLOPE, steep), "{steep}");
    }

    #[test]
    fn fouriers_of_a_wave_is_one_line() {
        let mut wave: Vec<(f64, f64)> = (0..64)
            .map(|i| ((2.0 * PI * 5.0 * f64::from(i) / 64.0).cos(), 0.0))
            .collect();
        fourier(&mut wave);
        for (k, (re, im)) in wave.into_iter().enumerate() {
            let expected = if k == 5 || k == 59 { 32.0 } else { 0.0 };
            assert!(
                (re - expected).abs() < 1e-9 && im.abs() < 1e-9,
                "{k} {re} {im}"
            );
        }
    }

    #[test]
    fn game_green_glares() {
        let semantic = image(20, |_, _| Semantic::Leaf);
        let paint = |p: [u8; 3]| colour(&image(20, |_, _| p), &semantic);
        let dark = paint([60, 75, 40]).expect("foliage");
        assert!((dark.gcc - 75.0 / 175.0).abs() < 1e-12 && dark.glaring == 0.0);
        let game = paint([30, 200, 20]).expect("foliage");
        assert!(game.gcc > 0.6 && game.glaring == 1.0);
        assert!((game.hue_deg - 116.7).abs() < 0.1 && (dark.hue_deg - 85.7).abs() < 0.1);
    }
}
