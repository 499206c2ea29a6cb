//! The steps of a picture: uploading, drawing and reading back.

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use glam::{DVec3, Vec3};
use nemoral_scene::{Image, ObjectId, TruthImages};
use nemoral_seed::Key;

use super::accumulation::{AccumulatedLight, PendingReadback, instants};
use super::cascade::Cascade;
use super::cull::{Culled, Culler, ViewBindings};
use super::distortion_bounds::DistortionBounds;
use super::frame::{FrameRecord, origin_of};
use super::frustum::Frustum;
use super::lighting::{LightingInputs, LightingPass};
use super::memory::{GpuMemory, MemoryReservation};
use super::params::GpuParams;
use super::pass::TruthPass;
use super::pipeline::{ExactPass, Layouts, group};
use super::readback::Readback;
use super::shapes::Shapes;
use super::state::State;
use super::targets::{reversed, texels, truth_images, view_of};
use super::{Gpu, GpuError, Pass};
use crate::camera::picture::{self, Surroundings};
use crate::{CameraImages, CameraRenderer, Lighting, SceneView, View};

/// The images of the truth pass and of the passes that were added.
#[derive(Clone, Debug, PartialEq)]
pub struct GpuImages {
    /// The truth at exactly each pixel's centre.
    pub truth: TruthImages,
    /// For each pass that was added, in order, what its `paint` returned.
    pub passes: Vec<Image<[u32; 4]>>,
}

/// The camera that draws on a GPU.
///
/// It keeps shapes, instances and materials on the GPU between pictures, within
/// [`memory_mib`](GpuParams::memory_mib); the GPU decides which instances a picture shows. While
/// one picture is read back, that of another thread is drawn. The truth is the ray-cast camera's
/// except for rounding: on borders of surfaces, one pixel in some thousands shows the neighbour.
pub struct GpuCamera {
    gpu: Gpu,
    params: GpuParams,
    lighting: Lighting,
    layouts: Layouts,
    culler: Culler,
    state: Mutex<State>,
    /// Bytes of device memory that pictures in progress have reserved.
    reserved: Arc<AtomicU64>,
}

impl fmt::Debug for GpuCamera {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("GpuCamera")
            .field("gpu", &self.gpu)
            .field("params", &self.params)
            .finish_non_exhaustive()
    }
}

impl GpuCamera {
    /// A camera on a GPU, under a light.
    ///
    /// # Errors
    /// If a parameter is out of its range, or the GPU refuses.
    pub fn new(gpu: &Gpu, params: GpuParams, lighting: Lighting) -> Result<Self, GpuError> {
        params.check()?;
        let layouts = Layouts::new(gpu);
        let truth = ExactPass::new(gpu, &layouts, Box::new(TruthPass))?;
        let lighting_pass = LightingPass::new(gpu, &layouts, &lighting, &params)?;
        let culler = Culler::new(gpu);
        gpu.check()?;
        let state = State {
            materials: None,
            instances: None,
            shapes: Shapes::new(u64::from(params.memory_mib) << 20),
            passes: vec![truth],
            lighting: lighting_pass,
            targets: None,
            transient: 0,
        };
        Ok(Self {
            gpu: gpu.clone(),
            params,
            lighting,
            layouts,
            culler,
            state: Mutex::new(state),
            reserved: Arc::default(),
        })
    }

    /// The light it takes pictures in.
    #[must_use]
    pub fn lighting(&self) -> &Lighting {
        &self.lighting
    }

    /// The GPU that it draws on.
    #[must_use]
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Checks that the GPU can draw pictures of this size in pixels. Every picture is checked by
    /// itself; this allows a check before the first one.
    ///
    /// # Errors
    /// If the GPU is too small for them.
    pub fn check_size(&self, width: u32, height: u32) -> Result<(), GpuError> {
        self.gpu.check_size([width, height])
    }

    /// Draws this pass too from now on, by [`draw`](Self::draw).
    ///
    /// # Errors
    /// If its shader is wrong.
    pub fn add_pass(&self, pass: Box<dyn Pass>) -> Result<(), GpuError> {
        let mut state = self.state();
        state
            .passes
            .push(ExactPass::new(&self.gpu, &self.layouts, pass)?);
        Ok(())
    }

    /// The device memory in use.
    #[must_use]
    pub fn memory(&self) -> GpuMemory {
        let state = self.state();
        GpuMemory {
            bytes: state.fixed() + self.reserved_bytes() + state.shapes.pool.bytes(),
            limit_bytes: self.limit(),
            shapes: state.shapes.len(),
            evicted: state.shapes.evicted,
        }
    }

