//! Shading: the radiance that a surface sends towards the camera.

use std::f64::consts::TAU;
use std::ops::{Add, Mul};

use glam::Vec3;
use nemoral_scene::{Hit, Ray, SPECULAR_F0, gloss, specular_reflectance};
use nemoral_seed::Draw;

use crate::SceneView;
use crate::colour::LUMINANCE;
use crate::light::hex_tiling;
use crate::light::lighting::{Ambient, Lighting};
use crate::sky::sun_disc::DiscPoint;

/// A surface with all properties that shading needs.
#[derive(Clone, Copy)]
pub(crate) struct Surface {
    /// The shading normal on the viewer's side.
    normal: Vec3,
    /// The reflectance from below the interface and the transmittance; with the specular part they
    /// are at most 1.
    body: Vec3,
    transmittance: Vec3,
    roughness: f32,
    /// The interface's reflectance at right angles.
    f0: f32,
    /// The share of the light that the interface reflects and the albedo contains: that at right
    /// angles, and of a liquid, whose albedo is light from below alone, none.
    in_albedo: f32,
    /// Whether the surface is smooth, and its triangles are only what it was cut into: the ground.
    smooth: bool,
}

/// Where a ray to light leaves a surface.
#[derive(Clone, Copy)]
pub(crate) struct RayOrigin {
    /// The normal of the flat surface on the ray's side.
    side: Vec3,
    /// From the flat surface to where the ray begins, besides what rounding needs, metres.
    lift_m: Vec3,
}

impl RayOrigin {
    /// From a side of the flat surface.
    pub(crate) fn from_side(side: Vec3) -> Self {
        Self {
            side,
            lift_m: Vec3::ZERO,
        }
    }
}

/// A ray from a triangle of smooth ground that faces away from the light begins so high, times the
/// sine by which it does, metres. It is enough for triangles 2 m across, of cells of 1.4 m; wider
/// ones keep dark rims. (lighting.wgsl has the same.)
const LIFT_M: f32 = 0.5;

/// How a surface is viewed.
pub(crate) struct SurfaceView<'a> {
    pub(crate) ray: &'a Ray,
    pub(crate) hit: &'a Hit,
    /// The width of one sample at 1 m.
    pub(crate) sample_rad: f32,
    /// The point of the discs of sun and lamps that shadow rays go to.
    pub(crate) light: DiscPoint,
}

impl SurfaceView<'_> {
    /// The sign that turns the hit's normals to the viewer's side, 1 or -1.
    fn facing(&self) -> f32 {
        if self.hit.surface.geometric_normal.dot(self.ray.direction) > 0.0 {
            -1.0
        } else {
            1.0
        }
    }
}

/// Radiance towards the viewer of light from one direction, by where a surface sends it back.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Reflected {
    /// Scattered below the interface, or transmitted.
    pub(crate) diffuse: Vec3,
    /// Reflected by the interface.
    pub(crate) specular: Vec3,
}

impl Reflected {
    /// All of it.
    pub(crate) fn sum(self) -> Vec3 {
        self.diffuse + self.specular
    }
}

impl Add for Reflected {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            diffuse: self.diffuse + other.diffuse,
            specular: self.specular + other.specular,
        }
    }
}

impl Mul<Vec3> for Reflected {
    type Output = Self;

    fn mul(self, factor: Vec3) -> Self {
        Self {
            diffuse: self.diffuse * factor,
            specular: self.specular * factor,
        }
    }
}

/// A shaded surface, without the air in front of it.
pub(crate) struct Shaded {
    /// The surface.
    pub(crate) surface: Surface,
    /// Radiance from the light of sky, leaves and ground.
    pub(crate) indirect: Vec3,
    /// The part of it that is reflected specularly.
    pub(crate) sheen: Vec3,
    /// The rest of it as if the interface let all of it in and out.
    pub(crate) below: Vec3,
    /// Radiance from the sun without occlusion; zero if the sun shines on no side that matters.
    pub(crate) direct: Reflected,
    /// The ray to the sun, if it matters; if something blocks it, there is no direct light.
    pub(crate) shadow: Option<Ray>,
    /// The sky view factor at the surface.
    pub(crate) sky_view_factor: f32,
}

