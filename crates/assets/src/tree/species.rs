//! A species, which is numbers alone and has no code of its own. A species file is this struct as
//! TOML.

use serde::Deserialize;

use super::competition::CrownCompetition;
use super::litter::LitterLook;
use super::look::{BarkLook, LeafLook};
use super::phenology::{Phenology, Season, SeasonalLeaves};
use super::ranges::Ranges;
use nemoral_scene::ParamError;

/// A species. All lengths in metres and angles in degrees unless said otherwise; diameters inside
/// published relations are in centimetres, as their authors have them.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Species {
    /// `snake_case`, for files and names of prototypes.
    pub name: String,
    /// The botanical name.
    pub scientific_name: String,
    /// Where the numbers come from, and which of them are our choice; at least one entry.
    pub sources: Vec<String>,
    /// How big it grows.
    pub allometry: Allometry,
    /// The stem.
    pub stem: StemForm,
    /// The outline of the crown; that of grown trees, if [`Species::young_crown`] is given.
    pub crown: CrownForm,
    /// The outline of the crowns of young trees, if it differs; up to the mature class it turns
    /// into [`Species::crown`].
    pub young_crown: Option<CrownForm>,
    /// Living branches, first order first; 1 to 4 orders.
    pub levels: Vec<BranchLevel>,
    /// Dead branches below the crown.
    pub dead: DeadBranches,
    /// How the leaves are held.
    pub foliage: FoliageForm,
    /// What a leafy twig looks like.
    pub leaves: LeafLook,
    /// The leaves through the year; evergreen without it.
    pub phenology: Option<Phenology>,
    /// What the bark looks like.
    pub bark: BarkLook,
    /// What it sheds, if that differs from what most species shed.
    pub shed: Option<LitterLook>,
}

/// Published relations between a tree's diameter d (cm) and its other measures.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Allometry {
    /// Diameters at breast height that the relations were fitted to, or stay sensible for.
    pub dbh_range_m: [f64; 2],
    /// Diameters at which trees count as middle-aged, and as mature.
    pub class_dbh_m: [f64; 2],
    /// Rate a (1/cm) and shape b of the generalised Schnute height curve.
    pub height_curve: [f64; 2],
    /// The point the height curve is anchored at: dominant diameter (cm), dominant height (m).
    pub dominant: [f64; 2],
    /// Standard deviation of height about the curve, as a share of height.
    pub height_sd: f64,
    /// Least and greatest height / diameter (m/m), where the scatter of heights ends; the curve
    /// ends a tenth inside. The least is at most 0.8 times the greatest.
    pub slenderness: [f64; 2],
    /// Crown width = `[0]` + `[1]` · d^`[2]`, metres.
    pub crown_width: [f64; 3],
    /// Standard deviation of ln(crown width) about that.
    pub crown_width_sd: f64,
    /// Crown length / height: mean (unless [`Allometry::competition`] gives it), standard
    /// deviation, least, greatest.
    pub crown_ratio: [f64; 4],
    /// How the crown answers to competition.
    pub competition: Option<CrownCompetition>,
    /// One-sided leaf area = `[0]` · d^`[1]`, m².
    pub leaf_area: [f64; 2],
    /// Standard deviation of ln(leaf area) about that.
    pub leaf_area_sd: f64,
    /// Leaf area over the area of the mean crown's projection is at most this.
    pub leaf_area_index_max: f64,
    /// Standard deviation of the lean.
    pub lean_sd_deg: f64,
    /// Where the crown begins on the open side of a tree at the edge of a wood, as a share of its
    /// height, 0.02..=0.6; without it 0.12.
    pub edge_crown_base: Option<f64>,
}

/// The relative diameter of a stem over the relative height x = z/H: (1 + `butt` e^(−`butt_decay`
/// x)) (1 − x)^(`power` + `slenderness_power` · H/d + `top_power` (1 − x)), scaled to the diameter
/// at 1.3 m. H/d is in m/m.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Taper {
    /// How much the butt swells.
    pub butt: f64,
    /// How fast the swelling ends.
    pub butt_decay: f64,
    /// Exponent at the top.
    pub power: f64,
    /// Share of slenderness in the exponent.
    pub slenderness_power: f64,
    /// What is added to the exponent at the foot.
    pub top_power: f64,
}

/// The form of the stem.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StemForm {
    /// Its taper.
    pub taper: Taper,
    /// The share of the crown's length up to which there is one stem: 1 for an excurrent tree, near
    /// 0 for a tree that forks at the crown's base.
    pub apical_dominance: f64,
    /// Greatest angle of the basal sweep.
    pub sweep_deg: f64,
    /// Amplitude of its winding, as a share of height.
    pub sinuosity: f64,
    /// Lobes of the root flare, least and most.
    pub flare_lobes: [u32; 2],
    /// What a lobe adds to the radius at the ground, as a share of that radius, least and most.
    pub flare: [f64; 2],
    /// Share of the crown's length below the top of the stem that bears leaves.
    pub leafy: f64,
}

