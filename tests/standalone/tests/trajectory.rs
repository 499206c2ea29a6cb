//! Use of `nemoral-trajectory` alone: around a yard and back, and through a row of posts.

use std::convert::Infallible;
use std::sync::Arc;

use nemoral_scene::FlatSurface;
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_seed::Key;
use nemoral_trajectory::{
    Body, Obstacle, Path, Polyline, PoseFormat, PoseTrack, RecordedTrajectory, SpeedProfile,
    ThereAndBack, Trajectory, Wander, read_poses,
};

const PACE: SpeedProfile = SpeedProfile {
    spacing_m: 0.5,
    spacing_s: 0.0,
    speed_m_s: 1.0,
    rest_s: 0.0,
};
const BODY: Body = Body {
    wheelbase_m: 0.8,
    track_m: 0.6,
};

/// A quarter circle about the origin.
#[derive(Debug)]
struct Bend {
    radius_m: f64,
}

impl Polyline for Bend {
    fn length_m(&self) -> f64 {
        self.radius_m * std::f64::consts::FRAC_PI_2
    }

    fn position_m(&self, s_m: f64) -> DVec2 {
        DVec2::from_angle(s_m / self.radius_m) * self.radius_m
    }

    fn tangent(&self, s_m: f64) -> DVec2 {
        DVec2::from_angle(s_m / self.radius_m).perp()
    }
}

fn driven(path: Path) -> Trajectory {
    Trajectory {
        gait: None,
        path,
        pace: PACE,
        body: BODY,
    }
}

fn nothing(_: DVec2, _: f64) -> Result<Vec<Obstacle>, Infallible> {
    Ok(Vec::new())
}

#[test]
fn a_bend_is_driven_there_and_back_on_a_slope() {
    let ground = FlatSurface {
        height_m: 2.0,
        gradient: [0.1, 0.0].into(),
    };
    let bend = Arc::new(Bend { radius_m: 20.0 });
    let path = ThereAndBack::new(bend, 0.0, PACE.speed_m_s).expect("long enough to turn on");
    let trajectory = driven(Path::ThereAndBack(path));
    assert_eq!(trajectory.frames(), None);
    for frame in (0..1000).rev() {
        let pose = trajectory
            .pose(frame, 0.0, &nothing, &ground)
            .expect("never");
        let at = pose.translation_m;
        assert!((at.truncate().length() - 20.0).abs() < 1e-9);
        assert!((at.z - (2.0 + 0.1 * at.x)).abs() < 1e-9);
    }
    // The body's poses around a frame, for a scan of a tenth of a second.
    let track = PoseTrack::sample(0.05, |t| trajectory.pose(30, t, &nothing, &ground));
    let track = track.expect("never");
    let way = track.at(0.05).translation_m - track.at(-0.05).translation_m;
    assert!((way.length() - 0.1).abs() < 1e-3, "{way}");
}

#[test]
fn a_wander_keeps_clear_of_posts() {
    let posts = |place: DVec2, reach_m: f64| {
        let (first, last) = (place.x - reach_m, place.x + reach_m);
        let row = (first / 10.0).floor() as i64..=(last / 10.0).ceil() as i64;
        let post = |i| Obstacle {
            position_m: DVec2::new(10.0 * i as f64, 0.0),
            radius_m: 0.3,
        };
        Ok::<_, Infallible>(row.map(post).collect::<Vec<_>>())
    };
    let wander = Wander::new(DVec2::new(5.0, 0.0), DVec2::X, 6.0, 0.8, Key::world(3));
    let trajectory = driven(Path::Wander(wander));
    for frame in 0..400 {
        let pose = trajectory.pose(frame, 0.0, &posts, &FlatSurface::default());
        let at = pose.expect("never").translation_m.truncate();
        for post in posts(at, 2.0).expect("never") {
            assert!(at.distance(post.position_m) > 0.3 + 0.5, "frame {frame}");
        }
    }
}

#[test]
fn poses_are_read_from_text() {
    let text = "0 1 2 3 0 0 0 1\n2 3 2 3 0 0 0 1\n";
    let poses = read_poses(text, "poses.txt", PoseFormat::Tum).expect("two poses");
    let recording = RecordedTrajectory::new(poses, 0.5, false, "poses.txt").expect("in order");
    let trajectory = driven(Path::Recording(recording));
    assert_eq!((trajectory.frames(), trajectory.time_s(1)), (Some(2), 2.0));
    let pose = trajectory.pose(0, 0.5, &nothing, &FlatSurface::default());
    let at = pose.expect("never").translation_m;
    assert_eq!(at, DVec3::new(1.5, 2.0, 3.0));
    assert!(read_poses("0 1 2\n", "poses.txt", PoseFormat::Kitti).is_err());
}
