//! Measures and their ranges.

use nemoral_assets::Species;
use nemoral_realism::ranges;

use crate::measure::Stand;

/// A measure of a stand, and its range if there is one for such stands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Check {
    pub(crate) value: f64,
    pub(crate) range: Option<(f64, f64)>,
    pub(crate) places: usize,
}

impl Check {
    fn new(value: f64, places: usize, range: impl Into<Option<(f64, f64)>>) -> Self {
        Self {
            value,
            range: range.into(),
            places,
        }
    }

    /// Whether the measure is in its range. A measure of something that the stand has none of
    /// counts as met.
    pub(crate) fn is_met(&self) -> bool {
        let range = self.range.filter(|_| !self.value.is_nan());
        range.is_none_or(|(low, high)| (low..=high).contains(&self.value))
    }

    /// The text of a table's cell.
    pub(crate) fn cell(&self) -> String {
        let places = self.places;
        match self.range {
            _ if self.value.is_nan() => "–".to_owned(),
            Some((low, high)) if !self.is_met() => {
                format!("**{:.places$}** ✗ {low}–{high}", self.value)
            }
            _ => format!("{:.places$}", self.value),
        }
    }
}

/// A table's column: its heading and its check.
pub(crate) type Column = (&'static str, fn(&Stand) -> Check);

/// A check in percent of a measure that is a share.
pub(crate) fn percent(share: f64, places: usize, range: impl Into<Option<ranges::Range>>) -> Check {
    let range = range.into().map(|(low, high)| (100.0 * low, 100.0 * high));
    Check::new(100.0 * share, places, range)
}

/// A check of the pairs that look alike, per million pairs; NaN without any pairs.
fn alike((alike, same): (usize, usize)) -> Check {
    Check::new(1e6 * alike as f64 / same as f64, 0, ranges::ALIKE)
}

pub(crate) const STEMS: &[Column] = &[
    ("trees/ha", |s| {
        let per_ha = 10_000.0 / (s.config.chunks.size_m * s.config.chunks.size_m);
        let asked = s.config.placement.trees * (1.0 - s.config.assets.snags) * per_ha;
        let range = (ranges::TREES.0 * asked, ranges::TREES.1 * asked);
        Check::new(s.per_chunk * per_ha, 0, (range.0.round(), range.1.round()))
    }),
    ("basal area, m²/ha", |s| {
        Check::new(s.basal_area_m2_ha, 1, ranges::basal_area(s.name))
    }),
    ("diameters: distance", |s| {
        let range = ranges::diameter_distance(s.config.assets.individuals);
        Check::new(s.diameter_distance, 3, range)
    }),
    ("Weibull shape", |s| {
        let (low, high) = s.shapes;
        let cut = |v: f64| (100.0 * v).round() / 100.0;
        Check::new(s.weibull.0, 2, (cut(low), cut(high)))
    }),
    ("H/D in limits", |s| {
        Check::new(s.slender, 3, ranges::SLENDER)
    }),
    ("Clark-Evans R", |s| {
        let in_rows = s.config.placement.rows.spacing_m > 0.0;
        Check::new(s.clark_evans, 2, ranges::clark_evans(in_rows))
    }),
    ("g(r < 0.5 m)", |s| {
        Check::new(s.pairs[0], 2, ranges::PAIRS_NEAR)
    }),
    ("g(5–15 m)", |s| {
        let far = &s.pairs[10..30];
        Check::new(
            far.iter().sum::<f64>() / far.len() as f64,
            2,
            ranges::PAIRS_FAR,
        )
    }),
    ("sizes of neighbours < 3.5 m", |s| {
        Check::new(s.marks, 3, ranges::MARKS)
    }),
    ("alike within 30 m, per 10⁶ pairs", |s| alike(s.alike)),
    ("saplings alike within 30 m", |s| alike(s.saplings_alike)),
];

/// A check in millimetres of a measure in metres.
fn millimetres(value_m: f64, (low_m, high_m): (f64, f64)) -> Check {
    let range = (1000.0 * low_m, 1000.0 * high_m);
    Check::new(1000.0 * value_m, 1, range)
}

pub(crate) const SCANS: &[Column] = &[
    ("stems", |s| {
        Check::new(s.scanned.stems.len() as f64, 0, (20.0, 1e6))
    }),
    ("of, mm", |s| {
        Check::new(1000.0 * s.scanned.mean_m(), 0, None)
    }),
    ("diameter, bias, mm", |s| {
        millimetres(s.scanned.bias_m(), ranges::DBH_BIAS_M)
    }),
    ("diameter, RMSE, mm", |s| {
        millimetres(s.scanned.rmse_m(), ranges::DBH_RMSE_M)
    }),
];

pub(crate) const CANOPIES: &[Column] = &[
    ("LAI", |s| {
        let range = ranges::leaf_area_index(s.name);
        Check::new(s.leaf_area_index, 2, range)
    }),
    ("above the lines", |s| {
        Check::new(s.gaps.leaf_area_index, 2, None)
    }),
    ("Ω shoots", |s| {
        let (low, high) = ranges::SHOOTS;
        let asked = s.silhouette;
        Check::new(s.gaps.shoots, 2, (low * asked, high * asked))
    }),
    ("2 G", |s| Check::new(s.gaps.projection, 2, None)),
    ("Ω crowns, stand", |s| Check::new(s.gaps.crowns, 2, None)),
    ("Ω", |s| Check::new(s.gaps.clumping(), 2, None)),
    ("Ω photographed", |s| {
        let shoots = if ranges::is_of_needles(s.name) {
            s.gaps.shoots
        } else {
            1.0
        };
        Check::new(s.photographed * shoots, 3, ranges::photographed(s.name))
    }),
    ("exp(-0.93 Ω LAI)", |s| {
        Check::new(s.gaps.expected, 3, None)
    }),
    ("no leaf on the ray", |s| Check::new(s.leafless, 3, None)),
    ("over the law", |s| {
        Check::new(s.leafless / s.gaps.expected, 2, ranges::OVER_THE_LAW)
    }),
    ("nothing on the ray", |s| {
        Check::new(s.openness, 3, ranges::openness(s.name))
    }),
    ("nor to the zenith", |s| {
        Check::new(s.openness_above, 3, None)
    }),
];

pub(crate) const PROFILES: &[Column] = &[
    ("dominant height, m", |s| Check::new(s.dominant_m, 1, None)),
    ("densest at", |s| {
        let range = ranges::densest(s.name);
        Check::new(s.layers.mode, 2, range)
    }),
    ("half as dense over", |s| {
        let range = (s.name == "spruce").then_some(ranges::BREADTH);
        Check::new(s.layers.breadth, 2, range)
    }),
    ("under 2 m, over the mean", |s| {
        Check::new(s.layers.understorey, 2, None)
    }),
];

/// The cover of a layer.
fn cover(s: &Stand, layer: usize) -> Check {
    let share = s.layer_cover.shares()[layer];
    Check::new(share, 2, ranges::layer_cover(s.name)[layer])
}

pub(crate) const FLOOR: &[Column] = &[
    ("moss", |s| cover(s, 0)),
    ("herbs < 0.5 m", |s| cover(s, 1)),
    ("shrubs < 0.5 m", |s| cover(s, 2)),
    ("0.5–1.5 m", |s| cover(s, 3)),
    ("1.5–3 m", |s| cover(s, 4)),
    ("deadwood, m³/ha", |s| {
        Check::new(s.deadwood_m3_ha, 1, None)
    }),
    ("over what was asked for", |s| {
        let asked = s.config.deadwood.volume_m3_ha;
        Check::new(s.deadwood_m3_ha / asked, 2, ranges::deadwood(asked))
    }),
];

pub(crate) const VISIBILITY: &[Column] = &[
    ("seen within 10 m", |s| {
        Check::new(s.visibility.shares()[0], 2, None)
    }),
    ("10–20 m", |s| {
        Check::new(s.visibility.shares()[1], 2, None)
    }),
    ("20–30 m", |s| {
        Check::new(s.visibility.shares()[2], 2, None)
    }),
    ("30–40 m", |s| {
        Check::new(s.visibility.shares()[3], 2, None)
    }),
    ("k, 1/m", |s| {
        Check::new(s.visibility.falls_off_per_m(), 3, None)
    }),
    ("k of stems at random", |s| {
        Check::new(s.sight_law_per_m, 3, None)
    }),
    ("ratio", |s| {
        let ratio = s.visibility.falls_off_per_m() / s.sight_law_per_m;
        Check::new(ratio, 2, ranges::sight(s.name))
    }),
    ("off the curve", |s| {
        Check::new(s.visibility.off_the_curve(), 2, ranges::OFF_THE_CURVE)
    }),
];

pub(crate) const PICTURES: &[Column] = &[
    ("slope", |s| Check::new(s.slope, 2, ranges::SLOPE)),
    ("isotropy", |s| Check::new(s.isotropy, 2, ranges::ISOTROPY)),
    ("ground repeats", |s| {
        Check::new(s.ground_repeats, 2, ranges::GROUND_REPEATS)
    }),
    ("log-luminance SD", |s| {
        Check::new(s.tones.log_sd, 2, ranges::LOG_LUMINANCE_SD)
    }),
    ("kurtosis of steps", |s| {
        Check::new(s.tones.gradient_kurtosis, 1, ranges::KURTOSIS)
    }),
];

/// The share of trees with needles.
fn needles(s: &Stand) -> f64 {
    let needles =
        |name: &str| Species::built_in(name).is_some_and(|s| s.foliage.silhouette_factor < 0.9);
    let of_needles = s.trees.iter().filter(|t| needles(&t.species)).count();
    of_needles as f64 / s.trees.len() as f64
}

pub(crate) const COLOURS: &[Column] = &[
    ("GCC", |s| {
        let gcc = s.colour_from_above.map_or(f64::NAN, |c| c.gcc);
        Check::new(gcc, 3, ranges::green(s.name, needles(s)))
    }),
    ("hue", |s| {
        let hue = s.colour_from_above.map_or(f64::NAN, |c| c.hue_deg);
        Check::new(hue, 0, ranges::HUE_DEG)
    }),
    ("glaring, %", |s| {
        let glaring = s.colour_from_above.map_or(f64::NAN, |c| c.glaring);
        percent(glaring, 2, ranges::GLARING)
    }),
    ("GCC under crowns", |s| {
        Check::new(s.colour.map_or(f64::NAN, |c| c.gcc), 3, None)
    }),
    ("hue under crowns", |s| {
        let hue = s.colour.map_or(f64::NAN, |c| c.hue_deg);
        Check::new(hue, 0, ranges::HUE_DEG)
    }),
    ("glaring under crowns, %", |s| {
        let glaring = s.colour.map_or(f64::NAN, |c| c.glaring);
        percent(glaring, 2, None)
    }),
];
