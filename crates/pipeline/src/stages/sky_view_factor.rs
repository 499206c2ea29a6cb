//! The sky view factor under the crowns.

use std::sync::Arc;

use nemoral_raycast::{Group, RayScene};
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;
use nemoral_stand::{REACH_M, SkyViewArea, SkyViewFactor};

use crate::Error;
use crate::plan::{AnyChunkEdge, Demand, ForestTypes, Hasher, Node, Stage, Values, WorldEdge};
use crate::pool::in_pool;
use crate::recording::scene::chunk_offset_m;
use crate::world::assets::WorldAssets;
use crate::world::chunk_geometry::ObjectGeometry;
use crate::world::chunk_ground::ChunkGround;
use crate::world::snow::SnowCover;

/// The chunks whose trees may hide the sky from a chunk: as many rings as cover the reach of the
/// rays.
pub(crate) fn chunks_of_trees(
    at: ChunkCoord,
    chunk_size_m: f64,
) -> impl Iterator<Item = ChunkCoord> {
    at.square((REACH_M / chunk_size_m).ceil() as i32)
}

/// The square of a chunk.
fn area(at: ChunkCoord, chunk_size_m: f64, assets: &WorldAssets) -> SkyViewArea {
    SkyViewArea {
        origin_m: at.origin_m(chunk_size_m),
        side_m: chunk_size_m,
        canopy_height_m: assets.mean_height_m(),
    }
}

/// The trees in a chunk and in its neighbours, as `of` has them.
fn crowns(
    at: ChunkCoord,
    chunk_size_m: f64,
    objects: &Demand<'_, ObjectGeometry>,
    of: impl Fn(&ObjectGeometry) -> &Arc<Group>,
) -> Result<RayScene, Error> {
    let around: Vec<ChunkCoord> = chunks_of_trees(at, chunk_size_m).collect();
    let groups = around.iter().zip(objects.all(&around)?);
    let offset = |chunk: &ChunkCoord| chunk_offset_m(*chunk, at, chunk_size_m);
    let groups = groups.map(|(chunk, objects)| (offset(chunk), Arc::clone(of(&objects))));
    let groups: Vec<_> = groups.collect();
    Ok(in_pool(|| RayScene::new(groups)))
}

/// Measures the [`SkyViewFactor`] of a chunk near the ground in summer, by which plants grow.
#[derive(Clone, Copy, Debug)]
pub struct GroundSkyViewStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
}

impl Stage<ForestTypes> for GroundSkyViewStage {
    type At = ChunkCoord;
    type Inputs = (
        WorldEdge<WorldAssets>,
        Node<ChunkCoord, ChunkGround>,
        AnyChunkEdge<ObjectGeometry>,
    );
    type Output = SkyViewFactor;
    const ID: &'static str = "chunk.ground_sky_view_factor";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { chunk_size_m } = self;
        hasher.write_f64(*chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (assets, ground, objects): Values<'_, Self>,
    ) -> Result<SkyViewFactor, Error> {
        let area = area(at, self.chunk_size_m, &assets);
        let crowns = crowns(at, self.chunk_size_m, &objects, ObjectGeometry::in_summer)?;
        Ok(in_pool(|| {
            SkyViewFactor::measure_near_ground(&area, &*ground, &crowns)
        }))
    }
}

/// Measures the rest of the [`SkyViewFactor`] of a chunk, by which cameras see: all of it over
/// snow, or if the season has taken leaves away.
#[derive(Clone, Copy, Debug)]
pub struct SkyViewStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
}

impl Stage<ForestTypes> for SkyViewStage {
    type At = ChunkCoord;
    type Inputs = (
        WorldEdge<WorldAssets>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, SkyViewFactor>,
        AnyChunkEdge<ObjectGeometry>,
    );
    type Output = SkyViewFactor;
    const ID: &'static str = "chunk.sky_view_factor";
    const VERSION: u32 = 4;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { chunk_size_m } = self;
        hasher.write_f64(*chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (assets, ground, near_ground, objects): Values<'_, Self>,
    ) -> Result<SkyViewFactor, Error> {
        let crowns = crowns(at, self.chunk_size_m, &objects, |objects| &objects.group)?;
        let area = area(at, self.chunk_size_m, &assets);
        Ok(in_pool(|| match &assets.snow {
            Some(snow) => {
                let snow = SnowCover::new(snow, &ground, &*ground);
                SkyViewFactor::measure(&area, &snow, &crowns)
            }
            None if assets.differs_from_summer() => {
                SkyViewFactor::measure(&area, &*ground, &crowns)
            }
            None => near_ground.completed(&crowns),
        }))
    }
}
