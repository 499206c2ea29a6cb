//! A frame: the robot's pose, the visible scene, pictures and scans.

use std::sync::Arc;

use nemoral_render::CameraImages;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, LidarPoint};
use nemoral_seed::Key;
use nemoral_stand::{SceneObjects, SkyViewFactor};

use super::object_geometry::ObjectGeometry;
use super::undergrowth_geometry::UndergrowthGeometry;
use crate::Error;
use crate::plan::{AnyChunk, Demand, Forest, Hasher, Node, OfWorld, Stage};
use crate::pool::in_pool;
use crate::recording::moment::Moment;
use crate::recording::pose::FramePose;
use crate::recording::scene::{FrameScene, visible_chunks};
use crate::world::assets::WorldAssets;
use crate::world::cameras::CameraRig;
use crate::world::ground::ChunkGround;
use crate::world::lidars::LidarRig;
use crate::world::trajectory::{RobotTrajectory, Surroundings};

/// Drives the robot to a frame.
#[derive(Clone, Copy, Debug)]
pub struct PoseStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
    /// How long the pictures take, seconds.
    pub pictures_s: f64,
}

impl Stage<Forest> for PoseStage {
    type At = u64;
    type Inputs = (
        OfWorld<RobotTrajectory>,
        OfWorld<Vec<LidarRig>>,
        AnyChunk<ChunkGround>,
        AnyChunk<SceneObjects>,
    );
    type Output = FramePose;
    const ID: &'static str = "frame.pose";
    const VERSION: u32 = 1;

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
        (trajectory, lidars, ground, objects): (
            Arc<RobotTrajectory>,
            Arc<Vec<LidarRig>>,
            Demand<'_, ChunkGround>,
            Demand<'_, SceneObjects>,
        ),
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

/// Gathers the visible chunks.
#[derive(Clone, Copy, Debug)]
pub struct SceneStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
    /// The distance to which trees and ground are visible.
    pub visible_radius_m: f64,
    /// The distance to which undergrowth is visible.
    pub undergrowth_radius_m: f64,
}

impl Stage<Forest> for SceneStage {
    type At = u64;
    type Inputs = (
        Node<u64, FramePose>,
        AnyChunk<ObjectGeometry>,
        AnyChunk<UndergrowthGeometry>,
        AnyChunk<SkyViewFactor>,
    );
    type Output = FrameScene;
    const ID: &'static str = "frame.scene";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self {
            chunk_size_m,
            visible_radius_m,
            undergrowth_radius_m,
        } = self;
        hasher.write_f64(*chunk_size_m);
        hasher.write_f64(*visible_radius_m);
        hasher.write_f64(*undergrowth_radius_m);
    }

    fn run(
        &self,
        _: u64,
        _: Key,
        (pose, objects, undergrowth, sky_view): (
            Arc<FramePose>,
            Demand<'_, ObjectGeometry>,
            Demand<'_, UndergrowthGeometry>,
            Demand<'_, SkyViewFactor>,
        ),
    ) -> Result<FrameScene, Error> {
        let position = pose.world_from_body().translation_m.truncate();
        self.gather((pose.chunk, position), objects, undergrowth, sky_view)
    }
}

impl SceneStage {
    /// The scene that is visible from a place, around the corner of a chunk.
    pub(crate) fn gather(
        &self,
        (around, place_m): (ChunkCoord, DVec2),
        objects: Demand<'_, ObjectGeometry>,
        undergrowth: Demand<'_, UndergrowthGeometry>,
        sky_view: Demand<'_, SkyViewFactor>,
    ) -> Result<FrameScene, Error> {
        let size = self.chunk_size_m;
        let visible = visible_chunks(place_m, self.visible_radius_m, size);
        let near = visible_chunks(place_m, self.undergrowth_radius_m, size);
        let objects = objects.all(&visible)?.into_iter().map(|g| Arc::clone(&g.0));
        let objects = visible.iter().copied().zip(objects);
        let undergrowth = near.iter().zip(undergrowth.all(&near)?);
        let undergrowth =
            undergrowth.filter_map(|(chunk, g)| Some((*chunk, Arc::clone(g.0.as_ref()?))));
        let sky_view = visible.iter().copied().zip(sky_view.all(&visible)?);
        let sky_view = sky_view.collect();
        let groups = objects.chain(undergrowth);
        Ok(in_pool(|| FrameScene::new(around, size, groups, sky_view)))
    }
}

/// Takes the picture of each camera.
#[derive(Clone, Copy, Debug)]
pub struct ImageStage;

impl Stage<Forest> for ImageStage {
    type At = u64;
    type Inputs = (
        OfWorld<Vec<CameraRig>>,
        OfWorld<WorldAssets>,
        Node<u64, FramePose>,
        Node<u64, FrameScene>,
    );
    type Output = Vec<CameraImages>;
    const ID: &'static str = "frame.images";
    const VERSION: u32 = 8;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(
        &self,
        at: u64,
        world: Key,
        (rigs, assets, pose, scene): (
            Arc<Vec<CameraRig>>,
            Arc<WorldAssets>,
            Arc<FramePose>,
            Arc<FrameScene>,
        ),
    ) -> Result<Vec<CameraImages>, Error> {
        let moment = Moment::new(world, at, &pose, &scene, &assets.library.materials);
        let picture = |(i, rig)| moment.picture(i, rig);
        in_pool(|| rigs.iter().enumerate().map(picture).collect())
    }
}

/// Takes the scan of each LiDAR.
#[derive(Clone, Copy, Debug)]
pub struct ScanStage;

impl Stage<Forest> for ScanStage {
    type At = u64;
    type Inputs = (
        OfWorld<Vec<LidarRig>>,
        OfWorld<WorldAssets>,
        Node<u64, FramePose>,
        Node<u64, FrameScene>,
    );
    type Output = Vec<Vec<LidarPoint>>;
    const ID: &'static str = "frame.scans";
    const VERSION: u32 = 3;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(
        &self,
        at: u64,
        world: Key,
        (rigs, assets, pose, scene): (
            Arc<Vec<LidarRig>>,
            Arc<WorldAssets>,
            Arc<FramePose>,
            Arc<FrameScene>,
        ),
    ) -> Result<Vec<Vec<LidarPoint>>, Error> {
        let moment = Moment::new(world, at, &pose, &scene, &assets.library.materials);
        Ok(in_pool(|| {
            rigs.iter().map(|rig| moment.scan(rig)).collect()
        }))
    }
}
