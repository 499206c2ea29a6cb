//! From a size to a tree.

use std::f64::consts::{FRAC_PI_4, TAU};
use std::ops::Range;

use nemoral_scene::glam::DVec2;
use nemoral_scene::{Card, MaterialId, Mesh};
use nemoral_seed::{Draw, Key, Stage};

use super::foliage::{Leaf, Leafing, leaves, silhouette_m2};
use super::radii::radii;
use super::skeleton::{Axis, BREAST_M, skeleton};
use super::sweep::{Fineness, Flare, count, diameter_at, sweep};
use super::{Species, TreeSize};
use crate::error::ParamError;

const LEAN: Stage = Stage::new("assets.tree.lean");

/// The materials of one species' trees.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeMaterials {
    /// Stem at least as thick as the trunk threshold.
    pub stem: MaterialId,
    /// The foot of the stem.
    pub flare: MaterialId,
    /// Limbs at least as thick as the trunk threshold.
    pub limb: MaterialId,
    /// Living wood thinner than the trunk threshold.
    pub branch: MaterialId,
    /// Dead branches thinner than the trunk threshold.
    pub dead: MaterialId,
    /// The pictures of leaves to choose from, with equal chances.
    pub foliage: Vec<FoliageCard>,
}

/// A picture of a leafy twig. The twig enters at (u, v) = (0.5, 0); v grows towards its tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoliageCard {
    /// Its material, with the mask.
    pub material: MaterialId,
    /// Size along u, metres, before the generator's variation.
    pub width_m: f32,
    /// Size along v, metres, before the generator's variation.
    pub height_m: f32,
    /// The opaque share of its mask, 0..=1.
    pub opaque_fraction: f32,
    /// How many layers of leaves lie over each other where it is opaque, at least 1.
    pub leaf_layers: f32,
}

/// How finely to grow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrowthParams {
    /// Wood of at least this radius counts as trunk, metres, 0.005..=0.5.
    pub trunk_radius_m: f64,
    /// At most so many triangles of wood, 3,000..=200,000: twigs are thinned out to keep it.
    pub wood_triangles_max: usize,
    /// At most so many cards, 50..=100,000: they are larger where more would be needed.
    pub cards_max: usize,
}

impl Default for GrowthParams {
    fn default() -> Self {
        Self {
            trunk_radius_m: 0.04,
            wood_triangles_max: 12_000,
            cards_max: 6_000,
        }
    }
}

/// A tree. Its origin is the centre of its foot; the ground is z = 0.
#[derive(Clone, Debug)]
pub struct GrownTree {
    /// The wood.
    pub mesh: Mesh,
    /// The foliage.
    pub cards: Vec<Card>,
    /// The size, measured on what was grown.
    pub size: TreeSize,
    /// Volume of the stem over bark above the ground, m³.
    pub stem_volume_m3: f64,
    /// Radius of the root flare where it meets the ground, metres.
    pub foot_radius_m: f64,
}

/// Grows a tree of a demanded size.
///
/// The same arguments give the same bytes. Diameter, height, crown and leaf area are met as
/// [`GrownTree::size`] shows: the skeleton is grown into the demanded envelope, then stretched by the
/// few per cent that are missing.
///
/// # Errors
/// If a size, material or parameter is out of its range, or the triangle budget is too small for the
/// stem and its limbs.
pub fn grow(
    species: &Species,
    size: &TreeSize,
    materials: &TreeMaterials,
    params: &GrowthParams,
    key: Key,
) -> Result<GrownTree, ParamError> {
    species.check()?;
    size.check()?;
    materials.check()?;
    params.check()?;
    let heading = key.stage(LEAN).rng().range_f64(0.0, TAU);
    let (sin, cos) = libm::sincos(heading);
    let lean = DVec2::new(cos, sin) * libm::tan(size.lean_rad);
    let flare = Flare::new(&species.stem, size, key);
    let leafing = Leafing::new(&species.foliage, &materials.foliage, size, params.cards_max);
    // Leaves reach about this far beyond the wood; the fit below finds out exactly.
    let margin_m = (0.6 * leafing.card_m()).min(0.3 * size.crown_radius_m);
    // Deep enough for the lobes' ends on a slope of 20 degrees.
    let sunk_m = (0.3 + 0.25 * size.dbh_m).min(0.5);

    let most = params.wood_triangles_max;
    let mut density = 1.0;
    while density > 0.03 {
        let mut axes = skeleton(species, size, margin_m, sunk_m, density, lean, key);
        let fineness = Fineness {
            trunk_radius_m: params.trunk_radius_m,
            tolerance: 1.0 / f64::sqrt(density),
        };
        let mut triangles = count(&axes, &radii(&axes, species, size), fineness);
        if triangles <= most {
            let mut leaves = leaves(&axes, &leafing, key);
            fit(&mut axes, &mut leaves, size, lean);
            let radii = radii(&axes, species, size);
            let (mesh, stem) = sweep(&axes, &radii, &flare, materials, fineness);
            // The fit can bend a joint enough to need a ring more.
            triangles = mesh.triangles.len();
            if triangles <= most {
                return Ok(finish(
                    species,
                    size,
                    materials,
                    &flare,
                    Parts {
                        axes,
                        leaves,
                        mesh,
                        stem,
                        lean,
                    },
                ));
            }
        }
        density *= (0.97 * libm::pow(most as f64 / triangles as f64, 0.7)).max(0.4);
    }
    let allowed = "enough for this tree's stem and limbs: at least several thousand for a big oak";
    Err(ParamError::new("wood_triangles_max", most, allowed))
}

