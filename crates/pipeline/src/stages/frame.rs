//! A frame: where the robot is, what it sees there, and what its sensors make of it.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use nemoral_lidar::ScanRequest;
use nemoral_raycast::{Group, RayScene};
use nemoral_render::{CameraImages, CameraRenderer, SceneView, View};
use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{
    ChunkCoord, InstancedScene, LidarPoint, PlacedGroup, RayCaster, RigidTransform, Twist,
};
use nemoral_seed::{Domain, Key};
use nemoral_trajectory::PoseTrack;

use super::assets::WorldAssets;
use super::chunk::{Low, Solid};
use super::ground::ChunkGround;
use super::guide::{Guide, Land};
use super::openness::Openness;
use super::sensors::{CameraRig, LidarRig, shutter};
use super::things::Things;
use crate::Error;
use crate::config::Config;
use crate::plan::{AnyChunk, Demand, Forest, Hasher, Node, OfWorld, Stage};

const CAMERA: Domain = Domain::new("pipeline.camera");

/// Where the robot is, and how it moves while its LiDAR scans.
#[derive(Debug)]
pub struct FramePose {
    /// The frame's time, seconds: the middle of the exposure and of the scan.
    pub time_s: f64,
    /// World poses of the body about that time.
    pub track: PoseTrack,
    /// How the body moves while cameras with a shutter take their pictures; still for others.
    pub motion: Twist,
    /// The chunk the robot is in: the scene's origin is its corner.
    pub chunk: ChunkCoord,
}

impl FramePose {
    /// The body's world pose at the frame's time.
    #[must_use]
    pub fn world_from_body(&self) -> RigidTransform {
        self.track.middle()
    }
}

/// Drives the robot to a frame.
#[derive(Clone, Copy, Debug)]
pub struct PoseStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
    /// How long the pictures take, seconds.
    pub pictures_s: f64,
}

/// How the body moves about a frame, over the time that pictures take; still if they take none.
///
/// # Errors
/// If the land cannot be made.
pub(super) fn motion(
    guide: &Guide,
    frame: u64,
    pictures_s: f64,
    land: Land<'_>,
) -> Result<Twist, Error> {
    if pictures_s == 0.0 {
        return Ok(Twist::STILL);
    }
    let at = |side: f64| guide.pose(frame, side * pictures_s / 2.0, land);
    Ok(Twist::between(&at(-1.0)?, &at(1.0)?, pictures_s))
}

/// How long the longest picture of a robot's cameras takes, seconds.
#[must_use]
pub fn pictures_s(config: &Config) -> f64 {
    let cameras = config.all_cameras();
    let durations = cameras.map(|(_, camera)| shutter(camera).duration_s());
    durations.fold(0.0, f64::max)
}

impl Stage<Forest> for PoseStage {
    type At = u64;
    type Inputs = (
        OfWorld<Guide>,
        OfWorld<Vec<LidarRig>>,
        AnyChunk<ChunkGround>,
        AnyChunk<Things>,
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
        (guide, lidars, ground, things): (
            Arc<Guide>,
            Arc<Vec<LidarRig>>,
            Demand<'_, ChunkGround>,
            Demand<'_, Things>,
        ),
    ) -> Result<FramePose, Error> {
        if let Some(frames) = guide.frames().filter(|&frames| at >= frames) {
            return Err(Error::request(format!(
                "frame {at}: the path has {frames} poses"
            )));
        }
        let longest_s = lidars
            .iter()
            .map(|l| l.scanner.duration_s())
            .fold(0.0, f64::max);
        let half_s = longest_s / 2.0;
        let land = Land { ground, things };
        let track = PoseTrack::sample(half_s, |offset_s| guide.pose(at, offset_s, land))?;
        let position = track.middle().translation_m.truncate();
        let chunk = ChunkCoord::containing(position, self.chunk_size_m);
        Ok(FramePose {
            time_s: guide.time_s(at),
            track,
            motion: motion(&guide, at, self.pictures_s, land)?,
            chunk,
        })
    }
}

