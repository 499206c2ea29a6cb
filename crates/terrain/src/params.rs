//! The parameters of a terrain.

use nemoral_scene::ParamError;

/// The paper's five parameters of a terrain (section IV-B).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TerrainParams {
    /// Layers of noise, 1..=16.
    pub octaves: u32,
    /// Wavelength of the first octave, metres, 1..=100,000: the distance between its lattice
    /// points.
    pub scale_m: f64,
    /// Factor of frequency from octave to octave, above 1 and up to 16.
    pub lacunarity: f64,
    /// Factor of amplitude from octave to octave, 0..=1.
    pub persistence: f64,
    /// Heights are in 0..=`max_height_m`, 0..=10,000 m.
    pub max_height_m: f64,
}

impl Default for TerrainParams {
    /// Rolling ground: 5 octaves from 120 m, lacunarity 2, persistence 0.35, up to 12 m.
    fn default() -> Self {
        Self {
            octaves: 5,
            scale_m: 120.0,
            lacunarity: 2.0,
            persistence: 0.35,
            max_height_m: 12.0,
        }
    }
}

impl TerrainParams {
    /// The finest useful wavelength, metres, as no mesh shows finer ones.
    const FINEST_M: f64 = 0.001;

    pub(crate) fn check(&self) -> Result<(), ParamError> {
        ParamError::check_range("octaves", f64::from(self.octaves), 1.0..=16.0, "1..=16")?;
        ParamError::check_range("scale_m", self.scale_m, 1.0..=100_000.0, "1..=100000 m")?;
        ParamError::check_range(
            "lacunarity",
            self.lacunarity,
            1.0_f64.next_up()..=16.0,
            "above 1 and at most 16",
        )?;
        ParamError::check_range("persistence", self.persistence, 0.0..=1.0, "0..=1")?;
        ParamError::check_range(
            "max_height_m",
            self.max_height_m,
            0.0..=10_000.0,
            "0..=10000 m",
        )?;
        let finest_m = self.scale_m / libm::pow(self.lacunarity, f64::from(self.octaves - 1));
        ParamError::check_range(
            "octaves",
            f64::from(self.octaves),
            if finest_m < Self::FINEST_M {
                1.0..=0.0
            } else {
                1.0..=16.0
            },
            "so few that scale_m / lacunarity^(octaves - 1), the finest wavelength, is at least 1 \
             mm",
        )
    }
}
