use glam::Vec3;

/// The air and the clouds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyParams {
    /// Linke's turbidity at 550 nm, 1..=10: 2 very clear, 3 clear, 5 hazy, 10 fog.
    pub turbidity: f64,
    /// Cloud cover as an even veil, 0 clear ..= 1 overcast without a sun.
    pub overcast: f64,
    /// Multiplies the strength of the sun above the atmosphere, 0..=100; 1 is ours.
    pub sun_intensity: f64,
    /// Multiplies its colour, linear sRGB, each 0..=10.
    pub sun_tint: Vec3,
    /// Mean albedo of the ground around, linear sRGB, each 0..=1.
    pub ground_albedo: Vec3,
    /// Share of the light on a leaf that leaves it again on either side (reflectance +
    /// transmittance), linear sRGB, each 0..=0.99.
    pub foliage_albedo: Vec3,
}

impl Default for SkyParams {
    fn default() -> Self {
        Self {
            turbidity: 3.0,
            overcast: 0.0,
            sun_intensity: 1.0,
            sun_tint: Vec3::ONE,
            ground_albedo: Vec3::new(0.11, 0.10, 0.06),
            foliage_albedo: Vec3::new(0.13, 0.24, 0.034),
        }
    }
}
