//! The camera that casts rays.

mod centres;
mod paths;
mod samples;

use glam::{DVec2, Vec3};
use nemoral_scene::{Hit, ObjectId, Ray, RayCaster, Semantic};
use nemoral_seed::{Domain, Key, Rng};
use rayon::prelude::*;

use self::centres::centre;
use self::samples::Further;
use crate::error::{ParamError, check};
use crate::haze::Haze;
use crate::maps::Maps;
use crate::shade::{Look, shade};
use crate::sun_disc::SunDisc;
use crate::tone::{develop, log_mean_luminance};
use crate::{CameraImages, CameraRenderer, Lens, Lighting, SceneView, View};

/// How carefully a picture is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayCastParams {
    /// Colour samples of every pixel, 1..=256; the first lies at its centre.
    pub colour_samples: u32,
    /// Further colour samples of pixels on silhouettes, 0..=256.
    pub edge_samples: u32,
    /// The most further samples for silhouettes, as a share of the number of pixels, 0..=256; the
    /// strongest contrasts are served first.
    pub edge_budget: f32,
    /// The least colour samples of every pixel of a picture that blurs because the camera moves,
    /// 2..=256: one each for as many equal parts of the exposure.
    pub blur_samples: u32,
    /// Over how many surfaces light is followed that comes by way of them, 0..=16, by rays drawn at
    /// random; what is left after the last is the mean light of its place. With 0 it is that at once.
    pub bounces: u32,
    /// How far is seen; things fade into the sky towards there. Metres, 1..=100,000.
    pub max_range_m: f32,
    /// What the lens does to the light.
    pub lens: Lens,
    /// Return the radiance image too?
    pub keep_linear: bool,
}

impl RayCastParams {
    /// One ray per pixel: for previews and speed.
    #[must_use]
    pub fn draft() -> Self {
        Self {
            edge_samples: 0,
            ..Self::default()
        }
    }

    /// Four samples everywhere and twelve on silhouettes: for figures.
    #[must_use]
    pub fn fine() -> Self {
        Self {
            colour_samples: 4,
            edge_samples: 8,
            edge_budget: 8.0,
            ..Self::default()
        }
    }
}

impl Default for RayCastParams {
    /// Four samples on the strongest silhouettes, for at most 30 % more rays.
    fn default() -> Self {
        Self {
            colour_samples: 1,
            edge_samples: 3,
            edge_budget: 0.3,
            blur_samples: 9,
            bounces: 0,
            max_range_m: 300.0,
            lens: Lens::default(),
            keep_linear: false,
        }
    }
}

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

/// What is exactly at an image position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelTruth {
    /// The fine semantic; [`Semantic::Sky`] where nothing was hit.
    pub semantic: Semantic,
    /// Whose surface it is.
    pub object: ObjectId,
    /// Planar depth: z in the optical frame, metres; 0 where nothing was hit.
    pub depth_m: f32,
    /// Unit normal of the flat primitive in the optical frame, towards the camera; zero where
    /// nothing was hit.
    pub normal: Vec3,
}

/// Rows that are cast together, and rays: enough that a caster finds many alike.
const ROWS: usize = 16;
const BATCH: usize = 4096;

const FIRST: Domain = Domain::new("render.first_sample");
const ALL: Domain = Domain::new("render.all_pixels");
const EDGES: Domain = Domain::new("render.edges");

impl RayCastCamera {
    /// A camera under a light.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: RayCastParams, lighting: Lighting) -> Result<Self, ParamError> {
        let p = &params;
        check(
            "camera.colour_samples",
            p.colour_samples.into(),
            1.0,
            256.0,
            "1..=256",
        )?;
        check(
            "camera.edge_samples",
            p.edge_samples.into(),
            0.0,
            256.0,
            "0..=256",
        )?;
        check(
            "camera.edge_budget",
            p.edge_budget.into(),
            0.0,
            256.0,
            "0..=256",
        )?;
        check(
            "camera.blur_samples",
            p.blur_samples.into(),
            2.0,
            256.0,
            "2..=256",
        )?;
        check("camera.bounces", p.bounces.into(), 0.0, 16.0, "0..=16")?;
        check(
            "camera.max_range_m",
            p.max_range_m.into(),
            1.0,
            1e5,
            "1..=100,000 m",
        )?;
        p.lens.check()?;
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

