//! The species there are, and where their numbers come from.

use super::{
    Allometry, BranchLevel, CrownForm, DeadBranches, FoliageForm, Species, StemForm, Taper,
};

impl Species {
    /// All species, in a fixed order: maritime pine, eucalyptus, English oak.
    #[must_use]
    pub fn all() -> Vec<Self> {
        vec![
            Self::maritime_pine(),
            Self::eucalyptus(),
            Self::english_oak(),
        ]
    }

    /// Maritime pine, *Pinus pinaster*.
    ///
    /// Relations as tabled with their sources in `reference/vegetation.md`, section 2. Height: generalised
    /// Schnute curve of NW Spain, inland. Crown width: geometric mean of the forest-grown .225 d^.851 (its
    /// density term at 384 stems/ha) and the open-grown .389 d^.831 (medfate). Crown ratio: from the
    /// published height of the crown's base, about .63 H. Taper: the segmented curve of Fang et al. for the Galician
    /// coast, refitted to [`Taper`] (within 0.03 of the diameter at breast height). Leaf area: Forrester et
    /// al. 2017. Silhouette factor: 4 STAR of pine shoots (Stenberg). Scatter and branching: our choice.
    #[must_use]
    pub fn maritime_pine() -> Self {
        Self {
            name: "maritime_pine",
            scientific_name: "Pinus pinaster",
            allometry: Allometry {
                dbh_range_m: [0.08, 0.60],
                height_curve: [0.046_11, 1.894],
                dominant: [35.0, 20.0],
                height_sd: 0.08,
                slenderness: [27.0, 80.0],
                crown_width: [0.2775, 0.841],
                crown_width_sd: 0.12,
                crown_ratio: [0.37, 0.04, 0.25, 0.5],
                leaf_area: [0.0416, 2.235],
                leaf_area_sd: 0.15,
                leaf_area_index_max: 6.0,
                lean_sd_deg: 2.5,
            },
            stem: StemForm {
                taper: Taper {
                    butt: 0.6544,
                    butt_decay: 13.825,
                    power: 0.6661,
                    slenderness_power: 0.0,
                    top_power: -0.7724,
                },
                apical_dominance: 1.0,
                sweep_deg: 12.0,
                sinuosity: 0.004,
                flare_lobes: [4, 6],
                flare: [0.12, 0.28],
                leafy: 0.06,
            },
            crown: CrownForm {
                widest_at: 0.42,
                base: 0.5,
                lower_power: 1.6,
                upper_power: 2.6,
                asymmetry: 0.12,
            },
            levels: vec![
                BranchLevel {
                    per_node: [4, 6],
                    node_spacing_m: 0.65,
                    zone: [0.0, 0.97],
                    divergence_deg: 37.0,
                    insertion_deg: [78.0, 42.0],
                    angle_sd_deg: 7.0,
                    length: [0.55, 1.0],
                    length_min_m: 0.2,
                    curve_deg: 38.0,
                    gnarl_deg: 9.0,
                    zigzag_deg: 0.0,
                    joint_m: 0.45,
                    radius_ratio: [0.12, 0.28],
                    leafy_from: 0.85,
                },
                BranchLevel {
                    per_node: [2, 3],
                    node_spacing_m: 0.32,
                    zone: [0.35, 0.95],
                    divergence_deg: 55.0,
                    insertion_deg: [58.0, 40.0],
                    angle_sd_deg: 9.0,
                    length: [0.3, 0.55],
                    length_min_m: 0.15,
                    curve_deg: 40.0,
                    gnarl_deg: 7.0,
                    zigzag_deg: 0.0,
                    joint_m: 0.25,
                    radius_ratio: [0.25, 0.6],
                    leafy_from: 0.55,
                },
            ],
            dead: DeadBranches {
                from: 0.15,
                persistence: 0.45,
                stub_m: [0.05, 0.3],
                whole: 0.7,
                whole_zone: 0.3,
                insertion_deg: 82.0,
                radius_ratio: 0.16,
            },
            foliage: FoliageForm {
                silhouette_factor: 0.59,
                inclination_mean_deg: 57.3,
                inclination_sd_deg: 21.5,
                cards_per_cluster: 3,
                spread_deg: 30.0,
                tropism: 0.35,
                tip_weight_m: 0.4,
                tip_radius_m: 0.003,
                pipe_exponent: 2.3,
            },
        }
    }

