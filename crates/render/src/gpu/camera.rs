//! The camera itself.

use std::fmt;
use std::sync::{Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3, Mat4, Vec3, Vec4};
use nemoral_scene::{Image, ObjectId, TruthImages};
use nemoral_seed::Key;

use super::bend::{Bend, BendRecord};
use super::cascade::Cascade;
use super::cull::{Crowd, Frustum};
use super::lit::{Lit, LitShot};
use super::materials::Materials;
use super::pages::GpuMemory;
use super::pass::TruthPass;
use super::pipeline::{Batch, ExactPass, Layouts, group};
use super::readback::Readback;
use super::shapes::Shapes;
use super::targets::{Targets, reversed, texels, truth_images, view_of};
use super::{Gpu, GpuError, Pass};
use crate::error::{ParamError, check};
use crate::tone::{develop, log_mean_luminance};
use crate::{CameraImages, CameraRenderer, Lens, Lighting, SceneView, View};

/// How the GPU's pictures are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GpuParams {
    /// How far is seen; things fade into the sky towards there. Metres, 1..=100,000.
    pub max_range_m: f32,
    /// What the lens does to the light.
    pub lens: Lens,
    /// Return the radiance image too?
    pub keep_linear: bool,
    /// Colour samples of a pixel: 1, at its centre, or 4.
    pub colour_samples: u32,
    /// Instants of a picture that blurs because the camera moves, 2..=256, in as many equal parts of
    /// the exposure; each is drawn with as many samples a pixel.
    pub blur_samples: u32,
    /// Sides of each shadow map, texels, 256..=8192.
    pub shadow_px: u32,
    /// The most device memory that is used, MiB, 128..=1,048,576.
    pub memory_mib: u32,
}

impl Default for GpuParams {
    fn default() -> Self {
        Self {
            max_range_m: 300.0,
            lens: Lens::default(),
            keep_linear: false,
            colour_samples: 4,
            blur_samples: 9,
            shadow_px: 2048,
            memory_mib: 4096,
        }
    }
}

/// What the exact passes drew.
#[derive(Clone, Debug, PartialEq)]
pub struct GpuImages {
    /// What is exactly at each pixel's centre.
    pub truth: TruthImages,
    /// Of each pass that was added, in order: what its `paint` gave.
    pub passes: Vec<Image<[u32; 4]>>,
}

/// The camera that draws on a GPU.
///
/// It keeps shapes and materials on the GPU between pictures, within
/// [`memory_mib`](GpuParams::memory_mib). The truth is the ray-cast camera's but for rounding: on
/// borders of surfaces a pixel in some thousands sees the neighbour.
pub struct GpuCamera {
    gpu: Gpu,
    params: GpuParams,
    lighting: Lighting,
    layouts: Layouts,
    state: Mutex<State>,
}

struct State {
    materials: Option<Materials>,
    shapes: Shapes,
    /// The truth first.
    passes: Vec<ExactPass>,
    lit: Lit,
    targets: Option<Targets>,
    /// Of the last picture: batches and read-backs.
    transient: u64,
}

/// Things nearer than this are not drawn.
const NEAR_M: f64 = 0.01;

/// A frame's origin lies on a grid of this step, so that places of chunks are exact in f32.
const GRID_PER_M: f64 = 1024.0;

/// `Frame` in `surface.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct FrameRecord {
    /// By columns.
    pub(crate) clip: [[f32; 4]; 4],
    pub(crate) eye: [f32; 4],
    pub(crate) forward: [f32; 4],
    pub(crate) right: [f32; 4],
    pub(crate) down: [f32; 4],
    pub(crate) size: [f32; 4],
    pub(crate) bend: BendRecord,
}

