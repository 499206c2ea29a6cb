//! What makes a species: numbers, no code of its own.

use crate::error::ParamError;

/// A species. All lengths in metres and angles in degrees unless said otherwise; diameters inside
/// published relations are in centimetres, as their authors have them.
#[derive(Clone, Debug, PartialEq)]
pub struct Species {
    /// `snake_case`, for files and names of prototypes.
    pub name: &'static str,
    /// The botanical name.
    pub scientific_name: &'static str,
    /// How big it grows.
    pub allometry: Allometry,
    /// The stem.
    pub stem: StemForm,
    /// The outline of the crown.
    pub crown: CrownForm,
    /// Living branches, first order first; 1 to 4 orders.
    pub levels: Vec<BranchLevel>,
    /// Dead branches below the crown.
    pub dead: DeadBranches,
    /// The leaves.
    pub foliage: FoliageForm,
}

/// Published relations between a tree's diameter d (cm) and its other measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allometry {
    /// Diameters at breast height that the relations were fitted to, or stay sensible for.
    pub dbh_range_m: [f64; 2],
    /// Rate a (1/cm) and shape b of the generalised Schnute height curve.
    pub height_curve: [f64; 2],
    /// The point the height curve is anchored at: dominant diameter (cm), dominant height (m).
    pub dominant: [f64; 2],
    /// Standard deviation of height about the curve, as a share of height.
    pub height_sd: f64,
    /// Least and greatest height / diameter (m/m).
    pub slenderness: [f64; 2],
    /// Crown width = `[0]` · d^`[1]`, metres.
    pub crown_width: [f64; 2],
    /// Standard deviation of ln(crown width) about that.
    pub crown_width_sd: f64,
    /// Crown length / height: mean, standard deviation, least, greatest.
    pub crown_ratio: [f64; 4],
    /// One-sided leaf area = `[0]` · d^`[1]`, m².
    pub leaf_area: [f64; 2],
    /// Standard deviation of ln(leaf area) about that.
    pub leaf_area_sd: f64,
    /// Leaf area over the area of the mean crown's projection is at most this.
    pub leaf_area_index_max: f64,
    /// Standard deviation of the lean.
    pub lean_sd_deg: f64,
}

/// Relative stem diameter over relative height x = z/H:
/// (1 + `butt` e^(−`butt_decay` x)) (1 − x)^(`power` + `slenderness_power` · H/d + `top_power` (1 − x)),
/// then scaled through the diameter at 1.3 m. H/d is in m/m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taper {
    /// How much the butt swells.
    pub butt: f64,
    /// How fast the swelling ends.
    pub butt_decay: f64,
    /// Exponent at the top.
    pub power: f64,
    /// Share of slenderness in the exponent.
    pub slenderness_power: f64,
    /// What the exponent has more at the foot.
    pub top_power: f64,
}

/// The form of the stem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StemForm {
    /// Its taper.
    pub taper: Taper,
    /// The share of the crown's length through which the stem stays one: 1 excurrent, near 0 a tree
    /// that forks at the crown's base.
    pub apical_dominance: f64,
    /// Greatest angle of the basal sweep.
    pub sweep_deg: f64,
    /// Amplitude of its winding, as a share of height.
    pub sinuosity: f64,
    /// Lobes of the root flare, least and most.
    pub flare_lobes: [u32; 2],
    /// What a lobe adds to the radius at the ground, as a share of it, least and most.
    pub flare: [f64; 2],
    /// Share of the crown's length below the top of the stem that bears leaves.
    pub leafy: f64,
}

/// The outline of the crown: radius over relative height t in the crown, two superelliptic arcs.
#[derive(Clone, Copy, Debug, PartialEq)]
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BranchLevel {
    /// Branches at a node, least and most: several are a whorl.
    pub per_node: [u32; 2],
    /// Distance between nodes on the parent.
    pub node_spacing_m: f64,
    /// The part of the parent that has nodes, 0 its base .. 1 its tip (first order: of its length in
    /// the crown).
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
    /// Shorter ones are left out.
    pub length_min_m: f64,
    /// Bend over the whole length: positive turns the tip up, negative down.
    pub curve_deg: f64,
    /// Standard deviation of the turn at each joint.
    pub gnarl_deg: f64,
    /// Turn to alternate sides at each joint: the zig-zag of sympodial growth.
    pub zigzag_deg: f64,
    /// Distance between joints.
    pub joint_m: f64,
    /// Radius at the base as a share of the parent's there, least and most.
    pub radius_ratio: [f64; 2],
    /// From this share of its length on it bears leaves; 1 or more is bare.
    pub leafy_from: f64,
}

