//! Scenes and poses anywhere in a forest, which need not be on the robot's path.

use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, RigidTransform};
use nemoral_trajectory::{Body, PathPose, forward_of_heading};

use crate::plan::Runner;
use crate::recording::scene::FrameScene;
use crate::recording::visible_reach::VisibleReach;
use crate::{Error, ForestPlan};

impl ForestPlan {
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
        let chunk = ChunkCoord::containing(place_m, self.reach.chunk_size_m);
        let path_pose = PathPose::Level {
            position_m: place_m,
            forward: forward_of_heading(heading_deg),
        };
        // A level body has no wheels.
        let body = Body {
            wheelbase_m: 1.0,
            track_m: 1.0,
        };
        Ok(path_pose.pose(&body, &*runner.get(self.ground, chunk)?))
    }

    /// The scene that is visible from a place on the map, of chunks that come within `reach_m`.
    /// With the visible radius or more it has all that is seen from there in any direction. If it
    /// is not asked to be lit, nothing is hidden from the sky, which saves most of the time.
    ///
    /// # Errors
    /// If a stage fails.
    pub fn scene_around(
        &self,
        runner: &Runner<'_>,
        place_m: DVec2,
        reach_m: f64,
        is_lit: bool,
    ) -> Result<FrameScene, Error> {
        let reach = VisibleReach {
            is_lit,
            ..self.reach.within(reach_m)
        };
        let around = ChunkCoord::containing(place_m, reach.chunk_size_m);
        let geometry = (
            runner.demand(self.object_geometry),
            runner.demand(self.undergrowth_geometry),
            runner.demand(self.litter_geometry),
        );
        let light = (
            runner.demand(self.sky_view_factor),
            runner.demand(self.ground_occlusion),
        );
        FrameScene::gather(&reach, (around, place_m), None, geometry, Some(light))
    }
}
