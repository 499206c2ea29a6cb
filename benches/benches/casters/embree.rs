//! Bindings to a shared library of Intel's Embree 4, as far as this comparison needs it.
//!
//! Names, layouts and numbers are those of `rtcore.h` of Embree 4.4. Opaque triangles are one
//! geometry of a shape, masked ones another with an intersection filter that looks the mask up.
#![allow(
    unsafe_code,
    reason = "a foreign library; each block says why it is sound"
)]

use std::ffi::{OsStr, c_char, c_int, c_uint, c_void};
use std::ptr::{null, null_mut};
use std::sync::Arc;

use nemoral_scene::glam::Vec3;
use nemoral_scene::{AlphaMask, Ray};

use crate::placed::{Placed, Triangle};

type Handle = *mut c_void;

/// The functions that are used.
#[derive(Clone, Copy)]
struct Api {
    new_device: unsafe extern "C" fn(*const c_char) -> Handle,
    device_error: unsafe extern "C" fn(Handle) -> c_int,
    new_scene: unsafe extern "C" fn(Handle) -> Handle,
    commit_scene: unsafe extern "C" fn(Handle),
    new_geometry: unsafe extern "C" fn(Handle, c_int) -> Handle,
    new_buffer: unsafe extern "C" fn(Handle, c_int, c_uint, c_int, usize, usize) -> *mut c_void,
    set_user_data: unsafe extern "C" fn(Handle, *mut c_void),
    set_filter: unsafe extern "C" fn(Handle, unsafe extern "C" fn(*const FilterArguments)),
    set_instanced: unsafe extern "C" fn(Handle, Handle),
    set_transform: unsafe extern "C" fn(Handle, c_uint, c_int, *const c_void),
    commit_geometry: unsafe extern "C" fn(Handle),
    attach: unsafe extern "C" fn(Handle, Handle) -> c_uint,
    intersect1: unsafe extern "C" fn(Handle, *mut RayHit<1>, *const Arguments),
    intersect8: unsafe extern "C" fn(*const c_int, Handle, *mut RayHit<8>, *const Arguments),
}

const TRIANGLES: c_int = 0;
const INSTANCE: c_int = 121;
const INDEX: c_int = 0;
const VERTEX: c_int = 1;
const UINT3: c_int = 0x5003;
const FLOAT3: c_int = 0x9003;
const FLOAT3X4_COLUMNS: c_int = 0x9234;
const NONE: u32 = u32::MAX;

/// `RTCRayHit` and `RTCRayHit8`: `N` lanes of each field.
#[repr(C, align(32))]
struct RayHit<const N: usize> {
    origin: [[f32; N]; 3],
    near: [f32; N],
    direction: [[f32; N]; 3],
    time: [f32; N],
    far: [f32; N],
    mask: [u32; N],
    id: [u32; N],
    flags: [u32; N],
    normal: [[f32; N]; 3],
    u: [f32; N],
    v: [f32; N],
    primitive: [u32; N],
    geometry: [u32; N],
    /// The instance and, depending on how the library was built, its primitive.
    instance: [[u32; N]; 2],
}

/// `RTCIntersectArguments`.
#[repr(C)]
struct Arguments {
    flags: c_int,
    features: c_uint,
    context: *mut c_void,
    filter: *const c_void,
    intersect: *const c_void,
}

/// `RTCFilterFunctionNArguments`.
#[repr(C)]
struct FilterArguments {
    valid: *mut c_int,
    user_data: *const c_void,
    context: *mut c_void,
    ray: *const c_void,
    hit: *const c_void,
    n: c_uint,
}

/// What the filter of a masked geometry needs to know about each of its triangles.
struct Masked {
    triangles: Vec<Triangle>,
    masks: Vec<Arc<AlphaMask>>,
}

/// The loaded library. It is never unloaded: its threads outlive `dlclose`.
#[derive(Clone, Copy)]
pub(crate) struct Embree {
    api: Api,
    device: Handle,
}

/// A scene, ready for rays. Never freed: the process ends after the comparison.
#[derive(Clone, Copy)]
pub(crate) struct Scene {
    api: Api,
    handle: Handle,
}

// SAFETY: many threads may cast rays at a committed scene, and nothing else is done here.
unsafe impl Sync for Scene {}