/// Dead branches on the stem below the living crown.
#[derive(Clone, Copy, Debug, PartialEq)]
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoliageForm {
    /// Silhouette of a shoot over its one-sided leaf area, 4 · STAR (Stenberg): 1 for flat leaves.
    pub silhouette_factor: f64,
    /// Mean of the leaves' inclination (0 flat, 90 upright).
    pub inclination_mean_deg: f64,
    /// Its standard deviation.
    pub inclination_sd_deg: f64,
    /// Cards that spring from one point of a twig.
    pub cards_per_cluster: u32,
    /// Angle between twig and card.
    pub spread_deg: f64,
    /// What a card's direction is drawn to: 1 up, −1 hanging, 0 along the twig.
    pub tropism: f64,
    /// A twig's tip attracts as many clusters as this length of twig.
    pub tip_weight_m: f64,
    /// Radius of the thinnest twig.
    pub tip_radius_m: f64,
    /// Exponent g of the pipe model: r_parent^g = Σ r_child^g.
    pub pipe_exponent: f64,
}

impl Species {
    /// Refuses numbers that the generator cannot work with.
    pub(super) fn check(&self) -> Result<(), ParamError> {
        let field = |name: &str| format!("{}.{name}", self.name);
        let range =
            |name: &str, value, low, high| ParamError::check_range(field(name), value, low, high);
        let levels = self.levels.len();
        if !(1..=4).contains(&levels) {
            return Err(ParamError::new(field("levels"), levels, "1..=4 orders"));
        }
        range(
            "stem.apical_dominance",
            self.stem.apical_dominance,
            0.02,
            1.0,
        )?;
        range(
            "stem.flare_lobes",
            f64::from(self.stem.flare_lobes[0]),
            2.0,
            8.0,
        )?;
        range(
            "stem.flare_lobes",
            f64::from(self.stem.flare_lobes[1]),
            f64::from(self.stem.flare_lobes[0]),
            8.0,
        )?;
        range("crown.widest_at", self.crown.widest_at, 0.01, 0.99)?;
        range("crown.base", self.crown.base, 0.0, 1.0)?;
        range("crown.lower_power", self.crown.lower_power, 0.3, 10.0)?;
        range("crown.upper_power", self.crown.upper_power, 0.3, 10.0)?;
        for (i, level) in self.levels.iter().enumerate() {
            let name = |f: &str| format!("levels[{i}].{f}");
            range(&name("node_spacing_m"), level.node_spacing_m, 0.02, 20.0)?;
            range(&name("joint_m"), level.joint_m, 0.02, 20.0)?;
            range(&name("length_min_m"), level.length_min_m, 0.02, 20.0)?;
            range(
                &name("per_node"),
                f64::from(level.per_node[0]),
                1.0,
                f64::from(level.per_node[1]),
            )?;
            range(&name("per_node"), f64::from(level.per_node[1]), 1.0, 12.0)?;
            range(&name("zone"), level.zone[1] - level.zone[0], 0.0, 1.0)?;
        }
        let leaf = &self.foliage;
        range(
            "foliage.silhouette_factor",
            leaf.silhouette_factor,
            0.05,
            2.0,
        )?;
        range(
            "foliage.inclination_mean_deg",
            leaf.inclination_mean_deg,
            5.0,
            85.0,
        )?;
        range(
            "foliage.inclination_sd_deg",
            leaf.inclination_sd_deg,
            1.0,
            40.0,
        )?;
        range(
            "foliage.cards_per_cluster",
            f64::from(leaf.cards_per_cluster),
            1.0,
            16.0,
        )?;
        range("foliage.tip_radius_m", leaf.tip_radius_m, 0.0005, 0.02)?;
        range("foliage.pipe_exponent", leaf.pipe_exponent, 1.5, 4.0)
    }
}
