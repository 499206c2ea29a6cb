//! Light meters: which part of a picture decides its exposure.

use glam::Vec3;
use nemoral_scene::Semantic;
use rayon::prelude::*;

use crate::colour::LUMINANCE;

/// What a light meter looks at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Metering {
    /// The whole picture.
    #[default]
    Average,
    /// A disc in the middle, of half the picture's height, with 75 % of the weight; the rest of the
    /// picture has 25 % (Nikon's centre-weighted metering has these weights).
    Centre,
    /// All that is not sky, as if one exposed for the ground. The whole picture if all is sky.
    Ground,
    /// The sky alone, as if one exposed for it. The whole picture if there is none.
    Sky,
    /// The brightest fiftieth of the picture, which becomes nearly white, whatever else is dark, so
    /// that what a lamp shines on does not clip (Nikon's highlight-weighted metering).
    Highlights,
}

/// The share of the weight that the middle has with [`Metering::Centre`].
const CENTRE: f64 = 0.75;

/// The share of a picture that is brighter than what [`Metering::Highlights`] looks at, and that
/// luminance over middle grey, where the standard curve is nearly white.
const HIGHLIGHTS: f64 = 0.02;
const BELOW_WHITE: f32 = 5.0;

/// Starlight, cd/m²: the luminance of a picture without any light.
const STARLIGHT: f64 = 1e-3;

impl Metering {
    /// The luminance that becomes middle grey, cd/m². But for highlights it is exp(mean(ln Y)) over
    /// the metered pixels that are not black; 1e-3 cd/m² if all are.
    pub(crate) fn luminance(self, linear: &[Vec3], width: usize, semantic: &[Semantic]) -> f64 {
        let height = linear.len() / width;
        let (mean, rest) = match self {
            Self::Average => (LogMean::of(linear, |_| true), None),
            Self::Centre => {
                let in_disc = |i: usize| {
                    let x = (i % width) as f64 + 0.5 - 0.5 * width as f64;
                    let y = (i / width) as f64 + 0.5 - 0.5 * height as f64;
                    16.0 * (x * x + y * y) <= (height * height) as f64
                };
                let disc = LogMean::of(linear, in_disc);
                (disc, Some(LogMean::of(linear, |i| !in_disc(i))))
            }
            Self::Highlights => return highlights(linear),
            Self::Ground => (LogMean::of(linear, |i| semantic[i] != Semantic::Sky), None),
            Self::Sky => (LogMean::of(linear, |i| semantic[i] == Semantic::Sky), None),
        };
        let log_mean = match (mean.value(), rest.and_then(|rest| rest.value())) {
            (Some(centre), Some(rest)) => CENTRE * centre + (1.0 - CENTRE) * rest,
            (Some(one), None) | (None, Some(one)) => one,
            (None, None) => match LogMean::of(linear, |_| true).value() {
                Some(whole) => whole,
                None => return STARLIGHT,
            },
        };
        libm::exp(log_mean)
    }
}

/// The luminance that becomes middle grey where the brightest pixels become nearly white.
fn highlights(linear: &[Vec3]) -> f64 {
    let mut luminances: Vec<f32> = linear.par_iter().map(|c| c.dot(LUMINANCE)).collect();
    let brighter = (HIGHLIGHTS * linear.len() as f64) as usize;
    let descending = |a: &f32, b: &f32| b.total_cmp(a);
    match luminances.get(brighter) {
        None => STARLIGHT,
        Some(_) => {
            let (_, metered, _) = luminances.select_nth_unstable_by(brighter, descending);
            f64::from(*metered / BELOW_WHITE).max(STARLIGHT)
        }
    }
}

/// exp(mean(ln Y)) over the pixels that are not black; 1e-3 cd/m² (starlight) if all are.
pub(crate) fn log_mean_luminance(linear: &[Vec3]) -> f64 {
    Metering::Average.luminance(linear, linear.len().max(1), &[])
}

/// A mean of logarithms.
#[derive(Clone, Copy)]
struct LogMean {
    sum: f64,
    n: u32,
}

impl LogMean {
    const PART: usize = 1 << 14;