/// The light of a hit.
pub(crate) fn shade(scene: &SceneView<'_>, lighting: &Lighting, seen: &SurfaceView<'_>) -> Shaded {
    let (ray, hit) = (seen.ray, seen.hit);
    let point = ray.at(hit.surface.distance_m);
    let facing = seen.facing();
    let surface = surface(scene, seen, hit.shading.normal * facing);

    let sky_view_factor = scene.sky_visibility.sky_view_factor(point);
    let lies = scene.materials.get(hit.surface.material).lies_on_ground();
    let near = Near {
        own: hit.shading.ambient_occlusion,
        on_ground: match lies {
            true => scene.sky_visibility.ground_occlusion(point),
            false => 1.0,
        },
    };
    let (below, entering, sheen) = indirect(
        &surface,
        &lighting.ambient(sky_view_factor),
        lighting,
        ray.direction,
        sky_view_factor,
        near,
    );

    let irradiance = lighting.sun_irradiance();
    let mut shaded = Shaded {
        surface,
        indirect: below * entering + sheen,
        sheen,
        below,
        direct: Reflected::default(),
        shadow: None,
        sky_view_factor,
    };
    if irradiance != Vec3::ZERO
        && let Some((radiance, origin)) = reflected(&shaded.surface, seen, seen.light.sun)
    {
        shaded.direct = radiance * irradiance;
        shaded.shadow = Some(ray_from_hit(seen, origin, seen.light.sun, f32::INFINITY));
    }
    shaded
}

/// The radiance towards the viewer for a unit of irradiance from a direction on a plane that faces
/// it, and where a ray to there leaves the side that it falls on; `None` if that side neither
/// reflects nor transmits it to the viewer.
///
/// Where light grazes a smooth surface, some of its triangles face away from it. They would be dark
/// with sharp borders, though the surface is not. So their rays begin as high as the surface lies
/// above them at most (the shadow terminator; Hanika 2021, "Hacking the shadow terminator").
pub(crate) fn reflected(
    surface: &Surface,
    seen: &SurfaceView<'_>,
    from: Vec3,
) -> Option<(Reflected, RayOrigin)> {
    let flat = seen.hit.surface.geometric_normal * seen.facing();
    let cos = surface.normal.dot(from);
    let facing = flat.dot(from);
    let lit_front = cos > 0.0 && (facing > 0.0 || surface.smooth);
    let lit_back = cos < 0.0 && surface.transmittance != Vec3::ZERO;
    let origin = if lit_front && facing <= 0.0 {
        RayOrigin {
            side: flat,
            lift_m: surface.normal * (-facing * LIFT_M),
        }
    } else {
        RayOrigin::from_side(flat * if facing > 0.0 { 1.0 } else { -1.0 })
    };
    let radiance = || direct(surface, cos, from, seen.ray.direction);
    (lit_front || lit_back).then(|| (radiance(), origin))
}

/// The ray from a hit in a direction.
pub(crate) fn ray_from_hit(
    seen: &SurfaceView<'_>,
    origin: RayOrigin,
    direction: Vec3,
    t_max_m: f32,
) -> Ray {
    let point = seen.ray.at(seen.hit.surface.distance_m);
    // The origin is off the surface by more than the rounding of distance and coordinates.
    let offset = 1e-4 * (1.0 + seen.hit.surface.distance_m) + 2e-6 * point.abs().max_element();
    Ray {
        origin: point + origin.side * offset + origin.lift_m,
        direction,
        t_min_m: offset,
        t_max_m,
    }
}

impl Surface {
    /// A random ray to where light may come from, drawn by how much the surface scatters from
    /// there below its interface, and the factor for the radiance along it; `None` if the surface
    /// scatters nothing.
    pub(crate) fn bounce(
        &self,
        seen: &SurfaceView<'_>,
        reach_m: f32,
        rng: &mut impl Draw,
    ) -> Option<(Ray, Vec3)> {
        let (back, through) = (self.body.dot(LUMINANCE), self.transmittance.dot(LUMINANCE));
        let drawn = rng.unit_f32() * (back + through);
        let (side, weight) = if drawn < back {
            (1.0, self.body * ((back + through) / back))
        } else if through > 0.0 {
            (-1.0, self.transmittance * ((back + through) / through))
        } else {
            return None;
        };
        // The direction is weighted by the cosine (Malley's method): a point of the disc, projected
        // up to the hemisphere.
        let (x, y) = self.normal.any_orthonormal_pair();
        let (radius, turn) = (rng.unit_f32().sqrt(), rng.unit_f64() * TAU);
        let (sin, cos) = libm::sincos(turn);
        let lift = (1.0 - radius * radius).max(0.0).sqrt();
        let direction = (x * cos as f32 + y * sin as f32) * radius + self.normal * (side * lift);
        let flat = seen.hit.surface.geometric_normal * (seen.facing() * side);
        // Directions into the flat surface are reflected to its outer side, so that no light is
        // lost.
        let under = flat.dot(direction).min(0.0);
        let direction = (direction - flat * (2.0 * under)).normalize_or(flat);
        let (_, entering) = self.interface(seen.ray.direction);
        let ray = ray_from_hit(seen, RayOrigin::from_side(flat), direction, reach_m);
        Some((ray, weight * entering))
    }

