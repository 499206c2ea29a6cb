//! What a camera does to light: where it looks from, its lens, its exposure and its sensor.

pub(crate) mod lens;
pub(crate) mod sensor_noise;
pub(crate) mod tone;
pub(crate) mod view;
