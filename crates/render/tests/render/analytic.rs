//! Worlds of exact shapes, for which rays are computed in f64: the oracle of the camera's tests,
//! and the scene of its example.
#![allow(
    dead_code,
    unreachable_pub,
    missing_docs,
    reason = "shared by targets that each use a part"
)]

use glam::{DVec2, DVec3, Vec2, Vec3};
use nemoral_render::{
    CameraImages, CameraRenderer, Lens, Lighting, OpenSky, RayCastCamera, RayCastParams, SceneView,
    View,
};
use nemoral_scene::{
    Card, ChunkCoord, Hit, Intrinsics, Material, MaterialId, MaterialLibrary, ObjectId, Ray,
    RayCaster, RigidTransform, Shading, SurfaceHit,
};
use nemoral_seed::Key;

pub enum Shape {
    /// The points p with p · normal = offset.
    Plane {
        normal: DVec3,
        offset: f64,
    },
    Sphere {
        centre: DVec3,
        radius: f64,
    },
    /// An upright cylinder without ends.
    Cylinder {
        foot: DVec3,
        radius: f64,
        height: f64,
    },
    Card(Card),
    /// Shapes inside of a sphere.
    Group {
        centre: DVec3,
        radius: f64,
        items: Vec<Item>,
    },
}

pub struct Item {
    pub shape: Shape,
    pub material: MaterialId,
    pub object: ObjectId,
    pub variation: f32,
}

#[derive(Default)]
pub struct World {
    pub materials: MaterialLibrary,
    pub items: Vec<Item>,
}

struct Found {
    t: f64,
    normal: DVec3,
    uv: Vec2,
    uv_per_m: f32,
}

/// The pictures of a world with their radiance, without glare and with a long visible range.
pub fn radiances(
    world: &World,
    lighting: Lighting,
    view: &View,
    params: RayCastParams,
) -> CameraImages {
    let params = RayCastParams {
        lens: Lens {
            veiling_glare: 0.0,
            ..Lens::default()
        },
        keep_linear: true,
        max_range_m: 1e5,
        ..params
    };
    let camera = RayCastCamera::new(params, lighting).expect("valid");
    let images = camera.render(&world.view(), view, Key::world(7));
    images.expect("renders")
}

impl World {
    /// Adds a shape of a new material.
    pub fn add(&mut self, shape: Shape, material: Material, item: u16) {
        let material = self.materials.add(material);
        self.items.push(Item {
            shape,
            material,
            object: object(item),
            variation: 0.5,
        });
    }

