//! What the trees of a stand take of each other's light, and how much crown that leaves them.
//!
//! Crowns of close trees meet, and their lower branches die in the shade: the crown ratio falls
//! with the stand's density, and with a tree's rank in it. Measures and model are those of
//! Hasenauer and Monserud 1996, "A crown model for Austrian forests", fitted to trees of Austria's
//! forest inventory; coefficients of Hasenauer 2000. Their terms of the site are those of level
//! ground 500 m above the sea, and are in each species' constant.

use serde::Deserialize;

use super::Species;
use super::ranges::Ranges;
use nemoral_scene::ParamError;

/// How a species' crown answers to competition.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CrownCompetition {
    /// The mean crown ratio is 1 / (1 + e^x), where x = `[0]` + `[1]` · H/d + `[2]` · H + `[3]` ·
    /// d² + `[4]` · [`Competition::larger_m2_ha`] + `[5]` · ln [`Competition::crown_factor`]; H/d
    /// in m/m, H in m, d in cm.
    pub ratio: [f64; 6],
    /// Crown width of a tree that grew in the open = `[0]` · d^`[1]`, metres, d in cm (Hasenauer
    /// 1997).
    pub open_width: [f64; 2],
}

impl CrownCompetition {
    pub(super) fn check(&self, r: &Ranges<'_>) -> Result<(), ParamError> {
        const RANGES: [[f64; 2]; 6] = [
            [-10.0, 10.0],
            [0.0, 0.1],
            [0.0, 0.2],
            [-1e-3, 1e-3],
            [0.0, 0.1],
            [0.0, 2.0],
        ];
        for (i, (value, [low, high])) in self.ratio.into_iter().zip(RANGES).enumerate() {
            r.one(&format!("competition.ratio[{i}]"), value, low, high)?;
        }
        let [width, power] = self.open_width;
        r.one("competition.open_width[0]", width, 0.05, 5.0)?;
        r.one("competition.open_width[1]", power, 0.1, 2.0)
    }
}

/// What a tree competes with, in the measures of forest inventories.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Competition {
    /// Basal area of all thicker trees, m² per hectare (BAL); 0 for the thickest tree.
    pub larger_m2_ha: f64,
    /// Crown competition factor (CCF; Krajicek 1961), percent: the share of the ground that the
    /// stand's crowns would cover if each tree had grown in the open. 100 where such crowns would
    /// just meet, 200 to 400 in most managed stands.
    pub crown_factor: f64,
}

impl Default for Competition {
    /// A tree of a closed stand, as the trees are to whose leaves and crowns the other relations of
    /// a species were fitted.
    fn default() -> Self {
        Self {
            larger_m2_ha: 15.0,
            crown_factor: 250.0,
        }
    }
}

/// The trees of a stand as competitors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Competitors {
    /// From thick to thin: diameter, metres, and the basal area of all trees up to it, m²/ha.
    basal_area: Vec<[f64; 2]>,
    crown_factor: f64,
}

impl Competitors {
    /// Of trees of these species, diameters (m) and numbers per hectare.
    #[must_use]
    pub fn new<'a>(trees: impl IntoIterator<Item = (&'a Species, f64, f64)>) -> Self {
        const M2_PER_HA: f64 = 1e4;
        let mut all = Self::default();
        for (species, dbh_m, per_ha) in trees {
            let disc = |width_m: f64| per_ha * std::f64::consts::FRAC_PI_4 * width_m * width_m;
            all.crown_factor += 100.0 * disc(species.open_crown_width_m(dbh_m)) / M2_PER_HA;
            all.basal_area.push([dbh_m, disc(dbh_m)]);
        }
        all.basal_area.sort_by(|a, b| b[0].total_cmp(&a[0]));
        let mut sum = 0.0;
        for [_, area] in &mut all.basal_area {
            sum += *area;
            *area = sum;
        }
        all
    }

    /// What a tree of this diameter, metres, competes with.
    #[must_use]
    pub fn of(&self, dbh_m: f64) -> Competition {
        let thicker = self.basal_area.partition_point(|[other, _]| *other > dbh_m);
        let last = thicker.checked_sub(1);
        Competition {
            larger_m2_ha: last.map_or(0.0, |i| self.basal_area[i][1]),
            crown_factor: self.crown_factor,
        }
    }
}

impl Species {
    /// Crown width of a tree of this diameter that grew in the open, metres; of a species of which
    /// none is known, that in a stand.
    #[must_use]
    pub fn open_crown_width_m(&self, dbh_m: f64) -> f64 {
        match self.allometry.competition {
            Some(CrownCompetition {
                open_width: [k, p], ..
            }) => k * libm::pow(100.0 * dbh_m, p),
            None => self.mean_crown_width_m(dbh_m),
        }
    }

    /// Mean crown length / height of trees of this size under this competition, within the
    /// species' limits; of a species whose answer to competition is not known, its mean.
    #[must_use]
    pub fn mean_crown_ratio(&self, dbh_m: f64, height_m: f64, competition: &Competition) -> f64 {
        let [mean, _, least, most] = self.allometry.crown_ratio;
        let Some(CrownCompetition { ratio: b, .. }) = self.allometry.competition else {
            return mean;
        };
        let dbh_cm = 100.0 * dbh_m;
        let x = b[0]
            + b[1] * height_m / dbh_m
            + b[2] * height_m
            + b[3] * dbh_cm * dbh_cm
            + b[4] * competition.larger_m2_ha
            + b[5] * libm::log(competition.crown_factor.max(1.0));
        (1.0 / (1.0 + libm::exp(x))).clamp(least, most)
    }
}
