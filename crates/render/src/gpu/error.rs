//! Errors of the GPU camera.

use crate::ParamError;

/// Why the GPU made no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// There is no GPU, or none that is accepted.
    #[error(
        "no GPU: {reason}. Use the CPU (--backend cpu), install the GPU's Vulkan driver, or \
         software Vulkan for tests (Debian, Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1)"
    )]
    NoAdapter {
        /// What was found, or the system's error.
        reason: String,
    },
    /// The GPU lacks something that is needed.
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
        /// The driver's message.
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
    /// The scene has lamps.
    #[error("lamps shine on the CPU alone (--backend cpu): the scene has {count}")]
    Lamps {
        /// How many.
        count: usize,
    },
    /// The GPU was lost: reset, unplugged, or its driver crashed.
    ///
    /// A data set keeps the renderer that it began with, so a run cannot continue on the CPU.
    #[error(
        "the GPU was lost: {reason}. It was reset or unplugged, or its driver failed. The frames \
         of a data set that are written are whole: go on with --resume when the GPU answers again, \
         or begin anew on the CPU (--backend cpu with --overwrite or another --out)"
    )]
    Lost {
        /// The driver's message.
        reason: String,
    },
    /// The driver refused a command.
    #[error("the GPU refused a command: {reason}")]
    Refused {
        /// The driver's message.
        reason: String,
    },
    /// A pass's shader is wrong.
    #[error("pass `{pass}`: {reason}")]
    Shader {
        /// The pass.
        pass: String,
        /// The compiler's message.
        reason: String,
    },
    /// The scene was given without its shapes.
    #[error("the scene is given without its shapes (SceneView::instances)")]
    NoShapes,
    /// The view or a parameter is invalid.
    #[error(transparent)]
    Param(#[from] ParamError),
}
