//! Sun and sky: where the sun stands, what the air makes of its light, and the haze before a
//! camera.

pub(crate) mod atmosphere;
pub(crate) mod haze;
pub(crate) mod irradiance;
pub(crate) mod model;
pub(crate) mod photograph;
pub(crate) mod sun;
pub(crate) mod sun_disc;
