//! What a species sheds: numbers for the litter that lies under it.

use serde::Deserialize;

use super::look::LeafKind;
use super::species::Species;
use nemoral_scene::ParamError;

/// Dead leaves, fruits and bark on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShedLook {
    /// Mean linear RGB reflectance of a dead leaf or needle, 0.01..=0.7.
    pub albedo: [f64; 3],
    /// Leaves that stand out on a square metre of middling litter, 1..=200; of conifers, mats of
    /// needles.
    pub leaves_per_m2: f64,
    /// Cones, nuts or capsules.
    pub fruit: Option<FruitLook>,
    /// Pieces of bark.
    pub bark: Option<ShedBark>,
}

/// A cone, nut or capsule: an egg of whorled scales, or smooth.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FruitLook {
    /// Length, least and most, metres, 0.005..=0.4.
    pub length_m: [f64; 2],
    /// Its width over its length, least and most, 0.05..=1.5.
    pub width_ratio: [f64; 2],
    /// How far its scales stand off, as a share of its radius, 0..=0.5: 0 for a nut.
    pub scales: f64,
    /// How many lie on a square metre, 0..=20.
    pub per_m2: f64,
}

/// Strips or flakes of bark.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShedBark {
    /// Length, least and most, metres, 0.01..=1.4; short ones are more frequent.
    pub length_m: [f64; 2],
    /// Width, least and most, metres, 0.005..=0.2.
    pub width_m: [f64; 2],
    /// How many lie on a square metre, 0..=20.
    pub per_m2: f64,
}

impl Species {
    /// What it sheds: its own numbers, or, without any, leaves as those of most species.
    #[must_use]
    pub fn shed_look(&self) -> ShedLook {
        let has_needles = matches!(
            self.leaves.kind,
            LeafKind::NeedleTuft | LeafKind::NeedleSpray
        );
        self.shed.unwrap_or(ShedLook {
            albedo: [0.149, 0.089, 0.060],
            leaves_per_m2: if has_needles { 24.0 } else { 90.0 },
            fruit: None,
            bark: None,
        })
    }
}

impl ShedLook {
    pub(super) fn check(&self, species: &str) -> Result<(), ParamError> {
        let range = |name: &str, value, low, high| {
            ParamError::check_within(format!("{species}.shed.{name}"), value, low, high)
        };
        let pair = |name: &str, [least, most]: [f64; 2], low, high| {
            range(name, least, low, most)?;
            range(name, most, low, high)
        };
        for value in self.albedo {
            range("albedo", value, 0.01, 0.7)?;
        }
        range("leaves_per_m2", self.leaves_per_m2, 1.0, 200.0)?;
        if let Some(fruit) = &self.fruit {
            pair("fruit.length_m", fruit.length_m, 0.005, 0.4)?;
            pair("fruit.width_ratio", fruit.width_ratio, 0.05, 1.5)?;
            range("fruit.scales", fruit.scales, 0.0, 0.5)?;
            range("fruit.per_m2", fruit.per_m2, 0.0, 20.0)?;
        }
        if let Some(bark) = &self.bark {
            pair("bark.length_m", bark.length_m, 0.01, 1.4)?;
            pair("bark.width_m", bark.width_m, 0.005, 0.2)?;
            range("bark.per_m2", bark.per_m2, 0.0, 20.0)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_out_of_range_are_refused_by_name() {
        let mut species = Species::eucalyptus();
        assert!(species.check().is_ok());
        let shed = species.shed.as_mut().expect("it sheds bark");
        shed.bark.as_mut().expect("it sheds bark").length_m = [0.5, 0.1];
        let said = species
            .check()
            .expect_err("the least is the most")
            .to_string();
        assert!(said.contains("eucalyptus.shed.bark.length_m"), "{said}");
        species.shed = None;
        assert!(species.check().is_ok() && species.shed_look().leaves_per_m2 > 1.0);
    }
}