    /// The truth and all passes that were added, without colour.
    ///
    /// # Errors
    /// If the view is invalid, the scene does not fit, or the GPU failed.
    pub fn draw(&self, scene: &SceneView<'_>, view: &View) -> Result<GpuImages, GpuError> {
        view.check()?;
        let mut state = self.state();
        let mut picture = self.prepare(&mut state, scene, view, &[])?;
        let (readbacks, submission) = self.draw_exact(&mut state, &mut picture, usize::MAX);
        drop(state);
        let mut images = readbacks
            .iter()
            .map(|readback| readback.read(&self.gpu, &submission, |rows| texels(rows, view)));
        let truth = images.next().expect("the truth is the first pass")?;
        Ok(GpuImages {
            truth: truth_images(&truth, view, &picture.objects),
            passes: images.collect::<Result<_, _>>()?,
        })
    }

    /// Uploads everything that a picture needs, and culls it.
    fn prepare(
        &self,
        state: &mut State,
        scene: &SceneView<'_>,
        view: &View,
        cascades: &[Cascade],
    ) -> Result<PreparedPicture, GpuError> {
        self.gpu.check()?;
        let groups = scene.instances.ok_or(GpuError::NoShapes)?.placed_groups();
        state.hold_materials(&self.gpu, scene)?;
        state.hold_targets(&self.gpu, view)?;
        let origin_m = origin_of(view);
        let range_m = self.params.max_range_m;
        let distortion = DistortionBounds::of(view);
        if distortion.is_some() {
            state.prepare_distorted(&self.gpu, &self.layouts)?;
        }
        state.hold_instances(&self.gpu, &groups, origin_m)?;
        let mut reservation = MemoryReservation::new(&self.reserved);
        state.shapes.held = state.fixed() + self.reserved_bytes() + state.transient;

        let camera = Frustum::of_view(view, distortion.as_ref(), origin_m, range_m.into());
        let shadows = cascades.iter().map(Cascade::frustum);
        let frustums: Vec<Frustum> = std::iter::once(camera).chain(shadows).collect();
        let instances = state.instances.as_ref().expect("it was gathered");
        let seen = instances.visible_prototypes(&frustums, origin_m);
        state
            .shapes
            .ensure(&self.gpu, &self.layouts.page, seen.iter().map(|(p, _)| p))?;
        let culled = (self.culler).cull(
            &self.gpu,
            instances,
            &state.shapes,
            &seen,
            &frustums,
            origin_m,
        )?;
        reservation.add(culled.bytes);

        let origin = origin_m - instances.origin_m;
        let frame = FrameRecord::new(view, distortion.as_ref(), origin_m, origin, range_m);
        let materials = state.materials.as_ref().expect("they were uploaded");
        let frame = bytemuck::bytes_of(&frame);
        let bindings = ViewBindings::new(&self.gpu, &self.layouts, materials, instances, 0, frame)?;
        let targets = state.targets.as_ref().expect("they were made");
        targets.cast_rays(&self.gpu, view, origin_m);
        Ok(PreparedPicture {
            origin_m,
            origin,
            distortion,
            culled,
            bindings,
            objects: Arc::clone(&instances.objects),
            reservation,
        })
    }

