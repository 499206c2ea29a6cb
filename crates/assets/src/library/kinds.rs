//! The kinds of plants, and of what else stands or lies on the forest floor.

use std::ops::{Index, IndexMut};
use std::slice::Iter;

/// A kind of what a forest has besides trees, logs, litter by species and closed vegetation. A
/// [`Library`](crate::Library) holds a list of [`PlantAsset`](crate::PlantAsset)s of each.
///
/// What is done to every kind is a loop over [`ALL`](Self::ALL). What differs between kinds is a
/// `match` of all of them: how each grows, and what snow does to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlantKind {
    /// Gorse, heather and bramble.
    Shrub,
    /// Stumps, equally many of each species, species by species, thin ones first.
    Stump,
    /// Rocks, smallest first.
    Rock,
    /// Patches of grass.
    Grass,
    /// Patches of herbs.
    Herbs,
    /// Patches of ferns and bracken.
    Ferns,
    /// Single tree seedlings, species by species, small ones first.
    Seedling,
    /// Patches of fallen twigs, cones and leaves.
    Litter,
    /// Tufts for trails: grass, trodden grass, plantain, clover.
    TrailTuft,
    /// Mats of short grass, plantain and clover, half a metre wide, for strips between ruts.
    StripMat,
    /// Loose stones for trails.
    TrailStone,
    /// Roots that lie across trails, along x.
    TrailRoot,
    /// Mouths of culverts, which open along x.
    Culvert,
    /// Steps of logs across a trail a metre wide, which goes down along y: by
    /// [`TrailSurfaceKind::index`](nemoral_scene::TrailSurfaceKind::index),
    /// [`TRAIL_STEPS`](crate::Library::TRAIL_STEPS) for trails of each kind.
    TrailStep,
    /// Roots that spread over the ground from old trees,
    /// [`SURFACE_ROOTS`](crate::Library::SURFACE_ROOTS) of each species. Each lies along +x and
    /// goes on from a lobe of a root flare that ends at x = 0,
    /// [`ROOT_LOBE_M`](crate::Library::ROOT_LOBE_M) from the middle of its stem.
    SurfaceRoot,
    /// Beds of stones for ditches and edges, a metre wide.
    StoneBed,
    /// What sticks out of slopes that trails have cut, downhill along x: the first half without
    /// roots, the second with them.
    Bank,
    /// The root plate of each of the thrown trees in [`Deadwood`](crate::Deadwood), in the plane
    /// x = 0 with its centre at the origin.
    RootPlate,
    /// Fallen branches and tops, lying at z = 0.
    Branch,
    /// Mats of brash.
    Brash,
    /// Ivy on the ground around climbed trees.
    IvyCarpet,
    /// The [rocks](Self::Rock) in the same order, wet up to some height, as in a stream.
    WetRock,
    /// The [loose stones](Self::TrailStone) in the same order, wet.
    WetStone,
    /// The [beds of stones](Self::StoneBed) in the same order, wet.
    WetBed,
}

impl PlantKind {
    /// All kinds. A library is stored in this order.
    pub const ALL: [Self; 24] = [
        Self::Shrub,
        Self::Stump,
        Self::Rock,
        Self::Grass,
        Self::Herbs,
        Self::Ferns,
        Self::Seedling,
        Self::Litter,
        Self::TrailTuft,
        Self::StripMat,
        Self::TrailStone,
        Self::TrailRoot,
        Self::Culvert,
        Self::TrailStep,
        Self::SurfaceRoot,
        Self::StoneBed,
        Self::Bank,
        Self::RootPlate,
        Self::Branch,
        Self::Brash,
        Self::IvyCarpet,
        Self::WetRock,
        Self::WetStone,
        Self::WetBed,
    ];
}

/// A value for each kind of plants, by kind: `by_kind[PlantKind::Grass]`.
#[derive(Clone, Debug)]
pub struct ByKind<T>([T; PlantKind::ALL.len()]);

impl<T> ByKind<T> {
    /// The values that `of` gives for each kind, asked in the order of [`PlantKind::ALL`].
    #[must_use]
    pub fn new(of: impl FnMut(PlantKind) -> T) -> Self {
        Self(PlantKind::ALL.map(of))
    }

    /// The values in the order of [`PlantKind::ALL`].
    pub fn iter(&self) -> Iter<'_, T> {
        self.0.iter()
    }
}

impl<T> Index<PlantKind> for ByKind<T> {
    type Output = T;

    fn index(&self, kind: PlantKind) -> &T {
        &self.0[kind as usize]
    }
}

impl<T> IndexMut<PlantKind> for ByKind<T> {
    fn index_mut(&mut self, kind: PlantKind) -> &mut T {
        &mut self.0[kind as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_a_value_of_its_own() {
        let mut by_kind = ByKind::new(Some);
        for (kind, value) in PlantKind::ALL.into_iter().zip(by_kind.iter()) {
            assert_eq!((*value, by_kind[kind]), (Some(kind), Some(kind)));
        }
        by_kind[PlantKind::WetBed] = None;
        let left = by_kind.iter().flatten().count();
        assert_eq!(left, PlantKind::ALL.len() - 1);
    }
}
