//! Sharpness of the lens, and scattering and fall-off of light in it.

use glam::{DVec2, DVec3, Vec3};
use nemoral_scene::Intrinsics;
use rayon::prelude::*;

use super::aberration::ChromaticAberration;
use crate::colour::in_parts;
use crate::error::{ParamError, check};

/// Sharpness, scattering and fall-off. In a forest they decide how trunks look against the sky:
/// gaps are several stops brighter than anything in front of them, and their scattered light washes
/// out nearby edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// The share of all light that is spread evenly over the picture, 0..=0.5; a clean lens has
    /// 0.01.
    pub veiling_glare: f32,
    /// The share of light that is scattered around its image point, 0..=0.5: half of it within a
    /// hundredth of the picture's width, a fifth within a tenth and more (two of the components of
    /// the glare of optics and eyes; Spencer et al. 1995, "Physically-based glare effects").
    pub halo: f32,
    /// How corners darken.
    pub vignetting: Vignetting,
    /// Fringes of colour.
    pub aberration: ChromaticAberration,
    /// The standard deviation of the light of a point around its place, pixels, 0..=4: by
    /// diffraction, aberrations, focus and the filter in front of a sensor. It is a Gaussian; one
    /// of less than a third of a pixel spreads nothing.
    pub spread_px: f32,
}

/// How the light behind a lens falls off away from its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Vignetting {
    /// By this share of the fourth power of the cosine of the angle from the axis: 0 not at all, 1
    /// as behind a plain lens. 0..=1.
    CosineFourth(f32),
    /// To 1 + a2 ρ² + a4 ρ⁴ + a6 ρ⁶, where ρ is the distance from the principal point over half the
    /// picture's diagonal. It is between 0 and 2 for all ρ up to 1, and as far as the picture goes,
    /// which is more if the principal point is off its middle.
    Polynomial {
        /// −2..=2, as the others.
        a2: f32,
        /// Of the fourth power.
        a4: f32,
        /// Of the sixth power.
        a6: f32,
    },
}

impl Vignetting {
    const NONE: Self = Self::CosineFourth(0.0);

    /// Checks it up to a distance from the principal point, in half diagonals.
    fn check(&self, farthest: f64) -> Result<(), ParamError> {
        match *self {
            Self::CosineFourth(share) => check("lens.vignetting", share.into(), 0.0, 1.0, "0..=1"),
            Self::Polynomial { a2, a4, a6 } => {
                for (field, a) in [("a2", a2), ("a4", a4), ("a6", a6)] {
                    let field = format!("lens.vignetting.{field}");
                    check(&field, a.into(), -2.0, 2.0, "-2..=2")?;
                }
                (0_u32..=64).try_for_each(|i| {
                    let rho = farthest * f64::from(i) / 64.0;
                    let share = polynomial([a2, a4, a6], rho as f32);
                    let allowed = "shares of light from 0 to 2 everywhere";
                    check("lens.vignetting", share.into(), 0.0, 2.0, allowed)
                })
            }
        }
    }

    /// The share of light that arrives at a pixel.
    fn share(&self, pixel: DVec2, intrinsics: &Intrinsics) -> f32 {
        match *self {
            Self::CosineFourth(share) => {
                let cos = intrinsics.direction(pixel).z as f32;
                let falls_off = 1.0 - cos * cos * cos * cos;
                1.0 - share * falls_off
            }
            Self::Polynomial { a2, a4, a6 } => {
                polynomial([a2, a4, a6], half_diagonals(pixel, intrinsics) as f32).max(0.0)
            }
        }
    }
}

/// The distance from the principal point over half the picture's diagonal.
fn half_diagonals(pixel: DVec2, intrinsics: &Intrinsics) -> f64 {
    let size = DVec2::new(intrinsics.width.into(), intrinsics.height.into());
    let centre = DVec2::new(intrinsics.cx, intrinsics.cy);
    (pixel - centre).length() / (0.5 * size.length())
}

fn polynomial([a2, a4, a6]: [f32; 3], rho: f32) -> f32 {
    let r2 = rho * rho;
    1.0 + r2 * (a2 + r2 * (a4 + r2 * a6))
}

impl Default for Lens {
    /// A clean lens, well corrected.
    fn default() -> Self {
        Self {
            veiling_glare: 0.01,
            halo: 0.0,
            vignetting: Vignetting::NONE,
            aberration: ChromaticAberration::default(),
            spread_px: 0.0,
        }
    }
}

