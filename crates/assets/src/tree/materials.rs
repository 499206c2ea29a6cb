//! What a tree's surfaces are made of.

use nemoral_scene::MaterialId;

use nemoral_scene::ParamError;

/// The materials of one species' trees.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeMaterials {
    /// Stem at least as thick as the trunk threshold.
    pub stem: MaterialId,
    /// The stem where its lower bark turns into the upper one; v = 0 below, 1 above.
    pub change: MaterialId,
    /// The stem above the change of bark.
    pub upper: MaterialId,
    /// The foot of the stem.
    pub flare: MaterialId,
    /// Limbs at least as thick as the trunk threshold.
    pub limb: MaterialId,
    /// Living wood thinner than the trunk threshold.
    pub branch: MaterialId,
    /// Dead branches thinner than the trunk threshold.
    pub dead: MaterialId,
    /// Dead stems and limbs at least as thick as the trunk threshold.
    pub snag: MaterialId,
    /// The images of leaves to choose from, with equal chances.
    pub foliage: Vec<FoliageCard>,
}

/// An image of a leafy twig. The twig enters at (u, v) = (0.5, 0); v grows towards its tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoliageCard {
    /// Its material, with the mask.
    pub material: MaterialId,
    /// Size along u, metres, before the generator's variation.
    pub width_m: f32,
    /// Size along v, metres, before the generator's variation.
    pub height_m: f32,
    /// The opaque share of its mask, 0..=1.
    pub opaque_fraction: f32,
}

impl FoliageCard {
    /// The opaque area of a card of nominal size, m².
    pub(super) fn silhouette_m2(&self) -> f64 {
        f64::from(self.width_m) * f64::from(self.height_m) * f64::from(self.opaque_fraction)
    }
}

impl TreeMaterials {
    pub(super) fn check(&self) -> Result<(), ParamError> {
        if self.foliage.is_empty() {
            return Err(ParamError::new("foliage", "[]", "at least one card"));
        }
        for (i, card) in self.foliage.iter().enumerate() {
            let range = |name: &str, value: f32, low, high| {
                ParamError::check_within(
                    format!("foliage[{i}].{name}"),
                    f64::from(value),
                    low,
                    high,
                )
            };
            range("width_m", card.width_m, 0.02, 3.0)?;
            range("height_m", card.height_m, 0.02, 3.0)?;
            range("opaque_fraction", card.opaque_fraction, 0.01, 1.0)?;
        }
        Ok(())
    }
}
