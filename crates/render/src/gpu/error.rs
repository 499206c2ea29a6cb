//! What can go wrong on a GPU.

use crate::ParamError;

/// Why the GPU made no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// No driver, or none that is wanted.
    #[error(
        "no GPU: {reason}. Use the CPU (--backend cpu), install the GPU's Vulkan driver, or \
         software Vulkan for tests (Debian, Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1)"
    )]
    NoAdapter {
        /// What was found, or what the system said.
        reason: String,
    },
    /// The GPU is there and cannot do what is needed.
    #[error(
        "the GPU {name} is too small: {what}. Use the CPU (--backend cpu) or another GPU \
         (WGPU_ADAPTER_NAME, a part of its name)"
    )]
    TooSmall {
        /// The GPU.
        name: String,
        /// What it lacks.
        what: String,
    },
    /// The driver refused to open the GPU.
    #[error(
        "cannot open the GPU {name}: {reason}. Use the CPU (--backend cpu), or end other programs \
         that use the GPU"
    )]
    NoDevice {
        /// The GPU.
        name: String,
        /// What the driver said.
        reason: String,
    },
    /// The scene does not fit.
    #[error(
        "the scene needs {needed_mib} MiB on the GPU, {allowed_mib} MiB are allowed: allow more \
         (--gpu-memory), lower chunks.visible_radius_m or use the CPU (--backend cpu)"
    )]
    OutOfMemory {
        /// What this frame needs at least.
        needed_mib: u64,
        /// The limit.
        allowed_mib: u64,
    },
    /// The GPU went away: reset, unplugged, or its driver crashed.
    ///
    /// A data set keeps the renderer that it began with, so the CPU is no way to go on.
    #[error(
        "the GPU was lost: {reason}. It was reset or unplugged, or its driver failed. The frames \
         of a data set that are written are whole: go on with --resume when the GPU answers again, \
         or begin anew on the CPU (--backend cpu with --overwrite or another --out)"
    )]
    Lost {
        /// What the driver said.
        reason: String,
    },
    /// The driver refused a command.
    #[error("the GPU refused a command: {reason}")]
    Refused {
        /// What it said.
        reason: String,
    },
    /// A pass's shader is wrong.
    #[error("pass `{pass}`: {reason}")]
    Shader {
        /// The pass.
        pass: String,
        /// What the compiler said.
        reason: String,
    },
    /// The scene was given without its shapes.
    #[error("the scene is given without its shapes (SceneView::instances)")]
    NoShapes,
    /// The view or a parameter is impossible.
    #[error(transparent)]
    Param(#[from] ParamError),
}