    /// Blue gum, *Eucalyptus globulus*.
    ///
    /// Relations as tabled with their sources in `reference/vegetation.md`, section 2. Leaf area: foliage
    /// mass (Diéguez-Aranda 2009) times specific leaf area. Crown ratio: .3 to .45 (Soares and Tomé). Limits
    /// of slenderness: published. Our choice, for want of a published one at hand: the height curve's
    /// a = .05, the crown's width (plantations at 3 m × 3 m), the taper, scatter and branching.
    #[must_use]
    pub fn eucalyptus() -> Self {
        Self {
            name: "eucalyptus",
            scientific_name: "Eucalyptus globulus",
            allometry: Allometry {
                dbh_range_m: [0.06, 0.50],
                height_curve: [0.05, 1.0],
                dominant: [20.0, 22.0],
                height_sd: 0.08,
                slenderness: [57.0, 157.0],
                crown_width: [0.35, 0.78],
                crown_width_sd: 0.12,
                crown_ratio: [0.38, 0.04, 0.28, 0.5],
                leaf_area: [0.1834, 1.917],
                leaf_area_sd: 0.15,
                leaf_area_index_max: 6.0,
                lean_sd_deg: 1.5,
            },
            stem: StemForm {
                taper: Taper {
                    butt: 0.35,
                    butt_decay: 18.0,
                    power: 0.85,
                    slenderness_power: 0.0,
                    top_power: -0.1,
                },
                apical_dominance: 1.0,
                sweep_deg: 4.0,
                sinuosity: 0.003,
                flare_lobes: [4, 6],
                flare: [0.08, 0.2],
                leafy: 0.08,
            },
            crown: CrownForm {
                widest_at: 0.5,
                base: 0.45,
                lower_power: 1.6,
                upper_power: 2.0,
                asymmetry: 0.15,
            },
            levels: vec![
                BranchLevel {
                    per_node: [1, 1],
                    node_spacing_m: 0.36,
                    zone: [0.0, 0.96],
                    divergence_deg: 137.5,
                    insertion_deg: [52.0, 26.0],
                    angle_sd_deg: 8.0,
                    length: [0.5, 1.0],
                    length_min_m: 0.2,
                    curve_deg: 18.0,
                    gnarl_deg: 9.0,
                    zigzag_deg: 0.0,
                    joint_m: 0.35,
                    radius_ratio: [0.14, 0.38],
                    leafy_from: 0.9,
                },
                BranchLevel {
                    per_node: [1, 2],
                    node_spacing_m: 0.3,
                    zone: [0.45, 0.98],
                    divergence_deg: 137.5,
                    insertion_deg: [50.0, 38.0],
                    angle_sd_deg: 10.0,
                    length: [0.3, 0.5],
                    length_min_m: 0.15,
                    curve_deg: -35.0,
                    gnarl_deg: 8.0,
                    zigzag_deg: 0.0,
                    joint_m: 0.25,
                    radius_ratio: [0.25, 0.6],
                    leafy_from: 0.4,
                },
                BranchLevel {
                    per_node: [1, 1],
                    node_spacing_m: 0.2,
                    zone: [0.35, 0.95],
                    divergence_deg: 137.5,
                    insertion_deg: [45.0, 35.0],
                    angle_sd_deg: 10.0,
                    length: [0.4, 0.7],
                    length_min_m: 0.12,
                    curve_deg: -70.0,
                    gnarl_deg: 8.0,
                    zigzag_deg: 0.0,
                    joint_m: 0.18,
                    radius_ratio: [0.3, 0.6],
                    leafy_from: 0.2,
                },
            ],
            dead: DeadBranches {
                from: 0.5,
                persistence: 0.12,
                stub_m: [0.04, 0.25],
                whole: 0.6,
                whole_zone: 0.2,
                insertion_deg: 60.0,
                radius_ratio: 0.15,
            },
            foliage: FoliageForm {
                silhouette_factor: 1.0,
                inclination_mean_deg: 70.0,
                inclination_sd_deg: 13.0,
                cards_per_cluster: 2,
                spread_deg: 40.0,
                tropism: -1.6,
                tip_weight_m: 0.25,
                tip_radius_m: 0.002,
                pipe_exponent: 2.3,
            },
        }
    }

