//! What sensors record at any pose, which need not be on the robot's path.

use nemoral_render::CameraImages;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, LidarPoint, RigidTransform};
use nemoral_trajectory::{Body, Stance};

use crate::plan::Runner;
use crate::recording::moment::Moment;
use crate::recording::pose::FramePose;
use crate::recording::scene::FrameScene;
use crate::stages::frame::SceneStage;
use crate::stages::trajectory::forward;
use crate::{Error, ForestPlan};

/// What the robot's sensors record at a pose.
#[derive(Debug)]
pub struct Observation {
    /// The pose.
    pub pose: FramePose,
    /// Colour and truth images of each camera.
    pub images: Vec<CameraImages>,
    /// The points of each LiDAR.
    pub scans: Vec<Vec<LidarPoint>>,
}

/// The greatest distance of a pose from the world's origin along each axis, metres.
const FARTHEST_M: f64 = 1e8;

impl ForestPlan {
    /// What the robot's sensors record while its body holds still at a world pose, at a time that
    /// decides which part of its pattern a LiDAR scans. `number` is to noise what a frame's number
    /// is: equal ones give equal noise.
    ///
    /// A robot that holds still at a frame of this pose, time and number records the same to the
    /// bit.
    ///
    /// # Errors
    /// If the pose or the time is impossible, or a stage fails.
    pub fn observe(
        &self,
        runner: &Runner<'_>,
        world_from_body: RigidTransform,
        time_s: f64,
        number: u64,
    ) -> Result<Observation, Error> {
        let RigidTransform {
            rotation,
            translation_m,
        } = world_from_body;
        if !rotation.is_normalized() {
            let message = format!("rotation = {rotation}: must be a unit quaternion");
            return Err(Error::request(message));
        }
        if translation_m.abs().max_element() > FARTHEST_M || !translation_m.is_finite() {
            let message = format!("translation_m = {translation_m}: must be within 1e8 m");
            return Err(Error::request(message));
        }
        if !(0.0..=1e9).contains(&time_s) {
            return Err(Error::request(format!(
                "time_s = {time_s}: must be 0..=1e9"
            )));
        }
        let assets = runner.get(self.assets, ())?;
        let cameras = runner.get(self.cameras, ())?;
        let lidars = runner.get(self.lidars, ())?;
        let scene = self.scene_around(runner, translation_m.truncate(), f64::INFINITY)?;
        let pose = FramePose::still(world_from_body, time_s, &lidars, self.chunks.size_m);
        let materials = &assets.library.materials;
        let moment = Moment::new(self.world(), number, &pose, &scene, materials);
        let pictures = cameras.iter().enumerate();
        let images = pictures.map(|(i, rig)| moment.picture(i, rig));
        Ok(Observation {
            images: images.collect::<Result<_, _>>()?,
            scans: lidars.iter().map(|rig| moment.scan(rig)).collect(),
            pose,
        })
    }

    /// The pose of a body that stands level on the ground, as on a tripod, and faces a direction
    /// clockwise from north. A station of `[robot.stations]` there has the same pose to the bit.
    ///
    /// # Errors
    /// If a stage fails.
    pub fn level_pose(
        &self,
        runner: &Runner<'_>,
        place_m: DVec2,
        heading_deg: f64,
    ) -> Result<RigidTransform, Error> {
        let chunk = ChunkCoord::containing(place_m, self.chunks.size_m);
        let stance = Stance::Level {
            position_m: place_m,
            forward: forward(heading_deg),
        };
        // A level body has no wheels.
        let body = Body {
            wheelbase_m: 1.0,
            track_m: 1.0,
        };
        Ok(stance.pose(&body, &*runner.get(self.ground, chunk)?))
    }

    /// The scene that is visible from a place on the map, of chunks that come within `reach_m`. With
    /// the visible radius or more it is that of a frame there.
    ///
    /// # Errors
    /// If a stage fails.
    pub fn scene_around(
        &self,
        runner: &Runner<'_>,
        place_m: DVec2,
        reach_m: f64,
    ) -> Result<FrameScene, Error> {
        let chunk_size_m = self.chunks.size_m;
        let stage = SceneStage {
            chunk_size_m,
            visible_radius_m: self.chunks.visible_radius_m.min(reach_m),
            undergrowth_radius_m: self.chunks.undergrowth_radius_m.min(reach_m),
        };
        stage.gather(
            (ChunkCoord::containing(place_m, chunk_size_m), place_m),
            runner.demand(self.object_geometry),
            runner.demand(self.undergrowth_geometry),
            runner.demand(self.sky_view_factor),
        )
    }
}
