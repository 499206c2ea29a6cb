//! The camera that casts rays.

use glam::{DVec2, Vec3};
use nemoral_scene::TruthImages;
use nemoral_seed::{Domain, Key, Rng};
use rayon::prelude::*;

use super::context::{PictureContext, ShadowRays};
use super::frame_buffer::{DirectLight, FrameBuffer, LATTICE};
use super::params::RayCastParams;
use super::pixel_truth::PixelTruth;
use super::primary_rays::{ROWS, cast_band, pixel_centre, pixel_truth, truth_images};
use super::shadow_filter::add_filtered_light;
use super::silhouettes::silhouettes;
use super::supersampling::AdditionalSamples;
use crate::camera::metering::log_mean_luminance;
use crate::camera::picture::{self, Surroundings};
use crate::error::ParamError;
use crate::light::lamp::LampInAir;
use crate::light::lamp_glow::LampGlow;
use crate::sky::sun_disc::SunDisc;
use crate::{CameraImages, CameraRenderer, Lighting, SceneView, View};

/// The camera that casts rays on the CPU, through the caster that the LiDAR uses.
///
/// Pictures depend on scene, view, parameters, light and key alone, not on the number of threads
/// (it works in the current rayon pool).
#[derive(Clone, Debug)]
pub struct RayCastCamera {
    params: RayCastParams,
    lighting: Lighting,
    sun_disc: SunDisc,
}

const FIRST: Domain = Domain::new("render.first_sample");
const ALL: Domain = Domain::new("render.all_pixels");
const EDGES: Domain = Domain::new("render.edges");

impl RayCastCamera {
    /// A camera under a light.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: RayCastParams, lighting: Lighting) -> Result<Self, ParamError> {
        params.check()?;
        let sun_disc = SunDisc::new(lighting.sun_direction());
        Ok(Self {
            params,
            lighting,
            sun_disc,
        })
    }

    /// The light it takes pictures in.
    #[must_use]
    pub fn lighting(&self) -> &Lighting {
        &self.lighting
    }

    /// The truth at exactly each pixel's centre, as in [`render`](CameraRenderer::render), without
    /// colour.
    ///
    /// # Errors
    /// If the view is invalid.
    pub fn truth(&self, scene: &SceneView<'_>, view: &View) -> Result<TruthImages, ParamError> {
        view.check()?;
        Ok(truth_images(scene, view, self.params.max_range_m))
    }

    /// The truth at an image position in pixels, which need not be a pixel's centre, by the same
    /// ray and hit as in [`render`](CameraRenderer::render).
    #[must_use]
    pub fn truth_at(&self, scene: &SceneView<'_>, view: &View, pixel: DVec2) -> PixelTruth {
        let ray = view.ray(pixel, self.params.max_range_m);
        let hit = scene.caster.closest_hit(&ray);
        pixel_truth(scene, view, pixel, &ray, hit.as_ref())
    }
}

/// The light of a lamp in a band of rows: its radiance, and whether it arrives.
type LampOfBand<'a> = (&'a mut [Vec3], &'a mut [bool]);

