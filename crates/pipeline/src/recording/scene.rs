//! The visible scene of a frame.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use nemoral_raycast::{Group, RayScene};
use nemoral_render::SkyVisibility;
use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{ChunkCoord, InstancedScene, PlacedGroup, RayCaster};
use nemoral_stand::{GroundOcclusion, OCCLUSION_MARGIN_M, SkyViewFactor};

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
    light: LightOfChunks,
}

/// What crowns, and whatever is near the ground, leave of the light, by chunk.
#[derive(Default)]
pub(crate) struct LightOfChunks {
    sky_view: BTreeMap<ChunkCoord, Arc<SkyViewFactor>>,
    /// Of chunks where anything stands.
    ground_occlusion: BTreeMap<ChunkCoord, Arc<Option<GroundOcclusion>>>,
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
    /// The scene around the corner of a chunk, from groups in any chunks and their light.
    pub(crate) fn new(
        (around, chunk_size_m): (ChunkCoord, f64),
        chunks: Vec<ChunkCoord>,
        groups: impl Iterator<Item = (ChunkCoord, Arc<Group>)>,
        light: LightOfChunks,
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
            light,
        }
    }

    /// The scene that is visible from a place, around the corner of a chunk; of that, what is in an
    /// area, if one is given. Without the light of chunks, or if it is not lit, nothing is hidden
    /// from the sky; so it is always in chunks of which nothing is looked at.
    pub(crate) fn gather(
        reach: &VisibleReach,
        (around, place_m): (ChunkCoord, DVec2),
        seen: Option<&SeenArea>,
        (objects, undergrowth, litter): Geometry<'_>,
        light: Option<Light<'_>>,
    ) -> Result<Self, Error> {
        let within = |radius_m: f64| {
            let mut chunks = visible_chunks(place_m, radius_m, reach.chunk_size_m);
            chunks.retain(|chunk| seen.is_none_or(|area| area.includes(*chunk)));
            chunks
        };
        let chunks = within(reach.visible_radius_m);
        let low = within(reach.undergrowth_radius_m);
        let littered = reach.litter_radius_m.map(within).unwrap_or_default();
        let light = light.filter(|_| reach.is_lit);
        let mut batch = objects.batch(&chunks).and(undergrowth.batch(&low));
        batch = batch.and(litter.batch(&littered));
        // What only casts shadows is not looked at, so that its own light does not matter.
        let is_looked_at = |chunk: &ChunkCoord| seen.is_none_or(|area| area.shows(*chunk));
        let looked_at = |chunks: &[ChunkCoord]| -> Vec<_> {
            chunks.iter().copied().filter(is_looked_at).collect()
        };
        let [lit, shaded] = [&chunks, &low].map(|chunks| looked_at(chunks));
        if let Some((sky_view, ground_occlusion)) = light {
            batch = batch.and(sky_view.batch(&lit));
            batch = batch.and(ground_occlusion.batch(&shaded));
        }
        batch.compute()?;
        let solid = chunks.iter().zip(objects.all(&chunks)?);
        let mut groups: Vec<_> = solid.map(|(at, g)| (*at, Arc::clone(&g.group))).collect();
        let low = low.iter().zip(undergrowth.all(&low)?);
        groups.extend(low.filter_map(|(at, g)| Some((*at, Arc::clone(g.0.as_ref()?)))));
        let shed = littered.iter().zip(litter.all(&littered)?);
        groups.extend(shed.filter_map(|(at, g)| Some((*at, Arc::clone(g.0.as_ref()?)))));
        let mut of_chunks = LightOfChunks::default();
        if let Some((sky_view, ground_occlusion)) = light {
            let open = sky_view.all(&lit)?;
            of_chunks.sky_view.extend(lit.into_iter().zip(open));
            let occluded = ground_occlusion.all(&shaded)?;
            let occluded = shaded.into_iter().zip(occluded);
            let grown = occluded.filter(|(_, map)| map.is_some());
            of_chunks.ground_occlusion.extend(grown);
        }
        let place = (around, reach.chunk_size_m);
        Ok(in_pool(|| {
            Self::new(place, chunks, groups.into_iter(), of_chunks)
        }))
    }
}

impl SkyVisibility for FrameScene {
    fn sky_view_factor(&self, scene_point: Vec3) -> f32 {
        let world = self.origin_m + scene_point.as_dvec3();
        let chunk = ChunkCoord::containing(world.truncate(), self.chunk_size_m);
        let grid = self.light.sky_view.get(&chunk);
        grid.map_or(1.0, |grid| grid.at(world))
    }

    fn ground_occlusion(&self, scene_point: Vec3) -> f32 {
        let world_m = (self.origin_m + scene_point.as_dvec3()).truncate();
        let [low, high] = [-OCCLUSION_MARGIN_M, OCCLUSION_MARGIN_M]
            .map(|margin_m| ChunkCoord::containing(world_m + margin_m, self.chunk_size_m));
        let near = (low.x..=high.x)
            .flat_map(|x| (low.y..=high.y).map(move |y| ChunkCoord::new(x, y)))
            .filter_map(|chunk| self.light.ground_occlusion.get(&chunk)?.as_ref().as_ref());
        GroundOcclusion::combined(near.map(|map| map.at(world_m)))
    }
}

/// The light of chunks: what crowns leave of the sky, and what is near the ground leaves to it.
pub(crate) type Light<'a> = (
    Demand<'a, SkyViewFactor>,
    Demand<'a, Option<GroundOcclusion>>,
);

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
