//! Our terrain: octaves of gradient noise.

use glam::DVec2;
use nemoral_scene::{Surface, SurfaceSample};
use nemoral_seed::{Domain, Key};

use crate::gradient_noise::SIGMA;
use crate::octave::Octave;
use crate::terraces::Terraces;
use crate::{ParamError, ReliefParams, TerrainParams};

const OCTAVE: Domain = Domain::new("terrain.octave");
const WARP: Domain = Domain::new("terrain.warp");

/// The contrast of heights. The largest value for which they cluster around the middle rather than
/// at the ends of the range is √⅓.
const CONTRAST: f64 = 0.55;

/// Wavelength of the noise that displaces places, in multiples of the terrain's scale.
const WARP_SCALE: f64 = 2.0;

/// Octaves of gradient noise, normalised to unit variance, and squashed smoothly into
/// 0..=`max_height_m`.
///
/// Heights never reach the ends of the range, so they are never cut off: there are no plateaus.
/// Because the sum is normalised by its variance, slopes get steeper, on average over the plane,
/// with every increase of persistence and of lacunarity. Every octave has its own turn and shift,
/// so that lattice points (where gradient noise is 0) of different octaves never coincide.
#[derive(Clone, Debug)]
pub struct NoiseTerrain {
    octaves: Vec<Octave>,
    /// What displaces places along x and along y before the octaves are looked up.
    warp: Option<[Octave; 2]>,
    terraces: Option<Terraces>,
    max_height_m: f64,
}

impl NoiseTerrain {
    /// The terrain of the world (or of the layer of ground) of `key`.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: TerrainParams, key: Key) -> Result<Self, ParamError> {
        Self::shaped(params, ReliefParams::default(), key)
    }

    /// As [`new`](Self::new), with octaves that are ridged, displaced and terraced. Heights stay in
    /// the same range, and the gradient stays exact.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn shaped(
        params: TerrainParams,
        relief: ReliefParams,
        key: Key,
    ) -> Result<Self, ParamError> {
        params.check()?;
        relief.check(&params)?;
        let TerrainParams {
            scale_m,
            max_height_m,
            ..
        } = params;
        let mut frequency = 1.0 / scale_m;
        let mut amplitude = 1.0;
        let mut ridges = relief.ridges;
        let octaves = (0..params.octaves)
            .map(|i| {
                let key = key.domain(OCTAVE).item(u64::from(i));
                let factor = amplitude / deviation(&params, SIGMA);
                let octave = Octave::new(key, frequency, factor, ridges);
                frequency *= params.lacunarity;
                amplitude *= params.persistence;
                ridges *= relief.ridges;
                octave
            })
            .collect();
        let warp = (relief.warp > 0.0).then(|| {
            let frequency = 1.0 / (WARP_SCALE * scale_m);
            let factor = relief.warp * scale_m / SIGMA;
            [0, 1].map(|axis| Octave::new(key.domain(WARP).item(axis), frequency, factor, 0.0))
        });
        let terraces =
            (relief.terraces > 0.0).then(|| Terraces::new(&relief, (scale_m, max_height_m), key));
        Ok(Self {
            octaves,
            warp,
            terraces,
            max_height_m,
        })
    }

    /// The sum of the octaves, which has unit variance, and its gradient.
    fn sum(&self, world_m: DVec2) -> (f64, DVec2) {
        let mut sum = 0.0;
        let mut gradient = DVec2::ZERO;
        for octave in &self.octaves {
            let (value, slope) = octave.sample(world_m);
            sum += value;
            gradient += slope;
        }
        (sum, gradient)
    }
}

impl Surface for NoiseTerrain {
    fn sample(&self, world_m: DVec2) -> SurfaceSample {
        let (sum, gradient) = match &self.warp {
            None => self.sum(world_m),
            Some(warp) => {
                let [(x, along_x), (y, along_y)] = warp.map(|octave| octave.sample(world_m));
                let (sum, there) = self.sum(world_m + DVec2::new(x, y));
                // The chain rule: the transpose of the displacement's Jacobian.
                (sum, there + there.x * along_x + there.y * along_y)
            }
        };
        let (height_m, rate) = squash(sum, self.max_height_m);
        let sample = SurfaceSample {
            height_m,
            gradient: rate * gradient,
        };
        match &self.terraces {
            None => sample,
            Some(terraces) => terraces.apply(world_m, sample),
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
