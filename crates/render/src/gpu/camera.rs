//! The camera itself.

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use glam::{DVec3, Vec3};
use nemoral_scene::{Image, ObjectId, TruthImages};
use nemoral_seed::Key;

use super::bend::Bend;
use super::cascade::Cascade;
use super::cull::{Aim, Culled, Culler};
use super::exposure::{Coming, Exposure, instants};
use super::frame::{FrameRecord, origin_of};
use super::lit::{Lit, LitShot};
use super::pages::GpuMemory;
use super::pass::TruthPass;
use super::pipeline::{ExactPass, Layouts, group};
use super::readback::Readback;
use super::shapes::Shapes;
use super::sight::Sight;
use super::state::{Loan, State};
use super::targets::{reversed, texels, truth_images, view_of};
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
/// It keeps shapes, instances and materials on the GPU between pictures, within
/// [`memory_mib`](GpuParams::memory_mib); the GPU decides which instances a picture shows. While one
/// picture comes back, another thread's is drawn. The truth is the ray-cast camera's but for rounding: on
/// borders of surfaces a pixel in some thousands sees the neighbour.
pub struct GpuCamera {
    gpu: Gpu,
    params: GpuParams,
    lighting: Lighting,
    layouts: Layouts,
    culler: Culler,
    state: Mutex<State>,
    /// Device memory of pictures under way, bytes.
    on_loan: Arc<AtomicU64>,
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
            Err(ParamError::new(
                "camera.colour_samples",
                p.colour_samples,
                "1 or 4",
            ))?;
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
        let culler = Culler::new(gpu);
        gpu.check()?;
        let state = State {
            materials: None,
            herd: None,
            shapes: Shapes::new(u64::from(params.memory_mib) << 20),
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
            culler,
            state: Mutex::new(state),
            on_loan: Arc::default(),
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

    /// Can it draw pictures of this size, pixels? Every picture asks; who asks before the first knows
    /// sooner.
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
            bytes: state.fixed() + self.on_loan() + state.shapes.pages.bytes(),
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
        let mut shot = self.prepare(&mut state, scene, view, &[])?;
        let (readbacks, submission) = self.draw_exact(&mut state, &mut shot, usize::MAX);
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
        let groups = scene.instances.ok_or(GpuError::NoShapes)?.placed_groups();
        state.hold_materials(&self.gpu, scene)?;
        state.hold_targets(&self.gpu, view)?;
        let origin_m = origin_of(view);
        let range_m = self.params.max_range_m;
        let bend = Bend::of(view);
        if bend.is_some() {
            state.bend(&self.gpu, &self.layouts)?;
        }
        state.hold_herd(&self.gpu, &groups, origin_m)?;
        let mut loan = Loan::new(&self.on_loan);
        state.shapes.held = state.fixed() + self.on_loan() + state.transient;

        let camera = Sight::of_view(view, bend.as_ref(), origin_m, range_m.into());
        let shadows = cascades.iter().map(Cascade::sight);
        let sights: Vec<Sight> = std::iter::once(camera).chain(shadows).collect();
        let herd = state.herd.as_ref().expect("it was gathered");
        let seen = herd.seen(&sights, origin_m);
        state
            .shapes
            .ensure(&self.gpu, &self.layouts.page, seen.iter().map(|(p, _)| p))?;
        let culled = (self.culler).ask(&self.gpu, herd, &state.shapes, &seen, &sights, origin_m)?;
        loan.take(culled.bytes);

        let origin = origin_m - herd.origin_m;
        let frame = FrameRecord::new(view, bend.as_ref(), origin_m, origin, range_m);
        let materials = state.materials.as_ref().expect("they were uploaded");
        let frame = bytemuck::bytes_of(&frame);
        let aim = Aim::new(&self.gpu, &self.layouts, materials, herd, 0, frame)?;
        let targets = state.targets.as_ref().expect("they were made");
        targets.cast_rays(&self.gpu, view, origin_m);
        Ok(Shot {
            origin_m,
            origin,
            bend,
            culled,
            aim,
            objects: Arc::clone(&herd.objects),
            loan,
        })
    }

