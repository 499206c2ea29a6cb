//! This crate is virtual LiDAR scanners: scan patterns, and scans of whatever rays can be cast at.
//!
//! ```
//! use nemoral_lidar::{ExactRange, HorizonLike, Scanner, ScannerParams};
//! use nemoral_scene::glam::{Vec2, Vec3};
//! use nemoral_scene::{
//!     Hit, Material, MaterialId, MaterialLibrary, ObjectId, Ray, RayCaster, RigidTransform, Semantic,
//! };
//! use nemoral_seed::Key;
//!
//! /// A wall 10 m ahead; real scenes are cast at by `nemoral-raycast`.
//! struct Wall(MaterialId);
//! impl RayCaster for Wall {
//!     fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
//!         Some(Hit {
//!             distance_m: (10.0 - ray.origin.x) / ray.direction.x,
//!             geometric_normal: Vec3::NEG_X,
//!             shading_normal: Vec3::NEG_X,
//!             uv: Vec2::ZERO,
//!             uv_per_m: 1.0,
//!             material: self.0,
//!             object: ObjectId::NONE,
//!             blend: None,
//!             variation: 0.0,
//!             near_light: 1.0,
//!         })
//!     }
//! }
//! let mut materials = MaterialLibrary::new();
//! let wall = Wall(materials.add(Material::plain("wall", Semantic::Rock, Vec3::splat(0.4))));
//! let scanner = Scanner::new(ScannerParams::default(), Box::new(HorizonLike))?;
//! let standing = |_time_s: f64| RigidTransform::IDENTITY;
//! let scan = scanner.scan(0, &wall, &materials, &standing, &ExactRange, Key::world(7));
//! assert_eq!(scan.len(), 50_000);
//! assert!(scan.iter().all(|p| (p.position_m.x - 10.0).abs() < 1e-5));
//! # Ok::<(), nemoral_lidar::ParamError>(())
//! ```
//!
//! # Model
//! A [`ScanPattern`] is an endless sequence of pulses: the paper's three are [`RepeatingLines`], the
//! circular non-repeating [`Mid40`] and the rectangular non-repeating [`HorizonLike`]; [`Mid70`],
//! [`Avia`], [`Spinning`] heads by their beam tables, a
//! terrestrial scanner's [`Panorama`] and any [`TablePattern`] stand beside them, and
//! [`Device`] has the numbers of what one can buy. A [`Scanner`] fires a stretch of a pattern, each pulse
//! from where the sensor is at that moment, and writes [`LidarPoint`](nemoral_scene::LidarPoint)s with
//! their truth (class, thing, range, incidence) for what comes back.
//!
//! A pulse is a line to the nearest opaque texel, or a [`Beam`] of sub-rays whose hits are put together
//! to several [echoes](Returns), mixed pixels among them. A surface is Lambertian. What the receiver
//! makes of an echo's range is a [`RangeModel`]'s business; other errors are [`PulseErrors`].
//!
//! Metres, seconds, radians; LiDAR frame with x forward, y left, z up. Patterns are exact after years:
//! phases are counted in integers.

mod beam;
mod device;
mod echo;
mod error;
mod horizon;
mod lines;
mod panorama;
mod pattern;
mod range_model;
mod receive;
mod receiver;
mod risley;
mod scan;
mod scanner;
mod spinning;
mod table;

pub use beam::Beam;
pub use device::{Device, DeviceSheet};
pub use echo::Returns;
pub use error::ParamError;
pub use horizon::HorizonLike;
pub use lines::{RepeatingLines, RepeatingLinesParams};
pub use panorama::{Panorama, PanoramaParams};
pub use pattern::{Pulse, ScanPattern};
pub use range_model::{EchoObservation, ExactRange, RangeModel};
pub use receiver::PulseErrors;
pub use risley::{Avia, Mid40, Mid70};
pub use scanner::{Scanner, ScannerParams, Wavelength};
pub use spinning::{Laser, Spinning};
pub use table::{TableError, TablePattern};