    /// Over the lit pixels that are metered. The parts do not depend on the number of threads.
    fn of(linear: &[Vec3], is_metered: impl Fn(usize) -> bool + Sync) -> Self {
        let part = |(number, linear): (usize, &[Vec3])| {
            let first = number * Self::PART;
            let metered = linear.iter().enumerate();
            let metered = metered.filter(|(i, _)| is_metered(first + i));
            let lit = metered.map(|(_, c)| c.dot(LUMINANCE)).filter(|&y| y > 0.0);
            lit.fold((0.0, 0_u32), |(sum, n), y| {
                (sum + f64::from(libm::logf(y)), n + 1)
            })
        };
        let parts: Vec<(f64, u32)> = (linear.par_chunks(Self::PART).enumerate())
            .map(part)
            .collect();
        let (sum, n) = (parts.into_iter()).fold((0.0, 0), |(sum, n), p| (sum + p.0, n + p.1));
        Self { sum, n }
    }

    fn value(self) -> Option<f64> {
        (self.n > 0).then(|| self.sum / f64::from(self.n))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of 40 × 20: a sky of 800 cd/m² over a ground of 50, with a disc of 200 in the
    /// middle.
    fn picture() -> (Vec<Vec3>, Vec<Semantic>) {
        (0..800_usize)
            .map(|i| {
                let (x, y) = ((i % 40) as f64 - 19.5, (i / 40) as f64 - 9.5);
                let semantic = if y < 0.0 {
                    Semantic::Sky
                } else {
                    Semantic::Soil
                };
                let luminance = match semantic {
                    _ if x * x + y * y <= 25.0 => 200.0,
                    Semantic::Sky => 800.0,
                    _ => 50.0,
                };
                (Vec3::splat(luminance), semantic)
            })
            .unzip()
    }

    fn metered(metering: Metering) -> f64 {
        let (linear, semantic) = picture();
        metering.luminance(&linear, 40, &semantic)
    }

    #[test]
    fn the_middle_has_three_quarters_of_the_weight() {
        // Sky and ground have as many pixels outside of the disc.
        let around = (800.0_f64 * 50.0).sqrt();
        let exact = 200.0_f64.powf(0.75) * around.powf(0.25);
        let got = metered(Metering::Centre);
        assert!((got / exact - 1.0).abs() < 1e-6, "{got} for {exact}");
    }

    #[test]
    fn sky_and_ground_are_metered_by_themselves() {
        let (_, semantic) = picture();
        let disc = semantic.len() as f64 / 2.0;
        // Half of the disc's pixels lie in either.
        let in_disc = picture().0.iter().filter(|c| c.x == 200.0).count() as f64 / 2.0;
        let mixed = |other: f64| {
            let share = in_disc / disc;
            200.0_f64.powf(share) * other.powf(1.0 - share)
        };
        for (metering, exact) in [
            (Metering::Sky, mixed(800.0)),
            (Metering::Ground, mixed(50.0)),
        ] {
            let got = metered(metering);
            assert!(
                (got / exact - 1.0).abs() < 1e-6,
                "{metering:?}: {got} for {exact}"
            );
        }
    }

    #[test]
    fn highlights_are_nearly_white_whatever_is_dark() {
        for dark in [1e-4, 1.0, 30.0] {
            let mut linear = vec![Vec3::splat(dark); 1000];
            linear[17..20].fill(Vec3::splat(9000.0));
            linear[300..400].fill(Vec3::splat(200.0));
            let got = Metering::Highlights.luminance(&linear, 40, &[]);
            assert!(
                (got * f64::from(BELOW_WHITE) / 200.0 - 1.0).abs() < 1e-6,
                "{dark}: {got}"
            );
        }
        assert_eq!(Metering::Highlights.luminance(&[], 1, &[]), STARLIGHT);
        assert_eq!(
            Metering::Highlights.luminance(&[Vec3::ZERO; 9], 3, &[]),
            STARLIGHT
        );
    }

    #[test]
    fn without_a_sky_the_whole_picture_is_metered() {
        let linear = [Vec3::splat(3.0), Vec3::splat(12.0)];
        let ground = [Semantic::Soil; 2];
        for metering in [Metering::Sky, Metering::Ground, Metering::Average] {
            let got = metering.luminance(&linear, 2, &ground);
            assert!((got - 6.0).abs() < 1e-5, "{metering:?}: {got}");
        }
        assert_eq!(log_mean_luminance(&[Vec3::ZERO; 3]), STARLIGHT);
    }
}