impl FrameRecord {
    fn new(view: &View, bend: Option<&Bend>, origin_m: DVec3, max_range_m: f32) -> Self {
        let k = &view.intrinsics;
        let (w, h) = (f64::from(k.width), f64::from(k.height));
        let axes = DMat3::from_quat(view.scene_from_camera.rotation);
        let eye = view.scene_from_camera.translation_m - origin_m;
        let (x, y, z) = (axes.x_axis, axes.y_axis, axes.z_axis);
        // Rows of the clip matrix, in scene axes about the eye.
        let rows = [
            (x * (2.0 * k.fx) + z * (2.0 * k.cx - w)) / w,
            -(y * (2.0 * k.fy) + z * (2.0 * k.cy - h)) / h,
            DVec3::ZERO,
            z,
        ];
        let constants = [0.0, 0.0, NEAR_M, 0.0];
        let row = |i: usize| -> Vec4 {
            let moved = constants[i] - rows[i].dot(eye);
            rows[i].extend(moved).as_vec4()
        };
        Self {
            clip: Mat4::from_cols(row(0), row(1), row(2), row(3))
                .transpose()
                .to_cols_array_2d(),
            eye: eye.as_vec3().extend(0.0).to_array(),
            forward: z.as_vec3().extend(max_range_m).to_array(),
            right: (x / k.fx).as_vec3().extend(k.cx as f32).to_array(),
            down: (y / k.fy).as_vec3().extend(k.cy as f32).to_array(),
            size: [w as f32, h as f32, NEAR_M as f32, 0.0],
            bend: bend.map_or_else(BendRecord::zeroed, |bend| bend.record(view)),
        }
    }
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
        let p = &params;
        let range = p.max_range_m.into();
        check("camera.max_range_m", range, 1.0, 1e5, "1..=100,000 m")?;
        p.lens.check()?;
        // WebGPU promises these two.
        if ![1, 4].contains(&p.colour_samples) {
            Err(ParamError {
                field: "camera.colour_samples",
                value: p.colour_samples.into(),
                allowed: "1 or 4",
            })?;
        }
        let instants = p.blur_samples.into();
        check("camera.blur_samples", instants, 2.0, 256.0, "2..=256")?;
        let shadow = p.shadow_px.into();
        check("camera.shadow_px", shadow, 256.0, 8192.0, "256..=8192")?;
        let memory = p.memory_mib.into();
        check(
            "camera.memory_mib",
            memory,
            128.0,
            1_048_576.0,
            "128..=1,048,576 MiB",
        )?;
        let layouts = Layouts::new(gpu);
        let truth = ExactPass::new(gpu, &layouts, Box::new(TruthPass))?;
        let lit = Lit::new(gpu, &layouts, &lighting, p)?;
        gpu.check()?;
        let state = State {
            materials: None,
            shapes: Shapes::new(0),
            passes: vec![truth],
            lit,
            targets: None,
            transient: 0,
        };
        Ok(Self {
            gpu: gpu.clone(),
            params,
            lighting,
            layouts,
            state: Mutex::new(state),
        })
    }

    /// The light it takes pictures in.
    #[must_use]
    pub fn lighting(&self) -> &Lighting {
        &self.lighting
    }

    /// Where it draws.
    #[must_use]
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
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
            bytes: state.fixed() + state.shapes.pages.bytes(),
            limit_bytes: self.limit(),
            shapes: state.shapes.len(),
            evicted: state.shapes.evicted,
        }
    }

    /// The truth and all passes that were added, without colour.
    ///
    /// # Errors
    /// If the view is impossible, the scene does not fit, or the GPU failed.
    pub fn draw(&self, scene: &SceneView<'_>, view: &View) -> Result<GpuImages, GpuError> {
        view.check()?;
        let mut state = self.state();
        let shot = self.prepare(&mut state, scene, view, &[])?;
        let (readbacks, submission) = self.draw_exact(&mut state, &shot, usize::MAX);
        drop(state);
        let mut images = readbacks
            .iter()
            .map(|readback| readback.read(&self.gpu, &submission, |rows| texels(rows, view)));
        let truth = images.next().expect("the truth is the first pass")?;
        Ok(GpuImages {
            truth: truth_images(&truth, view, &shot.objects),
            passes: images.collect::<Result<_, _>>()?,
        })
    }

    /// Brings all that a picture needs to the GPU.
    fn prepare(
        &self,
        state: &mut State,
        scene: &SceneView<'_>,
        view: &View,
        cascades: &[Cascade],
    ) -> Result<Shot, GpuError> {
        self.gpu.check()?;
        let groups = scene.caster.placed_groups().ok_or(GpuError::NoShapes)?;
        state.hold_materials(&self.gpu, scene)?;
        state.hold_targets(&self.gpu, view)?;
        let origin_m = origin_of(view);
        let range_m = self.params.max_range_m;
        let bend = Bend::of(view);
        if bend.is_some() {
            state.bend(&self.gpu, &self.layouts)?;
        }
        let frustum = Frustum::new(view, bend.as_ref(), origin_m, range_m.into());
        let crowd = Crowd::gather(&groups, origin_m, |ball| {
            frustum.sees(ball) || cascades.iter().any(|c| c.sees(ball))
        });
        state.shapes.limit = self.limit().saturating_sub(state.fixed());
        state
            .shapes
            .ensure(&self.gpu, &self.layouts.page, crowd.prototypes())?;
        let draws = crowd.draws(&state.shapes, |ball| frustum.sees(ball));
        let frame = FrameRecord::new(view, bend.as_ref(), origin_m, range_m);
        let materials = state.materials.as_ref().expect("they were uploaded");
        let frame = bytemuck::bytes_of(&frame);
        let batch = Batch::upload(&self.gpu, &self.layouts, materials, frame, &draws)?;
        let targets = state.targets.as_ref().expect("they were made");
        targets.cast_rays(&self.gpu, view, origin_m);
        Ok(Shot {
            origin_m,
            bend,
            crowd,
            batch,
            objects: draws.objects,
        })
    }

    /// Draws the first `count` exact passes, and sends the pictures on their way back.
    fn draw_exact(
        &self,
        state: &mut State,
        shot: &Shot,
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
            let pages = &state.shapes.pages;
            let pipelines = own.pipelines.of(shot.bend.is_some());
            shot.batch
                .draw(&self.gpu, &mut pass, pages, pipelines, &group);
            drop(pass);
            let readback = Readback::encode(&self.gpu, &mut encoder, &targets.exact, 16);
            readbacks.push(readback);
        }
        let submission = self.gpu.queue().submit([encoder.finish()]);
        let coming: u64 = readbacks.iter().map(Readback::bytes).sum();
        state.transient = shot.batch.bytes + coming;
        (readbacks, submission)
    }

    /// What light comes to the pixels: the mean over the exposure.
    fn draw_colour(
        &self,
        state: &mut State,
        shot: &Shot,
        scene: &SceneView<'_>,
        view: &View,
        cascades: &[Cascade],
    ) -> Result<Image<Vec3>, GpuError> {
        let materials = state.materials.as_ref().expect("they were uploaded");
        let targets = state.targets.as_ref().expect("they were made");
        let lit = LitShot {
            gpu: &self.gpu,
            layouts: &self.layouts,
            materials,
            shapes: &state.shapes,
            lighting: &self.lighting,
            view,
            scene,
            cascades,
            crowd: &shot.crowd,
            batch: &shot.batch,
            bent: shot.bend.is_some(),
            rays: &targets.rays,
            eyes: &targets.eyes,
        };
        let (light, mut bytes) = state.lit.light_up(&lit)?;
        let instants = if view.blurs() {
            self.params.blur_samples
        } else {
            1
        };
        let mut sum = vec![Vec3::ZERO; targets.pixels()];
        let mut add = |(instant, (readback, drawn)): (View, (Readback, _))| {
            readback.read(&self.gpu, &drawn, |rows| {
                state.lit.compose(rows, &instant, &self.lighting, &mut sum);
            })
        };
        // One is read while the GPU is at the next.
        let mut before = None;
        for i in 0..instants {
            let part = (f64::from(i) + 0.5) / f64::from(instants) - 0.5;
            let mut instant = *view;
            if instants > 1 {
                instant = view.later(part * view.shutter.exposure_s);
                let range_m = self.params.max_range_m;
                let bend = shot.bend.as_ref();
                let frame = FrameRecord::new(&instant, bend, shot.origin_m, range_m);
                shot.batch.aim(&self.gpu, bytemuck::bytes_of(&frame));
                targets.cast_rays(&self.gpu, &instant, shot.origin_m);
            }
            let coming = state.lit.draw(&lit, &light)?;
            bytes += if i < 2 { coming.0.bytes() } else { 0 };
            if let Some(before) = before.replace((instant, coming)) {
                add(before)?;
            }
        }
        before.map(&mut add).transpose()?;
        state.transient += bytes;
        for c in &mut sum {
            *c /= instants as f32;
        }
        let [width, height] = targets.size.map(|side| side as usize);
        Ok(Image::new(width, height, sum))
    }

    fn limit(&self) -> u64 {
        u64::from(self.params.memory_mib) << 20
    }

    /// A picture that panicked left nothing half done that the next one would use.
    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl CameraRenderer for GpuCamera {
    type Error = GpuError;

    /// The key is for the sensor's noise: nothing else in the picture is left to chance.
    fn render(
        &self,
        scene: &SceneView<'_>,
        view: &View,
        key: Key,
    ) -> Result<CameraImages, GpuError> {
        view.check()?;
        let mut guard = self.state();
        let state = &mut *guard;
        let cascades = Cascade::all(
            view,
            origin_of(view),
            self.params.max_range_m.into(),
            self.lighting.sun_direction(),
            self.params.shadow_px,
        );
        state.lit.hold_targets(&self.gpu, view)?;
        let shot = self.prepare(state, scene, view, &cascades)?;
        let (truth, truth_drawn) = self.draw_exact(state, &shot, 1);
        let linear = self.draw_colour(state, &shot, scene, view, &cascades)?;
        let truth = truth[0].read(&self.gpu, &truth_drawn, |rows| texels(rows, view))?;
        let truth = truth_images(&truth, view, &shot.objects);
        drop(guard);
        let (width, height) = (linear.width(), linear.height());
        let mut pixels = linear.into_pixels();
        self.params.lens.apply(&mut pixels, &view.intrinsics);
        let ev100 = view.exposure.ev100(log_mean_luminance(&pixels));
        let linear = Image::new(width, height, pixels);
        Ok(CameraImages {
            rgb: develop(&linear, ev100, view, key),
            linear: self.params.keep_linear.then_some(linear),
            truth,
            ev100,
        })
    }
}

