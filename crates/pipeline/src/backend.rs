//! Which renderer takes a data set's pictures: decided once, before anything is made.

#[cfg(feature = "gpu")]
use nemoral_render::{Accept, Gpu, GpuCamera, GpuError, GpuParams};
use nemoral_render::{CameraImages, CameraRenderer, RayCastCamera, SceneView, View};
use nemoral_scene::TruthImages;
use nemoral_seed::Key;

use crate::Error;
use crate::config::Config;

/// What a request says about the renderer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BackendChoice {
    /// A hardware GPU if there is one that will do, else the CPU.
    #[default]
    Auto,
    /// The ray-cast camera: works everywhere.
    Cpu,
    /// A GPU; software that plays one will do if there is no hardware.
    Gpu,
}

/// The renderer that was decided on.
#[derive(Clone, Debug, Default)]
pub enum Backend {
    /// The ray-cast camera.
    #[default]
    Cpu,
    /// A GPU.
    #[cfg(feature = "gpu")]
    Gpu {
        /// This one.
        gpu: Gpu,
        /// The most of its memory that a renderer uses, MiB.
        memory_mib: u32,
    },
}

impl Backend {
    /// Decides for a config, and says in words what and why.
    ///
    /// # Errors
    /// As [`Backend::resolve`].
    pub fn for_config(choice: BackendChoice, config: &Config) -> Result<(Self, String), Error> {
        if !config.camera.enabled {
            let none = "renderer: none, as there is no camera";
            return Ok((Self::Cpu, none.to_owned()));
        }
        let follows = config.all_cameras().find(|(_, camera)| camera.bounces > 0);
        match (choice, follows) {
            (BackendChoice::Auto, Some((path, camera))) => {
                let bounces = camera.bounces;
                let why = format!("renderer: the CPU, as {path}.bounces = {bounces} follows light");
                Ok((Self::Cpu, why))
            }
            _ => Self::resolve(choice),
        }
    }

    /// Decides, and says in words what and why.
    ///
    /// # Errors
    /// If a GPU is demanded and there is none that will do, or this build knows none (feature
    /// `gpu`).
    #[cfg(feature = "gpu")]
    pub fn resolve(choice: BackendChoice) -> Result<(Self, String), Error> {
        let on = |gpu: Gpu, why: &str| {
            let note = format!("renderer: the GPU {}{why}", gpu.name());
            let memory_mib = GpuParams::default().memory_mib;
            (Self::Gpu { gpu, memory_mib }, note)
        };
        match choice {
            BackendChoice::Cpu => Ok((Self::Cpu, "renderer: the CPU, as asked".to_owned())),
            BackendChoice::Gpu => {
                let gpu = Gpu::open(Accept::Any).map_err(|e| match e {
                    GpuError::NoAdapter { .. } | GpuError::TooSmall { .. } => {
                        Error::request(format!("--backend gpu: {e}"))
                    }
                    e => Error::Renderer(e.to_string().into()),
                })?;
                let software = gpu.is_software();
                Ok(on(
                    gpu,
                    if software {
                        ", software: slow"
                    } else {
                        ", as asked"
                    },
                ))
            }
            BackendChoice::Auto => Ok(match Gpu::open(Accept::Hardware) {
                Ok(gpu) => on(gpu, ""),
                Err(e) => (Self::Cpu, format!("renderer: the CPU ({})", cause(e))),
            }),
        }
    }

    /// Decides, and says in words what and why.
    ///
    /// # Errors
    /// If a GPU is demanded: this build knows none (feature `gpu`).
    #[cfg(not(feature = "gpu"))]
    pub fn resolve(choice: BackendChoice) -> Result<(Self, String), Error> {
        match choice {
            BackendChoice::Gpu => Err(Error::request(
                "--backend gpu: this program was built without its GPU renderer (feature `gpu`)",
            )),
            BackendChoice::Auto | BackendChoice::Cpu => {
                Ok((Self::Cpu, "renderer: the CPU".to_owned()))
            }
        }
    }

