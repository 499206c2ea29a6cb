//! What a forest inventory of a part of a forest would find.

mod files;
mod plots;

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use nemoral_mensuration::{AreaProfile, CanopyMaps, CanopyScene, CellRays, MapGrid, ShapeAreas};
use nemoral_raycast::{Group, RayScene};
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{
    ChunkCoord, DeadwoodRecord, MaterialId, MaterialLibrary, ObjectId, ParamError, TreeRecord,
};
use rayon::prelude::*;

pub use files::InventoryParams;
pub use plots::InventoryPlots;

use crate::plan::Runner;
use crate::pool::in_pool;
use crate::recording::scene::chunk_offset_m;
use crate::world::object_reach::ObjectReach;
use crate::{Error, Recorder};

/// Patches of undergrowth and litter reach less far over the border of their chunk, metres.
const PATCH_REACH_M: f64 = 5.0;

/// Climbers hang less far out of the crowns that they grow in, metres.
const CLIMBER_REACH_M: f64 = 2.0;

/// How finely a part of a forest is surveyed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurveyParams {
    /// Side of the cells of its maps, metres.
    pub cell_m: f64,
    /// Vertical rays a side of a cell, 1 to 32.
    pub rays_a_side: usize,
    /// Thickness of the layers of its profile, metres.
    pub layer_m: f64,
}

impl Default for SurveyParams {
    /// Cells of half a metre with 25 rays, layers of a metre.
    fn default() -> Self {
        Self {
            cell_m: 0.5,
            rays_a_side: 5,
            layer_m: 1.0,
        }
    }
}

/// What a forest inventory of a rectangle would find.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    /// The trees whose feet are in the rectangle, its west and south borders included, in order of
    /// their ids.
    pub trees: Vec<TreeRecord>,
    /// Other trees whose crowns are the top of a cell, in order of their ids.
    pub trees_outside: Vec<TreeRecord>,
    /// Logs and root plates whose middles are in the rectangle, in order of their ids.
    pub deadwood: Vec<DeadwoodRecord>,
    /// Ground and canopy, with trees as tops alone.
    pub maps: CanopyMaps,
    /// Leaves and wood above the rectangle, in the forest's season.
    pub profile: AreaProfile,
}

impl Recorder {
    /// The corners of a square around the robot's first place, at whole metres.
    ///
    /// # Errors
    /// If that place cannot be found.
    pub fn square_around_start(&self, side_m: f64) -> Result<[DVec2; 2], Error> {
        let place_m = self.pose(0)?.world_from_body().translation_m.truncate();
        let low_m = (place_m - side_m / 2.0).round();
        Ok([low_m, low_m + side_m])
    }

    /// Surveys a rectangle of the world, which must be whole cells.
    ///
    /// # Errors
    /// If the rectangle has no area, is in the coordinates of a site's files, or touches more than
    /// [`Recorder::EXPORT_CHUNKS`] chunks with what reaches into it, a parameter is out of its
    /// range, or chunks cannot be made.
    pub fn survey(
        &self,
        low_m: DVec2,
        high_m: DVec2,
        params: &SurveyParams,
    ) -> Result<Survey, Error> {
        let invalid = |e: ParamError| Error::request(e.to_string());
        let rectangle = self.rectangle(low_m, high_m)?;
        let grid = MapGrid::of(low_m, high_m, params.cell_m).map_err(invalid)?;
        let rays = CellRays::per_side(params.rays_a_side).map_err(invalid)?;
        let empty = AreaProfile::new(params.layer_m, &grid).map_err(invalid)?;
        self.prepare()?;
        let runner = self.runner();
        let assets = runner.get(self.forest().assets, ())?;
        let size_m = self.sequence().config.chunks.size_m;
        let reach_m = ObjectReach::of(&assets).across_m + CLIMBER_REACH_M;
        let chunks = rectangle
            .grown(reach_m.max(PATCH_REACH_M))?
            .chunks(size_m)?;
        let groups = self.groups_of(&runner, &chunks)?;
        let ground = self.ground_of(&runner, rectangle)?;
        let ground_m = |place_m: DVec2| ground.height_m(place_m);
        let around = ChunkCoord::containing(low_m, size_m);
        let placed = |(at, group): &(ChunkCoord, Arc<Group>)| {
            (chunk_offset_m(*at, around, size_m), Arc::clone(group))
        };
        let scene = in_pool(|| RayScene::new(groups.iter().map(placed).collect()));
        let tops_m = groups.iter().filter_map(|(_, group)| group.bounds());
        let above_m = tops_m.map(|b| f64::from(b.max.z)).fold(0.0, f64::max) + 1.0;
        let canopy = CanopyScene {
            caster: &scene,
            materials: &assets.library.materials,
            origin_m: around.origin_m(size_m).extend(0.0),
            above_m,
            ground_m: &ground_m,
        };
        let mut maps = in_pool(|| CanopyMaps::cast(&canopy, grid, rays));

        let Known {
            trees,
            deadwood,
            leaf_per_silhouette,
        } = self.known_of(&runner, &chunks)?;
        let is_tree = |top| trees.binary_search_by_key(&top, |tree| tree.object).is_ok();
        for cell in maps.cells.iter_mut().filter(|cell| !is_tree(cell.top)) {
            cell.top = ObjectId::NONE;
        }
        let tops: BTreeSet<ObjectId> = maps.cells.iter().map(|cell| cell.top).collect();
        let profile = in_pool(|| {
            let snow = assets.snow.iter().flat_map(|snow| snow.materials.covers());
            let leaves = Leaves {
                size_m,
                materials: &assets.library.materials,
                covers: snow.collect(),
                leaf_per_silhouette: &leaf_per_silhouette,
                ground_m: &ground_m,
            };
            leaves.profile(&groups, &grid, &empty)
        });
        let inside = |at_m: DVec3| {
            let place_m = at_m.truncate();
            place_m.cmpge(low_m).all() && place_m.cmplt(high_m).all()
        };
        let (trees, trees_outside): (Vec<_>, Vec<_>) =
            trees.into_iter().partition(|tree| inside(tree.position_m));
        let is_top = |tree: &TreeRecord| tops.contains(&tree.object);
        self.stay_near(rectangle.middle_m());
        Ok(Survey {
            trees,
            trees_outside: trees_outside.into_iter().filter(is_top).collect(),
            deadwood: (deadwood.into_iter())
                .filter(|piece| inside(piece.position_m))
                .collect(),
            maps,
            profile,
        })
    }

