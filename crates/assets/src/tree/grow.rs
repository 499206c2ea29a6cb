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
use super::{BarkLook, Species, TreeSize};
use crate::error::ParamError;

const LEAN: Stage = Stage::new("assets.tree.lean");
const SNAG: Stage = Stage::new("assets.tree.snag");

/// The materials of one species' trees.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeMaterials {
    /// Stem at least as thick as the trunk threshold.
    pub stem: MaterialId,
    /// The stem where its lower bark turns into the upper one; v = 0 below, 1 above.
    pub change: MaterialId,
    /// The stem above that.
    pub upper: MaterialId,
    /// The foot of the stem.
    pub flare: MaterialId,
    /// Limbs at least as thick as the trunk threshold.
    pub limb: MaterialId,
    /// Living wood thinner than the trunk threshold.
    pub branch: MaterialId,
    /// Dead branches thinner than the trunk threshold.
    pub dead: MaterialId,
    /// Dead stems and limbs at least as thick as the trunk threshold.
    pub snag: MaterialId,
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
    /// Is it alive? A dead tree has no leaves, no crown, and the crown's base at its broken top.
    pub alive: bool,
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

    let upper_from_m = species.bark.upper_from_m(size);
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
            set_height(&mut axes, &mut leaves, size, lean);
            let radii = radii(&axes, species, size);
            let (mesh, stem) = sweep(&axes, &radii, &flare, materials, upper_from_m, fineness);
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

/// Grows a standing dead tree: the wood of a tree that had the demanded size, its top broken off, its
/// twigs gone, some of its limbs left as stubs. All wood at least as thick as the trunk threshold is
/// [`TreeMaterials::snag`].
///
/// # Errors
/// As [`grow`].
pub fn grow_snag(
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
    let mut rng = key.stage(SNAG).rng();
    let (sin, cos) = libm::sincos(rng.range_f64(0.0, TAU));
    let lean = DVec2::new(cos, sin) * libm::tan(size.lean_rad);
    let flare = Flare::new(&species.stem, size, key);
    let sunk_m = (0.3 + 0.25 * size.dbh_m).min(0.5);
    let axes = skeleton(species, size, 0.0, sunk_m, 0.5, lean, key);
    let radii = radii(&axes, species, size);
    let stem_top = axes[0].points[axes[0].points.len() - 1].z;
    let broken_m = (size.height_m * rng.range_f64(0.4, 0.9))
        .max(BREAST_M + 0.7)
        .min(0.97 * stem_top);
    let (axes, radii) = weathered(axes, radii, broken_m, &mut rng);
    let fineness = Fineness {
        trunk_radius_m: params.trunk_radius_m,
        tolerance: 1.0,
    };
    let (mesh, stem) = sweep(&axes, &radii, &flare, materials, f64::INFINITY, fineness);
    let most = params.wood_triangles_max;
    if mesh.triangles.len() > most {
        let allowed = "enough for this tree's stem and limbs";
        return Err(ParamError::new("wood_triangles_max", most, allowed));
    }
    let end = axes[0].points[axes[0].points.len() - 1];
    let height_m = mesh.positions.iter().fold(0.0_f32, |m, p| m.max(p.z));
    Ok(GrownTree {
        size: TreeSize {
            dbh_m: diameter_at(&mesh, stem.clone(), BREAST_M),
            height_m: f64::from(height_m),
            crown_base_m: f64::from(height_m),
            crown_radius_m: 0.0,
            leaf_area_m2: 0.0,
            lean_rad: libm::atan(end.truncate().length() / end.z),
        },
        stem_volume_m3: volume_m3(&mesh, stem, end.z),
        foot_radius_m: species.stem.taper.radius_m(size, 0.0) * flare.greatest(),
        cards: Vec::new(),
        mesh,
        alive: false,
    })
}

/// What years leave of axes: the stem up to `broken_m`, most limbs as stubs, a few branches on them.
fn weathered(
    axes: Vec<Axis>,
    radii: Vec<Vec<f64>>,
    broken_m: f64,
    rng: &mut impl Draw,
) -> (Vec<Axis>, Vec<Vec<f64>>) {
    // Where each axis went, if it is still there.
    let mut places: Vec<Option<usize>> = Vec::with_capacity(axes.len());
    let mut kept: (Vec<Axis>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
    for (mut axis, mut r) in axes.into_iter().zip(radii) {
        let chance = [1.0, 0.55, 0.25, 0.0, 0.0][axis.order.min(4)];
        let length = rng.range_f64(0.12, 0.75);
        let stays = rng.chance(chance);
        let parent = axis.parent.map(|(p, s)| places[p].map(|p| (p, s)));
        let hold = match parent {
            None => true,
            Some(None) => false,
            // A parent that was shortened bears nothing beyond its end.
            Some(Some((p, s))) => stays && s <= (kept.0[p].points.len() - 2) as f64,
        };
        if !hold {
            places.push(None);
            continue;
        }
        if axis.order == 0 {
            let whole = axis.points.iter().take_while(|p| p.z < broken_m).count();
            let (a, b) = (axis.points[whole - 1], axis.points[whole]);
            let t = (broken_m - a.z) / (b.z - a.z);
            let (ra, rb) = (r[whole - 1], r[whole]);
            axis.points.truncate(whole);
            r.truncate(whole);
            axis.points.push(a.lerp(b, t));
            r.push(ra + (rb - ra) * t);
        } else {
            let n = ((axis.points.len() as f64 * length) as usize).max(2);
            axis.points.truncate(n);
            r.truncate(n);
        }
        axis.dead = true;
        axis.parent = parent.flatten();
        places.push(Some(kept.0.len()));
        kept.0.push(axis);
        kept.1.push(r);
    }
    kept
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
        alive: true,
    }
}

