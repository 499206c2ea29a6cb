//! A path tracer, which follows light over several surfaces.

use glam::Vec3;
use nemoral_scene::{Hit, Ray};
use nemoral_seed::{Domain, Key, PhiloxRng};

use super::context::{PictureContext, ShadowRays, sums_per_pixel};
use crate::light::shading::{SurfaceView, shade};
use crate::sky::sun_disc::DiscPoint;

const BOUNCES: Domain = Domain::new("render.bounces");

/// The angle of the bundle that a bounced ray stands for, over which textures are averaged.
const BUNDLE_RAD: f32 = 0.3;

/// A path from the camera towards the lights.
struct Path {
    /// The sample that it belongs to.
    sample: usize,
    ray: Ray,
    hit: Option<Hit>,
    /// The path's throughput, the factor for the radiance along the ray.
    throughput: Vec3,
    rng: PhiloxRng,
}

impl PictureContext<'_> {
    /// The colours of rays by path tracing (Kajiya 1986), summed by pixel. From each surface one
    /// ray goes to where light may come from, drawn by how the surface scatters it, and one to the
    /// sun and to each lamp.
    pub(super) fn path_traced(
        &self,
        rays: &[Ray],
        hits: &[Option<Hit>],
        points: &[DiscPoint],
        keys: impl Iterator<Item = Key>,
        samples: usize,
    ) -> Vec<Vec3> {
        let rngs = keys.flat_map(|key| {
            let key = key.domain(BOUNCES);
            (0..samples as u64).map(move |k| key.item(k).rng())
        });
        let mut colours = vec![Vec3::ZERO; rays.len()];
        let mut paths: Vec<Path> = (rays.iter().zip(hits).zip(rngs).enumerate())
            .map(|(sample, ((&ray, &hit), rng))| Path {
                sample,
                ray,
                hit,
                throughput: Vec3::ONE,
                rng,
            })
            .collect();
        for surface in 0..=self.params.bounces {
            self.gather(&mut paths, surface, points, &mut colours);
            let rays: Vec<Ray> = paths.iter().map(|p| p.ray).collect();
            let mut hits = vec![None; rays.len()];
            self.scene.caster.closest_hits(&rays, &mut hits);
            for (path, hit) in paths.iter_mut().zip(hits) {
                path.hit = hit;
            }
        }
        sums_per_pixel(&colours, samples)
    }

    /// Adds the light at the ends of paths to their samples, and keeps the paths that continue.
    fn gather(
        &self,
        paths: &mut Vec<Path>,
        surface: u32,
        points: &[DiscPoint],
        colours: &mut [Vec3],
    ) {
        let lighting = self.lighting;
        let last = surface == self.params.bounces;
        let (mut shadows, mut lights) = (ShadowRays::default(), Vec::new());
        paths.retain_mut(|path| {
            let colour = &mut colours[path.sample];
            let ray = path.ray;
            let background = lighting.background(&self.haze, ray.direction);
            let Some(hit) = path.hit else {
                // The sun's disc is added for the first rays. Later, those to the sun account for
                // it.
                *colour += path.throughput * background;
                return false;
            };
            let view = SurfaceView {
                ray: &ray,
                hit: &hit,
                sample_rad: if surface == 0 {
                    self.sample_rad
                } else {
                    BUNDLE_RAD
                },
                light: points[path.sample],
            };
            if let Some(liquid) = &self.scene.materials.get(hit.surface.material).liquid {
                // What it mirrors and its bed have the mean light.
                let (light, sky_view_factor) = self.liquid(&view, liquid);
                let (through, air) = match surface {
                    0 => self.air(&ray, &hit, sky_view_factor, background),
                    _ => (1.0, Vec3::ZERO),
                };
                *colour += path.throughput * (light.rest * through + air);
                if light.shadow.is_some() {
                    shadows.add(lights.len(), light.shadow);
                    lights.push((path.sample, path.throughput * light.sun * through));
                }
                return false;
            }
            let shaded = shade(self.scene, lighting, &view);
            if surface == 0 {
                let (through, air) = self.air(&ray, &hit, shaded.sky_view_factor, background);
                *colour += air;
                path.throughput = Vec3::splat(through);
            }
            if shaded.shadow.is_some() {
                shadows.add(lights.len(), shaded.shadow);
                lights.push((path.sample, path.throughput * shaded.direct.sum()));
            }
            for light in self.lamplight(&shaded.surface, &view, 1.0) {
                shadows.add(lights.len(), Some(light.shadow));
                lights.push((path.sample, path.throughput * light.radiance.sum()));
            }
            if last {
                *colour += path.throughput * shaded.indirect;
                return false;
            }
            // Specular reflection uses the mean light.
            *colour += path.throughput * shaded.sheen;
            let reach_m = self.params.max_range_m;
            let Some((ray, throughput)) = shaded.surface.bounce(&view, reach_m, &mut path.rng)
            else {
                return false;
            };
            path.ray = ray;
            path.throughput *= throughput;
            true
        });
        for i in shadows.lit(self.scene.caster) {
            let (sample, light) = lights[i];
            colours[sample] += light;
        }
    }
}