    /// What is exactly at an image position in pixels (not only at pixel centres): the same ray and
    /// the same answer as in [`render`](CameraRenderer::render).
    #[must_use]
    pub fn truth_at(&self, scene: &SceneView<'_>, view: &View, pixel: DVec2) -> PixelTruth {
        let ray = view.ray(pixel, self.params.max_range_m);
        let hit = scene.caster.closest_hit(&ray);
        truth(scene, view, pixel, &ray, hit.as_ref())
    }
}

fn truth(
    scene: &SceneView<'_>,
    view: &View,
    pixel: DVec2,
    ray: &Ray,
    hit: Option<&Hit>,
) -> PixelTruth {
    let Some(hit) = hit else {
        return PixelTruth {
            semantic: Semantic::Sky,
            object: ObjectId::NONE,
            depth_m: 0.0,
            normal: Vec3::ZERO,
        };
    };
    let away = hit.surface.geometric_normal.dot(ray.direction) > 0.0;
    let normal = hit.surface.geometric_normal * if away { -1.0 } else { 1.0 };
    PixelTruth {
        semantic: scene.materials.get(hit.surface.material).semantic,
        object: hit.surface.object,
        depth_m: (f64::from(hit.surface.distance_m) * view.intrinsics.direction(pixel).z) as f32,
        normal: view.to_optical(normal, pixel.y),
    }
}

/// One picture in the making.
struct Shot<'a> {
    camera: &'a RayCastCamera,
    scene: &'a SceneView<'a>,
    view: &'a View,
    haze: Haze,
    /// Angle of a sample at the image centre.
    sample_rad: f32,
    /// Openness at the camera.
    openness: f32,
}

/// A ray's colour in two parts, so that shadows can be smoothed before they are summed.
struct Colour {
    /// All light but the sun's.
    rest: Vec3,
    /// The sun's light as if nothing were between.
    sun: Vec3,
    /// The way of that light, if there is any.
    shadow: Option<Ray>,
}

/// Shadow rays of many colours, cast together.
#[derive(Default)]
struct Shadows {
    rays: Vec<Ray>,
    /// Whose they are.
    of: Vec<usize>,
    occluded: Vec<bool>,
}

impl Shadows {
    fn add(&mut self, of: usize, ray: Option<Ray>) {
        if let Some(ray) = ray {
            self.rays.push(ray);
            self.of.push(of);
        }
    }

    /// Those that the sun reaches.
    fn lit(&mut self, caster: &dyn RayCaster) -> impl Iterator<Item = usize> + '_ {
        self.occluded.clear();
        self.occluded.resize(self.rays.len(), false);
        caster.are_occluded(&self.rays, &mut self.occluded);
        let answers = self.of.iter().zip(&self.occluded);
        answers.filter_map(|(&of, &occluded)| (!occluded).then_some(of))
    }
}

