//! Virtual cameras: ray-cast RGB, semantic, instance, depth and normal images under sun and sky.

mod atmosphere;
mod error;
mod ground;
mod haze;
mod lighting;
mod maps;
mod raycast;
mod sh;
mod shade;
mod sky;
mod sun;
mod sun_disc;
mod tone;
mod view;

pub use error::ParamError;
pub use lighting::Lighting;
pub use raycast::{PixelTruth, RayCastCamera, RayCastParams};
pub use sky::SkyParams;
pub use sun::{Sun, UtcTime};
pub use tone::{Exposure, ToneCurve};
pub use view::{CameraImages, CameraRenderer, OpenSky, SceneView, SkyVisibility, View};