impl PictureContext<'_> {
    /// The truth and the first colour sample of every pixel, both of the ray through its centre.
    fn first_samples(&self, key: Key) -> FrameBuffer {
        let (width, height) = (
            self.view.intrinsics.width as usize,
            self.view.intrinsics.height as usize,
        );
        let mut frame = FrameBuffer::new(width, height);
        let band = ROWS * width;
        frame.lamps = (self.lamps.iter())
            .map(|_| DirectLight::none(width * height))
            .collect();
        let mut lamps_of_bands: Vec<Vec<LampOfBand<'_>>> =
            (0..height.div_ceil(ROWS)).map(|_| Vec::new()).collect();
        for lamp in &mut frame.lamps {
            let parts = lamp
                .radiance
                .chunks_mut(band)
                .zip(lamp.lit.chunks_mut(band));
            for (lamps, part) in lamps_of_bands.iter_mut().zip(parts) {
                lamps.push(part);
            }
        }
        let bands = (
            frame.semantic.par_chunks_mut(band),
            frame.object.par_chunks_mut(band),
            frame.depth_m.par_chunks_mut(band),
            frame.normal.par_chunks_mut(band),
            frame.linear.par_chunks_mut(band),
            frame.sun.radiance.par_chunks_mut(band),
            frame.sun.lit.par_chunks_mut(band),
            frame
                .blocker_m
                .par_chunks_mut(ROWS / LATTICE * width.div_ceil(LATTICE)),
            lamps_of_bands.par_iter_mut(),
        );
        bands.into_par_iter().enumerate().for_each(
            |(index, (semantic, object, depth_m, normal, linear, sun, lit, blocker_m, lamps))| {
                let mut rng = key.domain(FIRST).item(index as u64).rng();
                let mut shadows = ShadowRays::default();
                let (mut lamp_shadows, mut lamplit) = (ShadowRays::default(), Vec::new());
                cast_band(
                    self.scene,
                    self.view,
                    self.params.max_range_m,
                    index,
                    |i, pixel, ray, hit| {
                        let t = pixel_truth(self.scene, self.view, pixel_centre(pixel), ray, hit);
                        semantic[i] = t.semantic;
                        object[i] = t.object;
                        depth_m[i] = t.depth_m;
                        normal[i] = t.normal;
                        // Every pixel takes one word, whether or not it hits anything, so that
                        // pixels do not depend on each other.
                        let point = self.sun_disc.of_pixel(pixel, rng.next_u32());
                        let c = self.radiance(pixel_centre(pixel), ray, hit, point);
                        linear[i] = c.rest;
                        sun[i] = c.sun;
                        shadows.add(i, c.shadow);
                        for light in c.lamplight {
                            lamps[light.lamp].0[i] = light.radiance.sum();
                            lamp_shadows.add(lamplit.len(), Some(light.shadow));
                            lamplit.push((light.lamp, i));
                        }
                    },
                );
                for k in lamp_shadows.lit(self.scene.caster) {
                    let (lamp, i) = lamplit[k];
                    lamps[lamp].1[i] = true;
                }
                for i in shadows.lit(self.scene.caster) {
                    lit[i] = true;
                }
                let chosen = |i: usize| {
                    let middle = LATTICE / 2;
                    i % width % LATTICE == middle && i / width % LATTICE == middle
                };
                for (i, distance_m) in shadows.blockers(self.scene.caster, chosen) {
                    let square = i / width / LATTICE * width.div_ceil(LATTICE);
                    blocker_m[square + i % width / LATTICE] = distance_m;
                }
            },
        );
        frame
    }
}

impl CameraRenderer for RayCastCamera {
    type Error = ParamError;

    fn render(
        &self,
        scene: &SceneView<'_>,
        view: &View,
        key: Key,
    ) -> Result<CameraImages, ParamError> {
        view.check()?;
        scene.check()?;
        self.params.lens.check_for(&view.intrinsics)?;
        let p = &self.params;
        let position = view.scene_from_camera.translation_m.as_vec3();
        let focal_px = 0.5 * (view.intrinsics.fx + view.intrinsics.fy);
        let haze = self.lighting.haze(position.z, p.max_range_m);
        let lamps = LampInAir::all(scene.lamps, position.z, &haze);
        let context = PictureContext {
            params: &self.params,
            lighting: &self.lighting,
            sun_disc: &self.sun_disc,
            scene,
            view,
            haze,
            lamps: &lamps,
            lamp_glow: LampGlow::new(&lamps, view, p.max_range_m),
            sample_rad: (1.0 / focal_px) as f32,
            sky_view_factor: scene.sky_view_factor_of_camera(position)?,
        };
        let samples = if view.blurs() {
            p.colour_samples.max(p.blur_samples)
        } else {
            p.colour_samples
        };
        // All samples of every pixel, or those after the first one; then more for silhouettes.
        let (mut frame, additional) = if p.bounces > 0 {
            let frame = FrameBuffer::of_truth(self.truth(scene, view)?);
            (frame, AdditionalSamples::beside(0, samples))
        } else {
            let mut frame = context.first_samples(key);
            add_filtered_light(&mut frame, focal_px as f32);
            (frame, AdditionalSamples::after_the_first(samples - 1))
        };
        let n = frame.linear.len();
        if additional.samples > 0 {
            let every: Vec<u32> = (0..n as u32).collect();
            context.add_samples(&mut frame, &every, additional, key.domain(ALL));
        }
        if p.edge_samples > 0 {
            let limit = f64::from(p.edge_budget) * n as f64 / f64::from(p.edge_samples);
            let edges = silhouettes(&frame, log_mean_luminance(&frame.linear), limit as usize);
            context.add_samples(
                &mut frame,
                &edges,
                AdditionalSamples::beside(samples, p.edge_samples),
                key.domain(EDGES),
            );
        }
        let (light, truth) = frame.into_images();
        let ambient = self
            .lighting
            .ambient(context.sky_view_factor)
            .mean_radiance();
        let around = Surroundings {
            ambient,
            lamps: &lamps,
        };
        let picture = picture::take(light, &around, &truth, &p.lens, view, key);
        Ok(CameraImages {
            rgb: picture.rgb,
            linear: p.keep_linear.then_some(picture.linear),
            truth,
            ev100: picture.ev100,
        })
    }
}
