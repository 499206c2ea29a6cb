//! How much light surfaces reflect and let through at the wavelengths of lasers.

/// Reflectance and transmittance at one laser wavelength, hemispherical, 0..1.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LaserBand {
    /// The share of the light that is reflected.
    pub reflectance: f32,
    /// The share of the light that is transmitted.
    pub transmittance: f32,
}

/// The laser wavelengths of materials.
///
/// The constants are those of grown plants and of the ground, and of imported models that do not
/// say their own. Those of leaves are computed by PROSPECT-D (Féret et al. 2017). Those of wood,
/// soil and rock lie in the ranges of published near-infrared reflectances, chosen so that at
/// 905 nm leaves are at least as bright as bark, and at 1550 nm bark is brighter than leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Optics {
    /// 905 nm (Livox, Velodyne, Sick).
    pub nm905: LaserBand,
    /// 1550 nm (Riegl and other terrestrial scanners).
    pub nm1550: LaserBand,
}

impl Optics {
    /// Leaves of broad-leaved trees and shrubs (the beech's in the shade).
    pub const BROAD_LEAF: Self = Self::leaf([0.44, 0.51], [0.28, 0.39]);
    /// Thick evergreen leaves, needles and spines (the cork oak's numbers).
    pub const EVERGREEN_LEAF: Self = Self::leaf([0.48, 0.38], [0.23, 0.19]);
    /// Ferns, herbs, green grass.
    pub const HERB: Self = Self::leaf([0.44, 0.51], [0.27, 0.38]);
    /// Grass that has died on its stalk.
    pub const CURED_GRASS: Self = Self::leaf([0.51, 0.40], [0.45, 0.40]);
    /// Fallen leaves.
    pub const DEAD_LEAF: Self = Self::leaf([0.50, 0.32], [0.49, 0.36]);
    /// Bark.
    pub const BARK: Self = Self::opaque(0.36, 0.46);
    /// Sawn wood, weathered.
    pub const CUT_WOOD: Self = Self::opaque(0.55, 0.48);
    /// Litter on the ground.
    pub const LITTER: Self = Self::opaque(0.36, 0.42);
    /// Moss and humus.
    pub const MOSS: Self = Self::opaque(0.30, 0.22);
    /// Dry mineral soil.
    pub const DRY_SOIL: Self = Self::opaque(0.32, 0.42);
    /// Wet soil.
    pub const WET_SOIL: Self = Self::opaque(0.14, 0.13);
    /// Dry sand.
    pub const SAND: Self = Self::opaque(0.40, 0.48);
    /// Granite with lichens, gravel.
    pub const ROCK: Self = Self::opaque(0.36, 0.38);
    /// The same under a film of water, by the same formula as its colour; at 1550 nm a tenth of a
    /// millimetre of water takes a seventh besides (Hale and Querry 1973).
    pub const WET_ROCK: Self = Self::opaque(0.24, 0.21);
    /// A lawn on soil.
    pub const GRASS_GROUND: Self = Self::opaque(0.42, 0.28);
    /// Snow of some days, with grains of 0.2 mm (Wiscombe and Warren 1980; Kokhanovsky and Zege
    /// 2004, with the absorption of ice by Warren and Brandt 2008): at 905 nm the brightest thing
    /// in the wood, at 1550 nm the darkest.
    pub const SNOW: Self = Self::opaque(0.81, 0.05);

    /// Reflectance and transmittance at each wavelength.
    const fn leaf(nm905: [f32; 2], nm1550: [f32; 2]) -> Self {
        Self {
            nm905: LaserBand {
                reflectance: nm905[0],
                transmittance: nm905[1],
            },
            nm1550: LaserBand {
                reflectance: nm1550[0],
                transmittance: nm1550[1],
            },
        }
    }

    /// Reflectance at each wavelength of what lets no light through.
    const fn opaque(nm905: f32, nm1550: f32) -> Self {
        Self::leaf([nm905, 0.0], [nm1550, 0.0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_surface_gives_more_light_than_it_gets() {
        let all = [
            Optics::BROAD_LEAF,
            Optics::EVERGREEN_LEAF,
            Optics::HERB,
            Optics::CURED_GRASS,
            Optics::DEAD_LEAF,
            Optics::BARK,
            Optics::CUT_WOOD,
            Optics::LITTER,
            Optics::MOSS,
            Optics::DRY_SOIL,
            Optics::WET_SOIL,
            Optics::SAND,
            Optics::ROCK,
            Optics::WET_ROCK,
            Optics::GRASS_GROUND,
            Optics::SNOW,
        ];
        for band in all.iter().flat_map(|of| [of.nm905, of.nm1550]) {
            assert!(band.reflectance > 0.0 && band.transmittance >= 0.0);
            assert!(band.reflectance + band.transmittance <= 1.0, "{band:?}");
        }
    }

    #[test]
    fn leaves_are_brighter_than_bark_at_905_nm_alone() {
        for leaf in [Optics::BROAD_LEAF, Optics::EVERGREEN_LEAF, Optics::HERB] {
            assert!(leaf.nm905.reflectance >= Optics::BARK.nm905.reflectance);
            assert!(leaf.nm1550.reflectance < Optics::BARK.nm1550.reflectance);
        }
    }
}
