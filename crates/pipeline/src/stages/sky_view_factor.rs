//! The sky view factor under the crowns.

use std::sync::Arc;

use nemoral_raycast::RayScene;
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;
use nemoral_stand::{REACH_M, SkyViewArea, SkyViewFactor};

use crate::Error;
use crate::plan::{AnyChunk, Demand, Forest, Hasher, Node, OfWorld, Stage, Values};
use crate::pool::in_pool;
use crate::recording::scene::chunk_offset_m;
use crate::world::assets::WorldAssets;
use crate::world::chunk_geometry::ObjectGeometry;
use crate::world::ground::ChunkGround;

/// The chunks whose trees may hide the sky from a chunk: as many rings as cover the reach of the
/// rays.
pub(crate) fn chunks_of_trees(
    at: ChunkCoord,
    chunk_size_m: f64,
) -> impl Iterator<Item = ChunkCoord> {
    at.square((REACH_M / chunk_size_m).ceil() as i32)
}

/// Measures under the crowns of the trees in a chunk and in its neighbours.
fn under_crowns(
    at: ChunkCoord,
    chunk_size_m: f64,
    objects: &Demand<'_, ObjectGeometry>,
    measure: impl FnOnce(&RayScene) -> SkyViewFactor + Send,
) -> Result<SkyViewFactor, Error> {
    let around: Vec<ChunkCoord> = chunks_of_trees(at, chunk_size_m).collect();
    let groups = around.iter().zip(objects.all(&around)?);
    let offset = |chunk: &ChunkCoord| chunk_offset_m(*chunk, at, chunk_size_m);
    let groups = groups.map(|(chunk, objects)| (offset(chunk), Arc::clone(&objects.0)));
    let groups: Vec<_> = groups.collect();
    Ok(in_pool(|| measure(&RayScene::new(groups))))
}

/// Measures the [`SkyViewFactor`] of a chunk near the ground, by which plants grow.
#[derive(Clone, Copy, Debug)]
pub struct GroundSkyViewStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
}

impl Stage<Forest> for GroundSkyViewStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<WorldAssets>,
        Node<ChunkCoord, ChunkGround>,
        AnyChunk<ObjectGeometry>,
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
        let area = SkyViewArea {
            origin_m: at.origin_m(self.chunk_size_m),
            side_m: self.chunk_size_m,
            canopy_height_m: assets.mean_height_m(),
        };
        under_crowns(at, self.chunk_size_m, &objects, |crowns| {
            SkyViewFactor::measure_near_ground(&area, &*ground, crowns)
        })
    }
}

/// Measures the rest of the [`SkyViewFactor`] of a chunk, by which cameras see.
#[derive(Clone, Copy, Debug)]
pub struct SkyViewStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
}

impl Stage<Forest> for SkyViewStage {
    type At = ChunkCoord;
    type Inputs = (Node<ChunkCoord, SkyViewFactor>, AnyChunk<ObjectGeometry>);
    type Output = SkyViewFactor;
    const ID: &'static str = "chunk.sky_view_factor";
    const VERSION: u32 = 3;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { chunk_size_m } = self;
        hasher.write_f64(*chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (near_ground, objects): Values<'_, Self>,
    ) -> Result<SkyViewFactor, Error> {
        under_crowns(at, self.chunk_size_m, &objects, |crowns| {
            near_ground.completed(crowns)
        })
    }
}
