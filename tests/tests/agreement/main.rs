//! Sensors, renderers and casters agree with each other, point by point and pixel by pixel.

mod annotations;
mod card;
mod coverage;
mod models;
mod processing;
mod sensors;
mod site;
mod stereo;
mod water;
