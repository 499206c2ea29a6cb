//! Our terrain: octaves of gradient noise.

use glam::{DMat2, DVec2};
use nemoral_scene::{Surface, SurfaceSample};
use nemoral_seed::{Domain, Draw, Key, Rng};

use crate::gradient_noise::{SIGMA, gradient_noise};
use crate::{ParamError, TerrainParams};

const OCTAVE: Domain = Domain::new("terrain.octave");

/// The contrast of heights. The largest value for which they cluster around the middle rather than
/// at the ends of the range is √⅓.
const CONTRAST: f64 = 0.55;

/// Octaves of gradient noise, normalised to unit variance, and squashed smoothly into
/// 0..=`max_height_m`.
///
/// Heights never reach the ends of the range, so they are never cut off: there are no plateaus.
/// Because the sum is normalised by its variance, slopes get steeper, on average over the plane,
/// with every increase of persistence and of lacunarity. Every octave has its own turn and shift,
/// so that lattice points (where gradient noise is 0) of different octaves never coincide.
#[derive(Clone, Debug)]
pub struct Terrain {
    octaves: Vec<Octave>,
    max_height_m: f64,
}

#[derive(Clone, Copy, Debug)]
struct Octave {
    seed: u64,
    /// The linear map from world metres to octave space: a rotation and a scale.
    linear: DMat2,
    shift: DVec2,
    /// The height in units of the sum's standard deviation.
    amplitude: f64,
}

impl Terrain {
    /// The terrain of the world (or of the layer of ground) of `key`.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: TerrainParams, key: Key) -> Result<Self, ParamError> {
        params.check()?;
        let mut frequency = 1.0 / params.scale_m;
        let mut amplitude = 1.0;
        let octaves = (0..params.octaves)
            .map(|i| {
                let mut rng = key.domain(OCTAVE).item(u64::from(i)).rng();
                let angle = rng.range_f64(0.0, std::f64::consts::TAU);
                let (sin, cos) = (libm::sin(angle), libm::cos(angle));
                let turn = DMat2::from_cols(DVec2::new(cos, sin), DVec2::new(-sin, cos));
                let octave = Octave {
                    seed: rng.next_u64(),
                    linear: turn * frequency,
                    shift: DVec2::new(rng.unit_f64(), rng.unit_f64()) * 1024.0,
                    amplitude: amplitude / deviation(&params, SIGMA),
                };
                frequency *= params.lacunarity;
                amplitude *= params.persistence;
                octave
            })
            .collect();
        Ok(Self {
            octaves,
            max_height_m: params.max_height_m,
        })
    }
}

impl Surface for Terrain {
    fn sample(&self, world_m: DVec2) -> SurfaceSample {
        let mut sum = 0.0;
        let mut gradient = DVec2::ZERO;
        for o in &self.octaves {
            let (value, slope) = gradient_noise(o.seed, o.linear * world_m + o.shift);
            sum += o.amplitude * value;
            // The transpose transforms a gradient back: d/dx f(L x + s) = Lᵀ f'.
            gradient +=
                o.amplitude * DVec2::new(o.linear.x_axis.dot(slope), o.linear.y_axis.dot(slope));
        }
        let (height_m, rate) = squash(sum, self.max_height_m);
        SurfaceSample {
            height_m,
            gradient: rate * gradient,
        }
    }
}

/// Standard deviation of the sum of octaves of amplitude persistence^k, for noise of deviation
/// `sigma`.
pub(crate) fn deviation(params: &TerrainParams, sigma: f64) -> f64 {
    let mut variance = 0.0;
    let mut amplitude = 1.0;
    for _ in 0..params.octaves {
        variance += amplitude * amplitude;
        amplitude *= params.persistence;
    }
    sigma * libm::sqrt(variance)
}

/// A height in 0..=max for a value of unit variance, and the derivative: x / √(1 + x²).
pub(crate) fn squash(value: f64, max_height_m: f64) -> (f64, f64) {
    let x = CONTRAST * value;
    let root = libm::sqrt(1.0 + x * x);
    let half = 0.5 * max_height_m;
    (
        half * (1.0 + x / root),
        half * CONTRAST / (root * root * root),
    )
}
