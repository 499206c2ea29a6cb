//! The `noise` crate's terrain, for comparison.

use std::fmt;

use glam::DVec2;
use nemoral_scene::{Surface, SurfaceSample};
use nemoral_seed::{Domain, Key};
use noise::{Fbm, MultiFractal, NoiseFn, PerlinSurflet};

use crate::noise_terrain::{deviation, squash};
use crate::{ParamError, TerrainParams};

const SEED: Domain = Domain::new("terrain.perlin");

/// Standard deviation of `PerlinSurflet` over the plane, measured.
const SIGMA: f64 = 0.42;

/// Half the step of the difference quotient for the gradient, metres.
const STEP_M: f64 = 0.01;

/// `Fbm<PerlinSurflet>` of the `noise` crate, scaled to the same range as [`NoiseTerrain`].
///
/// It has known weaknesses: the lattice repeats after 256 cells, all octaves are 0 at lattice
/// points that they share, gradients are central differences over 2 cm, and it is slower.
///
/// [`NoiseTerrain`]: crate::NoiseTerrain
pub struct PerlinTerrain {
    fbm: Fbm<PerlinSurflet>,
    /// Turns the crate's normalisation by amplitudes into one by variance.
    factor: f64,
    max_height_m: f64,
}

impl PerlinTerrain {
    /// The terrain of the world (or of the layer of ground) of `key`.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: TerrainParams, key: Key) -> Result<Self, ParamError> {
        params.check()?;
        // The crate divides by the sum of powers of the persistence, which must not be 0.
        let (octaves, persistence) = if params.persistence > 0.0 {
            (params.octaves, params.persistence)
        } else {
            (1, 1.0)
        };
        let fbm = Fbm::new(key.domain(SEED).to_u64() as u32)
            .set_octaves(octaves as usize)
            .set_frequency(1.0 / params.scale_m)
            .set_lacunarity(params.lacunarity)
            .set_persistence(persistence);
        let (mut amplitudes, mut amplitude) = (0.0, 1.0);
        for _ in 0..octaves {
            amplitudes += amplitude;
            amplitude *= persistence;
        }
        Ok(Self {
            fbm,
            factor: amplitudes / deviation(&params, SIGMA),
            max_height_m: params.max_height_m,
        })
    }
}

impl Surface for PerlinTerrain {
    fn sample(&self, world_m: DVec2) -> SurfaceSample {
        let slope = |step: DVec2| {
            (self.height_m(world_m + step) - self.height_m(world_m - step)) / (2.0 * STEP_M)
        };
        SurfaceSample {
            height_m: self.height_m(world_m),
            gradient: DVec2::new(slope(DVec2::X * STEP_M), slope(DVec2::Y * STEP_M)),
        }
    }

    fn height_m(&self, world_m: DVec2) -> f64 {
        let value = self.factor * self.fbm.get(world_m.to_array());
        squash(value, self.max_height_m).0
    }
}

impl fmt::Debug for PerlinTerrain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PerlinTerrain")
            .field("max_height_m", &self.max_height_m)
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sigma_is_what_is_measured() {
        let mut sum = 0.0;
        let mut count = 0.0;
        for seed in 0..16 {
            let noise = PerlinSurflet::new(seed);
            for x in 0..100 {
                for y in 0..100 {
                    let p = [f64::from(x) * 0.618_034, f64::from(y) * 0.414_214];
                    sum += noise.get(p).powi(2);
                    count += 1.0;
                }
            }
        }
        let measured: f64 = f64::sqrt(sum / count);
        assert!((measured / SIGMA - 1.0).abs() < 0.03, "{measured}");
    }
}
