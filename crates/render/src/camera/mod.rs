//! The camera: its view, lens, exposure, sensor and processing.

pub(crate) mod aberration;
mod denoise;
pub(crate) mod exposure;
pub(crate) mod jpeg;
pub(crate) mod lens;
mod luma;
pub(crate) mod metering;
pub(crate) mod picture;
mod point_spread;
pub(crate) mod precipitation;
pub(crate) mod processing;
pub(crate) mod sensor_noise;
mod sharpening;
pub(crate) mod soiling;
pub(crate) mod tone;
pub(crate) mod view;
pub(crate) mod white_balance;
