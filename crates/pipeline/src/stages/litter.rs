//! The litter of a chunk: its patches, and their geometry.

use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;
use nemoral_stand::{SceneObjects, SkyViewFactor};

use crate::Error;
use crate::plan::{AnyChunkEdge, ForestTypes, Hasher, Node, Stage, Values, WorldEdge};
use crate::world::assets::WorldAssets;
use crate::world::chunk_geometry::{LitterGeometry, ObjectGeometry};
use crate::world::chunk_ground::ChunkGround;
use crate::world::flora::Flora;
use crate::world::litter::{GroundHeights, LitterPatch, Stems, instances};

/// Lays the litter of a chunk among the stems in it and in its neighbours.
#[derive(Clone, Copy, Debug)]
pub struct LitterStage {
    pub(crate) chunk_size_m: f64,
}

impl Stage<ForestTypes> for LitterStage {
    type At = ChunkCoord;
    type Inputs = (
        WorldEdge<Flora>,
        WorldEdge<WorldAssets>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, SkyViewFactor>,
        Node<ChunkCoord, ObjectGeometry>,
        AnyChunkEdge<SceneObjects>,
    );
    type Output = Vec<LitterPatch>;
    const ID: &'static str = "chunk.litter";
    const VERSION: u32 = 4;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { chunk_size_m } = self;
        hasher.write_f64(*chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (flora, assets, ground, sky, geometry, objects): Values<'_, Self>,
    ) -> Result<Vec<LitterPatch>, Error> {
        if !flora.has_litter() {
            return Ok(Vec::new());
        }
        let around: Vec<ChunkCoord> = at.square(1).collect();
        let around = objects.all(&around)?;
        let stems = Stems::new((at, self.chunk_size_m), &around, &assets);
        let mesh = GroundHeights::new(&geometry, &ground, at.origin_m(self.chunk_size_m));
        Ok(flora.litter(at, (&ground, &mesh), &sky, &stems))
    }
}

/// Makes the geometry of a chunk's litter.
#[derive(Clone, Copy, Debug)]
pub struct LitterGeometryStage {
    pub(crate) chunk_size_m: f64,
}

impl Stage<ForestTypes> for LitterGeometryStage {
    type At = ChunkCoord;
    type Inputs = (WorldEdge<WorldAssets>, Node<ChunkCoord, Vec<LitterPatch>>);
    type Output = LitterGeometry;
    const ID: &'static str = "chunk.litter_geometry";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { chunk_size_m } = self;
        hasher.write_f64(*chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (assets, patches): Values<'_, Self>,
    ) -> Result<LitterGeometry, Error> {
        let origin_m = at.origin_m(self.chunk_size_m);
        // Snow buries it.
        if assets.snow.is_some() {
            return Ok(LitterGeometry::new(Vec::new()));
        }
        Ok(LitterGeometry::new(instances(&patches, origin_m, &assets)))
    }
}
