//! Surfaces of liquids: what they mirror, and the bed that is seen through them.

use glam::{Vec2, Vec3};
use nemoral_scene::{Hit, Liquid, Ray};

use super::context::{Lamplight, PictureContext, RayRadiance};
use crate::light::ripples::rippled;
use crate::light::shading::{RayOrigin, SurfaceView, shade};

/// The share of the light from a bed that leaves a still surface, over that which would come from
/// it in air: it is spread when it is refracted, and partly mirrored down again (Mobley 1999,
/// "Estimation of the remote-sensing reflectance from above-surface measurements").
const LEAVES: f32 = 0.54;
/// A bed deeper than this along the ray is not seen, metres.
const DEEPEST_M: f32 = 5.0;
/// Surfaces of liquids that one looks through to find the bed.
const SURFACES: usize = 3;
/// The least cosine at which ripples are seen: steeper ones are hidden by those before them.
const LEAST_COS: f32 = 0.02;

impl PictureContext<'_> {
    /// The radiance of a liquid's surface, without the air in front of it, and the sky view factor
    /// there. Fresnel's share comes from one ray that is mirrored, the rest from below.
    pub(super) fn liquid(&self, view: &SurfaceView<'_>, liquid: &Liquid) -> (RayRadiance, f32) {
        let (ray, hit) = (view.ray, view.hit);
        let away = hit.surface.geometric_normal.dot(ray.direction) > 0.0;
        let facing = if away { -1.0 } else { 1.0 };
        let flat = hit.surface.geometric_normal * facing;
        let smooth = hit.shading.normal * facing;
        let normal = self.ripples(view, liquid, smooth);
        let mut seen = *hit;
        seen.shading.normal = normal * facing;
        let shaded = shade(
            self.scene,
            self.lighting,
            &SurfaceView {
                hit: &seen,
                ..*view
            },
        );

        let cos = -ray.direction.dot(normal);
        let mirrored = liquid.mirrored(cos);
        let point = ray.at(hit.surface.distance_m);
        // The origins are off the surface by more than the rounding of distance and coordinates.
        let offset = 1e-4 * (1.0 + hit.surface.distance_m) + 2e-6 * point.abs().max_element();
        let up = ray.direction + normal * (2.0 * cos);
        let under = (flat.dot(up) - LEAST_COS).min(0.0);
        let up = Ray {
            origin: point + flat * offset,
            direction: (up - flat * under).normalize_or(flat),
            t_min_m: 0.0,
            t_max_m: self.params.max_range_m,
        };
        let reflection = self.mirrored(&up, view);

        // Below: the liquid itself, and its bed.
        let ratio = 1.0 / liquid.refractive_index;
        let cos_below = (1.0 - ratio * ratio * (1.0 - cos * cos)).max(0.0).sqrt();
        let down = Ray {
            origin: point - flat * offset,
            direction: (ray.direction * ratio + normal * (ratio * cos - cos_below))
                .normalize_or(-flat),
            t_min_m: 0.0,
            t_max_m: DEEPEST_M,
        };
        let lamplight = self.lamplight_now(&shaded.surface, view);
        let below = self.bed(&down, view, liquid);
        let entering = 1.0 - mirrored;
        let (through, bed_rest, bed_sun, bed_lamps) = below.unwrap_or_default();
        let bed_rest = bed_rest + self.reaching(bed_lamps, view, flat);
        // The liquid scatters as much of the light as its depth takes from the bed.
        let scattered = Vec3::ONE - through;
        let body = shaded.below + lamplight.diffuse;
        let rest = reflection * mirrored
            + lamplight.specular
            + (body * scattered + bed_rest * through * LEAVES) * entering;
        let sun = shaded.direct.diffuse * scattered + bed_sun * through * LEAVES;
        let radiance = RayRadiance {
            rest,
            sun: shaded.direct.specular + sun * entering,
            shadow: shaded.shadow,
            lamplight: Vec::new(),
        };
        (radiance, shaded.sky_view_factor)
    }

    /// The normal with ripples, turned so that it is seen.
    fn ripples(&self, view: &SurfaceView<'_>, liquid: &Liquid, smooth: Vec3) -> Vec3 {
        let (ray, hit) = (view.ray, view.hit);
        let cos = (-ray.direction.dot(smooth)).max(0.05);
        // A sample is an ellipse on the surface; ripples along it are averaged.
        let sample_m = hit.surface.distance_m * view.sample_rad / cos.sqrt();
        let place: Vec2 = hit.shading.uv;
        let normal = rippled(liquid, place, smooth, sample_m);
        let hidden = (-ray.direction.dot(normal) - LEAST_COS).min(0.0);
        (normal + ray.direction * hidden).normalize_or(smooth)
    }

    /// The radiance along a mirrored ray, shaded as what the camera sees itself.
    fn mirrored(&self, ray: &Ray, view: &SurfaceView<'_>) -> Vec3 {
        let background = self.lighting.background(&self.haze, ray.direction);
        let Some(hit) = self.scene.caster.closest_hit(ray) else {
            return background;
        };
        let (light, sky_view_factor) = self.shaded(ray, &hit, view);
        let (through, air) = self.air(ray, &hit, sky_view_factor, background);
        light * through + air
    }

    /// The radiance of a surface that a ray from a liquid's surface hit.
    fn shaded(&self, ray: &Ray, hit: &Hit, view: &SurfaceView<'_>) -> (Vec3, f32) {
        let distance_m = hit.surface.distance_m.max(1e-3);
        let spread = 1.0 + view.hit.surface.distance_m / distance_m;
        let seen = SurfaceView {
            ray,
            hit,
            sample_rad: view.sample_rad * spread,
            light: view.light,
        };
        let shaded = shade(self.scene, self.lighting, &seen);
        let is_lit = (shaded.shadow).is_some_and(|ray| !self.scene.caster.is_occluded(&ray));
        let sun = if is_lit {
            shaded.direct.sum()
        } else {
            Vec3::ZERO
        };
        let lamplight = self.lamplight_now(&shaded.surface, &seen).sum();
        (shaded.indirect + sun + lamplight, shaded.sky_view_factor)
    }

    /// The light of those lamps that shine on a liquid's surface, on the side `flat`, as of a bed
    /// below it.
    fn reaching(&self, of_bed: Vec<Lamplight>, view: &SurfaceView<'_>, flat: Vec3) -> Vec3 {
        let reaches = |light: &Lamplight| {
            let origin = RayOrigin::from_side(flat);
            let shadow = self.lamps[light.lamp].shadow(view, origin, view.light.on_disc);
            shadow.direction.dot(flat) > 0.0 && !self.scene.caster.is_occluded(&shadow)
        };
        let lights = of_bed.into_iter().filter(reaches);
        lights.map(|light| light.radiance.sum()).sum()
    }

    /// The bed below a liquid along a refracted ray: the share of light that the liquid lets
    /// through, down and up, and the bed's radiance in air by other light than the sun's, and by
    /// the sun's where it shines on the surface above, and that of each lamp that does.
    fn bed(
        &self,
        down: &Ray,
        view: &SurfaceView<'_>,
        liquid: &Liquid,
    ) -> Option<(Vec3, Vec3, Vec3, Vec<Lamplight>)> {
        let mut ray = *down;
        for _ in 0..SURFACES {
            let hit = self.scene.caster.closest_hit(&ray)?;
            if self
                .scene
                .materials
                .get(hit.surface.material)
                .liquid
                .is_some()
            {
                ray.t_min_m = hit.surface.distance_m + 1e-3;
                continue;
            }
            let distance_m = hit.surface.distance_m;
            let spread = 1.0 + view.hit.surface.distance_m / distance_m.max(1e-3);
            let seen = SurfaceView {
                ray: &ray,
                hit: &hit,
                sample_rad: view.sample_rad * spread,
                light: view.light,
            };
            let shaded = shade(self.scene, self.lighting, &seen);
            let depth_m = distance_m * ray.direction.z.abs();
            let path_m = distance_m + depth_m;
            let through = liquid.absorption_per_m * -path_m;
            let through = Vec3::from(through.to_array().map(libm::expf));
            // The lamps' light is not bent where it enters.
            let lamps = self.lamplight(&shaded.surface, &seen, 1.0);
            return Some((through, shaded.indirect, shaded.direct.sum(), lamps));
        }
        None
    }
}
