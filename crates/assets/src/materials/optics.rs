//! Optical properties of leaves in visible light, with those at lasers' wavelengths ([`Optics`]).
//!
//! They are computed by PROSPECT-D with the CIE 1931 observer, as linear sRGB.

use glam::Vec3;
use nemoral_scene::Optics;

/// The optical properties of a leaf.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LeafOptics {
    /// Reflectance, linear RGB.
    pub(crate) albedo: Vec3,
    /// Transmittance, linear RGB.
    pub(crate) transmittance: Vec3,
    /// Its optics at the lasers' wavelengths.
    pub(crate) laser: Optics,
}

const fn leaf(albedo: [f32; 3], transmittance: [f32; 3], laser: Optics) -> LeafOptics {
    LeafOptics {
        albedo: Vec3::from_array(albedo),
        transmittance: Vec3::from_array(transmittance),
        laser,
    }
}

/// Thick evergreen leaves and spines of shrubs (the cork oak's numbers).
pub(crate) const EVERGREEN: LeafOptics = leaf(
    [0.068, 0.127, 0.033],
    [0.028, 0.068, 0.0],
    Optics::EVERGREEN_LEAF,
);
/// Bramble leaves (the beech's in the shade).
pub(crate) const BRAMBLE: LeafOptics = leaf(
    [0.053, 0.099, 0.035],
    [0.060, 0.126, 0.0],
    Optics::BROAD_LEAF,
);
/// Ferns, herbs, green grass.
pub(crate) const HERB: LeafOptics = leaf([0.084, 0.147, 0.032], [0.097, 0.166, 0.0], Optics::HERB);
/// Bilberry leaves: the beech's, a tenth lighter (our choice).
pub(crate) const BILBERRY: LeafOptics = leaf(
    [0.066, 0.120, 0.036],
    [0.070, 0.136, 0.0],
    Optics::BROAD_LEAF,
);
/// Grass that has died on its stalk.
pub(crate) const CURED: LeafOptics = leaf(
    [0.316, 0.215, 0.084],
    [0.22, 0.13, 0.02],
    Optics::CURED_GRASS,
);
/// Fallen leaves.
pub(crate) const LITTER_LEAF: LeafOptics =
    leaf([0.149, 0.089, 0.060], [0.055, 0.02, 0.0], Optics::DEAD_LEAF);