/// The outline of the crown: radius over relative height t in the crown, two superelliptic arcs.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CrownForm {
    /// t of the greatest radius, 0 (base) .. 1 (top).
    pub widest_at: f64,
    /// Radius at t = 0, as a share of the greatest.
    pub base: f64,
    /// Exponent of the lower arc: 1 straight, 2 round, more is boxier.
    pub lower_power: f64,
    /// Exponent of the upper arc.
    pub upper_power: f64,
    /// Standard deviation of the asymmetry between sides, as a share of the radius.
    pub asymmetry: f64,
}

/// Branches of one order.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BranchLevel {
    /// Branches at a node, least and most: several are a whorl.
    pub per_node: [u32; 2],
    /// Distance between nodes on the parent.
    pub node_spacing_m: f64,
    /// The part of the parent that has nodes, 0 its base .. 1 its tip (first order: of its length
    /// in the crown).
    pub zone: [f64; 2],
    /// Turn about the parent from node to node: 137.5 spiral, 180 two rows.
    pub divergence_deg: f64,
    /// Angle from the parent's direction at the zone's start and at its end.
    pub insertion_deg: [f64; 2],
    /// Standard deviation of both angles.
    pub angle_sd_deg: f64,
    /// First order: length as a share of the way to the envelope, least and most. Others: of the
    /// parent's length, at its base.
    pub length: [f64; 2],
    /// Least length; shorter branches are left out.
    pub length_min_m: f64,
    /// Bend over the inner and over the outer half: positive turns the tip up, negative down.
    pub curve_deg: [f64; 2],
    /// Whether its nodes lie in one plane with the level direction beside the parent (sprays,
    /// tiers).
    #[serde(default)]
    pub planar: bool,
    /// Standard deviation of the turn at each joint.
    pub gnarl_deg: f64,
    /// Turn to alternate sides at each joint: the zig-zag of sympodial growth.
    pub zigzag_deg: f64,
    /// Distance between joints.
    pub joint_m: f64,
    /// Radius at the base as a share of the parent's there, least and most.
    pub radius_ratio: [f64; 2],
    /// The share of its length beyond which it bears leaves; it is bare with 1 or more.
    pub leafy_from: f64,
}

/// Dead branches on the stem below the living crown.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DeadBranches {
    /// Lowest, as a share of the height of the crown's base.
    pub from: f64,
    /// Chance that a branch of a node below the crown is still there.
    pub persistence: f64,
    /// Length of a broken stub, least and most.
    pub stub_m: [f64; 2],
    /// Length of a whole dead branch just below the crown, as a share of the crown's radius.
    pub whole: f64,
    /// The share of the bare stem below the crown where whole dead branches are.
    pub whole_zone: f64,
    /// Angle from the stem.
    pub insertion_deg: f64,
    /// Radius at the base as a share of the stem's there.
    pub radius_ratio: f64,
}

/// The leaves.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FoliageForm {
    /// Silhouette of a shoot over its one-sided leaf area. For needles it is 4 · STAR (Stenberg);
    /// for broad leaves it is the share of the area that the leaves of its picture do not hide of
    /// each other, 1 if they lie side by side.
    pub silhouette_factor: f64,
    /// Mean of the leaves' inclination (0 flat, 90 upright).
    pub inclination_mean_deg: f64,
    /// Its standard deviation.
    pub inclination_sd_deg: f64,
    /// Cards that spring from one point of a twig.
    pub cards_per_cluster: u32,
    /// Angle between twig and card.
    pub spread_deg: f64,
    /// The tropism of cards: 1 turns them up, −1 lets them hang, 0 keeps them along the twig.
    pub tropism: f64,
    /// A twig's tip bears as many extra clusters as this length of twig, metres.
    pub tip_weight_m: f64,
    /// Radius of the thinnest twig.
    pub tip_radius_m: f64,
    /// Exponent g of the pipe model: r_parent^g = Σ r_child^g.
    pub pipe_exponent: f64,
}

