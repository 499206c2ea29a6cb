//! The port to smooth random fields of the plane.

use nemoral_scene::glam::DVec2;

/// A smooth field of the plane with values from 0 to 1, most of them near the middle.
///
/// Any closure from a world position (metres) to a number is one.
pub trait ScalarField {
    /// The field's value at a world position, metres.
    fn value(&self, world_m: DVec2) -> f64;
}

impl<F: Fn(DVec2) -> f64> ScalarField for F {
    fn value(&self, world_m: DVec2) -> f64 {
        self(world_m)
    }
}

/// Which octaves of gradient noise a [`ScalarField`] is expected to be made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldParams {
    /// The number of octaves.
    pub octaves: u32,
    /// The wavelength of the first octave, metres.
    pub scale_m: f64,
    /// The frequency of each octave relative to the one before.
    pub lacunarity: f64,
    /// The amplitude of each octave relative to the one before.
    pub persistence: f64,
}
