//! The radiance along single rays of a picture.

use glam::{DVec2, Vec3};
use nemoral_scene::{Hit, Ray, RayCaster};

use super::params::RayCastParams;
use crate::light::lamp::LampInAir;
use crate::light::lamp_glow::LampGlow;
use crate::light::lighting::Lighting;
use crate::light::shading::{Reflected, Surface, SurfaceView, shade};
use crate::sky::haze::Haze;
use crate::sky::sun_disc::{DiscPoint, SunDisc};
use crate::{SceneView, View};

/// The data that all rays of one picture share.
pub(super) struct PictureContext<'a> {
    pub(super) params: &'a RayCastParams,
    pub(super) lighting: &'a Lighting,
    pub(super) sun_disc: &'a SunDisc,
    pub(super) scene: &'a SceneView<'a>,
    pub(super) view: &'a View,
    pub(super) haze: Haze,
    /// The scene's lamps in it.
    pub(super) lamps: &'a [LampInAir],
    /// What the air scatters of the lamps' light.
    pub(super) lamp_glow: LampGlow,
    /// The angle of a sample at the image's centre.
    pub(super) sample_rad: f32,
    /// The sky view factor at the camera.
    pub(super) sky_view_factor: f32,
}

/// The radiance along a ray in two parts, so that shadows can be smoothed before they are summed.
pub(super) struct RayRadiance {
    /// All light but the sun's.
    pub(super) rest: Vec3,
    /// The sun's light without occlusion.
    pub(super) sun: Vec3,
    /// The ray to the sun, if the surface reflects or transmits any of its light.
    pub(super) shadow: Option<Ray>,
    /// The light of each lamp that shines on the surface.
    pub(super) lamplight: Vec<Lamplight>,
}

/// The light of a lamp that a surface sends along a ray.
pub(super) struct Lamplight {
    /// The lamp's number.
    pub(super) lamp: usize,
    /// The radiance without occlusion.
    pub(super) radiance: Reflected,
    /// The ray to the lamp.
    pub(super) shadow: Ray,
}

/// Shadow rays of many samples, cast together.
#[derive(Default)]
pub(super) struct ShadowRays {
    rays: Vec<Ray>,
    /// The sample that each ray belongs to.
    of: Vec<usize>,
    occluded: Vec<bool>,
}

impl ShadowRays {
    /// Adds the shadow ray of the sample `of`, if it has one.
    pub(super) fn add(&mut self, of: usize, ray: Option<Ray>) {
        if let Some(ray) = ray {
            self.rays.push(ray);
            self.of.push(of);
        }
    }

    /// Casts the rays; the samples that the light reaches.
    pub(super) fn lit(&mut self, caster: &dyn RayCaster) -> impl Iterator<Item = usize> + '_ {
        self.occluded.clear();
        self.occluded.resize(self.rays.len(), false);
        caster.are_occluded(&self.rays, &mut self.occluded);
        let results = self.of.iter().zip(&self.occluded);
        results.filter_map(|(&of, &occluded)| (!occluded).then_some(of))
    }

    /// The occluded samples that are `wanted`, and how far away what occludes them is, metres.
    /// The rays must have been cast before.
    pub(super) fn blockers(
        &self,
        caster: &dyn RayCaster,
        wanted: impl Fn(usize) -> bool,
    ) -> Vec<(usize, f32)> {
        let chosen = (self.of.iter().zip(&self.rays))
            .zip(&self.occluded)
            .filter(|((of, _), occluded)| **occluded && wanted(**of));
        let (of, rays): (Vec<usize>, Vec<Ray>) = chosen.map(|((of, ray), _)| (*of, *ray)).unzip();
        let mut hits = vec![None; rays.len()];
        caster.closest_surfaces(&rays, &mut hits);
        let distances = of.into_iter().zip(hits);
        distances
            .filter_map(|(of, hit)| Some((of, hit?.distance_m)))
            .collect()
    }
}