/// The halo's parts: the spread of a Gaussian as a share of the picture's width, and its weight.
const HALO: [(f32, f32); 3] = [(0.004, 0.5), (0.02, 0.3), (0.08, 0.2)];

/// Scattered light is computed on blocks of this number of pixels along each side.
const BLOCK: usize = 4;

impl Lens {
    /// Checks it before the first picture; renderers check it by themselves.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn check(&self) -> Result<(), ParamError> {
        self.check_within(1.0)
    }

    /// The same for pictures with these intrinsics, whose corners may be farther from the principal
    /// point than those of others.
    ///
    /// # Errors
    /// As [`check`](Self::check), and if a polynomial is no share of light in a corner.
    pub fn check_for(&self, intrinsics: &Intrinsics) -> Result<(), ParamError> {
        let (w, h) = (f64::from(intrinsics.width), f64::from(intrinsics.height));
        let corners = [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h)];
        let distances = corners.map(|(x, y)| half_diagonals(DVec2::new(x, y), intrinsics));
        self.check_within(distances.into_iter().fold(1.0, f64::max))
    }

    /// The same up to a distance from the principal point, in half diagonals.
    fn check_within(&self, farthest: f64) -> Result<(), ParamError> {
        for (field, value, most, allowed) in [
            ("lens.veiling_glare", self.veiling_glare, 0.5, "0..=0.5"),
            ("lens.halo", self.halo, 0.5, "0..=0.5"),
            ("lens.spread_px", self.spread_px, 4.0, "0..=4 pixels"),
        ] {
            check(field, value.into(), 0.0, most, allowed)?;
        }
        self.vignetting.check(farthest)?;
        self.aberration.check()
    }

    /// Turns the light in front of the lens, row by row, into the light behind it: scattering and
    /// fall-off, without aberration and spread.
    pub(crate) fn apply(&self, light: &mut [Vec3], intrinsics: &Intrinsics) {
        let clean = self.veiling_glare == 0.0 && self.halo == 0.0;
        if clean && self.vignetting == Vignetting::NONE {
            return;
        }
        let width = intrinsics.width as usize;
        let part = |light: &[Vec3]| light.iter().map(|c| c.as_dvec3()).sum::<DVec3>();
        let sum: DVec3 = in_parts(light, part).into_iter().sum();
        let veil = (sum / light.len() as f64).as_vec3() * self.veiling_glare;
        let kept = 1.0 - self.veiling_glare - self.halo;
        let around = (self.halo > 0.0).then(|| BlockImage::around(light, width));
        light
            .par_chunks_mut(width)
            .enumerate()
            .for_each(|(y, row)| {
                for (x, c) in row.iter_mut().enumerate() {
                    let mut behind = *c * kept + veil;
                    if let Some(around) = &around {
                        behind += around.at(x, y) * self.halo;
                    }
                    let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                    *c = behind * self.vignetting.share(pixel, intrinsics);
                }
            });
    }
}

/// A picture whose pixels are blocks.
#[derive(Clone)]
pub(super) struct BlockImage {
    width: usize,
    light: Vec<Vec3>,
}

impl BlockImage {
    /// The light that is scattered to each place.
    fn around(light: &[Vec3], width: usize) -> Self {
        let blocks = Self::of(light, width);
        let blurred = HALO.par_iter().map(|&(spread, weight)| {
            let mut part = blocks.clone();
            part.blur(spread * width as f32 / BLOCK as f32);
            (part.light, weight)
        });
        let mut sum = vec![Vec3::ZERO; blocks.light.len()];
        for (part, weight) in blurred.collect::<Vec<_>>() {
            for (sum, c) in sum.iter_mut().zip(part) {
                *sum += c * weight;
            }
        }
        Self {
            width: blocks.width,
            light: sum,
        }
    }

    /// The picture with a blur of this spread in its pixels.
    pub(super) fn blurred(light: &[Vec3], width: usize, spread_px: f32) -> Self {
        let mut blocks = Self::of(light, width);
        blocks.blur(spread_px / BLOCK as f32);
        blocks
    }

