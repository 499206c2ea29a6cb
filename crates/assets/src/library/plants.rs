//! Grows what has a [`PlantKind`]: the parts that all kinds share.

use std::sync::Arc;

use nemoral_scene::Prototype;
use nemoral_seed::{Domain, Key};
use rayon::prelude::*;

use super::{AssetParams, PlantAsset, PlantKind, prototype, with_occluders, with_occlusion};
use crate::ambient_occlusion::{MaskCoverage, OcclusionParams, Thickness};
use crate::materials::WorldMaterials;
use crate::plant::shape::Shape;
use crate::tree::{Season, Species};

/// Variants of each kind of patch.
pub(super) const PATCHES: u32 = 16;

/// Grows the i-th of a kind from its own key.
pub(super) type GrowOne<'a> = dyn Fn(u32, Key) -> PlantAsset + Sync + 'a;

/// What all of them are grown from.
pub(super) struct PlantGrower<'a> {
    pub(super) params: &'a AssetParams,
    pub(super) species: &'a [Species],
    pub(super) materials: &'a WorldMaterials,
    pub(super) masks: &'a MaskCoverage,
    /// High summer without one.
    pub(super) season: Option<Season>,
    pub(super) key: Key,
}

impl PlantGrower<'_> {
    /// All of a kind; none if they were not asked for.
    pub(super) fn grow(&self, kind: PlantKind) -> Vec<PlantAsset> {
        let (dry, wet) = (self.materials.stones, self.materials.wet_stones);
        match kind {
            PlantKind::Shrub => self.shrubs(),
            PlantKind::Stump => self.stumps(),
            PlantKind::Rock => self.rocks(None),
            PlantKind::Grass => self.grass(),
            PlantKind::Herbs => self.herbs(),
            PlantKind::Ferns => self.ferns(),
            PlantKind::Seedling => self.seedlings(),
            PlantKind::Litter => self.litter(),
            PlantKind::TrailTuft => self.trail_tufts(),
            PlantKind::StripMat => self.strip_mats(),
            PlantKind::TrailStone => self.stones(Some(dry)),
            PlantKind::TrailRoot => self.trail_roots(),
            PlantKind::Culvert => self.culverts(),
            PlantKind::TrailStep => self.trail_steps(),
            PlantKind::SurfaceRoot => self.surface_roots(),
            PlantKind::StoneBed => self.stone_beds(self.params.wayside.then_some(dry)),
            PlantKind::Bank => self.banks(),
            PlantKind::RootPlate => self.root_plates(),
            PlantKind::Branch => self.branches(),
            PlantKind::Brash => self.brash(),
            PlantKind::IvyCarpet => self.ivy_carpets(),
            PlantKind::WetRock => self.wet_rocks(),
            PlantKind::WetStone => self.stones(wet),
            PlantKind::WetBed => self.stone_beds(wet),
        }
    }

    /// `count` individuals, each from its own key, on all threads.
    pub(super) fn collect(
        &self,
        domain: Domain,
        count: u32,
        grow: &GrowOne<'_>,
    ) -> Vec<PlantAsset> {
        (0..count)
            .into_par_iter()
            .map(|i| grow(i, self.key.domain(domain).item(u64::from(i))))
            .collect()
    }

    /// A shape without leaves.
    pub(super) fn finish(
        &self,
        name: &str,
        number: u32,
        shape: Shape,
        radius_m: f32,
    ) -> PlantAsset {
        asset(
            name,
            prototype(name, number, shape, &self.materials.library),
            radius_m,
        )
    }

    /// The same of wood or stone that stands up from the ground, and hides light from it.
    pub(super) fn upright(
        &self,
        name: &str,
        number: u32,
        shape: Shape,
        (radius_m, thickness): (f32, Thickness),
    ) -> PlantAsset {
        let library = &self.materials.library;
        let shape = prototype(name, number, shape, library);
        let shape = with_occluders(shape, (library, self.masks), thickness);
        asset(name, shape, radius_m)
    }

    /// A shape whose parts, such as leaves, occlude each other and, if they do not lie on it, the
    /// ground.
    pub(super) fn leafy(
        &self,
        name: &str,
        number: u32,
        shape: Shape,
        radius_m: f32,
        occlusion: &OcclusionParams,
    ) -> PlantAsset {
        let library = &self.materials.library;
        let shape = prototype(name, number, shape, library);
        let shape = with_occluders(shape, (library, self.masks), Thickness::Thin);
        asset(name, with_occlusion(shape, self.masks, occlusion), radius_m)
    }

    /// A patch of low plants.
    pub(super) fn patch(&self, name: &str, number: u32, shape: Shape) -> PlantAsset {
        let radius_m = shape.reach_m();
        self.leafy(name, number, shape, radius_m, &OcclusionParams::LOW)
    }
}

fn asset(name: &str, prototype: Prototype, radius_m: f32) -> PlantAsset {
    PlantAsset {
        height_m: f64::from(prototype.bounds().max.z),
        prototype: Arc::new(prototype),
        name: name.to_owned(),
        radius_m: f64::from(radius_m),
    }
}
