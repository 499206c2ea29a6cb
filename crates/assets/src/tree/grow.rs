//! Grows a tree of a given size.

use std::f64::consts::TAU;
use std::ops::Range;

use nemoral_scene::glam::DVec2;
use nemoral_scene::{Card, Mesh};
use nemoral_seed::{Domain, Draw, Key};

use super::budget::{triangles, within_budget};
use super::fit::{Crown, fit, set_height};
use super::flare::{Flare, FlareLobe};
use super::foliage::{FoliageDensity, Leaf, leaves, silhouette_m2};
use super::materials::TreeMaterials;
use super::radii::radii;
use super::skeleton::{Axis, BREAST_M, skeleton};
use super::structure::TreeStructure;
use super::sweep::{Tessellation, diameter_at, sweep};
use super::wood::{StemProfile, WoodVolume};
use super::{BarkLook, Species, TreeSize};
use nemoral_scene::ParamError;

const LEAN: Domain = Domain::new("assets.tree.lean");

/// The least density of nodes, relative to the species', that a triangle budget may lead to.
/// Sparser crowns would look thin or clumped.
const SPARSEST: f64 = 0.2;

/// How finely to grow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrowthParams {
    /// Wood of at least this radius counts as trunk, metres, 0.005..=0.5.
    pub trunk_radius_m: f64,
    /// The most triangles of wood, 3,000..=200,000. Where a tree would have more, its twigs are
    /// first made coarser and fewer; then the thinnest wood is left out, beginning with twigs
    /// without leaves. Leaves on wood that is left out stay in their places.
    pub wood_triangles_max: usize,
    /// The most cards, 50..=100,000. Where a tree would have more, the cards are larger, so that
    /// their silhouette is the same.
    pub cards_max: usize,
    /// Where the living crown begins on the side of -x, metres, if light reaches the tree from the
    /// side of +x: from the size's crown base, at which it begins there, up to 0.9 of the height.
    /// `None` if all sides are alike. Dead trees do without it.
    pub shaded_base_m: Option<f64>,
}