    /// Draws the first `count` exact passes, and sends the pictures on their way back.
    fn draw_exact(
        &self,
        state: &mut State,
        shot: &mut Shot,
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
            (shot.culled).draw(&self.gpu, &mut pass, pages, pipelines, &shot.aim, &group);
            drop(pass);
            let readback = Readback::encode(&self.gpu, &mut encoder, &targets.exact, 16);
            readbacks.push(readback);
        }
        let submission = self.gpu.queue().submit([encoder.finish()]);
        shot.loan.take(readbacks.iter().map(Readback::bytes).sum());
        state.transient = shot.loan.bytes;
        (readbacks, submission)
    }

    /// Draws what light comes to the pixels over the exposure. All of its pictures but the last are
    /// back then.
    fn expose(
        &self,
        state: &mut State,
        shot: &mut Shot,
        scene: &SceneView<'_>,
        view: &View,
        cascades: &[Cascade],
    ) -> Result<Exposure, GpuError> {
        let targets = state.targets.as_ref().expect("they were made");
        let lit = LitShot {
            gpu: &self.gpu,
            layouts: &self.layouts,
            materials: state.materials.as_ref().expect("they were uploaded"),
            shapes: &state.shapes,
            lighting: &self.lighting,
            view,
            scene,
            cascades,
            origin: shot.origin,
            herd: state.herd.as_ref().expect("it was gathered"),
            culled: &shot.culled,
            aim: &shot.aim,
            bent: shot.bend.is_some(),
            rays: &targets.rays,
            eyes: &targets.eyes,
        };
        let (light, bytes) = state.lit.light_up(&lit)?;
        shot.loan.take(bytes);
        let views = instants(&self.gpu, &self.params, view);
        let mut sum = vec![Vec3::ZERO; targets.pixels()];
        let mut last: Option<Coming> = None;
        for (i, instant) in views.iter().enumerate() {
            if views.len() > 1 {
                let (bend, range_m) = (shot.bend.as_ref(), self.params.max_range_m);
                let frame = FrameRecord::new(instant, bend, shot.origin_m, shot.origin, range_m);
                shot.aim.at(&self.gpu, bytemuck::bytes_of(&frame));
                targets.cast_rays(&self.gpu, instant, shot.origin_m);
            }
            let (readback, drawn) = state.lit.draw(&lit, &light)?;
            // One is read while the GPU is at the next.
            if i < 2 {
                shot.loan.take(readback.bytes());
            }
            let coming = Coming {
                view: *instant,
                readback,
                drawn,
            };
            if let Some(before) = last.replace(coming) {
                let behind = (&self.lighting, state.lit.backdrop);
                before.add(&self.gpu, behind, &mut sum)?;
            }
        }
        state.transient = shot.loan.bytes;
        Ok(Exposure {
            backdrop: state.lit.backdrop,
            sum,
            count: views.len(),
            last: last.expect("there is an instant at least"),
        })
    }

    fn on_loan(&self) -> u64 {
        self.on_loan.load(Ordering::Relaxed)
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
        let mut shot = self.prepare(state, scene, view, &cascades)?;
        let (truth, truth_drawn) = self.draw_exact(state, &mut shot, 1);
        let exposure = self.expose(state, &mut shot, scene, view, &cascades)?;
        // From here on the next picture may be drawn.
        drop(guard);
        let truth = truth[0].read(&self.gpu, &truth_drawn, |rows| texels(rows, view))?;
        let truth = truth_images(&truth, view, &shot.objects);
        let linear = exposure.read(&self.gpu, &self.lighting)?;
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

/// A picture in the making.
struct Shot {
    origin_m: DVec3,
    /// About the herd's.
    origin: DVec3,
    bend: Option<Bend>,
    culled: Culled,
    /// The camera's.
    aim: Aim,
    /// Of the herd's instances.
    objects: Arc<[ObjectId]>,
    loan: Loan,
}