/// The point of the grid next to the camera.
fn origin_of(view: &View) -> DVec3 {
    (view.scene_from_camera.translation_m * GRID_PER_M).round() / GRID_PER_M
}

/// A picture in the making.
struct Shot {
    origin_m: DVec3,
    bend: Option<Bend>,
    crowd: Crowd,
    /// What the camera sees of it.
    batch: Batch,
    /// Of the batch's instances.
    objects: Vec<ObjectId>,
}

impl State {
    /// All but the pages, bytes.
    fn fixed(&self) -> u64 {
        let targets = self.targets.as_ref().map_or(0, Targets::bytes);
        let materials = self.materials.as_ref().map_or(0, Materials::bytes);
        targets + materials + self.lit.bytes() + self.transient
    }

    fn hold_materials(&mut self, gpu: &Gpu, scene: &SceneView<'_>) -> Result<(), GpuError> {
        let library = scene.materials;
        if !self.materials.as_ref().is_some_and(|m| m.are(library)) {
            self.materials = Some(Materials::upload(gpu, library)?);
            for pass in &mut self.passes {
                pass.table = None;
            }
        }
        for pass in self.passes.iter_mut().filter(|p| p.table.is_none()) {
            pass.tabulate(gpu, library)?;
        }
        Ok(())
    }

    /// Makes what bent pictures are drawn with.
    fn bend(&mut self, gpu: &Gpu, layouts: &Layouts) -> Result<(), GpuError> {
        for pass in &mut self.passes {
            pass.bend(gpu, layouts)?;
        }
        self.lit.bend(gpu, layouts)
    }

    fn hold_targets(&mut self, gpu: &Gpu, view: &View) -> Result<(), GpuError> {
        let size = [view.intrinsics.width, view.intrinsics.height];
        if self.targets.as_ref().is_none_or(|t| t.size != size) {
            let limit = gpu.device().limits().max_texture_dimension_2d;
            if size[0].max(size[1]) > limit {
                return Err(GpuError::TooSmall {
                    name: gpu.name(),
                    what: format!(
                        "it draws {limit} x {limit} pixels, {} x {} are asked for",
                        size[0], size[1]
                    ),
                });
            }
            // The old ones first: both need not fit.
            self.targets = None;
            self.targets = Some(Targets::new(gpu, size)?);
            gpu.check()?;
        }
        Ok(())
    }
}
