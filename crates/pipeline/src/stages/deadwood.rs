//! Where logs lie.

use nemoral_placement::Site;
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;
use nemoral_stand::{FallenStem, settle};

use crate::plan::{AnyChunkEdge, ForestTypes, Hasher, Node, Stage, Values, WorldEdge};
use crate::world::assets::WorldAssets;
use crate::world::chunk_ground::ChunkGround;
use crate::world::deadwood::{LogRecipe, Surroundings};
use crate::world::ground::GroundModel;
use crate::{Error, InputFiles};

/// Finds places for the logs of a chunk among what stands in it and its neighbours.
#[derive(Clone, Debug)]
pub struct FallenStemStage(pub(crate) LogRecipe);

impl Stage<ForestTypes> for FallenStemStage {
    type At = ChunkCoord;
    type Inputs = (
        WorldEdge<WorldAssets>,
        WorldEdge<GroundModel>,
        Node<ChunkCoord, ChunkGround>,
        AnyChunkEdge<Vec<Site>>,
        AnyChunkEdge<Vec<Site>>,
    );
    type Output = Vec<FallenStem>;
    const ID: &'static str = "chunk.fallen_stems";
    const VERSION: u32 = 3;

    fn fingerprint(&self, hasher: &mut Hasher) {
        InputFiles::default().encode(hasher, &self.0);
    }

    fn run(
        &self,
        at: ChunkCoord,
        world: Key,
        (assets, model, ground, rocks, woody): Values<'_, Self>,
    ) -> Result<Vec<FallenStem>, Error> {
        if self.0.is_empty() {
            return Ok(Vec::new());
        }
        let mut sites = rocks.joined(at.square(1))?;
        sites.extend(woody.joined(at.square(1))?);
        let around = Surroundings {
            ground: &ground,
            model: &model,
            sites: &sites,
        };
        Ok(self.0.logs(at, world, &assets, &around))
    }
}

/// The logs of a chunk that its neighbours' leave.
#[derive(Clone, Debug)]
pub struct DeadwoodStage {
    pub(crate) is_empty: bool,
}

impl Stage<ForestTypes> for DeadwoodStage {
    type At = ChunkCoord;
    type Inputs = (AnyChunkEdge<Vec<FallenStem>>,);
    type Output = Vec<FallenStem>;
    const ID: &'static str = "chunk.deadwood";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { is_empty } = self;
        hasher.write_u64(u64::from(*is_empty));
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (stems,): Values<'_, Self>,
    ) -> Result<Vec<FallenStem>, Error> {
        if self.is_empty {
            return Ok(Vec::new());
        }
        let around = stems.joined(at.square(1).filter(|near| *near != at))?;
        Ok(settle(&stems.at(at)?, &[&around]))
    }
}
