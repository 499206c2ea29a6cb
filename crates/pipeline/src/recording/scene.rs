//! The visible scene of a frame.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use nemoral_raycast::{Group, RayScene};
use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{ChunkCoord, InstancedScene, PlacedGroup, RayCaster};
use nemoral_stand::SkyViewFactor;

use super::seen_area::SeenArea;
use super::visible_reach::VisibleReach;
use crate::Error;
use crate::plan::Demand;
use crate::pool::in_pool;
use crate::world::chunk_geometry::{LitterGeometry, ObjectGeometry, UndergrowthGeometry};

/// Everything that is visible at a frame or from a place, around the corner of a chunk.
pub struct FrameScene {
    /// The ray caster of the scene. Sensors know nothing else of it, and cast rays in batches.
    pub caster: Arc<dyn RayCaster + Send + Sync>,
    /// The groups that the caster is made of, each with its offset in the scene. Another caster
    /// would be made of them, too.
    pub groups: Vec<(Vec3, Arc<Group>)>,
    /// The chunks whose ground and objects are among them, in order.
    pub chunks: Vec<ChunkCoord>,
    /// The world position of the scene's origin.
    pub origin_m: DVec3,
    chunk_size_m: f64,
    sky_view: BTreeMap<ChunkCoord, Arc<SkyViewFactor>>,
}

impl InstancedScene for FrameScene {
    fn placed_groups(&self) -> Vec<PlacedGroup> {
        let place = |(offset, group): &(Vec3, Arc<Group>)| (*offset, Arc::clone(group) as _);
        self.groups.iter().map(place).collect()
    }
}

impl fmt::Debug for FrameScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FrameScene")
            .field("origin_m", &self.origin_m)
            .finish_non_exhaustive()
    }
}

impl FrameScene {
    /// The scene around the corner of a chunk, from groups in any chunks and their sky view
    /// factors.
    pub(crate) fn new(
        (around, chunk_size_m): (ChunkCoord, f64),
        chunks: Vec<ChunkCoord>,
        groups: impl Iterator<Item = (ChunkCoord, Arc<Group>)>,
        sky_view: BTreeMap<ChunkCoord, Arc<SkyViewFactor>>,
    ) -> Self {
        let groups: Vec<_> = groups
            .map(|(chunk, group)| (chunk_offset_m(chunk, around, chunk_size_m), group))
            .collect();
        Self {
            caster: Arc::new(RayScene::new(groups.clone())),
            groups,
            chunks,
            origin_m: around.origin_m(chunk_size_m).extend(0.0),
            chunk_size_m,
            sky_view,
        }
    }

    /// The scene that is visible from a place, around the corner of a chunk; of that, what is in an
    /// area, if one is given. Without the sky view factors of chunks, or if it is not lit, the
    /// factor is 1 everywhere. In chunks of which nothing is looked at it is always 1.
    pub(crate) fn gather(
        reach: &VisibleReach,
        (around, place_m): (ChunkCoord, DVec2),
        seen: Option<&SeenArea>,
        (objects, undergrowth, litter): Geometry<'_>,
        sky_view: Option<Demand<'_, SkyViewFactor>>,
    ) -> Result<Self, Error> {
        let within = |radius_m: f64| {
            let mut chunks = visible_chunks(place_m, radius_m, reach.chunk_size_m);
            chunks.retain(|chunk| seen.is_none_or(|area| area.includes(*chunk)));
            chunks
        };
        let chunks = within(reach.visible_radius_m);
        let low = within(reach.undergrowth_radius_m);
        let littered = reach.litter_radius_m.map(within).unwrap_or_default();
        let sky_view = sky_view.filter(|_| reach.is_lit);
        let mut wanted = objects.wanted(&chunks).and(undergrowth.wanted(&low));
        wanted = wanted.and(litter.wanted(&littered));
        // What only casts shadows is not looked at, so that its own light does not matter.
        let is_looked_at = |chunk: &ChunkCoord| seen.is_none_or(|area| area.shows(*chunk));
        let looked_at: Vec<_> = chunks.iter().copied().filter(is_looked_at).collect();
        if let Some(sky_view) = sky_view {
            wanted = wanted.and(sky_view.wanted(&looked_at));
        }
        wanted.compute()?;
        let solid = chunks.iter().zip(objects.all(&chunks)?);
        let mut groups: Vec<_> = solid.map(|(at, g)| (*at, Arc::clone(&g.group))).collect();
        let low = low.iter().zip(undergrowth.all(&low)?);
        groups.extend(low.filter_map(|(at, g)| Some((*at, Arc::clone(g.0.as_ref()?)))));
        let shed = littered.iter().zip(litter.all(&littered)?);
        groups.extend(shed.filter_map(|(at, g)| Some((*at, Arc::clone(g.0.as_ref()?)))));
        let mut light = BTreeMap::new();
        if let Some(sky_view) = sky_view {
            let of_chunks = sky_view.all(&looked_at)?;
            light.extend(looked_at.into_iter().zip(of_chunks));
        }
        let place = (around, reach.chunk_size_m);
        Ok(in_pool(|| {
            Self::new(place, chunks, groups.into_iter(), light)
        }))
    }

    /// The sky view factor at a point of the scene.
    #[must_use]
    pub fn sky_view_factor(&self, scene_point: Vec3) -> f32 {
        let world = self.origin_m + scene_point.as_dvec3();
        let chunk = ChunkCoord::containing(world.truncate(), self.chunk_size_m);
        self.sky_view.get(&chunk).map_or(1.0, |grid| grid.at(world))
    }
}

/// The geometry of chunks.
pub(crate) type Geometry<'a> = (
    Demand<'a, ObjectGeometry>,
    Demand<'a, UndergrowthGeometry>,
    Demand<'a, LitterGeometry>,
);

/// The chunks that are visible from a place, in order.
#[must_use]
pub fn visible_chunks(position_m: DVec2, radius_m: f64, chunk_size_m: f64) -> Vec<ChunkCoord> {
    ChunkCoord::within(position_m, radius_m, chunk_size_m)
}

/// The position of a chunk's corner in a scene around the corner of another one.
pub(crate) fn chunk_offset_m(chunk: ChunkCoord, around: ChunkCoord, chunk_size_m: f64) -> Vec3 {
    Vec3::new(
        (chunk.x - around.x) as f32,
        (chunk.y - around.y) as f32,
        0.0,
    ) * chunk_size_m as f32
}
