//! The relations of a species, measured on grown trees.

use nemoral_assets::{FoliageCard, GrowthParams, Species, TreeMaterials, TreeSize, grow};
use nemoral_scene::MaterialId;
use nemoral_seed::{Domain, Key};

use crate::published_height_m;

/// Grown trees of a species and their measured sizes.
#[derive(Clone, Debug)]
pub struct Relations {
    /// Sizes measured on the grown trees.
    pub sizes: Vec<TreeSize>,
    /// Means of height, crown width and leaf area over those of the species' curves, of the thinner
    /// and of the thicker half of the trees.
    pub ratios: [[f64; 3]; 2],
}

impl Relations {
    /// The relations of this many trees, evenly spread over the diameters that the species'
    /// relations hold for.
    ///
    /// # Panics
    /// If one cannot be grown.
    #[must_use]
    pub fn of(species: &Species, trees: u32) -> Self {
        let [low, high] = species.allometry.dbh_range_m;
        let part = |i: u32| (f64::from(i) + 0.5) / f64::from(trees);
        let diameters_m: Vec<f64> = (0..trees).map(|i| low + (high - low) * part(i)).collect();
        Self::grown(species, &diameters_m)
    }

    /// The relations of trees of these diameters (metres), in ascending order. They grow with few
    /// cards and little wood, on which sizes do not depend (a test in `crates/assets` grows them
    /// completely).
    ///
    /// # Panics
    /// If one cannot be grown.
    #[must_use]
    pub fn grown(species: &Species, diameters_m: &[f64]) -> Self {
        let id = MaterialId(0);
        let card = FoliageCard {
            material: id,
            width_m: 0.4,
            height_m: 0.4,
            opaque_fraction: 0.5,
        };
        let materials = TreeMaterials {
            stem: id,
            flare: id,
            limb: id,
            branch: id,
            dead: id,
            snag: id,
            change: id,
            upper: id,
            foliage: vec![card],
        };
        let params = GrowthParams {
            wood_triangles_max: 3_000,
            cards_max: 200,
            ..GrowthParams::default()
        };
        let key = Key::world(21).domain(Domain::new(&species.name));
        let grown = |(i, dbh_m): (usize, &f64)| {
            let key = key.item(i as u64);
            let size = species.draw_size(*dbh_m, key);
            let tree = grow(species, &size, &materials, &params, key);
            tree.unwrap_or_else(|e| panic!("{} of {dbh_m} m: {e}", species.name))
                .size
        };
        Self::from_sizes(species, diameters_m.iter().enumerate().map(grown).collect())
    }

    /// The relations of trees with known sizes, in ascending order of diameters.
    #[must_use]
    pub fn from_sizes(species: &Species, sizes: Vec<TreeSize>) -> Self {
        let (thin, thick) = sizes.split_at(sizes.len() / 2);
        let ratios = [thin, thick].map(|half| {
            let mut sums = [0.0; 3];
            for size in half {
                let ratios = [
                    size.height_m / species.mean_height_m(size.dbh_m),
                    2.0 * size.crown_radius_m / species.mean_crown_width_m(size.dbh_m),
                    size.leaf_area_m2 / species.mean_leaf_area_m2(size.dbh_m),
                ];
                for (sum, ratio) in sums.iter_mut().zip(ratios) {
                    *sum += ratio / half.len() as f64;
                }
            }
            sums
        });
        Self { sizes, ratios }
    }

    /// Means of height over that of the [published formula](published_height_m) which the species'
    /// curve stands for, of the thinner and of the thicker half of the trees; `None` without one.
    #[must_use]
    pub fn over_source(&self, species: &Species) -> Option<[f64; 2]> {
        let (thin, thick) = self.sizes.split_at(self.sizes.len() / 2);
        let mean = |half: &[TreeSize]| -> Option<f64> {
            let ratio = |size: &TreeSize| {
                let published_m = published_height_m(&species.name, size.dbh_m)?;
                Some(size.height_m / published_m)
            };
            let ratios: Vec<f64> = half.iter().map(ratio).collect::<Option<_>>()?;
            Some(ratios.iter().sum::<f64>() / ratios.len() as f64)
        };
        Some([mean(thin)?, mean(thick)?])
    }

    /// The mean ratios over all trees.
    #[must_use]
    pub fn mean(&self) -> [f64; 3] {
        let [thin, thick] = self.ratios;
        [0, 1, 2].map(|i| 0.5 * (thin[i] + thick[i]))
    }
}
