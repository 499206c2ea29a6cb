//! What a terrain's relief is made of beyond plain octaves.

use nemoral_scene::ParamError;

use crate::TerrainParams;

/// How the octaves of a terrain are shaped. By default, all shares are 0 and it stays as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReliefParams {
    /// The share of ridges in the first octave, 0..=1: crests where the noise changes its sign. In
    /// each further octave it is multiplied by itself again, so that small forms stay rounder.
    pub ridges: f64,
    /// Domain warping: how far places are displaced by slow noise before the octaves are looked
    /// up, in multiples of their `scale_m`, as a standard deviation along each axis, 0..=0.25:
    /// valleys wind.
    pub warp: f64,
    /// The share of terraces, 0..=1: at 1, ground between two levels is up to four times as steep
    /// as without, and level in between. They fade in and out from place to place, and dip.
    pub terraces: f64,
    /// How sheer the rises between terraces are, 0..=1: at 1, up to eight times as steep as the
    /// ground without, which makes cliffs of slopes.
    pub cliffs: f64,
    /// The height of a terrace, metres, 0.2 to half of `max_height_m`.
    pub terrace_step_m: f64,
}

impl Default for ReliefParams {
    fn default() -> Self {
        Self {
            ridges: 0.0,
            warp: 0.0,
            terraces: 0.0,
            cliffs: 0.0,
            terrace_step_m: 4.0,
        }
    }
}

impl ReliefParams {
    pub(crate) fn check(&self, terrain: &TerrainParams) -> Result<(), ParamError> {
        ParamError::check_range("ridges", self.ridges, 0.0..=1.0, "0..=1")?;
        ParamError::check_range("warp", self.warp, 0.0..=0.25, "0..=0.25")?;
        ParamError::check_range("terraces", self.terraces, 0.0..=1.0, "0..=1")?;
        ParamError::check_range("cliffs", self.cliffs, 0.0..=1.0, "0..=1")?;
        if self.terraces > 0.0 {
            ParamError::check_range(
                "terrace_step_m",
                self.terrace_step_m,
                0.2..=0.5 * terrain.max_height_m,
                "0.2 m to half of max_height_m",
            )?;
        }
        Ok(())
    }
}
