//! Finding and opening a GPU.

use std::any::Any;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::{GpuError, requirements};

/// The kinds of GPUs that are accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AcceptedGpus {
    /// Only hardware.
    Hardware,
    /// Also software that emulates a GPU (Mesa's lavapipe), if there is no hardware. Its pictures
    /// are right, but it is slower than the ray-cast camera.
    Any,
}

/// An opened GPU. Clones share it.
#[derive(Clone)]
pub struct Gpu {
    inner: Arc<Inner>,
    starts_anywhere: bool,
}

struct Inner {
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    /// The first error outside of an error scope.
    failure: Arc<Mutex<Option<GpuError>>>,
}

impl fmt::Debug for Gpu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Gpu").field(&self.name()).finish()
    }
}

impl Inner {
    /// A panic of another thread leaves the value consistent, as every change is one statement.
    fn failure(&self) -> MutexGuard<'_, Option<GpuError>> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Inner {
    /// wgpu panics when the queue of a lost GPU is dropped with work in it. Therefore it is not
    /// dropped; the process can only report the error and end anyway.
    fn drop(&mut self) {
        if matches!(&*self.failure(), Some(GpuError::Lost { .. })) {
            std::mem::forget(self.queue.clone());
        }
    }
}

impl Gpu {
    /// Opens the best GPU: discrete ones before integrated ones, and Vulkan, Metal or DirectX
    /// before GL.
    ///
    /// The environment may narrow the choice, as in all programs that use wgpu: `WGPU_BACKEND`
    /// (`vulkan`, `metal`, `dx12`, `gl`) and `WGPU_ADAPTER_NAME` (a part of the name).
    ///
    /// # Errors
    /// If there is none, it is too small, or its driver fails.
    pub fn open(accepted: AcceptedGpus) -> Result<Self, GpuError> {
        if accepted == AcceptedGpus::Hardware && !has_hardware() {
            let reason = "this machine has no GPU device".to_owned();
            return Err(GpuError::NoAdapter { reason });
        }
        let mut found = Vec::new();
        // GL is asked only if there is nothing better, because that loads the libraries of the
        // window system.
        let asked = match wgpu::Backends::from_env() {
            Some(backends) => vec![backends],
            None => vec![wgpu::Backends::PRIMARY, wgpu::Backends::GL],
        };
        let mut adapters = Vec::new();
        for backends in asked {
            if found.is_empty() {
                adapters = adapters_of(backends);
                found.extend(adapters.iter().map(|a| a.get_info().name));
            }
        }
        adapters.retain(|a| {
            accepted == AcceptedGpus::Any || a.get_info().device_type != wgpu::DeviceType::Cpu
        });
        // The sort is stable, so that of equal GPUs the first that the system lists is taken.
        adapters.sort_by_key(|a| rank(&a.get_info()));
        let Some(adapter) = adapters.into_iter().next() else {
            let reason = if found.is_empty() {
                "no driver answers".to_owned()
            } else {
                format!("{} is software", found.join(", "))
            };
            return Err(GpuError::NoAdapter { reason });
        };
        Self::open_adapter(&adapter)
    }

    fn open_adapter(adapter: &wgpu::Adapter) -> Result<Self, GpuError> {
        let name = adapter.get_info().name;
        let flags = adapter.get_downlevel_capabilities().flags;
        let limits = adapter.limits();
        requirements::check(&name, flags, &limits)?;
        Self::request(adapter, limits)
    }

    fn request(adapter: &wgpu::Adapter, limits: wgpu::Limits) -> Result<Self, GpuError> {
        let info = adapter.get_info();
        let wanted = adapter.features() & wgpu::Features::INDIRECT_FIRST_INSTANCE;
        let starts_anywhere = !wanted.is_empty();
        let descriptor = wgpu::DeviceDescriptor {
            required_features: wanted,
            required_limits: limits,
            ..Default::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|e| {
                GpuError::NoDevice {
                    name: info.name.clone(),
                    reason: e.to_string(),
                }
            })?;
        let failure = Arc::new(Mutex::new(None));
        let first = |failure: &Mutex<Option<GpuError>>, error| {
            let mut slot = failure.lock().unwrap_or_else(PoisonError::into_inner);
            slot.get_or_insert(error);
        };
        let kept = Arc::clone(&failure);
        device.on_uncaptured_error(Arc::new(move |e| {
            let reason = e.to_string();
            first(&kept, GpuError::Refused { reason });
        }));
        let kept = Arc::clone(&failure);
        device.set_device_lost_callback(move |why, reason| {
            let reason = if reason.is_empty() {
                format!("{why:?}")
            } else {
                reason
            };
            first(&kept, GpuError::Lost { reason });
        });
        let inner = Inner {
            device,
            queue,
            info,
            failure,
        };
        Ok(Self {
            inner: Arc::new(inner),
            starts_anywhere,
        })
    }

    /// The GPU and its interface, such as `NVIDIA H200 (vulkan)`.
    #[must_use]
    pub fn name(&self) -> String {
        let info = &self.inner.info;
        format!("{} ({})", info.name, info.backend)
    }