/// The filter: refuses hits on transparent texels.
///
/// # Safety
/// To be called by Embree for a geometry whose user data is a [`Masked`] of its triangles.
unsafe extern "C" fn filter(arguments: *const FilterArguments) {
    // SAFETY: Embree passes arguments, of which valid has n lanes and hit 6 n and more (the
    // geometry normal's three, u, v, the primitive's number); user data was set by `geometry` to a
    // `Masked` that is never freed, and has an entry for each primitive.
    unsafe {
        let a = &*arguments;
        let masked = &*a.user_data.cast::<Masked>();
        let n = a.n as usize;
        for lane in 0..n {
            let valid = a.valid.add(lane);
            if *valid != -1 {
                continue;
            }
            let at = |row: usize| a.hit.cast::<f32>().add(row * n + lane).read();
            let triangle = masked.triangles.get_unchecked(at(5).to_bits() as usize);
            let uv = triangle.uv(at(3), at(4));
            let mask = triangle.mask.map(|mask| &masked.masks[mask as usize]);
            if mask.is_some_and(|mask| !mask.is_opaque(uv.x, uv.y)) {
                *valid = 0;
            }
        }
    }
}

impl Embree {
    /// Loads the library and makes a device that builds with one thread.
    pub(crate) fn load(path: &OsStr) -> Result<Self, libloading::Error> {
        // SAFETY: the caller names a libembree4, whose initialisers are those of a common library.
        // It is leaked, so the functions stay valid.
        let library: &'static _ = Box::leak(Box::new(unsafe { libloading::Library::new(path)? }));
        macro_rules! get {
            ($name:literal) => {
                // SAFETY: the field's type is the function's in `rtcore.h` of Embree 4.
                unsafe { *library.get(concat!($name, "\0").as_bytes())? }
            };
        }
        let api = Api {
            new_device: get!("rtcNewDevice"),
            device_error: get!("rtcGetDeviceError"),
            new_scene: get!("rtcNewScene"),
            commit_scene: get!("rtcCommitScene"),
            new_geometry: get!("rtcNewGeometry"),
            new_buffer: get!("rtcSetNewGeometryBuffer"),
            set_user_data: get!("rtcSetGeometryUserData"),
            set_filter: get!("rtcSetGeometryIntersectFilterFunction"),
            set_instanced: get!("rtcSetGeometryInstancedScene"),
            set_transform: get!("rtcSetGeometryTransform"),
            commit_geometry: get!("rtcCommitGeometry"),
            attach: get!("rtcAttachGeometry"),
            intersect1: get!("rtcIntersect1"),
            intersect8: get!("rtcIntersect8"),
        };
        // SAFETY: a configuration string that ends in 0.
        let device = unsafe { (api.new_device)(c"threads=1".as_ptr()) };
        Ok(Self { api, device })
    }

    /// A scene of all instances.
    pub(crate) fn scene(&self, placed: &Placed) -> Scene {
        let shapes: Vec<Handle> = placed
            .shapes
            .iter()
            .map(|shape| {
                let (opaque, masked) = shape.iter().partition(|t| t.mask.is_none());
                let parts = [
                    self.geometry(opaque, None),
                    self.geometry(masked, Some(placed)),
                ];
                self.commit(parts.into_iter().flatten())
            })
            .collect();
        let instances = placed.instances.iter().map(|instance| {
            let mut columns = [0.0_f32; 12];
            columns[..9].copy_from_slice(&instance.linear.to_cols_array());
            columns[9..].copy_from_slice(&instance.position.as_vec3().to_array());
            // SAFETY: handles of this device; twelve floats for a 3 x 4 matrix.
            unsafe {
                let geometry = (self.api.new_geometry)(self.device, INSTANCE);
                (self.api.set_instanced)(geometry, shapes[instance.shape]);
                let columns = columns.as_ptr().cast();
                (self.api.set_transform)(geometry, 0, FLOAT3X4_COLUMNS, columns);
                geometry
            }
        });
        let handle = self.commit(instances);
        // SAFETY: the device lives.
        let error = unsafe { (self.api.device_error)(self.device) };
        assert_eq!(error, 0, "Embree's error code");
        Scene {
            api: self.api,
            handle,
        }
    }

    fn commit(&self, geometries: impl Iterator<Item = Handle>) -> Handle {
        // SAFETY: handles of this device.
        unsafe {
            let scene = (self.api.new_scene)(self.device);
            for geometry in geometries {
                (self.api.commit_geometry)(geometry);
                (self.api.attach)(scene, geometry);
            }
            (self.api.commit_scene)(scene);
            scene
        }
    }

