//! Tests of the camera, in one program.

mod analytic;
mod lamps;
mod motion;
mod optics;
mod path_tracing;
mod properties;
mod radiance;
mod shadows;
mod still_life;
mod truth;
mod water;
