//! What a range sensor knows about an echo that it measures.

/// The true properties of an echo, before the receiver measures it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EchoObservation {
    /// True distance from the sensor to the surface, metres, at least 0.
    pub range_m: f64,
    /// Cosine of the angle between the beam and the surface normal, 1 (head-on) to 0 (grazing).
    pub incidence_cos: f64,
    /// Diffuse reflectance of the surface at the laser's wavelength, 0..1; of a glint of water the
    /// reflectance that a matt surface would need, which may be more.
    pub reflectance: f64,
}

impl EchoObservation {
    /// The same from the angle of incidence, radians, 0 (head-on) to π/2 (grazing).
    #[must_use]
    pub fn at_angle(range_m: f64, incidence_rad: f64, reflectance: f64) -> Self {
        Self {
            range_m,
            incidence_cos: libm::cos(incidence_rad).max(0.0),
            reflectance,
        }
    }
}
