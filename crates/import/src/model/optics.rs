//! What surfaces of a semantic reflect and let through, where a model does not say it.
//!
//! Files of models have colours alone. At a laser's wavelength a surface is as bright as others of
//! its semantic, by the numbers of grown plants and of the ground ([`Optics`]).

use nemoral_scene::{LaserBand, Optics, Semantic};

/// Water that is no liquid with a bed: what its surface mirrors (Fresnel).
const WATER: Optics = Optics {
    nm905: LaserBand {
        reflectance: 0.02,
        transmittance: 0.0,
    },
    nm1550: LaserBand {
        reflectance: 0.01,
        transmittance: 0.0,
    },
};

/// The optics of a semantic at lasers' wavelengths.
pub(super) fn at_lasers(semantic: Semantic) -> Optics {
    use Semantic as S;
    match semantic {
        S::Leaf | S::Bramble | S::Seedling => Optics::BROAD_LEAF,
        S::Grass | S::Herb | S::Fern => Optics::HERB,
        S::Needle | S::Climber | S::Shrub => Optics::EVERGREEN_LEAF,
        S::Litter | S::FallenTwig => Optics::DEAD_LEAF,
        S::Stem | S::Limb | S::RootFlare | S::Branch | S::Twig | S::FallenBranch => Optics::BARK,
        S::RootPlate | S::SurfaceRoot | S::FallenBark | S::Log => Optics::BARK,
        S::Stump | S::Snag => Optics::CUT_WOOD,
        S::GroundMoss | S::StemGrowth => Optics::MOSS,
        S::Rock | S::Stone => Optics::ROCK,
        S::Water => WATER,
        S::Ice | S::Snow => Optics::SNOW,
        _ => Optics::DRY_SOIL,
    }
}

/// Whether a surface of a semantic lets light through, as blades do: about as much as it reflects.
pub(super) fn is_translucent(semantic: Semantic) -> bool {
    at_lasers(semantic).nm905.transmittance > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_imported_is_as_bright_as_what_is_grown() {
        for (semantics, optics) in [
            (
                &[Semantic::Grass, Semantic::Herb, Semantic::Fern][..],
                Optics::HERB,
            ),
            (
                &[Semantic::Shrub, Semantic::Climber],
                Optics::EVERGREEN_LEAF,
            ),
            (&[Semantic::Leaf, Semantic::Bramble], Optics::BROAD_LEAF),
            (&[Semantic::Stem, Semantic::Branch], Optics::BARK),
            (&[Semantic::Rock, Semantic::Stone], Optics::ROCK),
            (&[Semantic::Snow], Optics::SNOW),
            (&[Semantic::Soil, Semantic::CutSlope], Optics::DRY_SOIL),
        ] {
            for &semantic in semantics {
                assert_eq!(at_lasers(semantic), optics, "{}", semantic.name());
            }
        }
        let through = [Semantic::Leaf, Semantic::Needle, Semantic::Fern];
        assert!(through.into_iter().all(is_translucent));
        let opaque = [Semantic::Stem, Semantic::Rock, Semantic::Water];
        assert!(!opaque.into_iter().any(is_translucent));
    }
}
