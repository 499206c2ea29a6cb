//! The size of a tree: drawn from published allometry and handed to the generator as a demand.

use nemoral_seed::{Domain, Draw, Key};

use super::{Competition, Species};

const DBH: Domain = Domain::new("assets.tree.dbh");
const SAPLING: Domain = Domain::new("assets.tree.sapling");
const SIZE: Domain = Domain::new("assets.tree.size");
const INDIVIDUALS: Domain = Domain::new("assets.tree.individuals");
const RANK: Domain = Domain::new("assets.tree.rank");

/// The size of one tree.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TreeSize {
    /// Diameter at breast height (1.3 m), over bark, metres.
    pub dbh_m: f64,
    /// Height of the highest twig or leaf, metres.
    pub height_m: f64,
    /// Height above which 98 % of the foliage is, metres.
    pub crown_base_m: f64,
    /// Quadratic mean of the crown's radii in eight directions, metres.
    pub crown_radius_m: f64,
    /// One-sided leaf area, m².
    pub leaf_area_m2: f64,
    /// Angle between the vertical and the line from the foot to the top of the crown's axis,
    /// radians.
    pub lean_rad: f64,
}

/// The age class of a tree by its diameter ([`Allometry::class_dbh_m`](super::Allometry)).
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
pub enum SizeClass {
    /// Thinner than the species' relations reach.
    Sapling,
    /// From the least diameter of the relations on.
    Young,
    /// From the first of the two class diameters on.
    Middle,
    /// From the second class diameter on.
    Mature,
}

impl SizeClass {
    /// All classes, from small to large.
    pub const ALL: [Self; 4] = [Self::Sapling, Self::Young, Self::Middle, Self::Mature];

    /// `snake_case`, for files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sapling => "sapling",
            Self::Young => "young",
            Self::Middle => "middle",
            Self::Mature => "mature",
        }
    }
}

/// The rank (0..=1) in a distribution of the `number`th of `of` individuals that stand for it. It
/// lies in the middle half of that individual's equal part, because a few draws from the whole
/// would not show the shape of the distribution.
#[must_use]
pub(crate) fn individual_rank(number: u32, of: u32, key: Key) -> f64 {
    let within = key.domain(RANK).rng().range_f64(0.25, 0.75);
    (f64::from(number) + within) / f64::from(of)
}

impl Species {
    /// The class of a diameter.
    #[must_use]
    pub fn size_class(&self, dbh_m: f64) -> SizeClass {
        let al = &self.allometry;
        let limits = [al.dbh_range_m[0], al.class_dbh_m[0], al.class_dbh_m[1]];
        SizeClass::ALL[limits.iter().filter(|&&l| dbh_m >= l).count()]
    }

    /// A typical diameter of a class, metres: its middle, or for the mature class a third above its
    /// lower end.
    #[must_use]
    pub fn class_dbh_m(&self, class: SizeClass) -> f64 {
        let [least, most] = self.allometry.dbh_range_m;
        let [middle, mature] = self.allometry.class_dbh_m;
        match class {
            SizeClass::Sapling => 0.4 * least,
            SizeClass::Young => 0.5 * (least + middle),
            SizeClass::Middle => 0.5 * (middle + mature),
            SizeClass::Mature => (1.33 * mature).min(most),
        }
    }

