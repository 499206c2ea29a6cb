//! The ray-cast camera: truth and first colours by primary rays, further samples, path tracing, and
//! shadows that are smoothed over neighbouring pixels.

pub(crate) mod camera;
mod context;
mod frame_buffer;
mod liquid;
pub(crate) mod params;
mod path_tracer;
mod penumbra;
pub(crate) mod pixel_truth;
mod primary_rays;
mod shadow_filter;
mod silhouettes;
mod supersampling;