impl PictureContext<'_> {
    /// The radiance along the ray of an image position whose shadow rays go to a point of the discs
    /// of sun and lamps.
    pub(super) fn radiance(
        &self,
        pixel: DVec2,
        ray: &Ray,
        hit: Option<&Hit>,
        light: DiscPoint,
    ) -> RayRadiance {
        let lighting = self.lighting;
        let background = lighting.background(&self.haze, ray.direction);
        let Some(hit) = hit else {
            let glow = self.lamp_glow.before(pixel, self.params.max_range_m);
            return RayRadiance {
                rest: background + self.sun_in_sample(pixel, ray) + glow,
                sun: Vec3::ZERO,
                shadow: None,
                lamplight: Vec::new(),
            };
        };
        let glow = self.lamp_glow.before(pixel, hit.surface.distance_m);
        let view = SurfaceView {
            ray,
            hit,
            sample_rad: self.sample_rad,
            light,
        };
        if let Some(liquid) = &self.scene.materials.get(hit.surface.material).liquid {
            let (light, sky_view_factor) = self.liquid(&view, liquid);
            let (through, air) = self.air(ray, hit, sky_view_factor, background);
            return RayRadiance {
                rest: light.rest * through + air + glow,
                sun: light.sun * through,
                shadow: light.shadow,
                lamplight: light.lamplight,
            };
        }
        let surface = shade(self.scene, lighting, &view);
        let (through, air) = self.air(ray, hit, surface.sky_view_factor, background);
        RayRadiance {
            rest: surface.indirect * through + air + glow,
            sun: surface.direct.sum() * through,
            shadow: surface.shadow,
            lamplight: self.lamplight(&surface.surface, &view, through),
        }
    }

    /// The radiance of the sun's disc in a sample of an image position that hits nothing. Samples
    /// of a blurred pixel have poses of their own.
    pub(super) fn sun_in_sample(&self, pixel: DVec2, ray: &Ray) -> Vec3 {
        if self.view.blurs() {
            return self.lighting.sun_disc(&self.haze, ray.direction);
        }
        (self.lighting).sun_in_pixel(&self.haze, self.view, pixel, ray.direction)
    }

    /// The light of each lamp that a surface sends to the viewer through air that lets a share of
    /// it `through`.
    pub(super) fn lamplight(
        &self,
        surface: &Surface,
        view: &SurfaceView<'_>,
        through: f32,
    ) -> Vec<Lamplight> {
        let lamps = self.lamps.iter().enumerate();
        let shining = lamps.filter_map(|(lamp, shines)| {
            let (radiance, from) = shines.on(surface, view, view.light.on_disc)?;
            Some(Lamplight {
                lamp,
                radiance: radiance * Vec3::splat(through),
                shadow: shines.shadow(view, from, view.light.on_disc),
            })
        });
        shining.collect()
    }

    /// The same of all lamps together, with occlusion.
    pub(super) fn lamplight_now(&self, surface: &Surface, view: &SurfaceView<'_>) -> Reflected {
        let lights = self.lamplight(surface, view, 1.0).into_iter();
        let arrives = |light: &Lamplight| !self.scene.caster.is_occluded(&light.shadow);
        let lights = lights.filter(arrives).map(|light| light.radiance);
        lights.fold(Reflected::default(), |sum, light| sum + light)
    }

    /// The transmittance of the air in front of a surface with this sky view factor, and the
    /// radiance that it adds.
    pub(super) fn air(
        &self,
        ray: &Ray,
        hit: &Hit,
        sky_view_factor: f32,
        background: Vec3,
    ) -> (f32, Vec3) {
        let rise_m = ray.direction.z * hit.surface.distance_m;
        let (air, fade) = self.haze.transmittance(hit.surface.distance_m, rise_m);
        // Air under crowns is as dark as the surface behind it; at the end of the visible range it
        // has the light of the sky.
        let sky_view_factor = 0.5 * (sky_view_factor + self.sky_view_factor);
        let glow = sky_view_factor * (1.0 - air) * fade;
        (air * fade, background * (1.0 - fade + glow))
    }
}

/// The sum of each pixel's samples.
pub(super) fn sums_per_pixel(colours: &[Vec3], samples: usize) -> Vec<Vec3> {
    colours
        .chunks_exact(samples)
        .map(|c| c.iter().sum())
        .collect()
}
