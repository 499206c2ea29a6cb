//! The sky view factor under the crowns.

use std::sync::Arc;

use nemoral_raycast::RayScene;
use nemoral_scene::ChunkCoord;
use nemoral_scene::glam::Vec3;
use nemoral_seed::Key;
use nemoral_stand::{REACH_M, SkyViewArea, SkyViewFactor};

use super::object_geometry::ObjectGeometry;
use crate::Error;
use crate::plan::{AnyChunk, Demand, Forest, Hasher, Node, OfWorld, Stage};
use crate::pool::in_pool;
use crate::world::assets::WorldAssets;
use crate::world::ground::ChunkGround;

/// Measures the [`SkyViewFactor`] of a chunk from the trees in it and in its neighbours.
#[derive(Clone, Copy, Debug)]
pub struct SkyViewStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
}

impl Stage<Forest> for SkyViewStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<WorldAssets>,
        Node<ChunkCoord, ChunkGround>,
        AnyChunk<ObjectGeometry>,
    );
    type Output = SkyViewFactor;
    const ID: &'static str = "chunk.sky_view_factor";
    const VERSION: u32 = 2;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { chunk_size_m } = self;
        hasher.write_f64(*chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (assets, ground, objects): (
            Arc<WorldAssets>,
            Arc<ChunkGround>,
            Demand<'_, ObjectGeometry>,
        ),
    ) -> Result<SkyViewFactor, Error> {
        // The number of rings of chunks that covers the reach of the rays.
        let rings = (REACH_M / self.chunk_size_m).ceil() as i32;
        let around: Vec<(i32, i32)> = (-rings..=rings)
            .flat_map(|x| (-rings..=rings).map(move |y| (x, y)))
            .collect();
        let chunks: Vec<ChunkCoord> = around.iter().map(|&(x, y)| at.offset(x, y)).collect();
        let groups = around.iter().zip(objects.all(&chunks)?);
        let offset = |x: i32, y: i32| Vec3::new(x as f32, y as f32, 0.0) * self.chunk_size_m as f32;
        let groups = groups.map(|(&(x, y), objects)| (offset(x, y), Arc::clone(&objects.0)));
        let groups: Vec<_> = groups.collect();
        let area = SkyViewArea {
            origin_m: at.origin_m(self.chunk_size_m),
            side_m: self.chunk_size_m,
            canopy_height_m: assets.mean_height_m(),
        };
        Ok(in_pool(|| {
            let crowns = RayScene::new(groups);
            SkyViewFactor::measure(&area, &*ground, &crowns)
        }))
    }
}
