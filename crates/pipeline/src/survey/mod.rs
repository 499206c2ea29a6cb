//! What a forest inventory of a part of a forest would find.

mod files;

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use nemoral_mensuration::{AreaProfile, CanopyMaps, CanopyScene, CellRays, MapGrid, ShapeAreas};
use nemoral_raycast::{Group, RayScene};
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{ChunkCoord, MaterialLibrary, ObjectId, ParamError, Surface, TreeRecord};
use rayon::prelude::*;

pub use files::InventoryParams;

use crate::export::Rectangle;
use crate::pool::in_pool;
use crate::recording::scene::chunk_offset_m;
use crate::world::object_reach::ObjectReach;
use crate::{Error, Recorder};

/// Low plants of a chunk reach less far over its border, metres.
const LOW_REACH_M: f64 = 5.0;

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
    /// Ground and canopy. Crowns of trees outside reach in.
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
    /// If the rectangle has no area or touches more than [`Recorder::EXPORT_CHUNKS`] chunks with
    /// what reaches into it, a parameter is out of its range, or chunks cannot be made.
    pub fn survey(
        &self,
        low_m: DVec2,
        high_m: DVec2,
        params: &SurveyParams,
    ) -> Result<Survey, Error> {
        let invalid = |e: ParamError| Error::request(e.to_string());
        let rectangle = Rectangle::new(low_m, high_m)?;
        let grid = MapGrid::of(low_m, high_m, params.cell_m).map_err(invalid)?;
        let rays = CellRays::a_side(params.rays_a_side).map_err(invalid)?;
        let empty = AreaProfile::new(params.layer_m, &grid).map_err(invalid)?;
        self.prepare()?;
        let runner = self.runner();
        let assets = runner.get(self.forest().assets, ())?;
        let size_m = self.sequence().config.chunks.size_m;
        let with = |reach_m: f64| rectangle.grown(reach_m)?.chunks(size_m);
        let tall = with(ObjectReach::of(&assets).across_m)?;
        let low = with(LOW_REACH_M)?;
        let objects = runner.demand(self.forest().object_geometry);
        let undergrowth = runner.demand(self.forest().undergrowth_geometry);
        let litter = runner.demand(self.forest().litter_geometry);
        let wanted = objects.wanted(&tall).and(undergrowth.wanted(&low));
        wanted.and(litter.wanted(&low)).compute()?;
        let mut groups: Vec<(ChunkCoord, Arc<Group>)> = Vec::new();
        let standing = tall.iter().zip(objects.all(&tall)?);
        groups.extend(standing.map(|(&at, of)| (at, Arc::clone(&of.group))));
        let growing = low.iter().zip(undergrowth.all(&low)?);
        groups.extend(growing.filter_map(|(&at, of)| Some((at, Arc::clone(of.0.as_ref()?)))));
        let lying = low.iter().zip(litter.all(&low)?);
        groups.extend(lying.filter_map(|(&at, of)| Some((at, Arc::clone(of.0.as_ref()?)))));

        let mut grounds = BTreeMap::new();
        for chunk in rectangle.chunks(size_m)? {
            grounds.insert(chunk, runner.get(self.forest().ground, chunk)?);
        }
        let ground_m = |place_m: DVec2| {
            let chunk = ChunkCoord::containing(place_m, size_m);
            grounds[&chunk].height_m(place_m)
        };
        let around = ChunkCoord::containing(low_m, size_m);
        let placed = |(at, group): &(ChunkCoord, Arc<Group>)| {
            (chunk_offset_m(*at, around, size_m), Arc::clone(group))
        };
        let scene = in_pool(|| RayScene::new(groups.iter().map(placed).collect()));
        let tops_m = groups.iter().filter_map(|(_, group)| group.bounds());
        let above_m = tops_m.map(|b| f64::from(b.max.z)).fold(0.0, f64::max) + 1.0;
        let canopy = CanopyScene {
            caster: &scene,
            origin_m: around.origin_m(size_m).extend(0.0),
            above_m,
            ground_m: &ground_m,
        };
        let maps = in_pool(|| CanopyMaps::cast(&canopy, grid, rays));

        let mut leaf_per_silhouette = HashMap::new();
        for &chunk in &tall {
            for object in &runner.get(self.forest().objects, chunk)?.0 {
                if let Some(species) = assets.species_of(object) {
                    let factor = 1.0 / assets.silhouette_factors[species];
                    leaf_per_silhouette.insert(object.object, factor);
                }
            }
        }
        let materials = &assets.library.materials;
        let profile = in_pool(|| {
            let leaves = Leaves {
                size_m,
                materials,
                leaf_per_silhouette: &leaf_per_silhouette,
            };
            leaves.profile(&groups, &maps, &empty)
        });
        let is_inside = |tree: &TreeRecord| tree.position_m.truncate().cmplt(high_m).all();
        let found = self.inventory(low_m, high_m)?;
        let mut trees: Vec<_> = found.into_iter().filter_map(|item| item.tree).collect();
        trees.retain(is_inside);
        self.stay_near(rectangle.middle_m());
        Ok(Survey {
            trees,
            maps,
            profile,
        })
    }
}

/// What the areas of leaves depend on.
struct Leaves<'a> {
    size_m: f64,
    materials: &'a MaterialLibrary,
    /// Of trees of species whose leaves hide each other, the leaf area over its silhouette.
    leaf_per_silhouette: &'a HashMap<ObjectId, f64>,
}

impl Leaves<'_> {
    /// The profile of what grows in chunks. It is summed group by group in their order.
    fn profile(
        &self,
        groups: &[(ChunkCoord, Arc<Group>)],
        maps: &CanopyMaps,
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
        let areas: Vec<ShapeAreas> = shapes
            .par_iter()
            .map(|shape| ShapeAreas::of(shape, self.materials))
            .collect();
        let of_group = |(chunk, group): &(ChunkCoord, Arc<Group>)| {
            let mut profile = empty.clone();
            let origin_m: DVec3 = chunk.origin_m(self.size_m).extend(0.0);
            for (instance, _) in group.instances() {
                let shape = &areas[numbers[&Arc::as_ptr(&instance.prototype).addr()]];
                let factor = self.leaf_per_silhouette.get(&instance.object);
                let ground = (&maps.grid, &maps.ground_m[..]);
                let factor = factor.copied().unwrap_or(1.0);
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
