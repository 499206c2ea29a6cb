//! The geometry of a chunk's undergrowth, ready for rays.

use nemoral_placement::CoverPoint;
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;
use nemoral_stand::{SceneObjects, SkyViewFactor};

use crate::config;
use crate::plan::{Encode, Encoder, ForestTypes, Hasher, Node, Stage, Values, WorldEdge};
use crate::world::assets::WorldAssets;
use crate::world::chunk_geometry::UndergrowthGeometry;
use crate::world::chunk_ground::ChunkGround;
use crate::world::climbers::Climbing;
use crate::world::ground::GroundModel;
use crate::world::low_plants::LowPlants;
use crate::world::patch::Patch;
use crate::world::surface_roots::surface_roots;
use crate::{Error, InputFiles};

/// Grows the undergrowth of a chunk.
#[derive(Clone, Debug)]
pub struct UndergrowthGeometryStage {
    pub(crate) climbers: config::Climbers,
    /// `trails.banks`.
    pub(crate) banks: f64,
    /// `undergrowth.surface_roots`.
    pub(crate) surface_roots: f64,
    pub(crate) chunk_size_m: f64,
}

impl Encode for UndergrowthGeometryStage {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            climbers,
            banks,
            surface_roots,
            chunk_size_m,
        } = self;
        encoder.field("climbers", climbers);
        encoder.field("banks", banks);
        encoder.field("surface_roots", surface_roots);
        encoder.field("chunk_size_m", chunk_size_m);
    }
}

impl Stage<ForestTypes> for UndergrowthGeometryStage {
    type At = ChunkCoord;
    type Inputs = (
        WorldEdge<WorldAssets>,
        WorldEdge<GroundModel>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, Vec<Patch>>,
        Node<ChunkCoord, Vec<CoverPoint>>,
        Node<ChunkCoord, SceneObjects>,
        Node<ChunkCoord, SkyViewFactor>,
    );
    type Output = UndergrowthGeometry;
    const ID: &'static str = "chunk.undergrowth_geometry";
    const VERSION: u32 = 13;

    fn fingerprint(&self, hasher: &mut Hasher) {
        InputFiles::default().encode(hasher, self);
    }

    fn run(
        &self,
        at: ChunkCoord,
        world: Key,
        (assets, model, ground, patches, seedlings, objects, sky): Values<'_, Self>,
    ) -> Result<UndergrowthGeometry, Error> {
        let dressing = model.trails().map(|t| t.dressing(at)).unwrap_or_default();
        let plants = LowPlants {
            patches: &patches,
            seedlings: &seedlings,
            dressing: &dressing,
            banks: self.banks,
            sky: &sky,
        };
        let place = (at, self.chunk_size_m);
        let mut instances = plants.instances(place, world, &assets, &ground)?;
        if !assets.climbers.is_empty() {
            let climbing = Climbing::new(&self.climbers, world)?;
            instances.extend(climbing.instances(place, &objects, &assets, &ground));
        }
        let (amount, key) = (self.surface_roots, world);
        instances.extend(surface_roots(
            place, key, amount, &objects, &assets, &ground,
        ));
        Ok(UndergrowthGeometry::new(instances))
    }
}