    /// A geometry of some triangles, with a filter if they have masks; `None` without triangles.
    fn geometry(&self, triangles: Vec<&Triangle>, masked: Option<&Placed>) -> Option<Handle> {
        let n = triangles.len();
        if n == 0 {
            return None;
        }
        // SAFETY: Embree returns buffers of the requested sizes, with its own alignment and
        // padding, which are written completely. The user data is leaked and so outlives the scene.
        unsafe {
            let geometry = (self.api.new_geometry)(self.device, TRIANGLES);
            let vertices = (self.api.new_buffer)(geometry, VERTEX, 0, FLOAT3, 12, 3 * n);
            let indices = (self.api.new_buffer)(geometry, INDEX, 0, UINT3, 12, n);
            for (i, t) in triangles.iter().enumerate() {
                vertices.cast::<[Vec3; 3]>().add(i).write(t.corners);
                let first = 3 * i as u32;
                indices
                    .cast::<[u32; 3]>()
                    .add(i)
                    .write([first, first + 1, first + 2]);
            }
            if let Some(placed) = masked {
                let data = Masked {
                    triangles: triangles.into_iter().copied().collect(),
                    masks: placed.masks.clone(),
                };
                let data: *mut Masked = Box::leak(Box::new(data));
                (self.api.set_user_data)(geometry, data.cast());
                (self.api.set_filter)(geometry, filter);
            }
            Some(geometry)
        }
    }
}

impl<const N: usize> RayHit<N> {
    fn of(rays: &[Ray]) -> Self {
        // The last ray stands in for those that are missing.
        let lane = |i: usize| &rays[i.min(rays.len() - 1)];
        let each = |f: &dyn Fn(&Ray) -> f32| std::array::from_fn(|i| f(lane(i)));
        Self {
            origin: [0, 1, 2].map(|k| each(&|r: &Ray| r.origin[k])),
            near: each(&|r| r.t_min_m),
            direction: [0, 1, 2].map(|k| each(&|r: &Ray| r.direction[k])),
            time: [0.0; N],
            far: each(&|r| r.t_max_m),
            mask: [NONE; N],
            id: [0; N],
            flags: [0; N],
            normal: [[0.0; N]; 3],
            u: [0.0; N],
            v: [0.0; N],
            primitive: [NONE; N],
            geometry: [NONE; N],
            instance: [[NONE; N]; 2],
        }
    }

    fn distance(&self, lane: usize) -> f32 {
        if self.geometry[lane] == NONE {
            f32::INFINITY
        } else {
            self.far[lane]
        }
    }
}

impl Scene {
    /// `rtcIntersect1` for each ray: distances, infinite where nothing is hit.
    pub(crate) fn cast1(&self, rays: &[Ray], distances: &mut [f32]) {
        for (ray, distance) in rays.iter().zip(distances) {
            let mut lanes = RayHit::<1>::of(std::slice::from_ref(ray));
            // SAFETY: a committed scene, a ray of the size and alignment asked for, default
            // arguments.
            unsafe { (self.api.intersect1)(self.handle, &mut lanes, null()) };
            *distance = lanes.distance(0);
        }
    }

    /// `rtcIntersect8` for each eight rays; `coherent` is Embree's hint.
    pub(crate) fn cast8(&self, rays: &[Ray], distances: &mut [f32], coherent: bool) {
        #[repr(C, align(32))]
        struct Valid([c_int; 8]);
        let arguments = Arguments {
            flags: if coherent { 1 << 16 } else { 0 },
            features: c_uint::MAX,
            context: null_mut(),
            filter: null(),
            intersect: null(),
        };
        for (rays, distances) in rays.chunks(8).zip(distances.chunks_mut(8)) {
            let mut lanes = RayHit::<8>::of(rays);
            let valid = Valid(std::array::from_fn(|i| if i < rays.len() { -1 } else { 0 }));
            // SAFETY: as above, and eight flags.
            unsafe {
                let valid = valid.0.as_ptr();
                (self.api.intersect8)(valid, self.handle, &mut lanes, &arguments);
            }
            for (lane, distance) in distances.iter_mut().enumerate() {
                *distance = lanes.distance(lane);
            }
        }
    }
}
