//! This crate computes what an inertial measurement unit on a moving body measures.
//!
//! [`motions`] derives the true motion of the unit from the pose of the body as a function of time;
//! [`ImuNoise`] adds the errors of a sensor; [`euroc`] writes both as the EuRoC MAV data set does.
//!
//! ```
//! use std::convert::Infallible;
//!
//! use nemoral_imu::{GRAVITY_M_S2, motions};
//! use nemoral_scene::RigidTransform;
//!
//! // A body at rest feels the ground that carries it.
//! let still = |_: f64| Ok::<_, Infallible>(RigidTransform::IDENTITY);
//! for motion in motions(200.0, 10, still) {
//!     let Ok(motion) = motion;
//!     assert_eq!(motion.specific_force_m_s2.to_array(), [0.0, 0.0, GRAVITY_M_S2]);
//! }
//! ```
//!
//! Frames are those of REP-103: the unit's x axis points forward, y to the left, z up; the world's
//! z axis points up. Times are seconds, rates rad/s, specific forces m/s².

pub mod euroc;
mod motion;
mod noise;

pub use motion::{GRAVITY_M_S2, ImuMotion, Motions, motions};
pub use noise::{ImuErrors, ImuNoise, ImuParams, ImuSample, SensorErrors};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