impl Default for GrowthParams {
    fn default() -> Self {
        Self {
            trunk_radius_m: 0.04,
            wood_triangles_max: 12_000,
            cards_max: 6_000,
            shaded_base_m: None,
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
    /// The diameters of its stem, up to where the stem ends or forks.
    pub stem: StemProfile,
    /// Volume of all its wood over bark above the ground, dead branches included.
    pub wood: WoodVolume,
    /// Radius of the root flare where it meets the ground, metres.
    pub foot_radius_m: f64,
    /// The lobes of the root flare.
    pub flare_lobes: Vec<FlareLobe>,
    /// Is it alive? A dead tree has no leaves, no crown, and the crown's base at its broken top.
    pub alive: bool,
}

/// Grows a tree of a demanded size.
///
/// The same arguments give the same bytes. Diameter, height, crown and leaf area are met as
/// [`GrownTree::size`] shows: the skeleton is grown into the demanded envelope, then stretched by
/// the few per cent that are missing.
///
/// # Errors
/// If a size, a material or a parameter is out of its range. A budget that is too small is no
/// error: [`GrowthParams`] says what is left out.
pub fn grow(
    species: &Species,
    size: &TreeSize,
    materials: &TreeMaterials,
    params: &GrowthParams,
    key: Key,
) -> Result<GrownTree, ParamError> {
    grow_with_structure(species, size, materials, params, key).map(|(tree, _)| tree)
}

/// The tree of [`grow`] with the graph of its wood.
///
/// # Errors
/// As [`grow`].
pub fn grow_with_structure(
    species: &Species,
    size: &TreeSize,
    materials: &TreeMaterials,
    params: &GrowthParams,
    key: Key,
) -> Result<(GrownTree, TreeStructure), ParamError> {
    check(species, size, materials, params)?;
    let heading = key.domain(LEAN).rng().range_f64(0.0, TAU);
    let (sin, cos) = libm::sincos(heading);
    let lean = DVec2::new(cos, sin) * libm::tan(size.lean_rad);
    let flare = Flare::new(&species.stem, size, key);
    let foliage = FoliageDensity::new(&species.foliage, &materials.foliage, size, params.cards_max);
    // Leaves reach about this far beyond the wood; the fit below finds out exactly.
    let margin_m = (0.6 * foliage.card_m()).min(0.3 * size.crown_radius_m);
    let upper_from_m = species.bark.upper_from_m(size);
    let most = params.wood_triangles_max;
    let mut density = 1.0;
    let demand = (size, params.shaded_base_m);
    let (mut axes, tessellation) = loop {
        let axes = skeleton(species, demand, margin_m, sunk_m(size), density, lean, key);
        let tessellation = Tessellation {
            trunk_radius_m: params.trunk_radius_m,
            tolerance: 1.0 / f64::sqrt(density),
        };
        let triangles = triangles(&axes, &radii(&axes, species, size), tessellation);
        let triangles: usize = triangles.iter().sum();
        // The fit below can bend joints so far that a few more rings are needed.
        if triangles as f64 <= 0.98 * most as f64 || density <= SPARSEST {
            break (axes, tessellation);
        }
        let thinner = (0.96 * libm::pow(most as f64 / triangles as f64, 0.7)).max(0.4);
        density = (density * thinner).max(SPARSEST);
    };
    let mut leaves = leaves(&axes, &foliage, key);
    fit(&mut axes, &mut leaves, size, lean);
    set_height(&mut axes, &mut leaves, size, lean);
    let radii = radii(&axes, species, size);
    let wood = within_budget(most, &axes, &radii, &leaves, tessellation);
    let (mesh, stem) = sweep(&axes, &radii, &flare, materials, upper_from_m, &wood);
    let structure = TreeStructure::new(&axes, &radii);
    let parts = Parts {
        axes,
        leaves,
        mesh,
        stem,
        lean,
    };
    let tree = finish(species, size, materials, &flare, parts, &structure);
    Ok((tree, structure))
}

/// Depth of a stem's foot, metres: deep enough for the lobes' ends on a slope of 40 degrees, as
/// banks along roads have.
pub(super) fn sunk_m(size: &TreeSize) -> f64 {
    0.3 + 0.6 * size.dbh_m
}

/// Checks the arguments of [`grow`].
pub(super) fn check(
    species: &Species,
    size: &TreeSize,
    materials: &TreeMaterials,
    params: &GrowthParams,
) -> Result<(), ParamError> {
    species.check()?;
    size.check()?;
    materials.check()?;
    if let Some(base_m) = params.shaded_base_m {
        let [low, high] = [size.crown_base_m, 0.9 * size.height_m];
        ParamError::check_within("shaded_base_m", base_m, low, high)?;
    }
    params.check()
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
    structure: &TreeStructure,
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
    let stem = stem_profile(&mesh, &stem, &axes[0], crown.top_m);
    GrownTree {
        size: TreeSize {
            dbh_m: stem.diameter_m(BREAST_M),
            height_m: crown.top_m,
            crown_base_m: crown.base_m,
            crown_radius_m: crown.radius_m,
            leaf_area_m2: silhouette / species.foliage.silhouette_factor,
            lean_rad: libm::atan(end.truncate().length() / end.z),
        },
        wood: WoodVolume::of(stem.frustums().chain(structure.branches())),
        stem,
        foot_radius_m: species.stem.taper.radius_m(size, 0.0) * flare.greatest(),
        flare_lobes: flare.lobes(species.stem.taper.radius_m(size, 0.0)),
        cards: leaves.iter().map(|l| l.card(&materials.foliage)).collect(),
        mesh,
        alive: true,
    }
}

impl TreeSize {
    fn check(&self) -> Result<(), ParamError> {
        let range = ParamError::check_within;
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
    /// Height where the upper bark begins, metres; infinite if there is none.
    fn upper_from_m(&self, size: &TreeSize) -> f64 {
        if self.upper.is_some() {
            self.upper_from * size.height_m
        } else {
            f64::INFINITY
        }
    }
}

impl GrowthParams {
    fn check(&self) -> Result<(), ParamError> {
        let range = ParamError::check_within;
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

/// The diameters of a stem of some triangles, whose centre line is `axis`, of a tree whose height
/// is `top_m`: cut where the stem has rings, half-way between them, and at breast height.
pub(super) fn stem_profile(
    mesh: &Mesh,
    stem: &Range<usize>,
    axis: &Axis,
    top_m: f64,
) -> StemProfile {
    let rings_m: Vec<f64> = axis.points.iter().map(|p| p.z).collect();
    let between_m = rings_m.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
    let mut heights_m: Vec<f64> = rings_m.iter().copied().chain(between_m).collect();
    heights_m.extend([0.0, BREAST_M]);
    heights_m.retain(|z| (0.0..=rings_m[rings_m.len() - 1]).contains(z));
    heights_m.sort_by(f64::total_cmp);
    heights_m.dedup();
    let cut = |z: f64| [z, diameter_at(mesh, stem.clone(), z)];
    StemProfile::new(heights_m.into_iter().map(cut).collect(), top_m)
}