    pub fn view(&self) -> SceneView<'_> {
        SceneView {
            caster: self,
            instances: None,
            materials: &self.materials,
            sky_visibility: &OpenSky,
            lamps: &[],
        }
    }

    fn visit(
        &self,
        items: &[Item],
        o: DVec3,
        d: DVec3,
        low: f64,
        best: &mut f64,
        hit: &mut Option<Hit>,
    ) {
        for item in items {
            if let Shape::Group {
                centre,
                radius,
                items,
            } = &item.shape
            {
                let along = (*centre - o).dot(d);
                let off = (*centre - o).length_squared() - along * along;
                if off <= radius * radius && along + radius >= low && along - radius <= *best {
                    self.visit(items, o, d, low, best, hit);
                }
                continue;
            }
            for found in self.meet(item, o, d) {
                if found.t >= low && found.t < *best {
                    *best = found.t;
                    *hit = Some(Hit {
                        surface: SurfaceHit {
                            distance_m: found.t as f32,
                            geometric_normal: found.normal.as_vec3(),
                            material: item.material,
                            object: item.object,
                        },
                        shading: Shading {
                            uv: found.uv,
                            uv_per_m: found.uv_per_m,
                            variation: item.variation,
                            ..Shading::flat(found.normal.as_vec3())
                        },
                    });
                }
            }
        }
    }

    fn meet(&self, item: &Item, o: DVec3, d: DVec3) -> Vec<Found> {
        match &item.shape {
            Shape::Plane { normal, offset } => {
                let t = (offset - normal.dot(o)) / normal.dot(d);
                let p = o + d * t;
                let uv = DVec2::new(p.x.rem_euclid(1024.0), p.y.rem_euclid(1024.0)).as_vec2();
                vec![Found {
                    t,
                    normal: *normal,
                    uv,
                    uv_per_m: 1.0,
                }]
            }
            Shape::Sphere { centre, radius } => {
                let m = o - *centre;
                roots(1.0, m.dot(d), m.length_squared() - radius * radius)
                    .map(|t| {
                        let normal = (m + d * t) / *radius;
                        let uv = Vec2::new(
                            normal.y.atan2(normal.x) as f32 / std::f32::consts::TAU,
                            normal.z as f32,
                        );
                        Found {
                            t,
                            normal,
                            uv,
                            uv_per_m: 0.16 / *radius as f32,
                        }
                    })
                    .collect()
            }
            Shape::Cylinder {
                foot,
                radius,
                height,
            } => {
                let m = o - *foot;
                let flat = |v: DVec3| v.truncate();
                roots(
                    flat(d).length_squared(),
                    flat(m).dot(flat(d)),
                    flat(m).length_squared() - radius * radius,
                )
                .filter_map(|t| {
                    let p = m + d * t;
                    let normal = flat(p).extend(0.0) / *radius;
                    let uv = Vec2::new(
                        normal.y.atan2(normal.x) as f32 / std::f32::consts::TAU,
                        p.z as f32,
                    );
                    (0.0..=*height).contains(&p.z).then_some(Found {
                        t,
                        normal,
                        uv,
                        uv_per_m: 1.0,
                    })
                })
                .collect()
            }
            Shape::Card(card) => {
                let (u, v) = (card.edge_u.as_dvec3(), card.edge_v.as_dvec3());
                let n = u.cross(v);
                let t = (card.corner.as_dvec3() - o).dot(n) / d.dot(n);
                let p = o + d * t - card.corner.as_dvec3();
                let (a, b) = (
                    p.cross(v).dot(n) / n.length_squared(),
                    u.cross(p).dot(n) / n.length_squared(),
                );
                let inside = (0.0..=1.0).contains(&a) && (0.0..=1.0).contains(&b);
                let mask = &self.materials.get(item.material).mask;
                let there = inside
                    && mask
                        .as_ref()
                        .is_none_or(|m| m.is_opaque(a as f32, b as f32));
                let uv = Vec2::new(a as f32, b as f32);
                let uv_per_m = 1.0 / u.length().max(v.length()) as f32;
                there
                    .then(|| Found {
                        t,
                        normal: n / n.length(),
                        uv,
                        uv_per_m,
                    })
                    .into_iter()
                    .collect()
            }
            Shape::Group { .. } => Vec::new(),
        }
    }
}

/// The roots of a t² + 2 b t + c = 0.
fn roots(a: f64, b: f64, c: f64) -> impl Iterator<Item = f64> {
    let d = b * b - a * c;
    let root = d.max(0.0).sqrt();
    [(-b - root) / a, (-b + root) / a]
        .into_iter()
        .filter(move |_| d > 0.0 && a > 0.0)
}

impl RayCaster for World {
    fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let mut hit = None;
        let mut best = f64::from(ray.t_max_m);
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        self.visit(
            &self.items,
            o,
            d,
            f64::from(ray.t_min_m),
            &mut best,
            &mut hit,
        );
        hit
    }
}

pub fn object(item: u16) -> ObjectId {
    ObjectId::new(ChunkCoord::new(2, -3), item).unwrap_or(ObjectId::NONE)
}

/// A level pose that looks from one point to another.
pub fn look(from: DVec3, to: DVec3) -> RigidTransform {
    let forward = (to - from) / (to - from).length();
    let yaw = forward.y.atan2(forward.x);
    let pitch = -forward.z.asin();
    RigidTransform::from_xyz_rpy(from, 0.0, pitch, yaw) * RigidTransform::body_from_optical()
}

pub fn camera(width: u32, height: u32, fov_deg: f64, from: DVec3, to: DVec3) -> View {
    let intrinsics = Intrinsics::from_fov(width, height, fov_deg.to_radians()).expect("a pinhole");
    View::new(intrinsics, look(from, to))
}

pub fn grey(albedo: f32) -> Material {
    Material::plain("grey", nemoral_scene::Semantic::Rock, Vec3::splat(albedo))
}