/// What a tree is made from.
struct Parts {
    axes: Vec<Axis>,
    leaves: Vec<Leaf>,
    mesh: Mesh,
    stem: Range<usize>,
    lean: DVec2,
}

/// Measures the tree.
fn finish(
    species: &Species,
    size: &TreeSize,
    materials: &TreeMaterials,
    flare: &Flare,
    parts: Parts,
) -> GrownTree {
    let Parts {
        axes,
        leaves,
        mesh,
        stem,
        lean,
    } = parts;
    let crown = Crown::measure(&axes, &leaves, lean);
    let silhouette = silhouette_m2(&leaves, &materials.foliage);
    let end = axes[0].points[axes[0].points.len() - 1];
    GrownTree {
        size: TreeSize {
            dbh_m: diameter_at(&mesh, stem.clone(), BREAST_M),
            height_m: crown.top_m,
            crown_base_m: crown.base_m,
            crown_radius_m: crown.radius_m,
            leaf_area_m2: silhouette / species.foliage.silhouette_factor,
            lean_rad: libm::atan(end.truncate().length() / end.z),
        },
        stem_volume_m3: volume_m3(&mesh, stem, end.z),
        foot_radius_m: species.stem.taper.radius_m(size, 0.0) * flare.greatest(),
        cards: leaves.iter().map(|l| l.card(&materials.foliage)).collect(),
        mesh,
    }
}

impl TreeSize {
    fn check(&self) -> Result<(), ParamError> {
        let range = ParamError::check_range;
        range("size.dbh_m", self.dbh_m, 0.03, 2.0)?;
        range("size.height_m", self.height_m, 2.5, 70.0)?;
        range(
            "size.crown_base_m",
            self.crown_base_m,
            0.1,
            0.9 * self.height_m,
        )?;
        range("size.crown_radius_m", self.crown_radius_m, 0.3, 15.0)?;
        range("size.leaf_area_m2", self.leaf_area_m2, 0.1, 5_000.0)?;
        range("size.lean_rad", self.lean_rad, 0.0, 0.35)
    }
}

impl TreeMaterials {
    fn check(&self) -> Result<(), ParamError> {
        if self.foliage.is_empty() {
            return Err(ParamError::new("foliage", "[]", "at least one card"));
        }
        for (i, card) in self.foliage.iter().enumerate() {
            let range = |name: &str, value: f32, low, high| {
                ParamError::check_range(format!("foliage[{i}].{name}"), f64::from(value), low, high)
            };
            range("width_m", card.width_m, 0.02, 3.0)?;
            range("height_m", card.height_m, 0.02, 3.0)?;
            range("opaque_fraction", card.opaque_fraction, 0.01, 1.0)?;
            range("leaf_layers", card.leaf_layers, 1.0, 10.0)?;
        }
        Ok(())
    }
}

impl GrowthParams {
    fn check(&self) -> Result<(), ParamError> {
        let range = ParamError::check_range;
        range("trunk_radius_m", self.trunk_radius_m, 0.005, 0.5)?;
        range(
            "wood_triangles_max",
            self.wood_triangles_max as f64,
            3_000.0,
            200_000.0,
        )?;
        range("cards_max", self.cards_max as f64, 50.0, 100_000.0)
    }
}