    /// The same, using at most so much memory of a GPU, MiB, for each renderer: cameras that differ
    /// in look, samples or radiance have one each.
    #[must_use]
    #[cfg_attr(
        not(feature = "gpu"),
        allow(unused_variables, reason = "only GPUs have memory of their own")
    )]
    pub fn with_gpu_memory(self, limit_mib: u32) -> Self {
        match self {
            Self::Cpu => Self::Cpu,
            #[cfg(feature = "gpu")]
            Self::Gpu { gpu, .. } => Self::Gpu {
                gpu,
                memory_mib: limit_mib,
            },
        }
    }

    /// Can it draw a frame while the processor is at the one before? The ray-cast camera is the
    /// processor.
    #[must_use]
    pub fn draws_ahead(&self) -> bool {
        !matches!(self, Self::Cpu)
    }

    /// As it is recorded: what one GPU draws, another need not continue.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Cpu => "cpu".to_owned(),
            #[cfg(feature = "gpu")]
            Self::Gpu { gpu, .. } => format!("gpu: {}", gpu.name()),
        }
    }
}

/// Why there is no GPU, without the advice for who insists on one.
#[cfg(feature = "gpu")]
fn cause(error: GpuError) -> String {
    match error {
        GpuError::NoAdapter { reason } => format!("no GPU: {reason}"),
        GpuError::TooSmall { name, what } => format!("the GPU {name} is too small: {what}"),
        GpuError::NoDevice { name, reason } => format!("cannot open the GPU {name}: {reason}"),
        other => other.to_string(),
    }
}

/// The camera of a backend.
#[derive(Debug)]
pub enum Renderer {
    /// Casts rays.
    Cpu(Box<RayCastCamera>),
    /// Draws.
    #[cfg(feature = "gpu")]
    Gpu(Box<GpuCamera>),
}

impl Renderer {
    /// The ray-cast camera, if it is one.
    #[must_use]
    pub fn ray_cast(&self) -> Option<&RayCastCamera> {
        match self {
            Self::Cpu(camera) => Some(camera),
            #[cfg(feature = "gpu")]
            Self::Gpu(_) => None,
        }
    }

    /// What is exactly at each pixel's centre, without colour.
    ///
    /// # Errors
    /// If the view is impossible, or the GPU failed.
    pub fn truth(&self, scene: &SceneView<'_>, view: &View) -> Result<TruthImages, Error> {
        match self {
            Self::Cpu(camera) => camera.truth(scene, view).map_err(Error::of_stage),
            #[cfg(feature = "gpu")]
            Self::Gpu(camera) => {
                let drawn = camera.draw(scene, view).map_err(Error::of_stage)?;
                Ok(drawn.truth)
            }
        }
    }

    /// Can it take pictures of this size, pixels?
    ///
    /// # Errors
    /// If its GPU is too small for them.
    #[cfg_attr(
        not(feature = "gpu"),
        allow(unused_variables, reason = "only GPUs have limits")
    )]
    pub fn check_size(&self, width: u32, height: u32) -> Result<(), Error> {
        match self {
            Self::Cpu(_) => Ok(()),
            #[cfg(feature = "gpu")]
            Self::Gpu(camera) => camera.check_size(width, height).map_err(Error::of_stage),
        }
    }

    /// What it holds of a GPU's memory, in words.
    #[must_use]
    pub fn gpu_memory(&self) -> Option<String> {
        match self {
            Self::Cpu(_) => None,
            #[cfg(feature = "gpu")]
            Self::Gpu(camera) => {
                let memory = camera.memory();
                let mib = |bytes: u64| bytes >> 20;
                Some(format!(
                    "GPU memory: {} of {} MiB, {} shapes, {} made room for others",
                    mib(memory.bytes),
                    mib(memory.limit_bytes),
                    memory.shapes,
                    memory.evicted
                ))
            }
        }
    }
}

impl CameraRenderer for Renderer {
    type Error = Error;

    fn render(&self, scene: &SceneView<'_>, view: &View, key: Key) -> Result<CameraImages, Error> {
        match self {
            Self::Cpu(camera) => camera.render(scene, view, key).map_err(Error::of_stage),
            #[cfg(feature = "gpu")]
            Self::Gpu(camera) => camera.render(scene, view, key).map_err(Error::of_stage),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn followed_light_is_the_processors() {
        let mut config = Config::default();
        config.camera.bounces = 3;
        let (backend, why) = Backend::for_config(BackendChoice::Auto, &config).expect("the CPU");
        assert_eq!(backend.name(), "cpu");
        assert_eq!(
            why,
            "renderer: the CPU, as camera.bounces = 3 follows light"
        );
    }
}
