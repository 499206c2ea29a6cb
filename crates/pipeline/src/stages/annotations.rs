//! Annotations of a picture: flow, hidden trunks, boxes.

use nemoral_render::CameraImages;
use nemoral_scene::{Annotations, ChunkCoord};
use nemoral_seed::Key;
use nemoral_stand::SceneObjects;

use crate::Error;
use crate::config::OntologyName;
use crate::plan::{AnyChunk, Forest, Hasher, Node, OfWorld, Stage, Values};
use crate::pool::in_pool;
use crate::recording::annotations::AnnotationRecipe;
use crate::recording::pose::{FramePose, next_body};
use crate::recording::scene::FrameScene;
use crate::world::assets::WorldAssets;
use crate::world::cameras::CameraRig;
use crate::world::chunk_geometry::ObjectGeometry;
use crate::world::chunk_ground::ChunkGround;
use crate::world::trajectory::{RobotTrajectory, Surroundings};
use crate::world::uncovered::{Trunks, UncoveredGeometry};

/// Strips the [`WorldAssets`] to their [`Trunks`].
#[derive(Clone, Debug)]
pub struct TrunkStage {
    pub(crate) ontology: OntologyName,
}

impl Stage<Forest> for TrunkStage {
    type At = ();
    type Inputs = (OfWorld<WorldAssets>,);
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

impl Stage<Forest> for UncoveredGeometryStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<Trunks>,
        OfWorld<WorldAssets>,
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

/// Makes the annotations that the cameras were asked for.
#[derive(Clone, Debug)]
pub struct AnnotationStage(pub(crate) AnnotationRecipe);

impl Stage<Forest> for AnnotationStage {
    type At = u64;
    type Inputs = (
        OfWorld<Vec<CameraRig>>,
        OfWorld<RobotTrajectory>,
        Node<u64, FramePose>,
        Node<u64, FrameScene>,
        Node<u64, Vec<CameraImages>>,
        AnyChunk<ChunkGround>,
        AnyChunk<SceneObjects>,
        AnyChunk<UncoveredGeometry>,
    );
    type Output = Vec<Annotations>;
    const ID: &'static str = "frame.annotations";
    const VERSION: u32 = 2;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.0.fingerprint(hasher);
    }

    fn run(
        &self,
        at: u64,
        _: Key,
        (rigs, trajectory, pose, scene, images, ground, objects, uncovered): Values<'_, Self>,
    ) -> Result<Vec<Annotations>, Error> {
        let next = if rigs.iter().any(|rig| rig.annotations.flow) {
            let surroundings = Surroundings { ground, objects };
            let pictures_s = self.0.pictures_s;
            next_body(at, &trajectory, surroundings, scene.origin_m, pictures_s)?
        } else {
            None
        };
        (self.0).annotate(&rigs, (&pose, &scene, &images), uncovered, next)
    }
}