    /// Whether it is software.
    #[must_use]
    pub fn is_software(&self) -> bool {
        self.inner.info.device_type == wgpu::DeviceType::Cpu
    }

    pub(crate) fn device(&self) -> &wgpu::Device {
        &self.inner.device
    }

    pub(crate) fn queue(&self) -> &wgpu::Queue {
        &self.inner.queue
    }

    /// Whether indirect draws may start at any instance.
    pub(crate) fn starts_anywhere(&self) -> bool {
        self.starts_anywhere
    }

    /// The same, as if its draws could not.
    #[cfg(test)]
    pub(crate) fn without_first_instances(&self) -> Self {
        Self {
            starts_anywhere: false,
            ..self.clone()
        }
    }

    /// Whether shaders may choose the samples of a pixel. In GL they may not, because naga's GLSL
    /// uses another type for the mask.
    pub(crate) fn chooses_samples(&self) -> bool {
        self.inner.info.backend != wgpu::Backend::Gl
    }

    /// # Errors
    /// Checks for errors since the GPU was opened. A lost GPU stays lost.
    pub(crate) fn check(&self) -> Result<(), GpuError> {
        let mut slot = self.inner.failure();
        match &*slot {
            None => Ok(()),
            Some(lost @ GpuError::Lost { .. }) => Err(lost.clone()),
            Some(_) => Err(slot.take().expect("it is there")),
        }
    }

    /// Waits until a submission is done.
    pub(crate) fn wait(&self, submission: wgpu::SubmissionIndex) -> Result<(), GpuError> {
        let wait = wgpu::PollType::Wait {
            submission_index: Some(submission),
            timeout: None,
        };
        let polled = survived(|| self.inner.device.poll(wait));
        // The driver's error is more useful than the fact that waiting failed.
        self.check()?;
        polled
    }

    /// # Errors
    /// If pictures of this size, pixels, are too large.
    pub(crate) fn check_size(&self, size: [u32; 2]) -> Result<(), GpuError> {
        requirements::check_size(&self.name(), size, &self.inner.device.limits())
    }

    /// Loses the GPU, as if its driver had failed after all submitted work is done.
    #[cfg(test)]
    pub(crate) fn lose(&self) {
        self.inner.device.destroy();
        let polled = self.inner.device.poll(wgpu::PollType::wait_indefinitely());
        polled.expect("it waits for what was asked for");
    }
}

/// Waits. If the GPU is lost meanwhile, wgpu panics after it has released its locks and called the
/// callback; that is turned into an error.
fn survived(
    poll: impl FnOnce() -> Result<wgpu::PollStatus, wgpu::PollError>,
) -> Result<(), GpuError> {
    let reason = match catch_unwind(AssertUnwindSafe(poll)) {
        Ok(Ok(_)) => return Ok(()),
        Ok(Err(e)) => e.to_string(),
        Err(panic) => message_of(&*panic),
    };
    Err(GpuError::Lost { reason })
}

/// The message of a panic.
fn message_of(panic: &(dyn Any + Send)) -> String {
    let literal = panic.downcast_ref::<&str>().copied();
    let said = literal.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    said.unwrap_or("waiting for it failed").to_owned()
}

/// Whether there may be a GPU. Asking its drivers takes a third of a second, and on machines
/// without a display they write to standard error.
#[allow(
    clippy::disallowed_methods,
    reason = "a folder of devices is looked at, no file of anybody's"
)]
fn has_hardware() -> bool {
    if !cfg!(target_os = "linux") {
        return true;
    }
    let Ok(devices) = std::fs::read_dir("/dev") else {
        return true;
    };
    // The drivers of Mesa and NVIDIA, those of Linux under Windows, and those of phones.
    let prefixes = ["dri", "nvidia", "dxg", "kgsl", "mali"];
    devices.flatten().any(|device| {
        let name = device.file_name();
        prefixes
            .iter()
            .any(|p| name.to_string_lossy().starts_with(p))
    })
}

/// The adapters that exist, filtered by `WGPU_ADAPTER_NAME`.
fn adapters_of(backends: wgpu::Backends) -> Vec<wgpu::Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = backends;
    // Validation layers are off in all profiles, because they may be older than the language of the
    // shaders.
    descriptor.flags = wgpu::InstanceFlags::empty().with_env();
    let instance = wgpu::Instance::new(descriptor);
    let mut adapters = pollster::block_on(instance.enumerate_adapters(backends));
    if let Ok(wanted) = std::env::var("WGPU_ADAPTER_NAME") {
        let wanted = wanted.to_lowercase();
        adapters.retain(|a| a.get_info().name.to_lowercase().contains(&wanted));
    }
    adapters
}

/// The rank of an adapter; smaller is better.
fn rank(info: &wgpu::AdapterInfo) -> (u8, u8) {
    let kind = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    };
    (kind, u8::from(info.backend == wgpu::Backend::Gl))
}

#[cfg(test)]
mod tests;
