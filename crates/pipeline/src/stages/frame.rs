//! A frame: the robot's pose, the visible scene, pictures and scans.

use nemoral_render::CameraImages;
use nemoral_scene::{LidarPoint, MaterialLibrary};
use nemoral_seed::Key;
use nemoral_stand::{GroundOcclusion, SceneObjects, SkyViewFactor};

use crate::Error;
use crate::plan::{AnyChunkEdge, ForestTypes, Hasher, Node, Stage, Values, WorldEdge};
use crate::pool::in_pool;
use crate::recording::pose::FramePose;
use crate::recording::recording_context::RecordingContext;
use crate::recording::scene::FrameScene;
use crate::recording::seen_area::SeenArea;
use crate::recording::visible_reach::VisibleReach;
use crate::world::assets::WorldAssets;
use crate::world::cameras::CameraRig;
use crate::world::chunk_geometry::{LitterGeometry, ObjectGeometry, UndergrowthGeometry};
use crate::world::chunk_ground::ChunkGround;
use crate::world::ground::GroundModel;
use crate::world::lidars::LidarRig;
use crate::world::object_reach::ObjectReach;
use crate::world::trajectory::{RobotTrajectory, Surroundings};

/// Drives the robot to a frame.
#[derive(Clone, Copy, Debug)]
pub struct PoseStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
    /// How long the pictures take, seconds.
    pub pictures_s: f64,
}

impl Stage<ForestTypes> for PoseStage {
    type At = u64;
    type Inputs = (
        WorldEdge<RobotTrajectory>,
        WorldEdge<Vec<LidarRig>>,
        AnyChunkEdge<ChunkGround>,
        AnyChunkEdge<SceneObjects>,
    );
    type Output = FramePose;
    const ID: &'static str = "frame.pose";
    const VERSION: u32 = 2;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self {
            chunk_size_m,
            pictures_s,
        } = self;
        hasher.write_f64(*chunk_size_m);
        hasher.write_f64(*pictures_s);
    }

    fn run(
        &self,
        at: u64,
        _: Key,
        (trajectory, lidars, ground, objects): Values<'_, Self>,
    ) -> Result<FramePose, Error> {
        let lengths = (self.chunk_size_m, self.pictures_s);
        FramePose::new(
            at,
            &trajectory,
            &lidars,
            Surroundings { ground, objects },
            lengths,
        )
    }
}

/// Gathers all visible chunks, whichever way sensors look.
#[derive(Clone, Copy, Debug)]
pub struct SceneStage(pub(crate) VisibleReach);

impl Stage<ForestTypes> for SceneStage {
    type At = u64;
    type Inputs = (
        Node<u64, FramePose>,
        AnyChunkEdge<ObjectGeometry>,
        AnyChunkEdge<UndergrowthGeometry>,
        AnyChunkEdge<LitterGeometry>,
        AnyChunkEdge<SkyViewFactor>,
        AnyChunkEdge<Option<GroundOcclusion>>,
    );
    type Output = FrameScene;
    const ID: &'static str = "frame.scene";
    const VERSION: u32 = 2;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.0.fingerprint(hasher);
    }

    fn run(
        &self,
        _: u64,
        _: Key,
        (pose, objects, undergrowth, litter, sky_view, occlusion): Values<'_, Self>,
    ) -> Result<FrameScene, Error> {
        let geometry = (objects, undergrowth, litter);
        FrameScene::gather(
            &self.0,
            pose.place(),
            None,
            geometry,
            Some((sky_view, occlusion)),
        )
    }
}

/// Gathers the chunks that the cameras see, with the light there.
#[derive(Clone, Copy, Debug)]
pub struct CameraSceneStage(pub(crate) VisibleReach);

