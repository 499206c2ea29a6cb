//! The plants of a world, with an acceleration structure for each shape.

mod measured;
mod prepare;
mod records;

use std::sync::Arc;

use nemoral_assets::{ByKind, Library, LogAsset, PlantKind, SnowMaterials, TreeAsset};
use nemoral_raycast::Blas;
use nemoral_scene::{ChunkCoord, InstancePlace, MaterialId, MaterialLibrary, ObjectKind};
use nemoral_stand::SceneObject;

use self::measured::MeasuredObject;
use super::models::WorldModels;
use super::water::WaterMaterials;

/// Snow that lies.
#[derive(Clone, Debug)]
pub struct LyingSnow {
    pub(crate) materials: SnowMaterials,
    /// Its depth on level ground in the open, metres.
    pub(crate) depth_m: f64,
    /// The share of that depth that lies under crowns.
    pub(crate) under_crowns: f64,
}

/// The library and, in the same order, each shape's acceleration structure.
#[derive(Debug)]
pub struct WorldAssets {
    /// Everything that was grown.
    pub library: Arc<Library>,
    /// The standing trees: living ones, then dead ones, then saplings.
    pub standing: Vec<StandingTree>,
    /// How many of `standing`, from the first on, are followed by as many that are the same trees
    /// grown at the wood's edge; `None` if none grew there.
    pub(crate) with_edge_trees: Option<usize>,
    /// The index in `standing` of the first sapling. Saplings are a layer of their own, and their
    /// weights are relative to each other.
    pub first_sapling: usize,
    /// Of `library.plants`.
    pub plants: ByKind<Vec<Arc<Blas>>>,
    /// The shrubs in full leaf.
    shrubs_in_full_leaf: Vec<Arc<Blas>>,
    /// Whether the season has taken leaves of trees or shrubs away.
    is_leafless: bool,
    /// How often each of the seedlings is chosen, relative to the others.
    pub seedling_weights: Vec<f64>,
    /// Of `library.shed`: wide patches and narrow ones.
    pub shed: Vec<[Vec<Arc<Blas>>; 2]>,
    /// Of `library.deadwood.logs`, then of its `thrown` stems.
    pub logs: Vec<Arc<Blas>>,
    /// Of `library.climbers`: what may grow on each grown tree of `standing`; empty if nothing
    /// climbs.
    pub climbers: Vec<ClimberShapes>,
    /// Of `library.communities`: wide tiles and narrow ones.
    pub communities: Vec<[Vec<Arc<Blas>>; 2]>,
    /// The species and their shares.
    pub shares: Vec<(String, f64)>,
    /// Of each of them the silhouette that its leaves or shoots are drawn with, over their
    /// one-sided leaf area.
    pub(crate) silhouette_factors: Vec<f64>,
    /// Mean diameter of the stand's trees at breast height, metres.
    pub dbh_mean_m: f64,
    /// The trees of the stem map, in its order.
    pub(crate) measured: Vec<MeasuredObject>,
    /// What the stem map calls each of them.
    field_ids: Vec<String>,
    /// The user's models among all these.
    pub(crate) models: WorldModels,
    /// The materials of waters and their beds, if there are any.
    pub water: Option<WaterMaterials>,
    /// The materials of lying snow, if any lies.
    pub(crate) snow: Option<LyingSnow>,
}

/// The shapes of a tree's `TreeClimbers`.
#[derive(Clone, Debug)]
pub struct ClimberShapes {
    /// Ivy that climbs a third of the stem, and ivy that climbs into the crown.
    pub ivy: Vec<Arc<Blas>>,
    /// Moss by the side where it is densest.
    pub moss: Vec<Arc<Blas>>,
    /// Honeysuckle that winds up the stem.
    pub honeysuckle: Option<Arc<Blas>>,
    /// Clematis that hangs from the crown.
    pub clematis: Option<Arc<Blas>>,
    /// Runs of resin on the bark.
    pub resin: Option<Arc<Blas>>,
}

/// A tree that can be placed.
#[derive(Clone, Debug)]
pub struct StandingTree {
    /// The tree.
    pub tree: TreeAsset,
    /// Its acceleration structure.
    pub blas: Arc<Blas>,
    /// The same in full leaf.
    in_full_leaf: Arc<Blas>,
    /// How often it is chosen, relative to the others.
    pub weight: f64,
}

impl WorldAssets {
    /// Mean height of trees without saplings, weighted by how often each is chosen, metres.
    #[must_use]
    pub fn mean_height_m(&self) -> f64 {
        let grown = self.standing[..self.first_sapling].iter();
        let (sum, weight) = grown.fold((0.0, 0.0), |(sum, weight), t| {
            (sum + t.weight * t.tree.size.height_m, weight + t.weight)
        });
        if weight > 0.0 { sum / weight } else { 0.0 }
    }

