//! This crate computes where a carrier of sensors goes: a pose of its body for any time, in any
//! order.
//!
//! A [`Trajectory`] is a [`Path`] that a [`Body`] follows with a [`SpeedProfile`]:
//! - [`Path::ThereAndBack`]: along a line, a trail for example, to its end and back, and so on.
//! - [`Path::Wander`]: a smooth curve about a straight line, which keeps clear of obstacles.
//!   The line may also be a loop of [`Lanes`] over an area, as one walks a plot.
//! - [`Path::Straight`]: a straight line, which does not avoid anything.
//! - [`Path::FlightLines`]: parallel lines above an area, as drones fly surveys.
//! - [`Path::Stations`]: a grid of level stations, as in terrestrial scanning.
//! - [`Path::Recording`]: poses from a file of TUM's or KITTI's format ([`read_poses`]).
//!
//! A walker who carries the sensors sways by a [`Gait`].
//!
//! Single views beside a path have places of their own ([`PoseSampler`]). What a navigation system
//! would estimate of poses, with its errors, is [`Navigation`]'s.
//!
//! Nothing is simulated step by step: a pose is a pure function of a frame's number and of a time
//! relative to it, so any frame can be made first. Frames are the moments at which sensors record.
//!
//! The user provides the land through three ports: the obstacles near a place ([`Obstacles`], which
//! closures implement), the ground ([`nemoral_scene::Surface`]), and lines to follow
//! ([`Polyline`]). Where ground is made piece by piece, [`Trajectory::path_pose`] tells first where
//! it is needed.
//!
//! Positions are world positions in metres, x east, y north, z up. A body's x axis points forward,
//! its y axis to the left; its origin is on the ground between its wheels.
//!
//! ```
//! use std::convert::Infallible;
//!
//! use nemoral_scene::FlatSurface;
//! use nemoral_scene::glam::DVec2;
//! use nemoral_trajectory::{Body, Obstacle, Path, SpeedProfile, Trajectory};
//!
//! let trajectory = Trajectory {
//!     path: Path::Straight { start_m: DVec2::ZERO, forward: DVec2::X },
//!     pace: SpeedProfile { spacing_m: 1.0, spacing_s: 0.0, speed_m_s: 1.5, rest_s: 0.0 },
//!     body: Body { wheelbase_m: 0.8, track_m: 0.6 },
//!     gait: None,
//! };
//! let nothing = |_: DVec2, _: f64| Ok::<Vec<Obstacle>, Infallible>(Vec::new());
//! let ground = FlatSurface { height_m: 3.0, gradient: DVec2::new(0.1, 0.0) };
//! // Any frame may be asked for first.
//! let pose = trajectory.pose(20, 0.0, &nothing, &ground)?;
//! assert!((pose.translation_m.x - 20.0).abs() < 1e-6);
//! # Ok::<(), Infallible>(())
//! ```
//!
//! # Non-goals
//! Dynamics, control, slip, the turns between flight lines, and planning towards a goal.

mod body;
mod error;
mod flight_lines;
mod gait;
mod heading;
mod lanes;
mod navigation;
mod port;
mod pose_file;
mod pose_sampler;
mod recorded_trajectory;
mod speed_profile;
mod spline;
mod stations;
mod sway;
mod there_and_back;
mod trajectory;
mod wander;

pub use body::{Body, PoseTrack};
pub use error::Error;
pub use flight_lines::{AltitudeMode, FlightLines, FlightLinesParams};
pub use gait::Gait;
pub use heading::forward_of_heading;
pub use lanes::{Lanes, LanesParams};
pub use navigation::{Navigation, NavigationParams, TrackPoint};
pub use port::{Obstacle, Obstacles, Polyline};
pub use pose_file::{PoseFormat, read_poses};
pub use pose_sampler::PoseSampler;
pub use recorded_trajectory::RecordedTrajectory;
pub use speed_profile::SpeedProfile;
pub use stations::Stations;
pub use there_and_back::{Pose2d, ThereAndBack};
pub use trajectory::{Path, PathPose, Trajectory};
pub use wander::Wander;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