    /// Draws the first `count` exact passes, and starts to read their images back.
    fn draw_exact(
        &self,
        state: &mut State,
        picture: &mut PreparedPicture,
        count: usize,
    ) -> (Vec<Readback>, wgpu::SubmissionIndex) {
        let targets = state.targets.as_ref().expect("they were made");
        let [exact, depth, rays] = [&targets.exact, &targets.depth, &targets.rays].map(view_of);
        let mut encoder = self
            .gpu
            .device()
            .create_command_encoder(&Default::default());
        let mut readbacks = Vec::new();
        for own in state.passes.iter().take(count) {
            let attachment = wgpu::RenderPassColorAttachment {
                view: &exact,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            };
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some(own.pass.name()),
                color_attachments: &[Some(attachment)],
                depth_stencil_attachment: Some(reversed(&depth)),
                ..Default::default()
            });
            let table = own.table.as_ref().expect("tables follow materials");
            let resources = [
                table.as_entire_binding(),
                wgpu::BindingResource::TextureView(&rays),
                targets.eyes.as_entire_binding(),
            ];
            let group = group(&self.gpu, own.pass.name(), &self.layouts.exact, &resources);
            let pool = &state.shapes.pool;
            let pipelines = own.pipelines.of(picture.distortion.is_some());
            (picture.culled).draw(
                &self.gpu,
                &mut pass,
                pool,
                pipelines,
                &picture.bindings,
                &group,
            );
            drop(pass);
            let readback = Readback::encode(&self.gpu, &mut encoder, &targets.exact, 16);
            readbacks.push(readback);
        }
        let submission = self.gpu.queue().submit([encoder.finish()]);
        picture
            .reservation
            .add(readbacks.iter().map(Readback::bytes).sum());
        state.transient = picture.reservation.bytes;
        (readbacks, submission)
    }

    /// Draws the light that comes to the pixels over the exposure. On return, all of its instants
    /// but the last are read back.
    fn expose(
        &self,
        state: &mut State,
        picture: &mut PreparedPicture,
        scene: &SceneView<'_>,
        view: &View,
        cascades: &[Cascade],
    ) -> Result<AccumulatedLight, GpuError> {
        let targets = state.targets.as_ref().expect("they were made");
        let inputs = LightingInputs {
            gpu: &self.gpu,
            layouts: &self.layouts,
            materials: state.materials.as_ref().expect("they were uploaded"),
            shapes: &state.shapes,
            lighting: &self.lighting,
            view,
            scene,
            cascades,
            origin: picture.origin,
            instances: state.instances.as_ref().expect("it was gathered"),
            culled: &picture.culled,
            bindings: &picture.bindings,
            distorted: picture.distortion.is_some(),
            rays: &targets.rays,
            eyes: &targets.eyes,
        };
        let (light, bytes) = state.lighting.upload(&inputs)?;
        picture.reservation.add(bytes);
        let views = instants(&self.gpu, &self.params, view);
        let mut sum = vec![Vec3::ZERO; targets.pixels()];
        let mut last: Option<PendingReadback> = None;
        for (i, instant) in views.iter().enumerate() {
            if views.len() > 1 {
                let (distortion, range_m) = (picture.distortion.as_ref(), self.params.max_range_m);
                let frame = FrameRecord::new(
                    instant,
                    distortion,
                    picture.origin_m,
                    picture.origin,
                    range_m,
                );
                picture
                    .bindings
                    .set_frame(&self.gpu, bytemuck::bytes_of(&frame));
                targets.cast_rays(&self.gpu, instant, picture.origin_m);
            }
            let (readback, submission) = state.lighting.draw(&inputs, &light)?;
            // One is read back while the GPU draws the next.
            if i < 2 {
                picture.reservation.add(readback.bytes());
            }
            let coming = PendingReadback {
                view: *instant,
                readback,
                submission,
            };
            if let Some(before) = last.replace(coming) {
                let behind = (&self.lighting, state.lighting.backdrop);
                before.add(&self.gpu, behind, &mut sum)?;
            }
        }
        state.transient = picture.reservation.bytes;
        Ok(AccumulatedLight {
            backdrop: state.lighting.backdrop,
            sum,
            count: views.len(),
            last: last.expect("there is an instant at least"),
        })
    }

    fn reserved_bytes(&self) -> u64 {
        self.reserved.load(Ordering::Relaxed)
    }

    fn limit(&self) -> u64 {
        u64::from(self.params.memory_mib) << 20
    }

    /// A panic while a picture was rendered cannot leave a state that the next picture must not
    /// use.
    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl CameraRenderer for GpuCamera {
    type Error = GpuError;

    /// The key is for the sensor's noise alone, as nothing else in the picture is random.
    fn render(
        &self,
        scene: &SceneView<'_>,
        view: &View,
        key: Key,
    ) -> Result<CameraImages, GpuError> {
        view.check()?;
        scene.check()?;
        self.params.lens.check_for(&view.intrinsics)?;
        let position = view.scene_from_camera.translation_m.as_vec3();
        let open = scene.sky_view_factor_of_camera(position)?;
        if !scene.lamps.is_empty() {
            let count = scene.lamps.len();
            return Err(GpuError::Lamps { count });
        }
        let mut guard = self.state();
        let state = &mut *guard;
        let cascades = Cascade::all(
            view,
            origin_of(view),
            self.params.max_range_m.into(),
            self.lighting.sun_direction(),
            self.params.shadow_px,
        );
        state.lighting.hold_targets(&self.gpu, view)?;
        let mut picture = self.prepare(state, scene, view, &cascades)?;
        let (truth, truth_drawn) = self.draw_exact(state, &mut picture, 1);
        let exposure = self.expose(state, &mut picture, scene, view, &cascades)?;
        // From here on the next picture may be drawn.
        drop(guard);
        let truth = truth[0].read(&self.gpu, &truth_drawn, |rows| texels(rows, view))?;
        let truth = truth_images(&truth, view, &picture.objects);
        let linear = exposure.read(&self.gpu, &self.lighting)?;
        let around = Surroundings {
            ambient: self.lighting.ambient(open).mean_radiance(),
            lamps: &[],
        };
        let picture = picture::take(linear, &around, &truth, &self.params.lens, view, key);
        Ok(CameraImages {
            rgb: picture.rgb,
            linear: self.params.keep_linear.then_some(picture.linear),
            truth,
            ev100: picture.ev100,
        })
    }
}

/// A picture whose scene is on the GPU, culled and ready to draw.
struct PreparedPicture {
    origin_m: DVec3,
    /// Relative to the instance buffer's origin.
    origin: DVec3,
    distortion: Option<DistortionBounds>,
    culled: Culled,
    /// The camera's frame.
    bindings: ViewBindings,
    /// The objects of the instance buffer's instances.
    objects: Arc<[ObjectId]>,
    reservation: MemoryReservation,
}