    /// From 0 in the young class to 1 in the mature one, for everything that changes as trees grow.
    pub(super) fn maturity(&self, dbh_m: f64) -> f64 {
        let [middle, mature] = self.allometry.class_dbh_m;
        let young = 0.5 * (self.allometry.dbh_range_m[0] + middle);
        let t = ((dbh_m - young) / (mature - young).max(1e-6)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }

    /// The size of a sapling of this height (clamped to 2..=5 m; 2 m for NaN). Saplings are thinner
    /// than the range of the relations for grown trees. Their diameter follows from a slenderness
    /// of 100 above breast height (our choice); crown width and leaf area follow from the
    /// extrapolated relations, limited in proportion to the height.
    #[must_use]
    pub fn draw_sapling(&self, height_m: f64, key: Key) -> TreeSize {
        // A NaN stays one when it is clamped.
        let height_m = if height_m > 2.0 {
            height_m.min(5.0)
        } else {
            2.0
        };
        let mut rng = key.domain(SAPLING).rng();
        let dbh_m = (0.010 * (height_m - 1.3) * rng.range_f64(0.85, 1.25)).max(0.008);
        let width_m = self.mean_crown_width_m(dbh_m) * rng.range_f64(0.85, 1.15);
        let crown_radius_m = 0.5 * width_m.clamp(0.35 * height_m, 0.7 * height_m);
        let index = (0.6 * self.allometry.leaf_area_index_max).min(2.5) * rng.range_f64(0.7, 1.1);
        let area_m2 = std::f64::consts::PI * crown_radius_m * crown_radius_m;
        TreeSize {
            dbh_m,
            height_m,
            crown_base_m: height_m * rng.range_f64(0.12, 0.25),
            crown_radius_m,
            leaf_area_m2: index * area_m2,
            lean_rad: (1.5 * self.allometry.lean_sd_deg * rng.normal().clamp(-2.0, 2.0))
                .abs()
                .to_radians(),
        }
    }

    /// Mean height of trees of this diameter, metres: the generalised Schnute curve H = (1.3^b +
    /// (H0^b − 1.3^b)(1 − e^(−a d)) / (1 − e^(−a D0)))^(1/b), kept a tenth inside the bounds of
    /// slenderness, so that the residual is not cut off on one side. The built-in species' bounds
    /// are so wide that this is the curve itself, but for maritime pines under 12 cm.
    #[must_use]
    pub fn mean_height_m(&self, dbh_m: f64) -> f64 {
        let al = &self.allometry;
        let [a, b] = al.height_curve;
        let [d0, h0] = al.dominant;
        // The limit of the quotient below as a goes to 0; where it is used, its error is 1e-7.
        let share = if a.abs() < 1e-9 {
            100.0 * dbh_m / d0
        } else {
            libm::expm1(-a * 100.0 * dbh_m) / libm::expm1(-a * d0)
        };
        let foot = libm::pow(1.3, b);
        let h = libm::pow(foot + (libm::pow(h0, b) - foot) * share, 1.0 / b);
        h.clamp(
            al.slenderness[0] * dbh_m * 1.1,
            al.slenderness[1] * dbh_m * 0.9,
        )
    }

    /// Mean diameter of trees of this height, metres: where [`Species::mean_height_m`] has it,
    /// within the range of the relations.
    #[must_use]
    pub fn mean_dbh_m(&self, height_m: f64) -> f64 {
        let [mut low, mut high] = self.allometry.dbh_range_m;
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.mean_height_m(middle) < height_m {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    /// Diameter over bark of the stem of a tree of this size at `above_ground_m`, metres, by the
    /// species' taper; without the root flare.
    #[must_use]
    pub fn stem_diameter_m(&self, size: &TreeSize, above_ground_m: f64) -> f64 {
        2.0 * self.stem.taper.radius_m(size, above_ground_m)
    }

    /// Mean crown width of trees of this diameter, metres.
    #[must_use]
    pub fn mean_crown_width_m(&self, dbh_m: f64) -> f64 {
        let [c, k, p] = self.allometry.crown_width;
        c + k * libm::pow(100.0 * dbh_m, p)
    }

    /// Mean one-sided leaf area of trees of this diameter, m².
    #[must_use]
    pub fn mean_leaf_area_m2(&self, dbh_m: f64) -> f64 {
        let [k, p] = self.allometry.leaf_area;
        let width = self.mean_crown_width_m(dbh_m);
        let ground = std::f64::consts::FRAC_PI_4 * width * width;
        (k * libm::pow(100.0 * dbh_m, p)).min(self.allometry.leaf_area_index_max * ground)
    }

    /// A diameter at breast height, metres: Weibull with this mean and shape (`vegetation` stands:
    /// about 3 even-aged, 1.2 uneven-aged), truncated to `limits_m` and to the species' own range
    /// by inverting the distribution between them.
    #[must_use]
    pub fn draw_dbh(&self, mean_m: f64, shape: f64, limits_m: [f64; 2], key: Key) -> f64 {
        let rank = key.domain(DBH).rng().unit_f64();
        self.dbh_of_rank(mean_m, shape, limits_m, rank)
    }

    /// The quantile `rank` (0..=1) of the diameters of such a stand, metres: that share of its
    /// trees is thinner.
    #[must_use]
    pub fn dbh_of_rank(&self, mean_m: f64, shape: f64, limits_m: [f64; 2], rank: f64) -> f64 {
        let [least, most] = self.allometry.dbh_range_m;
        let low = limits_m[0].max(least).min(most);
        let high = limits_m[1].min(most).max(low);
        let scale = mean_m / libm::tgamma(1.0 + 1.0 / shape);
        let survival = |d: f64| libm::exp(-libm::pow(d / scale, shape));
        let u = survival(low) * (1.0 - rank) + survival(high) * rank;
        let d = scale * libm::pow(-libm::log(u), 1.0 / shape);
        // The survival function underflows far beyond the mean, and a caller's shape may be NaN.
        if survival(low) > 0.0 && !d.is_nan() {
            d.clamp(low, high)
        } else {
            low
        }
    }

    /// The diameter, metres, of the `number`th (from thin to thick) of `of` trees that stand for
    /// all trees of such a stand: the quadratic mean of its equal part of the distribution, so that
    /// the basal area is the stand's. (Medians of the parts would give too little basal area, as
    /// the upper tail is longer.)
    ///
    /// `key` is shared by all of them. Each tree is thinner or thicker than that mean by up to an
    /// eighth of the trees of its part; of each four trees in turn, the outer two deviate one way
    /// and the inner two the other way. So the trees of two keys differ, but their mean and their
    /// spread do not.
    #[must_use]
    pub fn dbh_of_individual(
        &self,
        mean_m: f64,
        shape: f64,
        limits_m: [f64; 2],
        [number, of]: [u32; 2],
        key: Key,
    ) -> f64 {
        const STEPS: u32 = 32;
        let of_part = |within: f64| {
            let rank = (f64::from(number) + within) / f64::from(of);
            self.dbh_of_rank(mean_m, shape, limits_m, rank)
        };
        let square = |i: u32| {
            let d = of_part((f64::from(i) + 0.5) / f64::from(STEPS));
            d * d
        };
        let mean = ((0..STEPS).map(square).sum::<f64>() / f64::from(STEPS)).sqrt();
        let outer = matches!(number % 4, 0 | 3);
        let aside = key.domain(INDIVIDUALS).rng().range_f64(-0.125, 0.125);
        let aside = if outer { aside } else { -aside };
        let dbh_m = mean * of_part(0.5 + aside) / of_part(0.5);
        dbh_m.max(of_part(0.0)).min(of_part(1.0))
    }

    /// The size of a tree of this diameter (clamped to the species' range): the means of the
    /// published relations, with their scatter. A tree with a wide crown also has more leaves
    /// (correlation 0.6). It is a tree of a closed stand; [`Species::draw_size_among`] draws
    /// others.
    #[must_use]
    pub fn draw_size(&self, dbh_m: f64, key: Key) -> TreeSize {
        self.draw_size_among(dbh_m, &Competition::default(), key)
    }

    /// [`Species::draw_size`] of a tree under this competition. Its leaf area is in proportion to
    /// the share of its height that its crown has, as that of trees equally thick is (Valentine et
    /// al. 1994, "Surrogates for foliar dry matter in loblolly pine").
    #[must_use]
    pub fn draw_size_among(&self, dbh_m: f64, competition: &Competition, key: Key) -> TreeSize {
        let al = &self.allometry;
        let [least, most] = al.dbh_range_m;
        let dbh_m = dbh_m.max(least).min(most);
        let mut rng = key.domain(SIZE).rng();
        let mut normal = || rng.normal().clamp(-2.5, 2.5);
        let height_m = (self.mean_height_m(dbh_m) * (1.0 + al.height_sd * normal()))
            .clamp(al.slenderness[0] * dbh_m, al.slenderness[1] * dbh_m);
        let wide = normal();
        let leafy = 0.6 * wide + 0.8 * normal();
        // exp(s z − s²/2) has mean 1.
        let factor = |s: f64, z: f64| libm::exp(s * z - 0.5 * s * s);
        let [_, ratio_sd, least_ratio, most_ratio] = al.crown_ratio;
        let ratio = self.mean_crown_ratio(dbh_m, height_m, competition);
        let longer = ratio / self.mean_crown_ratio(dbh_m, height_m, &Competition::default());
        let crown_ratio = (ratio + ratio_sd * normal()).clamp(least_ratio, most_ratio);
        TreeSize {
            dbh_m,
            height_m,
            crown_base_m: height_m * (1.0 - crown_ratio),
            crown_radius_m: 0.5 * self.mean_crown_width_m(dbh_m) * factor(al.crown_width_sd, wide),
            leaf_area_m2: longer * self.mean_leaf_area_m2(dbh_m) * factor(al.leaf_area_sd, leafy),
            lean_rad: (al.lean_sd_deg * normal()).abs().to_radians(),
        }
    }
}
