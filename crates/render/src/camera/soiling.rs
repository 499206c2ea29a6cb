//! Dirt and drops on the front of a lens.

use glam::{Vec2, Vec3};
use nemoral_seed::{Domain, Draw, Key};
use rayon::prelude::*;

use super::lens::BlockImage;
use crate::error::{ParamError, check};

/// Dirt and drops of water on the front of a lens. They are so near that they are out of focus:
/// specks are soft spots that darken and veil what is behind them, and a drop is a small lens that
/// shows what is around it upside down and blurred. They are in the picture alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Soiling {
    /// Specks of dirt on the picture, 0..=2000.
    pub specks: u32,
    /// Mean radius of a speck as a share of the picture's width, 0.001..=0.2.
    pub speck_radius: f32,
    /// The share of light that a dense speck stops in its middle, 0..=1.
    pub opacity: f32,
    /// The share of what a speck stops that it scatters into the camera, 0..=1: wet soil has 0.1,
    /// dust 0.4.
    pub albedo: f32,
    /// Drops on the picture, 0..=500.
    pub drops: u32,
    /// Mean radius of a drop as a share of the picture's width, 0.001..=0.2.
    pub drop_radius: f32,
    /// The individual lens; equal keys have equal dirt.
    pub serial: Key,
}

const SPECKS: Domain = Domain::new("render.specks");
const DROPS: Domain = Domain::new("render.drops");

/// A drop shows this many times its own width.
const WIDER: f32 = 4.0;
/// The width of a drop's soft edge, as a share of its radius.
const EDGE: f32 = 0.3;
/// The spread of the blur of what drops show, as a share of the mean radius: a quarter of a radius
/// on the lens, where all is out of focus.
const BLUR: f32 = 1.0;
/// The light that passes a drop: what is reflected and lost at its edge is missing.
const THROUGH: f32 = 0.92;

/// A spot on the lens, in pixels.
struct Spot {
    centre: Vec2,
    radius: f32,
    /// The direction of the shorter axis; its length is how much shorter that axis is, 0..=0.25.
    stretch: Vec2,
    strength: f32,
}

impl Spot {
    /// The spots of a kind, of which those beyond the border show in part.
    fn all(key: Key, count: u32, mean_radius: f32, size: Vec2) -> impl Iterator<Item = Self> {
        let radius = mean_radius * size.x;
        (0..count).map(move |i| {
            let mut rng = key.item(i.into()).rng();
            let [x, y, s] = [0; 3].map(|_| rng.unit_f64() as f32);
            // Radii between half the mean one and twice it; many are small.
            let radius = radius * (0.5 + s * s * 1.5);
            let at = Vec2::new(x, y) * (size + 2.0 * radius) - radius;
            let (stretch, turn) = (
                0.25 * rng.unit_f64(),
                std::f64::consts::TAU * rng.unit_f64(),
            );
            let direction = Vec2::new(libm::cos(turn) as f32, libm::sin(turn) as f32);
            Self {
                centre: at,
                radius,
                stretch: direction * stretch as f32,
                strength: 0.4 + 0.6 * rng.unit_f64() as f32,
            }
        })
    }

    /// Distance from the centre over the radius.
    fn reach(&self, at: Vec2) -> f32 {
        let d = (at - self.centre) / self.radius;
        let along = d.dot(self.stretch);
        (d.length_squared() + 4.0 * along * along / self.stretch.length().max(1e-6)).sqrt()
    }

    /// Calls `paint` with each pixel that it touches and the reach there, below 1.
    fn for_each(&self, width: usize, height: usize, mut paint: impl FnMut(usize, Vec2, f32)) {
        let range = |centre: f32, n: usize| {
            let low = (centre - self.radius).floor().clamp(0.0, n as f32) as usize;
            let high = (centre + self.radius).ceil().clamp(0.0, n as f32) as usize;
            low..high
        };
        for y in range(self.centre.y, height) {
            for x in range(self.centre.x, width) {
                let at = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let reach = self.reach(at);
                if reach < 1.0 {
                    paint(y * width + x, at, reach);
                }
            }
        }
    }
}

