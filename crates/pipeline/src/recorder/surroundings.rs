//! What is around a place: the ground, the objects, and what is in a robot's way.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, ObjectRecord, Surface, SurfaceSample, TreeRecord};
use nemoral_stand::SceneObject;
use nemoral_trajectory::Obstacle;

use super::Recorder;
use crate::Error;
use crate::chunks::chunks_of;
use crate::world::trajectory::{WATER_REACH_M, obstacles, waters};
use crate::world::windthrow::LOG_REACH_M;

/// An object of an inventory.
#[derive(Clone, Debug)]
pub struct InventoryItem {
    /// The object.
    pub record: ObjectRecord,
    /// What a forester would measure, if it is a tree.
    pub tree: Option<TreeRecord>,
    /// Whether it lies on a trail, as stones do, and is no obstacle.
    pub on_trail: bool,
}

impl Recorder {
    /// The ground at world positions, in their order: height and slope, and the signed distance to
    /// the nearest edge of a trail, metres, negative on one.
    ///
    /// # Errors
    /// If the ground there cannot be made.
    pub fn ground(&self, places_m: &[DVec2]) -> Result<Vec<(SurfaceSample, f64)>, Error> {
        let runner = self.runner();
        let size_m = self.config().chunks.size_m;
        let mut known = BTreeMap::new();
        let mut samples = Vec::with_capacity(places_m.len());
        for &place_m in places_m {
            let chunk = ChunkCoord::containing(place_m, size_m);
            let ground = match known.entry(chunk) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(new) => new.insert(runner.get(self.forest.ground, chunk)?),
            };
            let sample = Surface::sample(&**ground, place_m);
            samples.push((sample, ground.trail_edge_m(place_m)));
        }
        if let Some(&place_m) = places_m.last() {
            self.stay_near(place_m);
        }
        Ok(samples)
    }

    /// The objects whose feet are in a rectangle of the world, borders included, chunk by chunk in
    /// order of their ids.
    ///
    /// # Errors
    /// If their chunks cannot be made, or are more than [`Recorder::INVENTORY_CHUNKS`].
    pub fn inventory(&self, low_m: DVec2, high_m: DVec2) -> Result<Vec<InventoryItem>, Error> {
        self.prepare()?;
        let assets = self.runner().get(self.forest.assets, ())?;
        let mut found = Vec::new();
        self.for_each_object(low_m, high_m, |object| {
            let foot_m = object.position_m.truncate();
            if foot_m.cmpge(low_m).all() && foot_m.cmple(high_m).all() {
                found.push(InventoryItem {
                    record: assets.object_record(object),
                    tree: assets.tree_record(object),
                    on_trail: object.on_trail,
                });
            }
        })?;
        self.stay_near((low_m + high_m) / 2.0);
        Ok(found)
    }

    /// The disks that reach into a rectangle and that a robot must not drive into: a stem, a shrub,
    /// a rock or a pond is one, a log or a stream is a row of them. Culverts have none.
    ///
    /// # Errors
    /// As [`Recorder::inventory`], of the rectangle with what is up to 17 m around it.
    pub fn obstacles(&self, low_m: DVec2, high_m: DVec2) -> Result<Vec<Obstacle>, Error> {
        self.prepare()?;
        let reaches_in = |disk: &Obstacle| {
            let nearest_m = disk.position_m.clamp(low_m, high_m);
            nearest_m.distance(disk.position_m) <= disk.radius_m
        };
        let reach_m = DVec2::splat(LOG_REACH_M);
        let mut found = Vec::new();
        self.for_each_object(low_m - reach_m, high_m + reach_m, |object| {
            found.extend(obstacles(object).filter(reaches_in));
        })?;
        let runner = self.runner();
        if runner.get(self.forest.trajectory, ())?.has_water {
            let reach_m = DVec2::splat(WATER_REACH_M);
            for chunk in self.chunks_in(low_m - reach_m, high_m + reach_m)? {
                let ground = runner.get(self.forest.ground, chunk)?;
                found.extend(waters(&ground, 0.0).filter(reaches_in));
            }
        }
        self.stay_near((low_m + high_m) / 2.0);
        Ok(found)
    }

    /// Visits the objects of all chunks that a rectangle meets.
    fn for_each_object(
        &self,
        low_m: DVec2,
        high_m: DVec2,
        mut visit: impl FnMut(&SceneObject),
    ) -> Result<(), Error> {
        let runner = self.runner();
        for chunk in self.chunks_in(low_m, high_m)? {
            let objects = runner.get(self.forest.objects, chunk)?;
            objects.0.iter().for_each(&mut visit);
        }
        Ok(())
    }

    /// The chunks that a rectangle meets, which may not be too many.
    fn chunks_in(&self, low_m: DVec2, high_m: DVec2) -> Result<Vec<ChunkCoord>, Error> {
        let most = ("rectangle", Self::INVENTORY_CHUNKS);
        chunks_of((low_m, high_m), self.config().chunks.size_m, most)
    }

    /// The most chunks of a rectangle of which an inventory is made.
    pub const INVENTORY_CHUNKS: i64 = 10_000;
}
