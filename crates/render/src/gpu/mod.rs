//! The camera that draws on a GPU, through wgpu: offscreen, no window, no display.
//!
//! Everything is drawn as what the ray-cast camera casts at: the same triangles, cards and one-bit
//! masks. The rasteriser only proposes which pixels a primitive may cover; a fragment then meets
//! its primitive with the ray through the pixel's centre, by the formula of the ray caster, so that
//! neither a GPU's snapped vertices nor its interpolation touch depth, mask or normal.
//!
//! What a picture needs is on the GPU before it: prototypes come when a chunk that has them may be
//! seen, and go with their last chunk or when others need the room; instances come with their
//! chunks. A compute pass culls them for the camera and for each shadow map, and writes the draws
//! that are then drawn indirectly. While one picture comes back, the next can be drawn.

mod accumulation;
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
pub use device::{Accept, Gpu};
pub use error::GpuError;
pub use memory::GpuMemory;
pub use params::GpuParams;
pub use pass::Pass;