impl Species {
    /// Refuses numbers that the generator cannot work with.
    pub(crate) fn check(&self) -> Result<(), ParamError> {
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        if self.name.is_empty() || !self.name.chars().all(plain) {
            let allowed = "snake_case: a to z, 0 to 9 and _";
            return Err(ParamError::new("name", &self.name, allowed));
        }
        let field = |name: &str| format!("{}.{name}", self.name);
        if self.sources.is_empty() {
            return Err(ParamError::new(
                field("sources"),
                "[]",
                "at least one entry: where the numbers come from",
            ));
        }
        let levels = self.levels.len();
        if !(1..=4).contains(&levels) {
            return Err(ParamError::new(field("levels"), levels, "1..=4 orders"));
        }
        self.allometry.check(&self.name)?;
        self.stem.check(&self.name)?;
        self.crown.check(&field("crown"))?;
        if let Some(crown) = &self.young_crown {
            crown.check(&field("young_crown"))?;
        }
        for (i, level) in self.levels.iter().enumerate() {
            level.check(&field(&format!("levels[{i}]")))?;
        }
        self.dead.check(&self.name)?;
        self.foliage.check(&self.name)?;
        self.leaves.check(&self.name)?;
        self.bark.check(&self.name)?;
        if let Some(phenology) = &self.phenology {
            phenology.check(&self.name)?;
        }
        self.shed.map_or(Ok(()), |shed| shed.check(&self.name))
    }
}

impl Species {
    /// The leaves with the optical properties of a shoot of them.
    #[must_use]
    pub fn shoot(&self) -> LeafLook {
        self.leaves.in_shoot(self.foliage.silhouette_factor)
    }

    /// The mean leaves of most of its trees in a season, or in high summer, as in a shoot, and the
    /// share of the leaf area of summer that is there.
    #[must_use]
    pub fn shoot_in(&self, season: Option<&Season>) -> (LeafLook, f64) {
        let Some((season, phenology)) = season.zip(self.phenology) else {
            return (self.shoot(), 1.0);
        };
        let phase = phenology.phase(season, 0.0, false);
        let factor = self.foliage.silhouette_factor;
        let leaves = SeasonalLeaves::new(self.leaves.clone(), phenology, phase, factor);
        (leaves.mean_look(), phase.leaf_area())
    }

    /// What it sheds: its own numbers, or, without any, leaves as those of most species.
    #[must_use]
    pub fn litter_look(&self) -> LitterLook {
        self.shed.unwrap_or(LitterLook {
            albedo: [0.149, 0.089, 0.060],
            leaves_per_m2: if self.leaves.kind.is_needle() {
                24.0
            } else {
                90.0
            },
            fruit: None,
            bark: None,
        })
    }
}

impl Allometry {
    fn check(&self, species: &str) -> Result<(), ParamError> {
        let name = format!("{species}.allometry");
        let r = Ranges(&name);
        r.pair("dbh_range_m", self.dbh_range_m, 0.03, 2.0)?;
        let [least, most] = self.dbh_range_m;
        r.pair("class_dbh_m", self.class_dbh_m, least, most)?;
        r.one("height_curve[0]", self.height_curve[0], -0.02, 1.0)?;
        r.one("height_curve[1]", self.height_curve[1], 0.2, 5.0)?;
        r.one("dominant[0]", self.dominant[0], 5.0, 200.0)?;
        r.one("dominant[1]", self.dominant[1], 3.0, 65.0)?;
        r.one("height_sd", self.height_sd, 0.0, 0.3)?;
        r.pair("slenderness", self.slenderness, 10.0, 200.0)?;
        let [slender, most_slender] = self.slenderness;
        // Mean heights keep a tenth inside both.
        r.one("slenderness[0]", slender, 10.0, 0.8 * most_slender)?;
        let [_, slope, power] = self.crown_width;
        r.one("crown_width[0]", self.crown_width[0], 0.0, 5.0)?;
        r.one("crown_width[1]", slope, 0.01, 5.0)?;
        r.one("crown_width[2]", power, 0.1, 2.0)?;
        r.one("crown_width_sd", self.crown_width_sd, 0.0, 0.5)?;
        let [mean, sd, low, high] = self.crown_ratio;
        r.pair("crown_ratio", [low, high], 0.12, 0.95)?;
        r.one("crown_ratio[0]", mean, low, high)?;
        r.one("crown_ratio[1]", sd, 0.0, 0.2)?;
        if let Some(competition) = &self.competition {
            competition.check(&r)?;
        }
        r.one("leaf_area[0]", self.leaf_area[0], 1e-4, 10.0)?;
        r.one("leaf_area[1]", self.leaf_area[1], 0.2, 4.0)?;
        r.one("leaf_area_sd", self.leaf_area_sd, 0.0, 0.5)?;
        r.one("leaf_area_index_max", self.leaf_area_index_max, 0.1, 15.0)?;
        if let Some(share) = self.edge_crown_base {
            r.one("edge_crown_base", share, 0.02, 0.6)?;
        }
        r.one("lean_sd_deg", self.lean_sd_deg, 0.0, 7.0)
    }
}

