//! Finding and opening a GPU.

use std::any::Any;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::{GpuError, requirements};

/// Which GPUs will do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Accept {
    /// Hardware alone.
    Hardware,
    /// Software that plays a GPU (Mesa's lavapipe) too, if there is no hardware: right, and slower
    /// than the ray-cast camera.
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
    /// The first thing that went wrong outside of an error scope.
    failure: Arc<Mutex<Option<GpuError>>>,
}

impl fmt::Debug for Gpu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Gpu").field(&self.name()).finish()
    }
}

impl Inner {
    /// A lock that a panic left is whole: every change is one statement.
    fn failure(&self) -> MutexGuard<'_, Option<GpuError>> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Inner {
    /// wgpu panics when the queue of a lost GPU is dropped with work in it. So it is not: the
    /// process has nothing left to do with it but to say so and end.
    fn drop(&mut self) {
        if matches!(&*self.failure(), Some(GpuError::Lost { .. })) {
            std::mem::forget(self.queue.clone());
        }
    }
}

impl Gpu {
    /// Opens the best GPU there is: discrete before integrated, Vulkan, Metal or DirectX before GL.
    ///
    /// The environment may narrow the choice, as in all programs that use wgpu: `WGPU_BACKEND`
    /// (`vulkan`, `metal`, `dx12`, `gl`) and `WGPU_ADAPTER_NAME` (a part of the name).
    ///
    /// # Errors
    /// If there is none, it is too small, or its driver fails.
    pub fn open(accept: Accept) -> Result<Self, GpuError> {
        if accept == Accept::Hardware && !has_hardware() {
            let reason = "this machine has no GPU device".to_owned();
            return Err(GpuError::NoAdapter { reason });
        }
        let mut found = Vec::new();
        // GL where nothing better answers: asking it wakes the window system's libraries.
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
        adapters
            .retain(|a| accept == Accept::Any || a.get_info().device_type != wgpu::DeviceType::Cpu);
        // The sort is stable: of equals, the first that the system names.
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

    /// The GPU and the interface it is driven through, such as `NVIDIA H200 (vulkan)`.
    #[must_use]
    pub fn name(&self) -> String {
        let info = &self.inner.info;
        format!("{} ({})", info.name, info.backend)
    }

    /// Is it software?
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

    /// Draws that the GPU tells itself may start at any instance.
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

    /// Shaders may choose samples of a pixel. Not in GL: naga's GLSL has their mask in a type of
    /// its own.
    pub(crate) fn chooses_samples(&self) -> bool {
        self.inner.info.backend != wgpu::Backend::Gl
    }

    /// # Errors
    /// What has gone wrong since the GPU was opened. A lost GPU stays lost.
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
        // What the driver said is better than that waiting failed.
        self.check()?;
        polled
    }

    /// # Errors
    /// If pictures of this size, pixels, are too large.
    pub(crate) fn check_size(&self, size: [u32; 2]) -> Result<(), GpuError> {
        requirements::check_size(&self.name(), size, &self.inner.device.limits())
    }

    /// Loses the GPU, as if its driver had failed once all that was asked for is done.
    #[cfg(test)]
    pub(crate) fn lose(&self) {
        self.inner.device.destroy();
        let polled = self.inner.device.poll(wgpu::PollType::wait_indefinitely());
        polled.expect("it waits for what was asked for");
    }
}

/// Waits. Of a GPU that is lost meanwhile wgpu tells by a panic, when it has locked nothing and
/// told the callback: an error like others.
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

/// What a panic said.
fn message_of(panic: &(dyn Any + Send)) -> String {
    let literal = panic.downcast_ref::<&str>().copied();
    let said = literal.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    said.unwrap_or("waiting for it failed").to_owned()
}

/// Could there be a GPU? Asking its drivers costs a third of a second, and they talk to the
/// standard error of machines without a display.
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
    // Mesa's drivers, NVIDIA's, and those of Windows' Linux and of phones.
    let prefixes = ["dri", "nvidia", "dxg", "kgsl", "mali"];
    devices.flatten().any(|device| {
        let name = device.file_name();
        prefixes
            .iter()
            .any(|p| name.to_string_lossy().starts_with(p))
    })
}

/// What answers, if `WGPU_ADAPTER_NAME` does not speak against it.
fn adapters_of(backends: wgpu::Backends) -> Vec<wgpu::Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = backends;
    // No validation layers, whatever the profile: they may be older than the shaders' language.
    descriptor.flags = wgpu::InstanceFlags::empty().with_env();
    let instance = wgpu::Instance::new(descriptor);
    let mut adapters = pollster::block_on(instance.enumerate_adapters(backends));
    if let Ok(wanted) = std::env::var("WGPU_ADAPTER_NAME") {
        let wanted = wanted.to_lowercase();
        adapters.retain(|a| a.get_info().name.to_lowercase().contains(&wanted));
    }
    adapters
}

/// The smaller, the better.
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
