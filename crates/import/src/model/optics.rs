//! What surfaces of a semantic reflect and let through, where a model does not say it.
//!
//! Files of models have colours alone. At a laser's wavelength a surface is as bright as others of
//! its semantic: leaves and needles by PROSPECT-D (Féret et al. 2017), wood, soil and rock within
//! the ranges of published near-infrared reflectances; the same numbers as those of grown plants.

use nemoral_scene::{LaserBand, Optics, Semantic};

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

const BROAD_LEAF: Optics = laser(0.44, 0.51, 0.28, 0.39);
const THICK_LEAF: Optics = laser(0.48, 0.38, 0.23, 0.19);
const DEAD_LEAF: Optics = laser(0.50, 0.32, 0.49, 0.36);
const BARK: Optics = laser(0.36, 0.0, 0.46, 0.0);
const BARE_WOOD: Optics = laser(0.55, 0.0, 0.48, 0.0);
const MOSS: Optics = laser(0.30, 0.0, 0.22, 0.0);
const SOIL: Optics = laser(0.32, 0.0, 0.42, 0.0);
const ROCK: Optics = laser(0.36, 0.0, 0.38, 0.0);
const WATER: Optics = laser(0.02, 0.0, 0.01, 0.0);
const SNOW: Optics = laser(0.85, 0.0, 0.05, 0.0);

/// The optics of a semantic at lasers' wavelengths.
pub(super) fn at_lasers(semantic: Semantic) -> Optics {
    use Semantic as S;
    match semantic {
        S::Leaf | S::Bramble | S::Grass | S::Herb | S::Fern | S::Seedling => BROAD_LEAF,
        S::Needle | S::Climber | S::Shrub => THICK_LEAF,
        S::Litter | S::FallenTwig => DEAD_LEAF,
        S::Stem | S::Limb | S::RootFlare | S::Branch | S::Twig | S::FallenBranch => BARK,
        S::RootPlate | S::SurfaceRoot | S::FallenBark | S::Log => BARK,
        S::Stump | S::Snag => BARE_WOOD,
        S::GroundMoss | S::StemGrowth => MOSS,
        S::Rock | S::Stone => ROCK,
        S::Water => WATER,
        S::Ice | S::Snow => SNOW,
        _ => SOIL,
    }
}

/// Whether a surface of a semantic lets light through, as blades do: about as much as it reflects.
pub(super) fn is_translucent(semantic: Semantic) -> bool {
    at_lasers(semantic).nm905.transmittance > 0.0
}
