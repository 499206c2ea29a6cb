//! What the robot's sensors record the scene around them from.

use std::fmt;

use nemoral_lidar::ScanRequest;
use nemoral_render::{CameraImages, CameraRenderer, Lamp, Precipitation, SceneView, View};
use nemoral_scene::{LidarPoint, MaterialLibrary, RayCaster, RigidTransform, TruthImages};
use nemoral_seed::{Domain, Key};

use super::pose::FramePose;
use super::scene::FrameScene;
use crate::Error;
use crate::world::cameras::CameraRig;
use crate::world::lidars::LidarRig;

const CAMERA: Domain = Domain::new("pipeline.camera");

/// The pose, the scene and the keys of one moment of a robot. Everything that its sensors record
/// then depends on this alone.
#[derive(Clone, Copy)]
pub struct RecordingContext<'a> {
    /// What rays are cast at, usually the scene's own caster.
    pub caster: &'a dyn RayCaster,
    world: Key,
    number: u64,
    pose: &'a FramePose,
    scene: &'a FrameScene,
    materials: &'a MaterialLibrary,
}

impl fmt::Debug for RecordingContext<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RecordingContext")
            .field("number", &self.number)
            .field("time_s", &self.pose.time_s)
            .finish_non_exhaustive()
    }
}

impl<'a> RecordingContext<'a> {
    /// What is recorded under this number in a world. Equal numbers give equal noise; frames have
    /// their own. The scene's materials are those of the world's library.
    #[must_use]
    pub fn new(
        world: Key,
        number: u64,
        pose: &'a FramePose,
        scene: &'a FrameScene,
        materials: &'a MaterialLibrary,
    ) -> Self {
        Self {
            caster: &*scene.caster,
            world,
            number,
            pose,
            scene,
            materials,
        }
    }

    /// The view of a camera.
    #[must_use]
    pub fn view(&self, rig: &CameraRig) -> View {
        let scene_from_body = self.scene_from_body();
        let precipitation = Precipitation {
            rain_mm_per_h: rig.rain_mm_per_h,
            snowfall_mm_per_h: rig.snowfall_mm_per_h,
            time_s: self.pose.time_s,
            scene_origin_m: self.scene.origin_m,
            key: self.world,
        };
        View {
            precipitation: Some(precipitation),
            ..rig.view(scene_from_body, self.pose.motion)
        }
    }

    /// The picture of a camera, and the truth about it. `position` is the camera's among those of
    /// the robot, from 0.
    ///
    /// # Errors
    /// If the view is impossible, or the renderer fails.
    pub fn picture(&self, position: usize, rig: &CameraRig) -> Result<CameraImages, Error> {
        let mut key = self.world.domain(CAMERA);
        if position > 0 {
            key = key.domain(Domain::new(&rig.name));
        }
        let key = key.item(self.number);
        let lamps = rig.lamps_on(&self.scene_from_body())?;
        self.see(&lamps, |seen| {
            rig.renderer.render(seen, &self.view(rig), key)
        })
    }

    /// The truth of a camera's picture alone.
    ///
    /// # Errors
    /// If the view is impossible, or the renderer fails.
    pub fn truth(&self, rig: &CameraRig) -> Result<TruthImages, Error> {
        self.see(&[], |seen| rig.renderer.truth(seen, &self.view(rig)))
    }

    fn scene_from_body(&self) -> RigidTransform {
        self.pose.track.relative_to(self.scene.origin_m).middle()
    }

    fn see<T>(&self, lamps: &[Lamp], look: impl FnOnce(&SceneView<'_>) -> T) -> T {
        look(&SceneView {
            caster: self.caster,
            instances: Some(self.scene),
            materials: self.materials,
            sky_visibility: self.scene,
            lamps,
        })
    }

    /// The points of a LiDAR.
    #[must_use]
    pub fn scan(&self, rig: &LidarRig) -> Vec<LidarPoint> {
        let track = self.pose.track.relative_to(self.scene.origin_m);
        let scene_from_lidar = |offset_s: f64| track.at(offset_s) * rig.body_from_lidar;
        let of_lidar = self.world.domain(Domain::new(&rig.name));
        // Nothing sets the prisms of a scanner when it is switched on, so each sequence has a part
        // of its own of a pattern that hardly repeats, and so has each of several such scanners.
        let start = rig.scanner.start(of_lidar);
        rig.scanner.scan(&ScanRequest {
            first_pulse: start.wrapping_add(rig.scanner.first_pulse_at(self.pose.time_s)),
            caster: self.caster,
            materials: self.materials,
            scene_from_lidar_at: &scene_from_lidar,
            range_model: &rig.noise,
            key: of_lidar.item(self.number),
        })
    }
}