impl TreeSize {
    fn check(&self) -> Result<(), ParamError> {
        let range = ParamError::check_range;
        range("size.dbh_m", self.dbh_m, 0.005, 2.0)?;
        range("size.height_m", self.height_m, 1.6, 70.0)?;
        range(
            "size.crown_base_m",
            self.crown_base_m,
            0.1,
            0.9 * self.height_m,
        )?;
        range("size.crown_radius_m", self.crown_radius_m, 0.2, 15.0)?;
        range("size.leaf_area_m2", self.leaf_area_m2, 0.1, 5_000.0)?;
        range("size.lean_rad", self.lean_rad, 0.0, 0.35)
    }
}

impl BarkLook {
    /// Height where the upper bark begins, metres; never, without one.
    fn upper_from_m(&self, size: &TreeSize) -> f64 {
        if self.upper.is_some() {
            self.upper_from * size.height_m
        } else {
            f64::INFINITY
        }
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

/// Where the stem may be stretched from: breast height, lower in saplings.
fn fixed_m(size: &TreeSize) -> f64 {
    BREAST_M.min(0.2 * size.height_m)
}

/// Stretches what is above [`fixed_m`] once more, by the one factor that puts the highest of all twigs
/// and leaves exactly at the demanded height.
fn set_height(axes: &mut [Axis], leaves: &mut [Leaf], size: &TreeSize, lean: DVec2) {
    let fixed = fixed_m(size);
    let room = size.height_m - fixed;
    // A leaf longer than the tree above its twig is laid down as far as need be.
    for leaf in leaves.iter_mut() {
        leaf.keep_below(size.height_m);
    }
    let ends = axes.iter().flat_map(|a| &a.points).map(|p| (p.z, 0.0));
    let tips = leaves.iter().map(|l| (l.at.z, l.along.z.max(0.0)));
    let stretch = ends
        .chain(tips)
        .filter(|(z, _)| *z > fixed + 0.05 * room)
        .map(|(z, above)| (room - above) / (z - fixed))
        .fold(f64::INFINITY, f64::min);
    if !stretch.is_finite() {
        return;
    }
    let stretch = stretch.clamp(0.5, 2.0);
    for p in axes.iter_mut().flat_map(|a| &mut a.points) {
        if p.z > fixed {
            let rise = (p.z - fixed) * (stretch - 1.0);
            *p += (lean * rise).extend(rise);
        }
    }
    for leaf in leaves.iter_mut() {
        leaf.at = axes[leaf.axis].at(leaf.s);
    }
}

/// Stretches axes and leaves so that the crown has the demanded base, top and radius. One map of
/// space moves everything, so what was attached stays attached; below breast height it is the identity.
fn fit(axes: &mut [Axis], leaves: &mut [Leaf], size: &TreeSize, lean: DVec2) {
    let fixed = fixed_m(size);
    for _ in 0..6 {
        let crown = Crown::measure(axes, leaves, lean);
        // A crown that begins at breast height has no stem below it to stretch.
        let (base, wanted_base) = if size.crown_base_m.min(crown.base_m) > 1.15 * fixed {
            let most = (1.3 * (crown.base_m - fixed)).min(0.9 * (size.height_m - fixed));
            (
                crown.base_m,
                (size.crown_base_m - fixed).clamp(0.7 * (crown.base_m - fixed), most) + fixed,
            )
        } else {
            (fixed, fixed)
        };
        let stretch_low = if base > fixed {
            (wanted_base - fixed) / (base - fixed)
        } else {
            1.0
        };
        let stretch_high =
            ((size.height_m - wanted_base) / (crown.top_m - base).max(0.1)).clamp(0.4, 2.5);
        let spread = (size.crown_radius_m / crown.radius_m.max(0.05)).clamp(0.5, 2.0);
        for axis in axes.iter_mut() {
            for p in axis.points.iter_mut().filter(|p| p.z > fixed) {
                let z = if p.z < base {
                    fixed + (p.z - fixed) * stretch_low
                } else {
                    wanted_base + (p.z - base) * stretch_high
                };
                let share = if base > fixed {
                    ((p.z - fixed) / (0.5 * (base - fixed))).min(1.0)
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
