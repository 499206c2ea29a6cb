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

/// The layers whose cover is measured, as [`LayerCover::shares`] has them.
pub const COVER_LAYERS: [&str; 5] = ["moss", "herbs", "shrubs < 0.5 m", "< 1.5 m", "< 3 m"];

/// The tops of layers above the ground, metres, the lowest first.
pub const TOPS_M: [f64; 3] = [0.5, 1.5, 3.0];

/// Counts of what lines straight down meet first within layers: a line begins at the top of each
/// layer, so that none hides what is below.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LayerCover {
    lines: u32,
    of: [u32; COVER_LAYERS.len()],
}

impl LayerCover {
    /// Counts a place by what its lines met first, from the lowest layer to the highest: the
    /// material, and how far below the layer's top, metres.
    pub fn add(&mut self, met: [Option<(&Material, f64)>; TOPS_M.len()]) {
        self.lines += 1;
        let bases_m = [0.0, TOPS_M[0], TOPS_M[1]];
        for (i, met) in met.into_iter().enumerate() {
            let Some((material, below_m)) = met else {
                continue;
            };
            let is_within = i == 0 || below_m <= TOPS_M[i] - bases_m[i];
            let layer = match (i, material.semantic) {
                (0, Semantic::GroundMoss) => 0,
                (0, Semantic::Fern | Semantic::Grass | Semantic::Herb | Semantic::Seedling) => 1,
                (0, Semantic::Shrub | Semantic::Bramble) => 2,
                (
                    i,
                    Semantic::Fern
                    | Semantic::Grass
                    | Semantic::Herb
                    | Semantic::Seedling
                    | Semantic::Shrub
                    | Semantic::Bramble,
                ) => 2 + i,
                _ => continue,
            };
            self.of[layer] += u32::from(is_within);
        }
    }

    /// The share of the ground that each of [`COVER_LAYERS`] covers.
    #[must_use]
    pub fn shares(&self) -> [f64; COVER_LAYERS.len()] {
        self.of.map(|n| f64::from(n) / f64::from(self.lines.max(1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::glam::Vec3;

    #[test]
    fn layers_do_not_hide_each_other() {
        let plain = |name: &str, semantic| Material::plain(name, semantic, Vec3::ONE);
        let (fern, moss) = (
            plain("fern", Semantic::Fern),
            plain("moss", Semantic::GroundMoss),
        );
        let (gorse, leaf) = (
            plain("gorse.foliage", Semantic::Shrub),
            plain("oak", Semantic::Leaf),
        );
        let mut cover = LayerCover::default();
        // A fern of 0.7 m over moss; gorse of 2 m whose foliage ends above the ground; a branch.
        cover.add([Some((&moss, 0.5)), Some((&fern, 0.8)), Some((&fern, 2.3))]);
        cover.add([
            Some((&gorse, 0.2)),
            Some((&gorse, 0.3)),
            Some((&gorse, 1.0)),
        ]);
        cover.add([None, Some((&leaf, 0.1)), None]);
        cover.add([Some((&fern, 0.1)), Some((&fern, 1.1)), Some((&fern, 2.6))]);
        assert_eq!(cover.shares(), [0.25, 0.25, 0.25, 0.5, 0.25]);
    }

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