    /// All that grows and lies in chunks, each group with its chunk.
    fn groups_of(
        &self,
        runner: &Runner<'_>,
        chunks: &[ChunkCoord],
    ) -> Result<Vec<(ChunkCoord, Arc<Group>)>, Error> {
        let objects = runner.demand(self.forest().object_geometry);
        let undergrowth = runner.demand(self.forest().undergrowth_geometry);
        let litter = runner.demand(self.forest().litter_geometry);
        let batch = objects.batch(chunks).and(undergrowth.batch(chunks));
        batch.and(litter.batch(chunks)).compute()?;
        let mut groups = Vec::new();
        let standing = chunks.iter().zip(objects.all(chunks)?);
        groups.extend(standing.map(|(&at, of)| (at, Arc::clone(&of.group))));
        let growing = chunks.iter().zip(undergrowth.all(chunks)?);
        groups.extend(growing.filter_map(|(&at, of)| Some((at, Arc::clone(of.0.as_ref()?)))));
        let lying = chunks.iter().zip(litter.all(chunks)?);
        groups.extend(lying.filter_map(|(&at, of)| Some((at, Arc::clone(of.0.as_ref()?)))));
        Ok(groups)
    }

    /// What is known of the objects of chunks.
    fn known_of(&self, runner: &Runner<'_>, chunks: &[ChunkCoord]) -> Result<Known, Error> {
        let assets = runner.get(self.forest().assets, ())?;
        let mut known = Known::default();
        for &chunk in chunks {
            for object in &runner.get(self.forest().objects, chunk)?.0 {
                if let Some(species) = assets.species_of(object) {
                    let factor = 1.0 / assets.silhouette_factors[species];
                    known.leaf_per_silhouette.insert(object.object, factor);
                }
                known.trees.extend(assets.tree_record(object));
                known.deadwood.extend(assets.deadwood_record(object));
            }
        }
        known.trees.sort_by_key(|tree| tree.object);
        known.deadwood.sort_by_key(|piece| piece.object);
        Ok(known)
    }
}

/// What is known of objects, in order of their ids.
#[derive(Default)]
struct Known {
    trees: Vec<TreeRecord>,
    deadwood: Vec<DeadwoodRecord>,
    /// Of trees, the leaf area that their drawn leaves or shoots stand for, over its silhouette.
    leaf_per_silhouette: HashMap<ObjectId, f64>,
}

/// What the areas of leaves depend on.
struct Leaves<'a> {
    size_m: f64,
    materials: &'a MaterialLibrary,
    /// The materials of snow on others.
    covers: BTreeSet<MaterialId>,
    /// As in [`Known`].
    leaf_per_silhouette: &'a HashMap<ObjectId, f64>,
    ground_m: &'a (dyn Fn(DVec2) -> f64 + Sync),
}

impl Leaves<'_> {
    /// The profile of what grows in chunks. It is summed group by group in their order.
    fn profile(
        &self,
        groups: &[(ChunkCoord, Arc<Group>)],
        grid: &MapGrid,
        empty: &AreaProfile,
    ) -> AreaProfile {
        let mut numbers = HashMap::new();
        let mut shapes = Vec::new();
        for (instance, _) in groups.iter().flat_map(|(_, group)| group.instances()) {
            numbers
                .entry(Arc::as_ptr(&instance.prototype).addr())
                .or_insert_with(|| {
                    shapes.push(&instance.prototype);
                    shapes.len() - 1
                });
        }
        let is_cover = |material: MaterialId| self.covers.contains(&material);
        let areas: Vec<ShapeAreas> = shapes
            .par_iter()
            .map(|shape| ShapeAreas::of(shape, self.materials, &is_cover))
            .collect();
        let of_group = |(chunk, group): &(ChunkCoord, Arc<Group>)| {
            let mut profile = empty.clone();
            let origin_m: DVec3 = chunk.origin_m(self.size_m).extend(0.0);
            for (instance, _) in group.instances() {
                let shape = &areas[numbers[&Arc::as_ptr(&instance.prototype).addr()]];
                let factor = self.leaf_per_silhouette.get(&instance.object);
                let factor = factor.copied().unwrap_or(1.0);
                let ground: (&MapGrid, &dyn Fn(DVec2) -> f64) = (grid, self.ground_m);
                profile.add((shape, instance), origin_m, ground, factor);
            }
            profile
        };
        let profiles: Vec<AreaProfile> = groups.par_iter().map(of_group).collect();
        let mut whole = empty.clone();
        profiles.iter().for_each(|profile| whole.join(profile));
        whole
    }
}