    /// The means of blocks, which have fewer pixels at the borders.
    fn of(light: &[Vec3], width: usize) -> Self {
        let height = light.len() / width;
        let (columns, rows) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
        let mean = |k: usize| {
            let (left, top) = (k % columns * BLOCK, k / columns * BLOCK);
            let (right, bottom) = ((left + BLOCK).min(width), (top + BLOCK).min(height));
            let pixels = (top..bottom).flat_map(|y| &light[y * width + left..y * width + right]);
            pixels.sum::<Vec3>() / ((right - left) * (bottom - top)) as f32
        };
        Self {
            width: columns,
            light: (0..columns * rows).into_par_iter().map(mean).collect(),
        }
    }

    /// Three running means along rows and along columns: a Gaussian to a few percent (Wells 1986,
    /// "Efficient synthesis of Gaussian filters by cascaded uniform filters"), of whole reach, so
    /// that small spreads are rounded. Beyond the border the picture is constant.
    fn blur(&mut self, sigma: f32) {
        let reach = (0.5 * ((4.0 * sigma * sigma + 1.0).sqrt() - 1.0)).round() as usize;
        let (width, height) = (self.width, self.light.len() / self.width);
        for _ in 0..3 {
            for row in self.light.chunks_mut(width) {
                running_mean(row, reach);
            }
        }
        let mut column = vec![Vec3::ZERO; height];
        for x in 0..width {
            for (y, c) in column.iter_mut().enumerate() {
                *c = self.light[y * width + x];
            }
            for _ in 0..3 {
                running_mean(&mut column, reach);
            }
            for (y, c) in column.iter().enumerate() {
                self.light[y * width + x] = *c;
            }
        }
    }

    /// Interpolates between the middles of blocks.
    fn at(&self, x: usize, y: usize) -> Vec3 {
        self.at_position(x as f32 + 0.5, y as f32 + 0.5)
    }

    /// The same at a position in the picture's pixels.
    pub(super) fn at_position(&self, x: f32, y: f32) -> Vec3 {
        let height = self.light.len() / self.width;
        let split = |x: f32, n: usize| {
            let at = (x / BLOCK as f32 - 0.5).clamp(0.0, (n - 1) as f32);
            let low = (at as usize).min(n.saturating_sub(2));
            (low, (low + 1).min(n - 1), at - low as f32)
        };
        let (left, right, u) = split(x, self.width);
        let (top, bottom, v) = split(y, height);
        let row = |y: usize| {
            let y = y * self.width;
            self.light[y + left].lerp(self.light[y + right], u)
        };
        row(top).lerp(row(bottom), v)
    }
}

