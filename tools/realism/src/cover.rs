//! The share of the ground that low plants cover.

use nemoral_scene::{Material, Semantic};

/// Kinds of low plants, as [`LowCover`] counts them.
pub const LOW_PLANTS: [&str; 8] = [
    "gorse",
    "heather",
    "bilberry",
    "bramble",
    "ferns",
    "grass",
    "herbs",
    "seedlings",
];

/// Counts of what lines straight down from 2 m above ground meet first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LowCover {
    lines: u32,
    of: [u32; LOW_PLANTS.len()],
    any: u32,
}

impl LowCover {
    /// Counts a line by the material that it met first, if any.
    pub fn add(&mut self, met: Option<&Material>) {
        self.lines += 1;
        let Some(met) = met else { return };
        let name = match met.semantic {
            // All shrubs have the same semantic class. Their wood shares a material and counts as
            // neither.
            Semantic::Shrub => met.name.split('.').next().unwrap_or_default(),
            Semantic::Bramble => "bramble",
            Semantic::Fern => "ferns",
            Semantic::Grass => "grass",
            Semantic::Herb => "herbs",
            Semantic::Seedling => "seedlings",
            _ => return,
        };
        self.any += 1;
        if let Some(kind) = LOW_PLANTS.iter().position(|k| *k == name) {
            self.of[kind] += 1;
        }
    }

    /// The share of the ground that each of [`LOW_PLANTS`] covers, seen from above, where plants
    /// hide others.
    #[must_use]
    pub fn shares(&self) -> [f64; LOW_PLANTS.len()] {
        self.of.map(|n| f64::from(n) / f64::from(self.lines))
    }

    /// The share of the ground that any of them covers.
    #[must_use]
    pub fn any(&self) -> f64 {
        f64::from(self.any) / f64::from(self.lines)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::glam::Vec3;

    #[test]
    fn shrubs_are_told_by_their_foliage() {
        let plain = |name: &str, semantic| Material::plain(name, semantic, Vec3::ONE);
        let heather = plain("heather.foliage.0", Semantic::Shrub);
        let wood = plain("shrub.wood", Semantic::Shrub);
        let litter = plain("ground.leaf_litter", Semantic::Litter);
        let mut cover = LowCover::default();
        for met in [Some(&heather), Some(&wood), Some(&litter), None] {
            cover.add(met);
        }
        assert_eq!(cover.shares()[1], 0.25);
        assert_eq!(cover.shares().iter().sum::<f64>(), 0.25);
        assert_eq!(cover.any(), 0.5);
    }
}
