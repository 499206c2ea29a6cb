//! Optical properties of leaves, wood and ground, in visible light and at lasers' wavelengths.
//!
//! Those of leaves are computed by PROSPECT-D with the CIE 1931 observer, as linear sRGB. Those of
//! wood, soil and rock lie in the ranges of published near-infrared reflectances, chosen so that at
//! 905 nm leaves are at least as bright as bark, and at 1550 nm bark is brighter than leaves.

use glam::Vec3;
use nemoral_scene::{LaserBand, Optics};

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

const fn laser(r905: f32, t905: f32, r1550: f32, t1550: f32) -> Optics {
    Optics {
        nm905: LaserBand {
            reflectance: r905,
            transmittance: t905,
        },
        nm1550: LaserBand {
            reflectance: r1550,
            transmittance: t1550,
        },
    }
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
    laser(0.48, 0.38, 0.23, 0.19),
);
/// Bramble leaves (the beech's in the shade).
pub(crate) const BRAMBLE: LeafOptics = leaf(
    [0.053, 0.099, 0.035],
    [0.060, 0.126, 0.0],
    laser(0.44, 0.51, 0.28, 0.39),
);
/// Ferns, herbs, green grass.
pub(crate) const HERB: LeafOptics = leaf(
    [0.084, 0.147, 0.032],
    [0.097, 0.166, 0.0],
    laser(0.44, 0.51, 0.27, 0.38),
);
/// Bilberry leaves: the beech's, a tenth lighter (our choice).
pub(crate) const BILBERRY: LeafOptics = leaf(
    [0.066, 0.120, 0.036],
    [0.070, 0.136, 0.0],
    laser(0.44, 0.51, 0.28, 0.39),
);
/// Grass that has died on its stalk.
pub(crate) const CURED: LeafOptics = leaf(
    [0.316, 0.215, 0.084],
    [0.22, 0.13, 0.02],
    laser(0.51, 0.40, 0.45, 0.40),
);
/// Fallen leaves.
pub(crate) const LITTER_LEAF: LeafOptics = leaf(
    [0.149, 0.089, 0.060],
    [0.055, 0.02, 0.0],
    laser(0.50, 0.32, 0.49, 0.36),
);

/// Bark.
pub(crate) const BARK: Optics = laser(0.36, 0.0, 0.46, 0.0);
/// Sawn wood, weathered.
pub(crate) const CUT_WOOD: Optics = laser(0.55, 0.0, 0.48, 0.0);
/// Litter on the ground.
pub(crate) const LITTER: Optics = laser(0.36, 0.0, 0.42, 0.0);
/// Moss and humus.
pub(crate) const MOSS: Optics = laser(0.30, 0.0, 0.22, 0.0);
/// Dry mineral soil.
pub(crate) const DRY_SOIL: Optics = laser(0.32, 0.0, 0.42, 0.0);
/// Wet soil.
pub(crate) const WET_SOIL: Optics = laser(0.14, 0.0, 0.13, 0.0);
/// Dry sand.
pub(crate) const SAND: Optics = laser(0.40, 0.0, 0.48, 0.0);
/// Granite with lichens, gravel.
pub(crate) const ROCK: Optics = laser(0.36, 0.0, 0.38, 0.0);
/// The same under a film of water, by the same formula as its colour; at 1550 nm a tenth of a
/// millimetre of water takes a seventh besides (Hale and Querry 1973).
pub(crate) const WET_ROCK: Optics = laser(0.24, 0.0, 0.21, 0.0);
/// A lawn on soil.
pub(crate) const GRASS_GROUND: Optics = laser(0.42, 0.0, 0.28, 0.0);
