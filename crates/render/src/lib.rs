//! This crate takes pictures of a scene with virtual cameras, by casting rays on the CPU: colour
//! under sun and sky, and the exact class, object, depth and normal at every pixel's centre.
//!
//! ```
//! use nemoral_render::{
//!     CameraRenderer, Lighting, OpenSky, RayCastCamera, RayCastParams, SceneView, SkyParams, Sun,
//!     View,
//! };
//! use nemoral_scene::{Hit, Intrinsics, MaterialLibrary, Ray, RayCaster, RigidTransform, Semantic};
//! use nemoral_seed::Key;
//!
//! /// An empty world. A real one is a bounding volume hierarchy.
//! struct Empty;
//! impl RayCaster for Empty {
//!     fn closest_hit(&self, _: &Ray) -> Option<Hit> {
//!         None
//!     }
//! }
//!
//! let sun = Sun::from_angles(135.0, 40.0)?;
//! let lighting = Lighting::new(&sun, &SkyParams::default())?;
//! let camera = RayCastCamera::new(RayCastParams::default(), lighting)?;
//! let materials = MaterialLibrary::new();
//! let scene = SceneView {
//!     caster: &Empty,
//!     instances: None,
//!     materials: &materials,
//!     sky_visibility: &OpenSky,
//!     lamps: &[],
//! };
//! let view = View::new(Intrinsics::from_fov(64, 36, 1.2)?, RigidTransform::body_from_optical());
//! let images = camera.render(&scene, &view, Key::world(7))?;
//! assert_eq!(*images.truth.semantic.at(32, 18), Semantic::Sky);
//! let [red, _, blue] = *images.rgb.at(32, 2);
//! assert!(blue > red, "a blue sky");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # One truth
//! Class, object, depth and normal come from the ray through the pixel's centre and are never
//! blended, filtered or taken from more samples; colour may be anti-aliased. The LiDAR uses the
//! same caster, so both sensors see the same world. [`RayCastCamera::truth_at`] gives the truth at
//! any image position. The paper (Nunes, Ferreira, Peixoto, sections V-C and V-D) draws classes
//! with a replacement shader and recovers metres from a fitted depth curve; here depth is that of
//! the ray.
//!
//! # Light
//! - The sun is given by angles or by place and time ([`Sun`]); its colour is what the air
//!   transmits.
//! - The sky is computed by single scattering on molecules and aerosols in a spherical atmosphere
//!   with ozone, with higher orders after Hillaire (2020) and a CIE overcast veil ([`SkyParams`]).
//!   After sunset it is as bright as measured (Seidelmann 1992), and the moon shines ([`Moon`]). A
//!   photographed sky can be used instead ([`SkyImage`]).
//! - Lamps ([`Lamp`]) shine on surfaces, with shadows, and on the air before the camera, in the
//!   ray-cast camera.
//! - Haze, by visibility (Koschmieder 1924), and ground fog both decrease exponentially with
//!   height, and are integrated in closed form along every ray.
//! - One shadow ray per sample goes to a point of the sun's disc; neighbouring pixels use different
//!   parts of the disc, and are averaged as far as a penumbra is wide, so penumbrae are smooth.
//! - There are no ambient-occlusion rays: the light of the sky, the green light that leaves scatter
//!   down (Goudriaan 1977) and the light that the ground reflects follow from one number per place,
//!   the sky view factor ([`SkyVisibility`]), and one that is baked with each shape, the share that
//!   its near parts let through ([`AmbientOcclusion`](nemoral_scene::AmbientOcclusion)).
//! - Leaves reflect and transmit; other surfaces are matt with a weak rough sheen. Energy is
//!   conserved: a white surface in a uniform world ([`Lighting::uniform`]) is invisible.
//! - The lens ([`Lens`]) spreads points, which filters detail finer than pixels, and adds veiling
//!   glare, a halo around bright areas, and darker corners.
//! - Exposure is set by a light meter ([`Exposure`], [`Metering`]), followed by a camera's standard
//!   curve or another one ([`ToneCurve`]) and sRGB.
//!
//! # Imperfections of a camera
//! A camera is perfect unless a [`View`] says otherwise. [`SensorNoise`] is EMVA 1288's.
//! [`Processing`] is what a camera makes of a sensor's values, from white balance to JPEG's
//! artefacts, and [`Soiling`] dirt and drops on the lens; both change the picture alone. With a
//! shutter ([`nemoral_scene::Shutter`]), a moving camera ([`nemoral_scene::Twist`]) reads row after
//! row, each from the pose at its time, with motion blur over its exposure. The truth is that of
//! the middle of each row's exposure, so labels fit the picture.
//!
//! # Units
//! Light is linear sRGB, scaled so that radiance has its luminance in cd/m² and irradiance its
//! illuminance in lux. Frames and axes are those of [`nemoral_scene`].

mod annotations;
mod camera;
mod colour;
mod error;
#[cfg(feature = "gpu")]
mod gpu;
mod light;
mod raycast;
mod renderer;
mod sky;

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;

pub use annotations::boxes::{BoxCandidate, object_boxes};
pub use annotations::nearest::{nearest_objects, with_visible};
pub use annotations::optical_flow::optical_flow;
pub use camera::aberration::ChromaticAberration;
pub use camera::exposure::Exposure;
pub use camera::jpeg::Jpeg;
pub use camera::lens::{Lens, Vignetting};
pub use camera::metering::Metering;
pub use camera::precipitation::Precipitation;
pub use camera::processing::Processing;
pub use camera::sensor_noise::SensorNoise;
pub use camera::soiling::Soiling;
pub use camera::tone::ToneCurve;
pub use camera::view::View;
pub use camera::white_balance::{WhiteBalance, WhiteReference};
pub use error::ParamError;
#[cfg(feature = "gpu")]
pub use gpu::{AcceptedGpus, Gpu, GpuCamera, GpuError, GpuImages, GpuMemory, GpuParams, Pass};
pub use light::lamp::{Lamp, LampParams};
pub use light::lighting::Lighting;
pub use raycast::camera::RayCastCamera;
pub use raycast::params::RayCastParams;
pub use raycast::pixel_truth::PixelTruth;
pub use renderer::{CameraImages, CameraRenderer, OpenSky, SceneView, SkyVisibility};
pub use sky::model::SkyParams;
pub use sky::moon::Moon;
pub use sky::sky_image::SkyImage;
pub use sky::sun::{Sun, UtcTime};
