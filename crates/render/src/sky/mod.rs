//! Sun, moon and sky: their places, the scattering of their light in the air, and the haze in front
//! of a camera.

pub(crate) mod atmosphere;
pub(crate) mod haze;
pub(crate) mod irradiance;
pub(crate) mod model;
pub(crate) mod moon;
pub(crate) mod sky_image;
pub(crate) mod sun;
pub(crate) mod sun_disc;
pub(crate) mod twilight;