/// The mean of each element and `reach` more on both sides.
fn running_mean(line: &mut [Vec3], reach: usize) {
    let before = line.to_vec();
    let at = |i: isize| before[i.clamp(0, before.len() as isize - 1) as usize];
    let reach = reach as isize;
    let mut sum: Vec3 = (-reach..=reach).map(at).sum();
    for (i, out) in (0..).zip(line.iter_mut()) {
        *out = (sum / (2 * reach + 1) as f32).max(Vec3::ZERO);
        sum += at(i + reach + 1) - at(i - reach);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(width: u32, height: u32) -> Intrinsics {
        Intrinsics::from_fov(width, height, 90_f64.to_radians()).expect("valid")
    }

    #[test]
    fn no_light_is_lost_but_in_the_corners() {
        let optics = view(160, 96);
        let mut light = vec![Vec3::ZERO; 160 * 96];
        light[48 * 160 + 80] = Vec3::splat(15360.0);
        let lens = Lens {
            veiling_glare: 0.05,
            halo: 0.1,
            ..Lens::default()
        };
        lens.apply(&mut light, &optics);
        let total: f32 = light.iter().map(|c| c.y).sum();
        assert!((total / 15360.0 - 1.0).abs() < 2e-3, "{total}");
        // The point remains, there is more light near it than far from it, and nowhere less than
        // the veil.
        let at = |x: usize, y: usize| light[y * 160 + x].y;
        assert!((at(80, 48) / 15360.0 - 0.85).abs() < 0.01);
        assert!(at(84, 48) > 2.0 * at(100, 48) && at(100, 48) > at(140, 48));
        assert!(at(0, 0) >= 0.05 * 0.999);
    }

    #[test]
    fn an_even_picture_stays_even_and_corners_fall_off_by_the_fourth_power() {
        let optics = view(160, 96);
        let even = vec![Vec3::new(3.0, 2.0, 1.0); 160 * 96];
        let lens = |share| Lens {
            veiling_glare: 0.02,
            halo: 0.08,
            vignetting: Vignetting::CosineFourth(share),
            ..Lens::default()
        };
        let mut light = even.clone();
        lens(0.0).apply(&mut light, &optics);
        let off = |a: &Vec3, b: &Vec3| (*a - *b).abs().max_element();
        assert!(light.iter().zip(&even).all(|(a, b)| off(a, b) < 1e-4));
        lens(1.0).apply(&mut light, &optics);
        let cos = optics.direction(DVec2::new(0.5, 0.5)).z as f32;
        assert!((light[0].x / 3.0 - cos.powi(4)).abs() < 1e-4);
        assert!((light[48 * 160 + 80].x / 3.0 - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_polynomial_falls_off_as_it_says() {
        let optics =
            Intrinsics::from_calibration(160, 96, DVec2::splat(90.0), DVec2::new(70.0, 50.0));
        let lens = Lens {
            veiling_glare: 0.0,
            vignetting: Vignetting::Polynomial {
                a2: -0.5,
                a4: 0.3,
                a6: -0.25,
            },
            ..Lens::default()
        };
        assert!(lens.check().is_ok());
        let mut light = vec![Vec3::splat(5.0); 160 * 96];
        lens.apply(&mut light, &optics.expect("valid"));
        let half_diagonal = 0.5 * (160.0_f64.powi(2) + 96.0_f64.powi(2)).sqrt();
        for (x, y) in [(0_usize, 0_usize), (69, 49), (120, 90), (159, 3)] {
            let r = (x as f64 + 0.5 - 70.0).hypot(y as f64 + 0.5 - 50.0) / half_diagonal;
            let exact = 5.0 * (1.0 - 0.5 * r.powi(2) + 0.3 * r.powi(4) - 0.25 * r.powi(6));
            let got = f64::from(light[y * 160 + x].x);
            assert!((got - exact).abs() < 1e-5, "{x} {y}: {got} for {exact}");
        }
        let black = Vignetting::Polynomial {
            a2: -1.5,
            a4: 0.0,
            a6: 0.0,
        };
        assert!(black.check(1.0).is_err(), "less than no light");
    }

    /// 1.478 half diagonals from the principal point, 3.33 times the light would arrive.
    #[test]
    fn a_polynomial_is_checked_in_all_corners() {
        let optics = |cx_px| {
            let centre = DVec2::new(cx_px, 360.0);
            Intrinsics::from_calibration(1280, 720, DVec2::splat(700.0), centre).expect("valid")
        };
        let lens = Lens {
            vignetting: Vignetting::Polynomial {
                a2: -0.9,
                a4: 0.9,
                a6: 0.0,
            },
            ..Lens::default()
        };
        assert_eq!(lens.check(), Ok(()));
        assert_eq!(lens.check_for(&optics(640.0)), Ok(()));
        let e = lens.check_for(&optics(256.0)).expect_err("too bright");
        assert_eq!(e.field, "lens.vignetting");
        // 2.34 half diagonals away, this one ends below 0.
        let darker = Lens {
            vignetting: Vignetting::Polynomial {
                a2: -0.3,
                a4: 0.0,
                a6: 0.0,
            },
            ..lens
        };
        assert_eq!(darker.check_for(&optics(256.0)), Ok(()));
        assert!(
            darker.check_for(&optics(-400.0)).is_err(),
            "less than no light"
        );
    }

    #[test]
    fn a_blur_has_its_spread() {
        for sigma in [4.5, 7.0, 16.0] {
            let mut line = BlockImage {
                width: 201,
                light: vec![Vec3::ZERO; 201],
            };
            line.light[100] = Vec3::ONE;
            line.blur(sigma);
            let moment = |k: i32| -> f32 {
                let x = |i: usize| (i as f32 - 100.0).powi(k);
                line.light.iter().enumerate().map(|(i, c)| c.x * x(i)).sum()
            };
            assert!((moment(0) - 1.0).abs() < 1e-4);
            assert!(
                (moment(2).sqrt() / sigma - 1.0).abs() < 0.12,
                "{}",
                moment(2).sqrt()
            );
        }
    }
}
