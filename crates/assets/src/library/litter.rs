//! Grows patches of litter.

use nemoral_scene::ParamError;
use nemoral_seed::Domain;

use super::PlantAsset;
use super::plants::PlantGrower;
use crate::ambient_occlusion::OcclusionParams;
use crate::plant::litter::{LitterPlan, SpeciesLitter, litter};

/// Variants of a patch, thin to deep: wide ones, and narrow ones.
const VARIANTS: [u32; 2] = [12, 8];

/// How many more leaves stand out right after the fall than in summer (our choice).
const JUST_FALLEN: f64 = 0.6;

/// What litter to make.
#[derive(Clone, Debug, PartialEq)]
pub struct LitterParams {
    /// How much of the stand each species is, one for each; at least 0.
    pub shares: Vec<f64>,
    /// Leaves and needles relative to what the species usually shed, 0.1..=2.
    pub leaves: f64,
    /// Twigs, bark, cones and nuts relative to the usual, 0..=4.
    pub wood: f64,
    /// Stones relative to the usual, 0..=10.
    pub stones: f64,
}

impl LitterParams {
    pub(super) fn check(&self, species: usize) -> Result<(), ParamError> {
        if self.shares.len() != species {
            let n = self.shares.len();
            return Err(ParamError::new("litter.shares", n, "one for each species"));
        }
        for (i, &share) in self.shares.iter().enumerate() {
            ParamError::check_within(format!("litter.shares[{i}]"), share, 0.0, 1e6)?;
        }
        ParamError::check_within("litter.leaves", self.leaves, 0.1, 2.0)?;
        ParamError::check_within("litter.wood", self.wood, 0.0, 4.0)?;
        ParamError::check_within("litter.stones", self.stones, 0.0, 10.0)
    }
}

/// Patches of the litter under a species, thin ones first.
#[derive(Clone, Debug, Default)]
pub struct LitterPatches {
    /// Patches with the first of [`RADII_M`](Self::RADII_M).
    pub wide: Vec<PlantAsset>,
    /// Patches with the second, for borders and uneven ground.
    pub narrow: Vec<PlantAsset>,
}

impl LitterPatches {
    /// The radii of wide and of narrow patches, metres.
    pub const RADII_M: [f64; 2] = [0.8, 0.42];
}

impl PlantGrower<'_> {
    /// The patches of each species, if they were asked for.
    pub(super) fn litter_patches(&self) -> Vec<LitterPatches> {
        let (Some(params), Some(fruit)) = (&self.params.litter, self.materials.fruit) else {
            return Vec::new();
        };
        let of_species = self.species.iter().zip(&self.materials.litter);
        let stand: Vec<SpeciesLitter<'_>> = of_species
            .map(|(species, materials)| SpeciesLitter {
                look: species.litter_look(),
                materials,
            })
            .collect();
        // What has just fallen lies loose, before it is pressed down and rots.
        let loose = |own: usize| -> f64 {
            let phenology = self.species[own].phenology;
            let fresh = (self.season.as_ref().zip(phenology)).map(|(s, of)| of.fresh_litter(s));
            1.0 + JUST_FALLEN * fresh.unwrap_or(0.0)
        };
        let patches = |own: usize, size: usize| {
            let name = format!("{}_litter", self.species[own].name);
            let count = VARIANTS[size];
            self.collect(Domain::new(&format!("assets.{name}")), count, &|i, key| {
                let plan = LitterPlan {
                    radius_m: LitterPatches::RADII_M[size] as f32,
                    depth: (i as f32 + 0.5) / count as f32,
                    amounts: [params.leaves * loose(own), params.wood, params.stones]
                        .map(|a| a as f32),
                    stand: &stand,
                    shares: &params.shares,
                    own,
                    fruit,
                    stone: self.materials.stones.stone,
                };
                let shape = litter(&plan, key.item(size as u64));
                let number = i + VARIANTS[0] * size as u32;
                let (radius_m, occlusion) = (shape.reach_m(), &OcclusionParams::LITTER);
                self.leafy(&name, number, shape, radius_m, occlusion)
            })
        };
        (0..stand.len())
            .map(|own| LitterPatches {
                wide: patches(own, 0),
                narrow: patches(own, 1),
            })
            .collect()
    }
}