impl Shot<'_> {
    /// The colour of a ray whose shadow ray goes to a point of the sun.
    fn colour(&self, ray: &Ray, hit: Option<&Hit>, sun: Vec3) -> Colour {
        let lighting = &self.camera.lighting;
        let background = lighting.background(&self.haze, ray.direction);
        let Some(hit) = hit else {
            return Colour {
                rest: background + lighting.sun_disc(&self.haze, ray.direction),
                sun: Vec3::ZERO,
                shadow: None,
            };
        };
        let look = Look {
            ray,
            hit,
            sample_rad: self.sample_rad,
            sun,
        };
        let surface = shade(self.scene, lighting, &look);
        let (through, air) = self.air(ray, hit, surface.openness, background);
        Colour {
            rest: surface.indirect * through + air,
            sun: surface.direct * through,
            shadow: surface.shadow,
        }
    }

    /// What the air before a surface, where the sky is as open as it says, lets through and adds.
    fn air(&self, ray: &Ray, hit: &Hit, openness: f32, background: Vec3) -> (f32, Vec3) {
        let rise_m = ray.direction.z * hit.surface.distance_m;
        let (air, fade) = self.haze.transmittance(hit.surface.distance_m, rise_m);
        // Air under crowns is as dark as what it hides; at the end of the world it is the sky's.
        let openness = 0.5 * (openness + self.openness);
        let glow = openness * (1.0 - air) * fade;
        (air * fade, background * (1.0 - fade + glow))
    }

    /// The truth and the first colour sample of every pixel, both of the ray through its centre.
    fn first_samples(&self, key: Key) -> Maps {
        let (width, height) = (
            self.view.intrinsics.width as usize,
            self.view.intrinsics.height as usize,
        );
        let mut maps = Maps::new(width, height);
        let band = ROWS * width;
        let bands = (
            maps.semantic.par_chunks_mut(band),
            maps.object.par_chunks_mut(band),
            maps.depth_m.par_chunks_mut(band),
            maps.normal.par_chunks_mut(band),
            maps.linear.par_chunks_mut(band),
            maps.sun.par_chunks_mut(band),
            maps.lit.par_chunks_mut(band),
        );
        bands.into_par_iter().enumerate().for_each(
            |(index, (semantic, object, depth_m, normal, linear, sun, lit))| {
                let mut rng = key.domain(FIRST).item(index as u64).rng();
                let mut shadows = Shadows::default();
                self.camera
                    .cast_band(self.scene, self.view, index, |i, pixel, ray, hit| {
                        let t = truth(self.scene, self.view, centre(pixel), ray, hit);
                        semantic[i] = t.semantic;
                        object[i] = t.object;
                        depth_m[i] = t.depth_m;
                        normal[i] = t.normal;
                        // One word for every pixel, hit or not, so that none shifts the others.
                        let sun_point = self.camera.sun_disc.of_pixel(pixel, rng.next_u32());
                        let c = self.colour(ray, hit, sun_point);
                        linear[i] = c.rest;
                        sun[i] = c.sun;
                        shadows.add(i, c.shadow);
                    });
                for i in shadows.lit(self.scene.caster) {
                    lit[i] = true;
                }
            },
        );
        maps
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
        let p = &self.params;
        let position = view.scene_from_camera.translation_m.as_vec3();
        let focal_px = 0.5 * (view.intrinsics.fx + view.intrinsics.fy);
        let shot = Shot {
            camera: self,
            scene,
            view,
            haze: self.lighting.haze(position.z, p.max_range_m),
            sample_rad: (1.0 / focal_px) as f32,
            openness: scene.sky_visibility.openness(position),
        };
        let samples = if view.blurs() {
            p.colour_samples.max(p.blur_samples)
        } else {
            p.colour_samples
        };
        // All samples of every pixel, or those after the first; then more for the silhouettes.
        let (mut maps, further) = if p.bounces > 0 {
            let maps = Maps::of_truth(self.truth(scene, view)?);
            (maps, Further::besides(0, samples))
        } else {
            let mut maps = shot.first_samples(key);
            maps.add_sun();
            (maps, Further::after_the_first(samples - 1))
        };
        let n = maps.linear.len();
        if further.samples > 0 {
            let every: Vec<u32> = (0..n as u32).collect();
            shot.add_samples(&mut maps.linear, &every, further, key.domain(ALL));
        }
        if p.edge_samples > 0 {
            let limit = f64::from(p.edge_budget) * n as f64 / f64::from(p.edge_samples);
            let edges = maps.edges(log_mean_luminance(&maps.linear), limit as usize);
            shot.add_samples(
                &mut maps.linear,
                &edges,
                Further::besides(samples, p.edge_samples),
                key.domain(EDGES),
            );
        }
        p.lens.apply(&mut maps.linear, &view.intrinsics);

        let ev100 = view.exposure.ev100(log_mean_luminance(&maps.linear));
        let (linear, truth) = maps.into_images();
        Ok(CameraImages {
            rgb: develop(&linear, ev100, view, key),
            linear: p.keep_linear.then_some(linear),
            truth,
            ev100,
        })
    }
}