/// What a crown measures.
struct Crown {
    base_m: f64,
    top_m: f64,
    radius_m: f64,
}

impl Crown {
    /// Directions in which radii are measured.
    const SECTORS: usize = 8;

    fn measure(axes: &[Axis], leaves: &[Leaf], lean: DVec2) -> Self {
        let ends = axes.iter().map(|a| a.points[a.points.len() - 1]);
        let tips = leaves.iter().map(|l| l.at + l.along);
        let top_m = ends.chain(tips.clone()).fold(0.0_f64, |m, p| m.max(p.z));
        let mut heights: Vec<f64> = leaves.iter().map(|l| l.at.z + 0.5 * l.along.z).collect();
        let rank = heights.len() / 50;
        let base_m = if heights.is_empty() {
            top_m
        } else {
            *heights.select_nth_unstable_by(rank, f64::total_cmp).1
        };
        let centre = lean * (0.5 * (base_m + top_m));
        let mut farthest = [0.0_f64; Self::SECTORS];
        for p in tips.chain(leaves.iter().map(|l| l.at)) {
            let off = p.truncate() - centre;
            let turns = libm::atan2(off.y, off.x) / (2.0 * FRAC_PI_4 * 4.0) + 1.0;
            let sector = (turns * Self::SECTORS as f64) as usize % Self::SECTORS;
            farthest[sector] = farthest[sector].max(off.length_squared());
        }
        let radius_m = (farthest.iter().sum::<f64>() / Self::SECTORS as f64).sqrt();
        Self {
            base_m,
            top_m,
            radius_m,
        }
    }
}

/// Stretches axes and leaves so that the crown has the demanded base, top and radius. One map of
/// space moves everything, so what was attached stays attached; below breast height it is the identity.
fn fit(axes: &mut [Axis], leaves: &mut [Leaf], size: &TreeSize, lean: DVec2) {
    for _ in 0..6 {
        let crown = Crown::measure(axes, leaves, lean);
        // A crown that begins at breast height has no stem below it to stretch.
        let (base, wanted_base) = if size.crown_base_m.min(crown.base_m) > BREAST_M + 0.5 {
            let most = (1.3 * (crown.base_m - BREAST_M)).min(0.9 * (size.height_m - BREAST_M));
            (
                crown.base_m,
                (size.crown_base_m - BREAST_M).clamp(0.7 * (crown.base_m - BREAST_M), most)
                    + BREAST_M,
            )
        } else {
            (BREAST_M, BREAST_M)
        };
        let stretch_low = if base > BREAST_M {
            (wanted_base - BREAST_M) / (base - BREAST_M)
        } else {
            1.0
        };
        let stretch_high =
            ((size.height_m - wanted_base) / (crown.top_m - base).max(0.1)).clamp(0.5, 2.0);
        let spread = (size.crown_radius_m / crown.radius_m.max(0.05)).clamp(0.5, 2.0);
        for axis in axes.iter_mut() {
            for p in axis.points.iter_mut().filter(|p| p.z > BREAST_M) {
                let z = if p.z < base {
                    BREAST_M + (p.z - BREAST_M) * stretch_low
                } else {
                    wanted_base + (p.z - base) * stretch_high
                };
                let share = if base > BREAST_M {
                    ((p.z - BREAST_M) / (0.5 * (base - BREAST_M))).min(1.0)
                } else {
                    1.0
                };
                let from_axis = p.truncate() - lean * p.z;
                *p = (lean * z + from_axis * (1.0 + (spread - 1.0) * share)).extend(z);
            }
        }
        for leaf in leaves.iter_mut() {
            leaf.at = axes[leaf.axis].at(leaf.s);
        }
    }
}

/// Volume between the ground and `top_m`, m³: level cuts, trapezoids between.
fn volume_m3(mesh: &Mesh, stem: Range<usize>, top_m: f64) -> f64 {
    const CUTS: u32 = 100;
    let step = top_m / f64::from(CUTS);
    let area = |i: u32| {
        let d = diameter_at(mesh, stem.clone(), step * f64::from(i));
        FRAC_PI_4 * d * d
    };
    step * (1..CUTS).map(area).sum::<f64>() + 0.5 * step * (area(0) + area(CUTS))
}