impl Stage<ForestTypes> for CameraSceneStage {
    type At = u64;
    type Inputs = (
        WorldEdge<Vec<CameraRig>>,
        WorldEdge<WorldAssets>,
        WorldEdge<GroundModel>,
        Node<u64, FramePose>,
        AnyChunkEdge<ObjectGeometry>,
        AnyChunkEdge<UndergrowthGeometry>,
        AnyChunkEdge<LitterGeometry>,
        AnyChunkEdge<SkyViewFactor>,
        AnyChunkEdge<Option<GroundOcclusion>>,
    );
    type Output = FrameScene;
    const ID: &'static str = "frame.camera_scene";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.0.fingerprint(hasher);
    }

    fn run(
        &self,
        _: u64,
        _: Key,
        (rigs, assets, ground, pose, objects, undergrowth, litter, sky_view, occlusion): Values<
            '_,
            Self,
        >,
    ) -> Result<FrameScene, Error> {
        let seen = SeenArea::of_cameras(&rigs, &pose, (&ground, ObjectReach::of(&assets)), &self.0);
        let geometry = (objects, undergrowth, litter);
        FrameScene::gather(
            &self.0,
            pose.place(),
            Some(&seen),
            geometry,
            Some((sky_view, occlusion)),
        )
    }
}

/// Gathers the chunks that the LiDARs see.
#[derive(Clone, Copy, Debug)]
pub struct LidarSceneStage(pub(crate) VisibleReach);

impl Stage<ForestTypes> for LidarSceneStage {
    type At = u64;
    type Inputs = (
        WorldEdge<Vec<LidarRig>>,
        WorldEdge<WorldAssets>,
        WorldEdge<GroundModel>,
        Node<u64, FramePose>,
        AnyChunkEdge<ObjectGeometry>,
        AnyChunkEdge<UndergrowthGeometry>,
        AnyChunkEdge<LitterGeometry>,
    );
    type Output = FrameScene;
    const ID: &'static str = "frame.lidar_scene";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        self.0.fingerprint(hasher);
    }

    fn run(
        &self,
        _: u64,
        _: Key,
        (rigs, assets, ground, pose, objects, undergrowth, litter): Values<'_, Self>,
    ) -> Result<FrameScene, Error> {
        let seen = SeenArea::of_lidars(&rigs, &pose, (&ground, ObjectReach::of(&assets)), &self.0);
        let geometry = (objects, undergrowth, litter);
        FrameScene::gather(&self.0, pose.place(), Some(&seen), geometry, None)
    }
}

/// Takes the picture of each camera.
#[derive(Clone, Copy, Debug)]
pub struct ImageStage;

impl Stage<ForestTypes> for ImageStage {
    type At = u64;
    type Inputs = (
        WorldEdge<Vec<CameraRig>>,
        WorldEdge<MaterialLibrary>,
        Node<u64, FramePose>,
        Node<u64, FrameScene>,
    );
    type Output = Vec<CameraImages>;
    const ID: &'static str = "frame.images";
    const VERSION: u32 = 18;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(
        &self,
        at: u64,
        world: Key,
        (rigs, materials, pose, scene): Values<'_, Self>,
    ) -> Result<Vec<CameraImages>, Error> {
        let context = RecordingContext::new(world, at, &pose, &scene, &materials);
        let picture = |(i, rig)| context.picture(i, rig);
        in_pool(|| rigs.iter().enumerate().map(picture).collect())
    }
}

/// Takes the scan of each LiDAR.
#[derive(Clone, Copy, Debug)]
pub struct ScanStage;

impl Stage<ForestTypes> for ScanStage {
    type At = u64;
    type Inputs = (
        WorldEdge<Vec<LidarRig>>,
        WorldEdge<MaterialLibrary>,
        Node<u64, FramePose>,
        Node<u64, FrameScene>,
    );
    type Output = Vec<Vec<LidarPoint>>;
    const ID: &'static str = "frame.scans";
    const VERSION: u32 = 11;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(
        &self,
        at: u64,
        world: Key,
        (rigs, materials, pose, scene): Values<'_, Self>,
    ) -> Result<Vec<Vec<LidarPoint>>, Error> {
        let context = RecordingContext::new(world, at, &pose, &scene, &materials);
        Ok(in_pool(|| {
            rigs.iter().map(|rig| context.scan(rig)).collect()
        }))
    }
}