impl Soiling {
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        let radius = "0.001..=0.2 of the picture's width";
        for (field, value, low, high, allowed) in [
            (
                "soiling.specks",
                f64::from(self.specks),
                0.0,
                2000.0,
                "0..=2000",
            ),
            (
                "soiling.speck_radius",
                self.speck_radius.into(),
                0.001,
                0.2,
                radius,
            ),
            ("soiling.opacity", self.opacity.into(), 0.0, 1.0, "0..=1"),
            ("soiling.albedo", self.albedo.into(), 0.0, 1.0, "0..=1"),
            ("soiling.drops", self.drops.into(), 0.0, 500.0, "0..=500"),
            (
                "soiling.drop_radius",
                self.drop_radius.into(),
                0.001,
                0.2,
                radius,
            ),
        ] {
            // Radii are f32, whose ends lie beside those of the range.
            check(field, value, low - 1e-8, high + 1e-8, allowed)?;
        }
        Ok(())
    }

    /// Puts drops and dirt before the light of a picture, row by row.
    pub(crate) fn apply(&self, light: &mut [Vec3], width: usize) {
        let height = light.len() / width;
        let size = Vec2::new(width as f32, height as f32);
        if self.drops > 0 {
            self.put_drops(light, width, size);
        }
        if self.specks == 0 {
            return;
        }
        let mut passing = vec![1.0_f32; light.len()];
        let specks = Spot::all(
            self.serial.domain(SPECKS),
            self.specks,
            self.speck_radius,
            size,
        );
        for speck in specks {
            let stops = self.opacity * speck.strength;
            speck.for_each(width, height, |i, _, reach| {
                let inside = 1.0 - reach * reach;
                passing[i] *= 1.0 - stops * inside * inside;
            });
        }
        // Dirt is lit by all that is before the lens.
        let sum: glam::DVec3 = light.iter().map(|c| c.as_dvec3()).sum();
        let scattered = (sum / light.len() as f64).as_vec3() * self.albedo;
        for (c, passing) in light.iter_mut().zip(passing) {
            *c = *c * passing + scattered * (1.0 - passing);
        }
    }

    fn put_drops(&self, light: &mut [Vec3], width: usize, size: Vec2) {
        let height = light.len() / width;
        let behind = BlockImage::blurred(light, width, BLUR * self.drop_radius * size.x);
        let drops: Vec<Spot> = Spot::all(
            self.serial.domain(DROPS),
            self.drops,
            self.drop_radius,
            size,
        )
        .collect();
        let mut cover: Vec<(f32, Vec2)> = vec![(0.0, Vec2::ZERO); light.len()];
        for drop in &drops {
            drop.for_each(width, height, |i, at, reach| {
                let edge = ((1.0 - reach) / EDGE).min(1.0);
                let share = edge * edge * (3.0 - 2.0 * edge);
                // The nearer middle wins where drops overlap.
                if share > cover[i].0 {
                    let shown = drop.centre - (at - drop.centre) * WIDER;
                    cover[i] = (share, shown);
                }
            });
        }
        light
            .par_iter_mut()
            .zip(cover)
            .for_each(|(c, (share, shown))| {
                if share > 0.0 {
                    let at = mirrored(shown, size);
                    let seen = behind.at_position(at.x, at.y) * THROUGH;
                    *c = *c * (1.0 - share) + seen * share;
                }
            });
    }
}

