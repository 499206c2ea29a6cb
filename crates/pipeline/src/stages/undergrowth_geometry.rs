//! The geometry of a chunk's undergrowth, ready for rays.

use std::sync::Arc;

use nemoral_placement::CoverPoint;
use nemoral_raycast::Group;
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;

use crate::Error;
use crate::plan::{Forest, Hasher, Node, OfWorld, Stage};
use crate::pool::in_pool;
use crate::world::assets::WorldAssets;
use crate::world::flora::Patch;
use crate::world::ground::{ChunkGround, GroundModel};
use crate::world::low_plants::LowPlants;

/// A chunk's undergrowth, seedlings and trail grass; `None` where nothing grows.
#[derive(Debug)]
pub struct UndergrowthGeometry(pub Option<Arc<Group>>);

/// Grows the undergrowth of a chunk.
#[derive(Clone, Copy, Debug)]
pub struct UndergrowthGeometryStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
}

impl Stage<Forest> for UndergrowthGeometryStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<WorldAssets>,
        OfWorld<GroundModel>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, Vec<Patch>>,
        Node<ChunkCoord, Vec<CoverPoint>>,
    );
    type Output = UndergrowthGeometry;
    const ID: &'static str = "chunk.undergrowth_geometry";
    const VERSION: u32 = 3;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { chunk_size_m } = self;
        hasher.write_f64(*chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        world: Key,
        (assets, model, ground, patches, seedlings): (
            Arc<WorldAssets>,
            Arc<GroundModel>,
            Arc<ChunkGround>,
            Arc<Vec<Patch>>,
            Arc<Vec<CoverPoint>>,
        ),
    ) -> Result<UndergrowthGeometry, Error> {
        let dressing = model.trails().map(|t| t.dressing(at)).unwrap_or_default();
        let plants = LowPlants {
            patches: &patches,
            seedlings: &seedlings,
            dressing: &dressing,
        };
        let instances = plants.instances((at, self.chunk_size_m), world, &assets, &ground);
        let is_bare = instances.is_empty();
        let group = (!is_bare).then(|| Arc::new(in_pool(|| Group::build(instances))));
        Ok(UndergrowthGeometry(group))
    }
}