    /// English oak, *Quercus robur*.
    ///
    /// Relations as tabled with their sources in `reference/vegetation.md`, section 2. Height: generalised
    /// Schnute curve. Leaf area: Forrester et al. 2017, at most an index of 5.5. Crown width: open-grown,
    /// exp(−.3973) d^.7328 (Hasenauer 1997, *Quercus*); crowns of a dense stand overlap. Taper: the published form
    /// of beech with a butt of our choice. Crown ratio .5 to .7, scatter and branching: our choice.
    #[must_use]
    pub fn english_oak() -> Self {
        Self {
            name: "english_oak",
            scientific_name: "Quercus robur",
            allometry: Allometry {
                dbh_range_m: [0.10, 1.20],
                height_curve: [0.0616, 1.067],
                dominant: [45.0, 20.0],
                height_sd: 0.08,
                slenderness: [23.0, 93.0],
                crown_width: [0.672, 0.7328],
                crown_width_sd: 0.12,
                crown_ratio: [0.66, 0.04, 0.5, 0.75],
                leaf_area: [0.1623, 2.138],
                leaf_area_sd: 0.15,
                leaf_area_index_max: 5.5,
                lean_sd_deg: 2.0,
            },
            stem: StemForm {
                taper: Taper {
                    butt: 0.3,
                    butt_decay: 20.0,
                    power: 0.9331,
                    slenderness_power: 0.002_62,
                    top_power: 0.152,
                },
                apical_dominance: 0.3,
                sweep_deg: 6.0,
                sinuosity: 0.014,
                flare_lobes: [5, 6],
                flare: [0.2, 0.4],
                leafy: 0.0,
            },
            crown: CrownForm {
                widest_at: 0.45,
                base: 0.75,
                lower_power: 2.0,
                upper_power: 3.0,
                asymmetry: 0.08,
            },
            levels: vec![
                BranchLevel {
                    per_node: [2, 3],
                    node_spacing_m: 0.75,
                    zone: [0.0, 1.0],
                    divergence_deg: 70.0,
                    insertion_deg: [64.0, 28.0],
                    angle_sd_deg: 8.0,
                    length: [0.85, 1.0],
                    length_min_m: 0.8,
                    curve_deg: 6.0,
                    gnarl_deg: 12.0,
                    zigzag_deg: 20.0,
                    joint_m: 0.75,
                    radius_ratio: [0.4, 0.75],
                    leafy_from: 0.9,
                },
                BranchLevel {
                    per_node: [1, 2],
                    node_spacing_m: 0.55,
                    zone: [0.2, 0.97],
                    divergence_deg: 137.5,
                    insertion_deg: [62.0, 45.0],
                    angle_sd_deg: 10.0,
                    length: [0.45, 0.7],
                    length_min_m: 0.4,
                    curve_deg: 12.0,
                    gnarl_deg: 14.0,
                    zigzag_deg: 16.0,
                    joint_m: 0.5,
                    radius_ratio: [0.3, 0.65],
                    leafy_from: 0.6,
                },
                BranchLevel {
                    per_node: [1, 2],
                    node_spacing_m: 0.3,
                    zone: [0.15, 0.97],
                    divergence_deg: 137.5,
                    insertion_deg: [60.0, 45.0],
                    angle_sd_deg: 12.0,
                    length: [0.45, 0.75],
                    length_min_m: 0.2,
                    curve_deg: 10.0,
                    gnarl_deg: 14.0,
                    zigzag_deg: 12.0,
                    joint_m: 0.4,
                    radius_ratio: [0.25, 0.6],
                    leafy_from: 0.1,
                },
            ],
            dead: DeadBranches {
                from: 0.4,
                persistence: 0.15,
                stub_m: [0.05, 0.35],
                whole: 0.35,
                whole_zone: 0.35,
                insertion_deg: 70.0,
                radius_ratio: 0.2,
            },
            foliage: FoliageForm {
                silhouette_factor: 1.0,
                inclination_mean_deg: 35.7,
                inclination_sd_deg: 19.3,
                cards_per_cluster: 2,
                spread_deg: 50.0,
                tropism: 0.1,
                tip_weight_m: 0.45,
                tip_radius_m: 0.0025,
                pipe_exponent: 2.4,
            },
        }
    }
}