    /// For light from all around: the share that is reflected specularly to a viewer along `view`,
    /// and the share that enters the surface, where the specular reflection at normal incidence may
    /// already be part of the albedo.
    fn interface(&self, view: Vec3) -> (f32, f32) {
        let gloss = gloss(self.roughness);
        let cos = (-view.dot(self.normal)).max(0.0);
        let glancing = gloss * fresnel(self.f0, (1.0 - self.roughness).max(self.f0), cos);
        (glancing, 1.0 - (glancing - self.in_albedo))
    }
}

/// Radiance for a unit of irradiance on a plane that faces where it comes from.
fn direct(surface: &Surface, cos: f32, from: Vec3, view: Vec3) -> Reflected {
    const PER_PI: f32 = std::f32::consts::FRAC_1_PI;
    let matt = |diffuse: Vec3| Reflected {
        diffuse,
        specular: Vec3::ZERO,
    };
    if cos <= 0.0 {
        return matt(surface.transmittance * (-cos * PER_PI));
    }
    let gloss = gloss(surface.roughness);
    let diffuse = surface.body * (PER_PI * cos);
    if gloss == 0.0 {
        return matt(diffuse);
    }
    // GGX with Kelemen's visibility; highlights are at least 2 degrees wide.
    let half = (from - view).normalize_or(surface.normal);
    let (nh, vh) = (surface.normal.dot(half), (-view).dot(half).max(0.1));
    let alpha = (surface.roughness * surface.roughness).max(0.05);
    let d = nh * nh * (alpha * alpha - 1.0) + 1.0;
    let distribution = alpha * alpha * PER_PI / (d * d);
    let specular = gloss * fresnel(surface.f0, 1.0, vh) * distribution / (4.0 * vh * vh);
    Reflected {
        diffuse,
        specular: Vec3::splat(specular * cos),
    }
}

/// The shares of the light from all around that arrive past what is near.
#[derive(Clone, Copy)]
struct Near {
    /// Past parts of the same shape.
    own: f32,
    /// On the ground, past what stands there.
    on_ground: f32,
}

/// What leaves and wood over the ground scatter of the light; our choice, of green leaves the mean
/// of all colours is 0.2. (lighting.wgsl has the same.)
const NEAR_GROUND: Vec3 = Vec3::splat(0.2);

/// Radiance from sky, leaves and ground: what is scattered below the interface as if the interface
/// let all of it in and out, the share of it that the interface does, and the specular part.
fn indirect(
    surface: &Surface,
    ambient: &Ambient<'_>,
    lighting: &Lighting,
    view: Vec3,
    sky_view_factor: f32,
    near: Near,
) -> (Vec3, f32, Vec3) {
    const PER_PI: f32 = std::f32::consts::FRAC_1_PI;
    let n = surface.normal;
    let mut diffuse = surface.body * ambient.irradiance(n);
    if surface.transmittance != Vec3::ZERO {
        diffuse += surface.transmittance * ambient.irradiance(-n);
    }
    diffuse *= among_near(near.own, surface.body + surface.transmittance)
        * among_near(near.on_ground, NEAR_GROUND);
    let below = diffuse * PER_PI;
    let (glancing, entering) = surface.interface(view);
    if glancing == 0.0 {
        return (below, 1.0, Vec3::ZERO);
    }
    let mirrored = view - n * (2.0 * view.dot(n));
    // The smoother the surface, the more it mirrors the sky itself.
    let smooth = (1.0 - surface.roughness) * (1.0 - surface.roughness);
    let blurred = ambient.irradiance(mirrored) * PER_PI;
    let reflected = if mirrored.z > 0.0 && smooth > 0.05 {
        let sharp = lighting.sky_radiance(mirrored);
        blurred.lerp(
            sharp * sky_view_factor + blurred * (1.0 - sky_view_factor),
            smooth,
        )
    } else {
        blurred
    };
    let sheen = reflected * (glancing * near.own * near.on_ground);
    (below, entering, sheen)
}

