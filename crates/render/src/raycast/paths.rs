//! Light by way of other surfaces, followed ray by ray.

use glam::Vec3;
use nemoral_scene::{Hit, Ray};
use nemoral_seed::{Domain, Key, PhiloxRng};

use super::samples::sums;
use super::{Shadows, Shot};
use crate::shade::{Look, shade};

const BOUNCES: Domain = Domain::new("render.bounces");

/// The width of a bundle that a ray of a bounce stands for, at 1 m: textures show their mean.
const BUNDLE_RAD: f32 = 0.3;

/// A way from the camera back to where light may come from.
struct Path {
    /// Whose it is.
    sample: usize,
    ray: Ray,
    hit: Option<Hit>,
    /// What the light at the ray's end is multiplied with.
    weight: Vec3,
    rng: PhiloxRng,
}

impl Shot<'_> {
    /// The colours of rays by paths (Kajiya 1986), summed by pixel: from each surface one ray to where light
    /// may come from, drawn by what the surface sends on of it, and one to the sun.
    pub(super) fn followed(
        &self,
        rays: &[Ray],
        hits: &[Option<Hit>],
        suns: &[Vec3],
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
                weight: Vec3::ONE,
                rng,
            })
            .collect();
        for surface in 0..=self.camera.params.bounces {
            self.gather(&mut paths, surface, suns, &mut colours);
            let rays: Vec<Ray> = paths.iter().map(|p| p.ray).collect();
            let mut hits = vec![None; rays.len()];
            self.scene.caster.closest_hits(&rays, &mut hits);
            for (path, hit) in paths.iter_mut().zip(hits) {
                path.hit = hit;
            }
        }
        sums(&colours, samples)
    }

    /// Adds the light of paths' ends to their samples, and leads on those that go on.
    fn gather(&self, paths: &mut Vec<Path>, surface: u32, suns: &[Vec3], colours: &mut [Vec3]) {
        let camera = self.camera;
        let lighting = &camera.lighting;
        let last = surface == camera.params.bounces;
        let (mut shadows, mut lights) = (Shadows::default(), Vec::new());
        paths.retain_mut(|path| {
            let colour = &mut colours[path.sample];
            let ray = path.ray;
            let background = lighting.background(&self.haze, ray.direction);
            let Some(hit) = path.hit else {
                // By way of surfaces, the disc itself is what the rays to the sun are for.
                let disc = (surface == 0).then(|| lighting.sun_disc(&self.haze, ray.direction));
                *colour += path.weight * (background + disc.unwrap_or_default());
                return false;
            };
            let look = Look {
                ray: &ray,
                hit: &hit,
                sample_rad: if surface == 0 {
                    self.sample_rad
                } else {
                    BUNDLE_RAD
                },
                sun: suns[path.sample],
            };
            let shaded = shade(self.scene, lighting, &look);
            if surface == 0 {
                let (through, air) = self.air(&ray, &hit, shaded.openness, background);
                *colour += air;
                path.weight = Vec3::splat(through);
            }
            if shaded.shadow.is_some() {
                shadows.add(lights.len(), shaded.shadow);
                lights.push((path.sample, path.weight * shaded.direct));
            }
            if last {
                *colour += path.weight * shaded.indirect;
                return false;
            }
            // What mirrors is seen in the mean light.
            *colour += path.weight * shaded.sheen;
            let reach_m = camera.params.max_range_m;
            let Some((ray, weight)) = shaded.surface.bounce(&look, reach_m, &mut path.rng) else {
                return false;
            };
            path.ray = ray;
            path.weight *= weight;
            true
        });
        for i in shadows.lit(self.scene.caster) {
            let (sample, light) = lights[i];
            colours[sample] += light;
        }
    }
}
