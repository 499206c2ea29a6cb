//! The renderer that takes a data set's pictures, which is chosen once before anything is made.

#[cfg(feature = "gpu")]
use nemoral_render::{AcceptedGpus, Gpu, GpuCamera, GpuError, GpuParams};
use nemoral_render::{CameraImages, CameraRenderer, Lighting, RayCastCamera, SceneView, View};
use nemoral_scene::TruthImages;
use nemoral_seed::Key;

use crate::Error;
use crate::config::{Config, Sequences};

/// What a request says about the renderer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BackendChoice {
    /// A hardware GPU if a suitable one is found, else the CPU.
    #[default]
    Auto,
    /// The ray-cast camera, which works everywhere.
    Cpu,
    /// A GPU, or software that emulates one if there is no hardware.
    Gpu,
}

/// Why a config's pictures are taken on the CPU, if they can be nowhere else.
fn needs_the_cpu(config: &Config) -> Option<String> {
    let follows = config.all_cameras().find(|(_, camera)| camera.bounces > 0);
    let lamp = config.all_lamps().map(|(path, _)| format!("{path} shines"));
    let follows = follows.map(|(path, c)| format!("{path}.bounces = {} follows light", c.bounces));
    lamp.chain(follows).next()
}

/// The renderer that was chosen.
#[derive(Clone, Debug, Default)]
pub enum Backend {
    /// The ray-cast camera.
    #[default]
    Cpu,
    /// A GPU.
    #[cfg(feature = "gpu")]
    Gpu {
        /// The device.
        gpu: Gpu,
        /// The most of its memory that a renderer uses, MiB.
        memory_mib: u32,
    },
}

impl Backend {
    /// Chooses for all sequences of a data set, and explains the choice in words.
    ///
    /// # Errors
    /// As [`Backend::resolve`], and if a sequence's config is impossible, or needs the CPU where a
    /// GPU is demanded.
    pub fn for_sequences(
        choice: BackendChoice,
        sequences: &Sequences,
    ) -> Result<(Self, String), Error> {
        let mut chosen = None;
        for number in 0..sequences.len() {
            let config = sequences.get(number)?.config;
            if !config.camera.enabled {
                continue;
            }
            if chosen.is_none() {
                let first = Self::for_config(choice, &config)?;
                if matches!(first.0, Self::Cpu) {
                    return Ok(first);
                }
                chosen = Some(first);
            }
            // A GPU must do for all sequences.
            match needs_the_cpu(&config) {
                None => {}
                Some(why) if choice == BackendChoice::Gpu => {
                    let message = format!("sequence {number}: {why}, on the CPU alone");
                    return Err(Error::request(format!("--backend gpu: {message}")));
                }
                Some(why) => {
                    let why = format!("renderer: the CPU, as in sequence {number} {why}");
                    return Ok((Self::Cpu, why));
                }
            }
        }
        match chosen {
            Some(gpu) => Ok(gpu),
            None => Self::for_config(choice, &sequences.get(0)?.config),
        }
    }

    /// Chooses for a config, and explains the choice in words.
    ///
    /// # Errors
    /// As [`Backend::resolve`].
    pub fn for_config(choice: BackendChoice, config: &Config) -> Result<(Self, String), Error> {
        if !config.camera.enabled {
            let none = "renderer: none, as there is no camera";
            return Ok((Self::Cpu, none.to_owned()));
        }
        match (choice, needs_the_cpu(config)) {
            (BackendChoice::Auto, Some(why)) => {
                Ok((Self::Cpu, format!("renderer: the CPU, as {why}")))
            }
            _ => Self::resolve(choice),
        }
    }

    /// Decides, and says in words what and why.
    ///
    /// # Errors
    /// If a GPU is demanded and no suitable one is found, or this build supports none (feature
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
                let gpu = Gpu::open(AcceptedGpus::Any).map_err(|e| match e {
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
            BackendChoice::Auto => Ok(match Gpu::open(AcceptedGpus::Hardware) {
                Ok(gpu) => on(gpu, ""),
                Err(e) => (Self::Cpu, format!("renderer: the CPU ({})", cause(e))),
            }),
        }
    }

    /// Decides, and says in words what and why.
    ///
    /// # Errors
    /// If a GPU is demanded, as this build supports none (feature `gpu`).
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

    /// The same with a limit on the memory of a GPU, MiB, for each renderer. Cameras that differ in
    /// look, samples or radiance have a renderer each.
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

    /// Whether it can draw a frame while the processor works on the one before. The ray-cast camera
    /// cannot, as it runs on the processor.
    #[must_use]
    pub fn draws_ahead(&self) -> bool {
        !matches!(self, Self::Cpu)
    }

    /// Its name in the data set, which is specific to the GPU, because another GPU may draw
    /// slightly different pictures.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Cpu => "cpu".to_owned(),
            #[cfg(feature = "gpu")]
            Self::Gpu { gpu, .. } => format!("gpu: {}", gpu.name()),
        }
    }
}

/// Why there is no GPU, without the advice for users who demand one.
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
    /// The ray-cast camera, if this is one.
    #[must_use]
    pub fn ray_cast(&self) -> Option<&RayCastCamera> {
        match self {
            Self::Cpu(camera) => Some(camera),
            #[cfg(feature = "gpu")]
            Self::Gpu(_) => None,
        }
    }

    /// The light that it shows things in.
    #[must_use]
    pub fn lighting(&self) -> &Lighting {
        match self {
            Self::Cpu(camera) => camera.lighting(),
            #[cfg(feature = "gpu")]
            Self::Gpu(camera) => camera.lighting(),
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

    /// Checks that it can take pictures of this size, pixels.
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

    /// How much memory of a GPU it uses, in words.
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
    use crate::config::Lamp;

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

    #[test]
    fn lamps_are_the_processors() {
        let mut config = Config::default();
        config.lamps.insert("left".to_owned(), Lamp::default());
        assert_eq!(needs_the_cpu(&config), None, "it is off");
        config
            .lamps
            .entry("left".to_owned())
            .and_modify(|lamp| lamp.enabled = true);
        let (backend, why) = Backend::for_config(BackendChoice::Auto, &config).expect("the CPU");
        assert_eq!(backend.name(), "cpu");
        assert_eq!(why, "renderer: the CPU, as lamps.left shines");
    }
}
