//! Measures of a stand per hectare.

use std::f64::consts::PI;

use nemoral_scene::{ParamError, TreeRecord};

/// Square metres of a hectare.
const HECTARE_M2: f64 = 10_000.0;

/// How many of the thickest trees of a hectare are dominant.
const DOMINANT_PER_HA: f64 = 100.0;

/// The plot whose trees are measured, and what counts on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plot {
    /// Its area on the map, m².
    pub area_m2: f64,
    /// The callipering limit: thinner trees do not count, metres.
    pub min_dbh_m: f64,
    /// The least diameter of lying dead wood at its thick end: thinner pieces do not count, metres.
    pub min_deadwood_diameter_m: f64,
}

/// What inventories report of a stand, from each tree's true diameter, height and volume.
///
/// Sources: Kershaw, Ducey, Beers and Husch 2016, *Forest Mensuration*, chapters 5 and 8; the
/// stand density index is Reineke's (1933), for 25.4 cm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandMeasures {
    /// Living trees per hectare.
    pub trees_per_ha: f64,
    /// Cross-sections of living stems at 1.3 m, m²/ha.
    pub basal_area_m2_ha: f64,
    /// Diameter of the tree of mean basal area (Dq), metres; `None` without basal area, as the next
    /// four.
    pub quadratic_mean_dbh_m: Option<f64>,
    /// Mean height weighted by basal area (Lorey's), metres.
    pub lorey_height_m: Option<f64>,
    /// Mean diameter of the 100 thickest trees per hectare, metres. On a plot of A hectares these
    /// are 100 A, of which the last counts by a fraction, at least one, and at most all there are.
    pub dominant_dbh_m: Option<f64>,
    /// Mean height of the same trees (H100), metres.
    pub dominant_height_m: Option<f64>,
    /// Reineke's stand density index: trees per hectare of a stand as dense, of 25.4 cm.
    pub stand_density_index: Option<f64>,
    /// Volume of living stems, over bark, from the ground to the tip or to where the stem forks,
    /// m³/ha.
    pub stem_volume_m3_ha: f64,
    /// Volume of all wood of living trees, over bark, above the ground, m³/ha; `None` if that of a
    /// tree is not known.
    pub wood_volume_m3_ha: Option<f64>,
    /// Volume of the part of that wood which is at least 7 cm thick, m³/ha; `None` if that of a
    /// tree is not known.
    pub merchantable_volume_m3_ha: Option<f64>,
    /// Leaf area that living trees have in summer, over that of the plot. Leaves count with one
    /// side, which is half of the whole surface of needles.
    pub leaf_area_index: f64,
    /// Standing dead trees per hectare.
    pub dead_trees_per_ha: f64,
    /// Their cross-sections at 1.3 m, m²/ha.
    pub dead_basal_area_m2_ha: f64,
    /// Volume of their stems, m³/ha.
    pub dead_stem_volume_m3_ha: f64,
}

impl Plot {
    /// Checks the numbers. A limit in centimetres would leave nothing: 2 m is the most.
    ///
    /// # Errors
    /// If one is not in its range.
    pub fn check(&self) -> Result<(), ParamError> {
        ParamError::check_positive("area_m2", self.area_m2)?;
        ParamError::check_within("min_dbh_m", self.min_dbh_m, 0.0, 2.0)?;
        let least_m = self.min_deadwood_diameter_m;
        ParamError::check_within("min_deadwood_diameter_m", least_m, 0.0, 2.0)
    }

    pub(crate) fn hectares(&self) -> f64 {
        self.area_m2 / HECTARE_M2
    }
}

impl StandMeasures {
    /// Those of all trees that stand on a plot.
    ///
    /// # Errors
    /// As [`Plot::check`].
    pub fn of<'a>(
        trees: impl IntoIterator<Item = &'a TreeRecord>,
        plot: &Plot,
    ) -> Result<Self, ParamError> {
        plot.check()?;
        let counted = |tree: &&TreeRecord| tree.dbh_m >= plot.min_dbh_m;
        let (mut living, mut dead): (Vec<&TreeRecord>, Vec<&TreeRecord>) =
            trees.into_iter().filter(counted).partition(|t| t.alive);
        // Sums must not depend on the order in which trees are given.
        for trees in [&mut living, &mut dead] {
            trees.sort_by(|a, b| b.dbh_m.total_cmp(&a.dbh_m).then(a.object.cmp(&b.object)));
        }
        let per_ha = 1.0 / plot.hectares();
        let sum = |of: &dyn Fn(&TreeRecord) -> f64| sum_of(living.iter().map(|tree| of(tree)));
        let known = |of: &dyn Fn(&TreeRecord) -> Option<f64>| {
            let volumes_m3: Option<Vec<f64>> = living.iter().map(|tree| of(tree)).collect();
            volumes_m3.map(|all| sum_of(all) * per_ha)
        };
        let count = living.len() as f64;
        let sections_m2 = sum(&section_m2);
        let has_any = sections_m2 > 0.0;
        let quadratic_mean_dbh_m = has_any.then(|| (4.0 / PI * sections_m2 / count).sqrt());
        let lorey = |tree: &TreeRecord| section_m2(tree) * tree.height_m;
        let density = |dbh_m: f64| count * per_ha * libm::pow(dbh_m / 0.254, 1.605);
        let dominant = has_any.then(|| dominant(&living, DOMINANT_PER_HA * plot.hectares()));
        Ok(Self {
            trees_per_ha: count * per_ha,
            basal_area_m2_ha: sections_m2 * per_ha,
            quadratic_mean_dbh_m,
            lorey_height_m: has_any.then(|| sum(&lorey) / sections_m2),
            dominant_dbh_m: dominant.map(|[dbh_m, _]| dbh_m),
            dominant_height_m: dominant.map(|[_, height_m]| height_m),
            stand_density_index: quadratic_mean_dbh_m.map(density),
            stem_volume_m3_ha: sum(&|t| t.stem_volume_m3) * per_ha,
            wood_volume_m3_ha: known(&|t| t.wood_volume_m3),
            merchantable_volume_m3_ha: known(&|t| t.merchantable_volume_m3),
            leaf_area_index: sum(&|t| t.leaf_area_m2) / plot.area_m2,
            dead_trees_per_ha: dead.len() as f64 * per_ha,
            dead_basal_area_m2_ha: sum_of(dead.iter().map(|tree| section_m2(tree))) * per_ha,
            dead_stem_volume_m3_ha: sum_of(dead.iter().map(|t| t.stem_volume_m3)) * per_ha,
        })
    }
}

/// Cross-section of a stem at breast height, m².
fn section_m2(tree: &TreeRecord) -> f64 {
    PI / 4.0 * tree.dbh_m * tree.dbh_m
}

/// The sum of numbers, which is 0 of none: that of the standard library is -0.
pub(crate) fn sum_of(numbers: impl IntoIterator<Item = f64>) -> f64 {
    0.0 + numbers.into_iter().sum::<f64>()
}

/// Mean diameter and height of so many of the first trees, the last by a fraction.
fn dominant(from_thickest: &[&TreeRecord], wanted: f64) -> [f64; 2] {
    let mut left = wanted.max(1.0);
    let (mut weights, mut sums) = (0.0, [0.0; 2]);
    for tree in from_thickest {
        let weight = left.min(1.0);
        weights += weight;
        sums[0] += weight * tree.dbh_m;
        sums[1] += weight * tree.height_m;
        left -= weight;
        if left <= 0.0 {
            break;
        }
    }
    sums.map(|sum| sum / weights)
}
