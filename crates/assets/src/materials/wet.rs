//! Wet stone.

use std::sync::Arc;

use glam::Vec3;
use nemoral_scene::{Material, Texture};

use super::optics;

/// How much of a wet surface is darker than a dry one: stone is smooth here and there.
const SHARE: f32 = 0.85;
const ROUGHNESS: f32 = 0.35;

/// The albedo of a surface under a film of water, by channel (Lekner and Dorf 1988, "Why some
/// things are darker when wet", Applied Optics 27, 1278, doi 10.1364/AO.27.001278, equations 5, 10
/// and 14 for a refractive index of 1.33): light that the surface throws back is thrown back again
/// by the water.
pub(crate) fn wet_albedo(dry: Vec3) -> Vec3 {
    const FROM_AIR: f32 = 0.020;
    const FROM_WATER: f32 = 0.474;
    // Absorption under water relative to that in air, of surfaces that absorb little.
    const COUPLING: f32 = 1.067;
    let absorbed = Vec3::ONE - dry;
    let absorbed = absorbed * (dry * COUPLING + absorbed);
    let left = Vec3::ONE - absorbed;
    (1.0 - FROM_AIR) * (1.0 - FROM_WATER) * left / (Vec3::ONE - FROM_WATER * left)
}

/// A material of stone as it is when it is wet.
pub(super) fn wet_stone(dry: &Material) -> Material {
    let texels: Vec<Vec3> = (dry.albedo.linear())
        .map(|dry| dry.lerp(wet_albedo(dry), SHARE))
        .collect();
    let albedo = Texture::from_linear(dry.albedo.width(), dry.albedo.height(), &texels);
    Material {
        name: format!("{}.wet", dry.name),
        albedo: Arc::new(albedo.expect("it has the size of a texture")),
        roughness: ROUGHNESS,
        optics: optics::WET_ROCK,
        ..dry.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wet_surfaces_are_darker_by_the_published_amount() {
        for (dry, wet) in [(0.05, 0.0248), (0.10, 0.0509), (0.30, 0.171), (0.90, 0.800)] {
            let found = wet_albedo(Vec3::splat(dry)).x;
            assert!((found - wet).abs() < 0.004, "{dry}: {found} for {wet}");
        }
    }
}
