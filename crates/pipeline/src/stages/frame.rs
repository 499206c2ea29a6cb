//! A frame: the robot's pose, the visible scene, pictures and scans.

use std::sync::Arc;

use nemoral_lidar::ScanRequest;
use nemoral_render::{CameraImages, CameraRenderer, SceneView, View};
use nemoral_scene::LidarPoint;
use nemoral_scene::glam::Vec3;
use nemoral_seed::{Domain, Key};
use nemoral_stand::{SceneObjects, SkyViewFactor};

use super::object_geometry::ObjectGeometry;
use super::undergrowth_geometry::UndergrowthGeometry;
use crate::Error;
use crate::plan::{AnyChunk, Demand, Forest, Hasher, Node, OfWorld, Stage};
use crate::pool::in_pool;
use crate::recording::pose::FramePose;
use crate::recording::scene::{FrameScene, visible_chunks};
use crate::world::assets::WorldAssets;
use crate::world::cameras::CameraRig;
use crate::world::ground::ChunkGround;
use crate::world::lidars::LidarRig;
use crate::world::trajectory::{RobotTrajectory, Surroundings};

const CAMERA: Domain = Domain::new("pipeline.camera");

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
        let size = self.chunk_size_m;
        let position = pose.world_from_body().translation_m.truncate();
        let visible = visible_chunks(position, self.visible_radius_m, size);
        let near = visible_chunks(position, self.undergrowth_radius_m, size);
        let objects = objects.all(&visible)?.into_iter().map(|g| Arc::clone(&g.0));
        let objects = visible.iter().copied().zip(objects);
        let undergrowth = near.iter().zip(undergrowth.all(&near)?);
        let undergrowth =
            undergrowth.filter_map(|(chunk, g)| Some((*chunk, Arc::clone(g.0.as_ref()?))));
        let sky_view = visible.iter().copied().zip(sky_view.all(&visible)?);
        let groups = objects.chain(undergrowth);
        let sky_view = sky_view.collect();
        Ok(in_pool(|| {
            FrameScene::new(pose.chunk, size, groups, sky_view)
        }))
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
    const VERSION: u32 = 7;

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
        let scene_from_body = pose.track.relative_to(scene.origin_m).middle();
        let sky_view = |p: Vec3| scene.sky_view_factor(p);
        let seen = SceneView {
            caster: &*scene.caster,
            instances: Some(&*scene),
            materials: &assets.library.materials,
            sky_visibility: &sky_view,
        };
        let picture = |(i, rig): (usize, &CameraRig)| {
            let mut view = View::new(rig.intrinsics, scene_from_body * rig.body_from_camera);
            view.exposure = rig.exposure;
            view.tone = rig.tone;
            view.noise = rig.noise;
            view.shutter = rig.shutter;
            view.motion = pose.motion.of_mounted(&rig.body_from_camera);
            let mut key = world.domain(CAMERA);
            if i > 0 {
                key = key.domain(Domain::new(&rig.name));
            }
            rig.renderer.render(&seen, &view, key.item(at))
        };
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
        let track = pose.track.relative_to(scene.origin_m);
        let scan = |rig: &LidarRig| {
            let scene_from_lidar = |offset_s: f64| track.at(offset_s) * rig.body_from_lidar;
            rig.scanner.scan(&ScanRequest {
                first_pulse: rig.scanner.first_pulse_at(pose.time_s),
                caster: &*scene.caster,
                materials: &assets.library.materials,
                scene_from_lidar_at: &scene_from_lidar,
                range_model: &rig.noise,
                key: world.domain(Domain::new(&rig.name)).item(at),
            })
        };
        Ok(in_pool(|| rigs.iter().map(scan).collect()))
    }
}
