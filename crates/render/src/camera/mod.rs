//! The camera: its view, lens, exposure and sensor.

pub(crate) mod lens;
mod point_spread;
pub(crate) mod sensor_noise;
pub(crate) mod tone;
pub(crate) mod view;