/// What is visible from a frame, around the corner of the robot's chunk.
pub struct FrameScene {
    /// What rays are cast at. Sensors know no more of it, and hand it batches.
    pub caster: Arc<dyn RayCaster + Send + Sync>,
    /// What it is made of, each with its offset in the scene: any other caster would be, too.
    pub groups: Vec<(Vec3, Arc<Group>)>,
    /// Where the scene's origin is in the world.
    pub origin_m: DVec3,
    chunk_size_m: f64,
    openness: BTreeMap<ChunkCoord, Arc<Openness>>,
}

impl InstancedScene for FrameScene {
    fn placed_groups(&self) -> Vec<PlacedGroup> {
        let place = |(offset, group): &(Vec3, Arc<Group>)| (*offset, Arc::clone(group) as _);
        self.groups.iter().map(place).collect()
    }
}

impl fmt::Debug for FrameScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FrameScene")
            .field("origin_m", &self.origin_m)
            .finish_non_exhaustive()
    }
}

impl FrameScene {
    /// Share of the sky seen at a point of the scene.
    #[must_use]
    pub fn openness(&self, scene_point: Vec3) -> f32 {
        let world = self.origin_m + scene_point.as_dvec3();
        let chunk = ChunkCoord::containing(world.truncate(), self.chunk_size_m);
        self.openness.get(&chunk).map_or(1.0, |grid| grid.at(world))
    }
}

/// The chunks that are visible from a place, in order.
#[must_use]
pub fn visible_chunks(position_m: DVec2, radius_m: f64, chunk_size_m: f64) -> Vec<ChunkCoord> {
    ChunkCoord::within(position_m, radius_m, chunk_size_m)
}

/// Gathers the visible chunks.
#[derive(Clone, Copy, Debug)]
pub struct SceneStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
    /// How far trees and ground are visible.
    pub visible_radius_m: f64,
    /// How far undergrowth is visible.
    pub undergrowth_radius_m: f64,
}

impl Stage<Forest> for SceneStage {
    type At = u64;
    type Inputs = (
        Node<u64, FramePose>,
        AnyChunk<Solid>,
        AnyChunk<Low>,
        AnyChunk<Openness>,
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
        (pose, solid, low, openness): (
            Arc<FramePose>,
            Demand<'_, Solid>,
            Demand<'_, Low>,
            Demand<'_, Openness>,
        ),
    ) -> Result<FrameScene, Error> {
        let size = self.chunk_size_m;
        let position = pose.world_from_body().translation_m.truncate();
        let visible = visible_chunks(position, self.visible_radius_m, size);
        let near = visible_chunks(position, self.undergrowth_radius_m, size);
        let offset = |c: ChunkCoord| {
            Vec3::new(
                (c.x - pose.chunk.x) as f32,
                (c.y - pose.chunk.y) as f32,
                0.0,
            ) * size as f32
        };
        let mut groups = Vec::new();
        for (chunk, solid) in visible.iter().zip(solid.all(&visible)?) {
            groups.push((offset(*chunk), Arc::clone(&solid.0)));
        }
        for (chunk, low) in near.iter().zip(low.all(&near)?) {
            if let Some(group) = &low.0 {
                groups.push((offset(*chunk), Arc::clone(group)));
            }
        }
        let openness = visible
            .iter()
            .copied()
            .zip(openness.all(&visible)?)
            .collect();
        Ok(FrameScene {
            caster: Arc::new(RayScene::new(groups.clone())),
            groups,
            origin_m: pose.chunk.origin_m(size).extend(0.0),
            chunk_size_m: size,
            openness,
        })
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
        let openness = |p: Vec3| scene.openness(p);
        let seen = SceneView {
            caster: &*scene.caster,
            instances: Some(&*scene),
            materials: &assets.library.materials,
            sky_visibility: &openness,
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
        rigs.iter().enumerate().map(picture).collect()
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
    const VERSION: u32 = 2;

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
        Ok(rigs.iter().map(scan).collect())
    }
}
