//! How much water a world has.

use nemoral_scene::ParamError;

/// Streams and ponds of a world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WaterParams {
    /// Mean number of springs on a square kilometre, 0..=400. A spring whose water would not come
    /// to a hollow within [`REACH_M`](crate::REACH_M) gives no stream.
    pub springs_per_km2: f64,
    /// Width of the water of a stream 100 m below its spring, metres, 0.3..=4. It grows with the
    /// square root of the length of all streams above.
    pub stream_width_m: f64,
    /// Share of the terrain's hollows that hold a pond, 0..=1; those in which a stream ends always
    /// do.
    pub ponds: f64,
    /// Mean radius of the largest ponds, metres, 2..=12.
    pub pond_radius_m: f64,
}

impl Default for WaterParams {
    fn default() -> Self {
        Self {
            springs_per_km2: 12.0,
            stream_width_m: 0.9,
            ponds: 0.05,
            pond_radius_m: 7.0,
        }
    }
}

impl WaterParams {
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        let Self {
            springs_per_km2,
            stream_width_m,
            ponds,
            pond_radius_m,
        } = *self;
        ParamError::check_range(
            "springs_per_km2",
            springs_per_km2,
            0.0..=400.0,
            "0..=400 per km²",
        )?;
        ParamError::check_range("stream_width_m", stream_width_m, 0.3..=4.0, "0.3..=4 m")?;
        ParamError::check_range("ponds", ponds, 0.0..=1.0, "0..=1")?;
        ParamError::check_range("pond_radius_m", pond_radius_m, 2.0..=12.0, "2..=12 m")
    }
}
