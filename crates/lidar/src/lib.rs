//! This crate provides virtual LiDAR scanners: scan patterns, and scans of anything that rays can
//! be cast at.
//!
//! ```
//! use nemoral_lidar::{ExactRange, LivoxHorizonLike, ScanRequest, Scanner, ScannerParams};
//! use nemoral_scene::glam::Vec3;
//! use nemoral_scene::{
//!     Hit, Material, MaterialId, MaterialLibrary, Ray, RayCaster, RigidTransform, Semantic,
//! };
//! use nemoral_seed::Key;
//!
//! /// A wall 10 m ahead; real scenes are cast at by `nemoral-raycast`.
//! struct Wall(MaterialId);
//! impl RayCaster for Wall {
//!     fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
//!         let distance_m = (10.0 - ray.origin.x) / ray.direction.x;
//!         ray.reaches(distance_m).then(|| Hit::new(distance_m, Vec3::NEG_X, self.0))
//!     }
//! }
//! let mut materials = MaterialLibrary::new();
//! let wall = Wall(materials.add(Material::plain("wall", Semantic::Rock, Vec3::splat(0.4))));
//! let scanner = Scanner::new(ScannerParams::default(), Box::new(LivoxHorizonLike))?;
//! let points = scanner.scan(&ScanRequest {
//!     first_pulse: 0,
//!     caster: &wall,
//!     materials: &materials,
//!     scene_from_lidar_at: &|_time_s| RigidTransform::IDENTITY,
//!     range_model: &ExactRange,
//!     key: Key::world(7),
//! });
//! assert_eq!(points.len(), 50_000);
//! assert!(points.iter().all(|p| (p.position_m.x - 10.0).abs() < 1e-5));
//! # Ok::<(), nemoral_lidar::ParamError>(())
//! ```
//!
//! # Model
//! A [`ScanPattern`] is an endless sequence of pulses. The paper's three are [`RepeatingLines`],
//! the circular non-repeating [`Mid40`] and the rectangular non-repeating [`LivoxHorizonLike`].
//! There are also [`Mid70`], [`Avia`], spinning heads by their beam tables ([`SpinningPattern`]),
//! a terrestrial scanner's [`Panorama`], the [`ScanMirror`]s of airborne scanners and any
//! [`CsvPattern`], each of which a motor may turn ([`MotorisedPattern`]); [`Device`] has the
//! numbers of real scanners. A [`Scanner`] fires a stretch of a pattern, each pulse from where the
//! sensor is at that moment, and makes [`LidarPoint`](nemoral_scene::LidarPoint)s with their truth
//! (class, object, range, incidence) of what comes back.
//!
//! A pulse is a line to the nearest opaque texel, or a [`Beam`] of sub-rays whose hits are grouped
//! into several [echoes](ReturnMode), mixed pixels among them. A surface is Lambertian; that of a
//! [`Liquid`](nemoral_scene::Liquid) glints where its ripples face the scanner, and it mirrors, so
//! that what the pulse meets then gives an echo at the range of the whole path,
//! [`PointFlags::MIRRORED`](nemoral_scene::PointFlags::MIRRORED). A [`Carrier`] hides what is
//! behind it. The [air](AirParams) weakens echoes, and fog has echoes of its own. A [`RangeModel`]
//! measures the range of an echo; the other errors are [`PulseErrors`].
//!
//! Units are metres, seconds and radians; the LiDAR frame has x forward, y left, z up. Patterns
//! stay exact after years, because their phases are counted in integers.

mod air;
mod beam;
mod carrier;
mod csv_pattern;
mod device;
mod echo;
mod echo_detection;
mod exponential;
mod label;
mod livox_horizon;
mod motorised;
mod panorama;
mod params;
mod pattern;
mod precipitation;
mod pulse_batch;
mod pulse_errors;
mod range_model;
mod reflection;
mod repeating_lines;
mod risley;
mod scan;
mod scan_mirror;
mod scanner;
mod spinning;
mod water_reflection;
mod waveform;

pub use air::{AirLayer, AirParams};
pub use beam::Beam;
pub use carrier::Carrier;
pub use csv_pattern::{CsvPattern, CsvPatternError};
pub use device::{DataSheet, Device};
pub use echo::ReturnMode;
pub use livox_horizon::LivoxHorizonLike;
pub use motorised::{MotorParams, MotorisedPattern};
pub use nemoral_scene::{EchoObservation, ParamError};
pub use panorama::{Panorama, PanoramaParams};
pub use params::{ScannerParams, Wavelength};
pub use pattern::{Pulse, ScanPattern};
pub use pulse_errors::PulseErrors;
pub use range_model::{ExactRange, RangeModel};
pub use repeating_lines::{RepeatingLines, RepeatingLinesParams};
pub use risley::{Avia, Mid40, Mid70};
pub use scan_mirror::{MirrorMotion, ScanMirror, ScanMirrorParams};
pub use scanner::{ScanRequest, Scanner};
pub use spinning::{Laser, SpinningPattern};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