/// The factor on light from all around where what is near lets only a share of it through. It
/// scatters some of its light to the surface; if it gets as much light as the surface, all orders
/// of scattering form a geometric series (Jimenez et al. 2016, "Practical real-time strategies for
/// accurate indirect occlusion", without their fit to scenes). It scatters the share `kept`, half
/// of it back to where it came from: leaves reflect about as much as they transmit, and most light
/// comes from above. Near parts of the same shape are assumed to be of the surface's own material.
fn among_near(ambient_occlusion: f32, kept: Vec3) -> Vec3 {
    ambient_occlusion / (Vec3::ONE - kept * (0.5 * (1.0 - ambient_occlusion)))
}

/// Schlick's approximation, from `f0` at normal to `f90` at grazing incidence.
fn fresnel(f0: f32, f90: f32, cos: f32) -> f32 {
    let x = (1.0 - cos).clamp(0.0, 1.0);
    f0 + (f90 - f0) * (x * x) * (x * x) * x
}

fn surface(scene: &SceneView<'_>, seen: &SurfaceView<'_>, normal: Vec3) -> Surface {
    let hit = seen.hit;
    let material = scene.materials.get(hit.surface.material);
    let cos = seen
        .ray
        .direction
        .dot(hit.surface.geometric_normal)
        .abs()
        .max(0.05);
    // A sample's ellipse on the surface is 1 / cos times as long as wide, and the mean is used. For
    // the ground, which is viewed at grazing angles, it is the width, because single leaves, a few
    // pixels wide and one high, would blur otherwise.
    let width_m = hit.surface.distance_m * seen.sample_rad;
    let texture = &material.albedo;
    let (mut reflectance, roughness) = if material.ground {
        let height_m = seen.ray.origin.z + seen.ray.direction.z * hit.surface.distance_m;
        hex_tiling::look(scene.materials, hit, height_m, width_m)
    } else {
        let width = width_m / cos.sqrt() * hit.shading.uv_per_m;
        (texture.sample(hit.shading.uv, width), material.roughness)
    };
    let mut transmittance = material.transmittance;
    let leaf = transmittance != Vec3::ZERO;
    let blade = texture.mean().dot(LUMINANCE);
    if leaf && blade > 1e-3 {
        // Veins and twigs on the card reflect and transmit less than the blade.
        transmittance *= (reflectance.dot(LUMINANCE) / blade).min(1.25);
    }
    if !material.ground {
        let tint = variation(hit.shading.variation, leaf);
        reflectance *= tint;
        transmittance *= tint;
    }
    let reflectance = reflectance.min(Vec3::ONE);
    let roughness = roughness.clamp(0.0, 1.0);
    // A measured albedo contains all reflected light, including the specular reflection of the
    // interface, which is most of a leaf's blue; a liquid's is what it scatters from below.
    let (f0, in_albedo) = match &material.liquid {
        Some(liquid) => (liquid.mirrored(1.0), 0.0),
        None => (SPECULAR_F0, specular_reflectance(roughness)),
    };
    Surface {
        normal,
        body: (reflectance - in_albedo).max(Vec3::ZERO),
        transmittance: transmittance.min(Vec3::ONE - reflectance),
        roughness,
        f0,
        in_albedo,
        smooth: material.ground,
    }
}

/// The colour variation of a plant: ±12 % of brightness, and for leaves ±5 degrees of hue. 0.5 is
/// neutral.
fn variation(v: f32, leaf: bool) -> Vec3 {
    let light = 1.0 + 0.24 * (v - 0.5);
    if !leaf {
        return Vec3::splat(light);
    }
    // A second number that is independent of the first, and 0.5 for 0.5.
    let w = v * 7.0;
    let yellow = 0.2 * (w - w.floor() - 0.5);
    Vec3::new(1.0 + yellow, 1.0, 1.0 - yellow) * light
}
