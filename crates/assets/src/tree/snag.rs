//! Standing dead trees.

use nemoral_scene::glam::DVec2;
use nemoral_seed::{Domain, Draw, Key};
use std::f64::consts::TAU;

use super::budget::within_budget;
use super::flare::Flare;
use super::grow::{GrownTree, GrowthParams, check, stem_profile, sunk_m};
use super::materials::TreeMaterials;
use super::radii::radii;
use super::skeleton::{Axis, BREAST_M, skeleton};
use super::structure::TreeStructure;
use super::sweep::{Tessellation, sweep};
use super::wood::WoodVolume;
use super::{Species, TreeSize};
use nemoral_scene::ParamError;

const SNAG: Domain = Domain::new("assets.tree.snag");

/// Grows a standing dead tree: the wood of a tree that had the demanded size, its top broken off,
/// its twigs gone, some of its limbs left as stubs. All wood at least as thick as the trunk
/// threshold is [`TreeMaterials::snag`].
///
/// # Errors
/// Those of [`super::grow::grow`].
pub fn grow_snag(
    species: &Species,
    size: &TreeSize,
    materials: &TreeMaterials,
    params: &GrowthParams,
    key: Key,
) -> Result<GrownTree, ParamError> {
    check(species, size, materials, params)?;
    let mut rng = key.domain(SNAG).rng();
    let (sin, cos) = libm::sincos(rng.range_f64(0.0, TAU));
    let lean = DVec2::new(cos, sin) * libm::tan(size.lean_rad);
    let flare = Flare::new(&species.stem, size, key);
    let axes = skeleton(species, (size, None), 0.0, sunk_m(size), 0.5, lean, key);
    let radii = radii(&axes, species, size);
    let stem_top = axes[0].points[axes[0].points.len() - 1].z;
    let broken_m = (size.height_m * rng.range_f64(0.4, 0.9))
        .max(BREAST_M + 0.7)
        .min(0.97 * stem_top);
    let (axes, radii) = weathered(axes, radii, broken_m, &mut rng);
    let tessellation = Tessellation {
        trunk_radius_m: params.trunk_radius_m,
        tolerance: 1.0,
    };
    let wood = within_budget(params.wood_triangles_max, &axes, &radii, &[], tessellation);
    let (mesh, stem) = sweep(&axes, &radii, &flare, materials, f64::INFINITY, &wood);
    let end = axes[0].points[axes[0].points.len() - 1];
    let height_m = f64::from(mesh.positions.iter().fold(0.0_f32, |m, p| m.max(p.z)));
    let stem = stem_profile(&mesh, &stem, &axes[0], height_m);
    let structure = TreeStructure::new(&axes, &radii);
    Ok(GrownTree {
        size: TreeSize {
            dbh_m: stem.diameter_m(BREAST_M),
            height_m,
            crown_base_m: height_m,
            crown_radius_m: 0.0,
            leaf_area_m2: 0.0,
            lean_rad: libm::atan(end.truncate().length() / end.z),
        },
        wood: WoodVolume::of(stem.frustums().chain(structure.branches())),
        stem,
        foot_radius_m: species.stem.taper.radius_m(size, 0.0) * flare.greatest(),
        flare_lobes: flare.lobes(species.stem.taper.radius_m(size, 0.0)),
        cards: Vec::new(),
        mesh,
        alive: false,
    })
}

/// The axes that weathering leaves: the stem up to `broken_m`, most limbs as stubs, and a few
/// branches on them.
fn weathered(
    axes: Vec<Axis>,
    radii: Vec<Vec<f64>>,
    broken_m: f64,
    rng: &mut impl Draw,
) -> (Vec<Axis>, Vec<Vec<f64>>) {
    // The new index of each axis that is kept.
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
            // A shortened parent bears nothing beyond its new end.
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