    /// The tree that a living tree of the stand would be at the wood's edge; `None` for others.
    pub(crate) fn at_edge(&self, asset: usize) -> Option<usize> {
        self.with_edge_trees
            .filter(|&count| asset < count)
            .map(|count| count + asset)
    }

    /// Whether a tree is one that grew up at the wood's edge.
    pub(crate) fn is_at_edge(&self, asset: usize) -> bool {
        (self.with_edge_trees).is_some_and(|count| (count..2 * count).contains(&asset))
    }

    /// An object's shape with its acceleration structure.
    #[must_use]
    pub fn shape(&self, object: &SceneObject) -> &Arc<Blas> {
        match object.kind {
            ObjectKind::Tree => &self.standing[object.asset].blas,
            ObjectKind::Log => &self.logs[object.asset],
            _ => {
                let (kind, number) = self.plant_of(object);
                &self.plants[kind][number]
            }
        }
    }

    /// Which kind an object is of that is neither a tree nor a log, and its number there. The
    /// numbers of rocks in streams follow those of dry ones.
    fn plant_of(&self, object: &SceneObject) -> (PlantKind, usize) {
        let dry = self.plants[PlantKind::Rock].len();
        let kind = match object.kind {
            ObjectKind::Stump => PlantKind::Stump,
            ObjectKind::Shrub => PlantKind::Shrub,
            ObjectKind::RootPlate => PlantKind::RootPlate,
            _ if object.on_trail => PlantKind::TrailStone,
            _ if object.asset < dry => PlantKind::Rock,
            _ => return (PlantKind::WetRock, object.asset - dry),
        };
        (kind, object.asset)
    }

    /// The materials in wet weather, from 0, dry, to 1. The beds of waters are wet in any, and snow
    /// is in none.
    pub(crate) fn wet_materials(&self, wetness: f64) -> MaterialLibrary {
        if wetness <= 0.0 {
            return self.library.materials.clone();
        }
        let beds = self.water.iter().flat_map(|of| [of.gravel, of.mud]);
        let covers = self.snow.iter().flat_map(|of| of.materials.covers());
        let but: Vec<MaterialId> = beds.chain(covers).collect();
        self.library.wet_materials(wetness, &but)
    }

    /// Whether light falls otherwise than in summer: leaves are missing, or snow lies.
    pub(crate) const fn differs_from_summer(&self) -> bool {
        self.is_leafless || self.snow.is_some()
    }

    /// An object's shape in full leaf.
    fn shape_in_full_leaf(&self, object: &SceneObject) -> &Arc<Blas> {
        match object.kind {
            ObjectKind::Tree => &self.standing[object.asset].in_full_leaf,
            ObjectKind::Shrub => &self.shrubs_in_full_leaf[object.asset],
            _ => self.shape(object),
        }
    }

    /// The number of a rock as it is in a stream among the shapes of rocks; those of a user's
    /// models stay as they are.
    pub(crate) fn in_stream(&self, rock: usize) -> usize {
        let [dry, wet] = [PlantKind::Rock, PlantKind::WetRock].map(|kind| self.plants[kind].len());
        if rock < wet { dry + rock } else { rock }
    }

    /// An object placed in its chunk, with its acceleration structure.
    pub(crate) fn instance(
        &self,
        object: &SceneObject,
        chunk: ChunkCoord,
        chunk_size_m: f64,
    ) -> (InstancePlace, Arc<Blas>) {
        let shape = self.shape(object);
        (object.place(chunk, chunk_size_m), Arc::clone(shape))
    }

    /// The same in full leaf.
    pub(crate) fn instance_in_full_leaf(
        &self,
        object: &SceneObject,
        chunk: ChunkCoord,
        chunk_size_m: f64,
    ) -> (InstancePlace, Arc<Blas>) {
        let shape = self.shape_in_full_leaf(object);
        (object.place(chunk, chunk_size_m), Arc::clone(shape))
    }

    /// The share of a species among the trees.
    pub(crate) fn share_of(&self, species: &str) -> f64 {
        let found = self.shares.iter().find(|(name, _)| name == species);
        found.map_or(0.0, |(_, share)| *share)
    }

    /// The number of the species of a tree among [`shares`](Self::shares); `None` for what is not
    /// a tree, and for trees of the user's models.
    pub(crate) fn species_of(&self, object: &SceneObject) -> Option<usize> {
        if object.kind != ObjectKind::Tree {
            return None;
        }
        let species = &self.standing[object.asset].tree.species;
        self.shares.iter().position(|(name, _)| name == species)
    }

    /// The asset of a log.
    fn log(&self, object: &SceneObject) -> &LogAsset {
        let of = &self.library.deadwood;
        let thrown = object.asset.checked_sub(of.logs.len());
        thrown.map_or_else(|| &of.logs[object.asset], |i| &of.thrown[i])
    }
}