impl StemForm {
    fn check(&self, species: &str) -> Result<(), ParamError> {
        let name = format!("{species}.stem");
        let r = Ranges(&name);
        let t = &self.taper;
        r.one("taper.butt", t.butt, 0.0, 2.0)?;
        r.one("taper.butt_decay", t.butt_decay, 2.0, 60.0)?;
        r.one("taper.power", t.power, 0.2, 3.0)?;
        r.one("taper.slenderness_power", t.slenderness_power, 0.0, 0.02)?;
        r.one("taper.top_power", t.top_power, -0.9, 1.0)?;
        r.one("apical_dominance", self.apical_dominance, 0.02, 1.0)?;
        r.one("sweep_deg", self.sweep_deg, 0.0, 25.0)?;
        r.one("sinuosity", self.sinuosity, 0.0, 0.08)?;
        r.pair("flare_lobes", self.flare_lobes.map(f64::from), 2.0, 8.0)?;
        r.pair("flare", self.flare, 0.0, 0.8)?;
        r.one("leafy", self.leafy, 0.0, 1.0)
    }
}

impl CrownForm {
    fn check(&self, name: &str) -> Result<(), ParamError> {
        let r = Ranges(name);
        r.one("widest_at", self.widest_at, 0.01, 0.99)?;
        r.one("base", self.base, 0.0, 1.0)?;
        r.one("lower_power", self.lower_power, 0.3, 10.0)?;
        r.one("upper_power", self.upper_power, 0.3, 10.0)?;
        r.one("asymmetry", self.asymmetry, 0.0, 0.4)
    }
}

impl BranchLevel {
    fn check(&self, name: &str) -> Result<(), ParamError> {
        let r = Ranges(name);
        r.pair("per_node", self.per_node.map(f64::from), 1.0, 12.0)?;
        r.one("node_spacing_m", self.node_spacing_m, 0.02, 20.0)?;
        r.pair("zone", self.zone, 0.0, 1.0)?;
        r.one("divergence_deg", self.divergence_deg, -360.0, 360.0)?;
        r.each("insertion_deg", &self.insertion_deg, 0.0, 150.0)?;
        r.one("angle_sd_deg", self.angle_sd_deg, 0.0, 40.0)?;
        r.pair("length", self.length, 0.01, 3.0)?;
        r.one("length_min_m", self.length_min_m, 0.02, 20.0)?;
        r.each("curve_deg", &self.curve_deg, -180.0, 180.0)?;
        r.one("gnarl_deg", self.gnarl_deg, 0.0, 60.0)?;
        r.one("zigzag_deg", self.zigzag_deg, 0.0, 60.0)?;
        r.one("joint_m", self.joint_m, 0.02, 20.0)?;
        r.pair("radius_ratio", self.radius_ratio, 0.01, 1.0)?;
        r.one("leafy_from", self.leafy_from, 0.0, 10.0)
    }
}

impl DeadBranches {
    fn check(&self, species: &str) -> Result<(), ParamError> {
        let name = format!("{species}.dead");
        let r = Ranges(&name);
        r.one("from", self.from, 0.0, 1.0)?;
        r.one("persistence", self.persistence, 0.0, 1.0)?;
        r.pair("stub_m", self.stub_m, 0.01, 3.0)?;
        r.one("whole", self.whole, 0.0, 2.0)?;
        r.one("whole_zone", self.whole_zone, 0.01, 1.0)?;
        r.one("insertion_deg", self.insertion_deg, 5.0, 150.0)?;
        r.one("radius_ratio", self.radius_ratio, 0.01, 0.9)
    }
}

impl FoliageForm {
    fn check(&self, species: &str) -> Result<(), ParamError> {
        let name = format!("{species}.foliage");
        let r = Ranges(&name);
        r.one("silhouette_factor", self.silhouette_factor, 0.05, 2.0)?;
        r.one("inclination_mean_deg", self.inclination_mean_deg, 5.0, 85.0)?;
        r.one("inclination_sd_deg", self.inclination_sd_deg, 1.0, 40.0)?;
        let cards = f64::from(self.cards_per_cluster);
        r.one("cards_per_cluster", cards, 1.0, 16.0)?;
        r.one("spread_deg", self.spread_deg, 0.0, 120.0)?;
        r.one("tropism", self.tropism, -5.0, 5.0)?;
        r.one("tip_weight_m", self.tip_weight_m, 0.0, 10.0)?;
        r.one("tip_radius_m", self.tip_radius_m, 0.0005, 0.02)?;
        r.one("pipe_exponent", self.pipe_exponent, 1.5, 4.0)
    }
}