/// The place in the picture that continues it beyond its border, as in a mirror there.
fn mirrored(at: Vec2, size: Vec2) -> Vec2 {
    let fold = |x: f32, n: f32| {
        let x = x.rem_euclid(2.0 * n);
        if x < n { x } else { 2.0 * n - x }
    };
    Vec2::new(fold(at.x, size.x), fold(at.y, size.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLEAN: Soiling = Soiling {
        specks: 0,
        speck_radius: 0.02,
        opacity: 0.8,
        albedo: 0.3,
        drops: 0,
        drop_radius: 0.05,
        serial: Key::world(4),
    };

    #[test]
    fn specks_stop_and_scatter_as_much_as_they_say() {
        let even = Vec3::new(4.0, 2.0, 1.0);
        let mut light = vec![even; 200 * 120];
        let dirty = Soiling {
            specks: 60,
            ..CLEAN
        };
        dirty.apply(&mut light, 200);
        // In an even field L a speck that lets T pass shows L (T + (1 - T) albedo).
        let shares: Vec<f32> = light.iter().map(|c| (c.x / even.x - 0.3) / 0.7).collect();
        assert!(shares.iter().all(|t| (0.0..=1.00001).contains(t)));
        assert!(shares.iter().any(|t| *t < 0.5) && shares.iter().any(|t| *t > 0.9999));
        assert!(
            light.iter().all(|c| (c.x / c.z - 4.0).abs() < 1e-4),
            "no colour of its own"
        );
        let lone = Soiling {
            specks: 1,
            opacity: 1.0,
            albedo: 0.0,
            ..CLEAN
        };
        let key = CLEAN.serial.domain(SPECKS);
        let spot = Spot::all(key, 1, 0.02, Vec2::new(200.0, 120.0))
            .next()
            .expect("one");
        let mut light = vec![Vec3::ONE; 200 * 120];
        lone.apply(&mut light, 200);
        spot.for_each(200, 120, |i, _, reach| {
            let passes = 1.0 - spot.strength * (1.0 - reach * reach).powi(2);
            assert!((light[i].y - passes).abs() < 1e-5);
        });
    }

    #[test]
    fn a_drop_shows_its_surroundings_upside_down() {
        // Bright above, dark below.
        let mut light: Vec<Vec3> = (0..200 * 120)
            .map(|i| Vec3::splat(if i < 200 * 60 { 9.0 } else { 1.0 }))
            .collect();
        let before = light.clone();
        let wet = Soiling { drops: 1, ..CLEAN };
        let key = CLEAN.serial.domain(DROPS);
        let drop = Spot::all(key, 1, 0.05, Vec2::new(200.0, 120.0))
            .next()
            .expect("one");
        wet.apply(&mut light, 200);
        let mut touched = 0;
        drop.for_each(200, 120, |i, at, reach| {
            touched += 1;
            if reach < 0.6 {
                let shown = mirrored(
                    drop.centre - (at - drop.centre) * 4.0,
                    Vec2::new(200.0, 120.0),
                );
                if (shown.y - 60.0).abs() > 26.0 {
                    let exact = if shown.y < 60.0 { 9.0 } else { 1.0 } * THROUGH;
                    assert!(
                        (light[i].y - exact).abs() < 0.5,
                        "{} for {exact}",
                        light[i].y
                    );
                }
            }
        });
        let changed = light.iter().zip(&before).filter(|(a, b)| a != b).count();
        assert!(touched > 50 && changed <= touched);
    }

    #[test]
    fn equal_lenses_have_equal_dirt() {
        let picture = |serial| {
            let mut light = vec![Vec3::ONE; 64 * 48];
            Soiling {
                specks: 9,
                drops: 3,
                serial,
                ..CLEAN
            }
            .apply(&mut light, 64);
            light
        };
        assert_eq!(picture(Key::world(1)), picture(Key::world(1)));
        assert_ne!(picture(Key::world(1)), picture(Key::world(2)));
        let sum: f32 = picture(Key::world(1)).iter().map(|c| c.y).sum();
        assert_eq!(format!("{sum:.3}"), VALUE, "value stability");
    }
    const VALUE: &str = "3061.892";
}
