//! What the interface of a solid with the air reflects, above what its body scatters.

/// The reflectance of a solid's interface for light at right angles to it: that of a refractive
/// index of 1.5.
pub const SPECULAR_F0: f32 = 0.04;

/// The share of a surface of this roughness, 0..=1, that gleams as a smooth interface does: none of
/// a matt one.
#[must_use]
pub fn gloss(roughness: f32) -> f32 {
    let gloss = 1.0 - roughness * roughness;
    if gloss < 0.05 { 0.0 } else { gloss }
}

/// The share of light at right angles that the interface of a surface of this roughness, 0..=1,
/// reflects. The albedo of a material that is no liquid contains it, as measured ones do.
#[must_use]
pub fn specular_reflectance(roughness: f32) -> f32 {
    gloss(roughness) * SPECULAR_F0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matt_surfaces_have_no_gleam() {
        assert_eq!(specular_reflectance(0.0), SPECULAR_F0);
        assert_eq!([0.98, 1.0].map(specular_reflectance), [0.0; 2]);
        assert!(specular_reflectance(0.9) > 0.0);
    }
}
