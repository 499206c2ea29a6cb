//! The camera that draws on a GPU through wgpu, offscreen, without a window or a display.
//!
//! It draws the same triangles, cards and one-bit masks that the ray-cast camera casts rays at. The
//! rasteriser only proposes which pixels a primitive may cover; a fragment then intersects its
//! primitive with the ray through the pixel's centre, by the formula of the ray caster, so that
//! neither the rounding of vertices nor the interpolation of a GPU affects depth, mask or normal.
//!
//! Resources stay on the GPU between pictures: prototypes are uploaded when a chunk that has them
//! may be visible, and dropped with their last chunk or when others need the memory; instances are
//! uploaded with their chunks. A compute pass culls them for the camera and for each shadow map,
//! and writes the indirect draws. While one picture is read back, the next can be drawn.

mod accumulation;
mod backdrop;
mod buffer_pool;
mod camera;
mod cascade;
mod cull;
mod device;
mod distortion_bounds;
mod error;
mod frame;
mod frustum;
mod instance_buffer;
mod light_tables;
mod lighting;
mod materials;
mod memory;
mod octahedral;
mod params;
mod pass;
mod pipeline;
mod primitive;
mod readback;
mod requirements;
mod shapes;
mod state;
mod targets;
#[cfg(test)]
mod testing;

pub use camera::{GpuCamera, GpuImages};
pub use device::{AcceptedGpus, Gpu};
pub use error::GpuError;
pub use memory::GpuMemory;
pub use params::GpuParams;
pub use pass::Pass;
