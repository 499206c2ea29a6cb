//! The robot's pose at a frame.

use std::convert::Infallible;

use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, RigidTransform, Twist};

use crate::Error;
use crate::config::Config;
use crate::world::lidars::LidarRig;
use crate::world::trajectory::{RobotTrajectory, Surroundings};
use nemoral_trajectory::PoseTrack;

/// The robot's pose, and its motion while its LiDAR scans.
#[derive(Debug)]
pub struct FramePose {
    /// The frame's time, seconds: the middle of the exposure and of the scan.
    pub time_s: f64,
    /// World poses of the body around that time.
    pub track: PoseTrack,
    /// How the body moves while cameras with a shutter take their pictures; still if there are
    /// none.
    pub motion: Twist,
    /// The chunk that the robot is in, whose corner is the scene's origin.
    pub chunk: ChunkCoord,
}

impl FramePose {
    /// Drives the robot to a frame; its pictures take `pictures_s`.
    pub(crate) fn new(
        at: u64,
        trajectory: &RobotTrajectory,
        lidars: &[LidarRig],
        surroundings: Surroundings<'_>,
        (chunk_size_m, pictures_s): (f64, f64),
    ) -> Result<Self, Error> {
        if let Some(frames) = trajectory.frames().filter(|&frames| at >= frames) {
            return Err(Error::request(format!(
                "frame {at}: the path has {frames} poses"
            )));
        }
        let place = |offset_s| trajectory.pose(at, offset_s, surroundings);
        let lengths = (chunk_size_m, pictures_s);
        Self::along(trajectory.time_s(at), lidars, lengths, place)
    }

    /// A body with these LiDARs that is at `place` some seconds after `time_s`.
    pub(crate) fn along(
        time_s: f64,
        lidars: &[LidarRig],
        (chunk_size_m, pictures_s): (f64, f64),
        place: impl Fn(f64) -> Result<RigidTransform, Error>,
    ) -> Result<Self, Error> {
        let track = PoseTrack::sample(half_scan_s(lidars), &place)?;
        let position = track.middle().translation_m.truncate();
        Ok(Self {
            time_s,
            track,
            motion: motion_along(pictures_s, place)?,
            chunk: ChunkCoord::containing(position, chunk_size_m),
        })
    }

    /// A body with these LiDARs that holds still.
    #[must_use]
    pub fn still(
        world_from_body: RigidTransform,
        time_s: f64,
        lidars: &[LidarRig],
        chunk_size_m: f64,
    ) -> Self {
        Self::moving(
            (world_from_body, Twist::STILL),
            time_s,
            lidars,
            chunk_size_m,
        )
    }

    /// A body with these LiDARs that moves steadily, in its own axes.
    #[must_use]
    pub fn moving(
        (world_from_body, motion): (RigidTransform, Twist),
        time_s: f64,
        lidars: &[LidarRig],
        chunk_size_m: f64,
    ) -> Self {
        let place = |offset_s| Ok::<_, Infallible>(world_from_body * motion.after(offset_s));
        let Ok(track) = PoseTrack::sample(half_scan_s(lidars), place);
        let place_m = world_from_body.translation_m.truncate();
        Self {
            time_s,
            track,
            motion,
            chunk: ChunkCoord::containing(place_m, chunk_size_m),
        }
    }

    /// The chunk that the body is in, and its place on the map.
    #[must_use]
    pub(crate) fn place(&self) -> (ChunkCoord, DVec2) {
        (self.chunk, self.world_from_body().translation_m.truncate())
    }

    /// The body's world pose at the frame's time.
    #[must_use]
    pub fn world_from_body(&self) -> RigidTransform {
        self.track.middle()
    }
}

/// The duration of the longest scan, seconds.
pub(crate) fn scan_s(lidars: &[LidarRig]) -> f64 {
    let durations = lidars.iter().map(|l| l.scanner.duration_s());
    durations.fold(0.0, f64::max)
}

/// How long before and after a frame's time a scan may fire, seconds.
pub(crate) fn half_scan_s(lidars: &[LidarRig]) -> f64 {
    let halves = lidars.iter().map(|l| l.scanner.half_scan_s());
    halves.fold(0.0, f64::max)
}

/// How the body moves around a frame's time, over the duration of pictures; still if that is 0.
fn motion_along(
    pictures_s: f64,
    place: impl Fn(f64) -> Result<RigidTransform, Error>,
) -> Result<Twist, Error> {
    if pictures_s == 0.0 {
        return Ok(Twist::STILL);
    }
    let at = |side: f64| place(side * pictures_s / 2.0);
    Ok(Twist::between(&at(-1.0)?, &at(1.0)?, pictures_s))
}

/// How long the longest picture of a robot's cameras takes, seconds.
#[must_use]
pub fn pictures_s(config: &Config) -> f64 {
    let cameras = config.all_cameras();
    let durations = cameras.map(|(_, camera)| camera.shutter_times().duration_s());
    durations.fold(0.0, f64::max)
}
