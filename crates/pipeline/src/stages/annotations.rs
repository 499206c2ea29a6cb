//! Annotations of a picture: flow, hidden trunks, boxes.

use std::sync::Arc;

use nemoral_render::CameraImages;
use nemoral_scene::{Annotations, ChunkCoord, Ontology, RigidTransform, Twist};
use nemoral_seed::Key;
use nemoral_stand::SceneObjects;

use super::object_geometry::ObjectGeometry;
use crate::Error;
use crate::config::Config;
use crate::plan::{AnyChunk, Demand, Forest, Hasher, Node, OfWorld, Stage};
use crate::pool::in_pool;
use crate::recording::annotations::{Annotator, StrippedScene};
use crate::recording::pose::{FramePose, next_body, pictures_s};
use crate::recording::scene::{FrameScene, visible_chunks};
use crate::world::assets::WorldAssets;
use crate::world::cameras::CameraRig;
use crate::world::ground::ChunkGround;
use crate::world::trajectory::{RobotTrajectory, Surroundings};
use crate::world::uncovered::{Trunks, UncoveredGeometry};

/// Strips the [`WorldAssets`] to their [`Trunks`].
#[derive(Clone, Debug)]
pub struct TrunkStage {
    ontology: String,
}

impl TrunkStage {
    /// The stage of a config.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            ontology: config.output.ontology.clone(),
        }
    }
}

impl Stage<Forest> for TrunkStage {
    type At = ();
    type Inputs = (OfWorld<WorldAssets>,);
    type Output = Trunks;
    const ID: &'static str = "world.trunks";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { ontology } = self;
        hasher.write_str(ontology);
    }

    fn run(&self, (): (), _: Key, (assets,): (Arc<WorldAssets>,)) -> Result<Trunks, Error> {
        let ontology = Ontology::by_name(&self.ontology)
            .expect("the config's words are the built-in ontologies");
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
        (trunks, assets, geometry, objects): (
            Arc<Trunks>,
            Arc<WorldAssets>,
            Arc<ObjectGeometry>,
            Arc<SceneObjects>,
        ),
    ) -> Result<UncoveredGeometry, Error> {
        let at = (at, self.chunk_size_m);
        let strip = || UncoveredGeometry::new(at, &trunks, &assets, &geometry.0, &objects);
        Ok(in_pool(strip))
    }
}

/// Makes the annotations that the cameras were asked for.
#[derive(Clone, Debug)]
pub struct AnnotationStage {
    ontology: String,
    chunk_size_m: f64,
    visible_radius_m: f64,
    pictures_s: f64,
}

impl AnnotationStage {
    /// The stage of a config.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            ontology: config.output.ontology.clone(),
            chunk_size_m: config.chunks.size_m,
            visible_radius_m: config.chunks.visible_radius_m,
            pictures_s: pictures_s(config),
        }
    }
}

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
        let Self {
            ontology,
            chunk_size_m,
            visible_radius_m,
            pictures_s,
        } = self;
        hasher.write_str(ontology);
        hasher.write_f64(*chunk_size_m);
        hasher.write_f64(*visible_radius_m);
        hasher.write_f64(*pictures_s);
    }

    fn run(
        &self,
        at: u64,
        _: Key,
        (rigs, trajectory, pose, scene, images, ground, objects, uncovered): (
            Arc<Vec<CameraRig>>,
            Arc<RobotTrajectory>,
            Arc<FramePose>,
            Arc<FrameScene>,
            Arc<Vec<CameraImages>>,
            Demand<'_, ChunkGround>,
            Demand<'_, SceneObjects>,
            Demand<'_, UncoveredGeometry>,
        ),
    ) -> Result<Vec<Annotations>, Error> {
        let any = |f: fn(&CameraRig) -> bool| rigs.iter().any(f);
        let next = if any(|r| r.annotations.flow) {
            let surroundings = Surroundings { ground, objects };
            next_body(
                at,
                &trajectory,
                surroundings,
                scene.origin_m,
                self.pictures_s,
            )?
        } else {
            None
        };
        self.annotate(&rigs, (&pose, &scene, &images), uncovered, next)
    }
}

impl AnnotationStage {
    /// The annotations of pictures that were taken at a pose; `next` is where the body is at the
    /// next frame, if there is one, in the scene.
    pub(crate) fn annotate(
        &self,
        rigs: &[CameraRig],
        (pose, scene, images): (&FramePose, &FrameScene, &[CameraImages]),
        uncovered: Demand<'_, UncoveredGeometry>,
        next: Option<(RigidTransform, Twist)>,
    ) -> Result<Vec<Annotations>, Error> {
        let any = |f: fn(&CameraRig) -> bool| rigs.iter().any(f);
        let stripped = if any(|r| r.annotations.trunks || r.annotations.boxes) {
            let position = pose.world_from_body().translation_m.truncate();
            let visible = visible_chunks(position, self.visible_radius_m, self.chunk_size_m);
            let uncovered = uncovered.all(&visible)?;
            let chunks = visible.iter().zip(&uncovered).map(|(at, u)| (*at, &**u));
            let strip = || StrippedScene::new(pose.chunk, self.chunk_size_m, chunks);
            Some(in_pool(strip))
        } else {
            None
        };
        let ontology = Ontology::by_name(&self.ontology)
            .expect("the config's words are the built-in ontologies");
        let annotator = Annotator {
            ontology: &ontology,
            max_range_m: self.visible_radius_m as f32,
            scene,
            stripped,
            body: (pose.track.relative_to(scene.origin_m).middle(), pose.motion),
            next,
        };
        let pictures = || rigs.iter().zip(images);
        Ok(in_pool(|| {
            let annotated = pictures().map(|(rig, images)| annotator.annotate(rig, images));
            annotated.collect()
        }))
    }
}
