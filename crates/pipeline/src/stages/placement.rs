//! The placement of rocks and woody plants.

use nemoral_placement::{Placement, Site};
use nemoral_scene::ChunkCoord;
use nemoral_scene::glam::DVec2;
use nemoral_seed::Key;

use crate::plan::{AnyChunkEdge, ForestTypes, Hasher, Node, Stage, Values, WorldEdge};
use crate::world::assets::WorldAssets;
use crate::world::chunk_ground::ChunkGround;
use crate::world::ground::GroundModel;
use crate::world::outcrops::outcrops;
use crate::world::placement::{PlacementRecipe, is_free, woody_sites};
use crate::{Error, InputFiles};

/// Makes the world's [`Placement`].
#[derive(Clone, Debug)]
pub struct PlacementStage(pub(crate) PlacementRecipe);

impl Stage<ForestTypes> for PlacementStage {
    type At = ();
    type Inputs = (WorldEdge<WorldAssets>, WorldEdge<GroundModel>);
    type Output = Placement;
    const ID: &'static str = "world.placement";
    const VERSION: u32 = 4;

    fn fingerprint(&self, hasher: &mut Hasher) {
        InputFiles::default().encode(hasher, &self.0);
    }

    fn run(
        &self,
        (): (),
        world: Key,
        (assets, ground): Values<'_, Self>,
    ) -> Result<Placement, Error> {
        self.0.make(&assets, &ground, world)
    }
}

/// The rocks of a chunk of phase `N`, which avoid those of neighbours in lower phases.
#[derive(Clone, Copy, Debug)]
pub struct RockPhaseStage<const N: usize>;

impl<const N: usize> Stage<ForestTypes> for RockPhaseStage<N> {
    type At = ChunkCoord;
    type Inputs = (
        WorldEdge<Placement>,
        Node<ChunkCoord, ChunkGround>,
        [AnyChunkEdge<Vec<Site>>; N],
    );
    type Output = Vec<Site>;
    const ID: &'static str = "chunk.rocks.phase";
    const VERSION: u32 = 3;

    fn fingerprint(&self, hasher: &mut Hasher) {
        hasher.write_u64(N as u64);
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (placement, ground, lower): Values<'_, Self>,
    ) -> Result<Vec<Site>, Error> {
        let neighbours = Placement::lower_phase_neighbours(at)
            .into_iter()
            .map(|c| lower[usize::from(Placement::phase(c))].at(c))
            .collect::<Result<Vec<_>, _>>()?;
        let slices: Vec<&[Site]> = neighbours.iter().map(|n| n.as_slice()).collect();
        let allowed = |p: DVec2, r: f64| is_free(&ground, p, r);
        Ok(placement.rocks(at, &allowed, &slices))
    }
}

/// The rocks of any chunk: those of its phase, then those that crop out.
#[derive(Clone, Copy, Debug)]
pub struct RockStage {
    pub(crate) outcrops: f64,
    pub(crate) chunk_size_m: f64,
}

impl Stage<ForestTypes> for RockStage {
    type At = ChunkCoord;
    type Inputs = (
        WorldEdge<Placement>,
        Node<ChunkCoord, ChunkGround>,
        [AnyChunkEdge<Vec<Site>>; 4],
    );
    type Output = Vec<Site>;
    const ID: &'static str = "chunk.rocks";
    const VERSION: u32 = 2;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self {
            outcrops,
            chunk_size_m,
        } = self;
        hasher.write_f64(*outcrops);
        hasher.write_f64(*chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        world: Key,
        (placement, ground, phases): Values<'_, Self>,
    ) -> Result<Vec<Site>, Error> {
        let mut rocks = phases[usize::from(Placement::phase(at))].at(at)?.to_vec();
        let varieties = &placement.params().rocks.varieties;
        let of = (self.outcrops, self.chunk_size_m);
        rocks.extend(outcrops(at, world, of, varieties, &ground)?);
        Ok(rocks)
    }
}

/// The trees, stumps and shrubs of a chunk, and last its part of a stem map.
#[derive(Clone, Copy, Debug)]
pub struct WoodyStage;

impl Stage<ForestTypes> for WoodyStage {
    type At = ChunkCoord;
    type Inputs = (
        WorldEdge<Placement>,
        Node<ChunkCoord, ChunkGround>,
        AnyChunkEdge<Vec<Site>>,
    );
    type Output = Vec<Site>;
    const ID: &'static str = "chunk.woody";
    const VERSION: u32 = 6;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(
        &self,
        at: ChunkCoord,
        world: Key,
        (placement, ground, rocks): Values<'_, Self>,
    ) -> Result<Vec<Site>, Error> {
        let around = rocks.joined(at.square(1))?;
        Ok(woody_sites(at, world, &placement, &ground, &around))
    }
}
