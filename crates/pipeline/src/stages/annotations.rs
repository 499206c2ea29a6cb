//! Annotations of a picture: flow, hidden trunks, boxes.

use nemoral_render::CameraImages;
use nemoral_scene::{Annotations, ChunkCoord};
use nemoral_seed::Key;
use nemoral_stand::SceneObjects;

use crate::Error;
use crate::config::OntologyName;
use crate::plan::{
    AnyChunkEdge, AnyFrameEdge, ForestTypes, Hasher, Node, Stage, Values, WorldEdge,
};
use crate::pool::in_pool;
use crate::recording::annotations::{AnnotationRecipe, NextFrame};
use crate::recording::pose::FramePose;
use crate::recording::scene::FrameScene;
use crate::world::assets::WorldAssets;
use crate::world::cameras::CameraRig;
use crate::world::chunk_geometry::ObjectGeometry;
use crate::world::trajectory::RobotTrajectory;
use crate::world::uncovered::{Trunks, UncoveredGeometry};

/// Strips the [`WorldAssets`] to their [`Trunks`].
#[derive(Clone, Debug)]
pub struct TrunkStage {
    pub(crate) ontology: OntologyName,
}

impl Stage<ForestTypes> for TrunkStage {
    type At = ();
    type Inputs = (WorldEdge<WorldAssets>,);
    type Output = Trunks;
    const ID: &'static str = "world.trunks";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { ontology } = self;
        hasher.write_str(ontology.word());
    }

    fn run(&self, (): (), _: Key, (assets,): Values<'_, Self>) -> Result<Trunks, Error> {
        let ontology = self.ontology.table();
        in_pool(|| Trunks::new(&assets, &ontology))
    }
}

/// Removes everything that hides the ground and the trunks of a chunk.
#[derive(Clone, Copy, Debug)]
pub struct UncoveredGeometryStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
}

impl Stage<ForestTypes> for UncoveredGeometryStage {
    type At = ChunkCoord;
    type Inputs = (
        WorldEdge<Trunks>,
        WorldEdge<WorldAssets>,
        Node<ChunkCoord, ObjectGeometry>,
        Node<ChunkCoord, SceneObjects>,
    );
    type Output = UncoveredGeometry;
    const ID: &'static str = "chunk.uncovered_geometry";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { chunk_size_m } = self;
        hasher.write_f64(*chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (trunks, assets, geometry, objects): Values<'_, Self>,
    ) -> Result<UncoveredGeometry, Error> {
        let at = (at, self.chunk_size_m);
        let strip = || UncoveredGeometry::new(at, &trunks, &assets, &geometry.group, &objects);
        Ok(in_pool(strip))
    }
}

/// Makes the annotations that the cameras were asked for. Flow alone asks for the next frame: for
/// its pose and for what its cameras see, which that frame needs itself.
#[derive(Clone, Debug)]
pub struct AnnotationStage(pub(crate) AnnotationRecipe);

impl Stage<ForestTypes> for AnnotationStage {
    type At = u64;
    type Inputs = (
        WorldEdge<Vec<CameraRig>>,
        WorldEdge<RobotTrajectory>,
        AnyFrameEdge<FramePose>,
        AnyFrameEdge<FrameScene>,
        Node<u64, Vec<CameraImages>>,
        AnyChunkEdge<UncoveredGeometry>,
    );
    type Output = Vec<Annotations>;
    const ID: &'static str = "frame.annotations";
    const VERSION: u32 = 3;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.0.fingerprint(hasher);
    }

    fn run(
        &self,
        at: u64,
        _: Key,
        (rigs, trajectory, poses, scenes, images, uncovered): Values<'_, Self>,
    ) -> Result<Vec<Annotations>, Error> {
        let has_flow = rigs.iter().any(|rig| rig.annotations.flow);
        let next = if has_flow && trajectory.trajectory.goes_on_after(at) {
            Some(NextFrame {
                pose: poses.at(at + 1)?,
                scene: scenes.at(at + 1)?,
            })
        } else {
            None
        };
        let (pose, scene) = (poses.at(at)?, scenes.at(at)?);
        (self.0).annotate(&rigs, (&pose, &scene, &images), uncovered, next)
    }
}
