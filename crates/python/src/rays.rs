//! A user's rays, and what they hit.

use nemoral_raycast::{HitRecord, Primitive};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{Ray, RayCaster};
use numpy::PyReadonlyArray2;
use rayon::prelude::*;

use crate::failure::Failure;
use crate::ray_scene::Built;

/// What is nothing's number.
const INVALID: u32 = u32::MAX;
/// Rays of a task: they are cast in one order, and their results are written by one thread.
const TASK: usize = 1 << 15;
/// The shortest direction: a hit's distance, in lengths of it, is a number.
const SHORTEST: f64 = 1e-30;

/// Origins and directions, six numbers a ray.
pub(crate) struct Rays(Vec<f32>);

impl Rays {
    /// The rows of an array of six columns.
    pub(crate) fn copied(rays: &PyReadonlyArray2<'_, f32>) -> Self {
        Self(match rays.as_slice() {
            Ok(numbers) => numbers.to_vec(),
            Err(_) => rays.as_array().iter().copied().collect(),
        })
    }

    fn rows(&self) -> &[[f32; 6]] {
        self.0.as_chunks().0
    }

    /// Refuses rays that cannot be cast, by the first of them.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        let rows = self.rows();
        let wrong = rows.par_iter().with_min_len(TASK);
        let Some(first) = wrong.position_first(|ray| !is_sound(ray)) else {
            return Ok(());
        };
        let found = format!("{:?}", rows[first]);
        let allowed = "finite numbers and a direction whose length is 1e-30 to 3.4e38";
        Err(Failure::argument(&format!("rays[{first}]"), found, allowed))
    }
}

/// The length of a ray's direction. In double precision none is too short or too long.
fn length(&[_, _, _, dx, dy, dz]: &[f32; 6]) -> f64 {
    Vec3::new(dx, dy, dz).as_dvec3().length()
}

fn is_sound(ray: &[f32; 6]) -> bool {
    let [x, y, z, ..] = ray;
    let length = length(ray);
    // Not a number is not within.
    [x, y, z].iter().all(|x| x.is_finite()) && length >= SHORTEST && (length as f32).is_finite()
}

/// From where to where hits of rays count, in lengths of their directions.
#[derive(Clone, Copy)]
pub(crate) struct Limits {
    near: f32,
    far: f32,
}

impl Limits {
    pub(crate) fn new(near: f32, far: f32) -> Result<Self, Failure> {
        if near >= 0.0 && far >= near {
            return Ok(Self { near, far });
        }
        let found = format!("{near}, {far}");
        let allowed = "0 <= tnear <= tfar";
        Err(Failure::argument("tnear, tfar", found, allowed))
    }

    /// Rays of unit directions, and the lengths of the given ones, which are sound.
    fn unit_rays(self, rays: &[[f32; 6]]) -> (Vec<Ray>, Vec<f32>) {
        let unit = |ray: &[f32; 6]| {
            let &[x, y, z, dx, dy, dz] = ray;
            let length = length(ray);
            let unit = DVec3::new(dx.into(), dy.into(), dz.into()) / length;
            let length = length as f32;
            let ray = Ray {
                t_min_m: self.near * length,
                t_max_m: self.far * length,
                ..Ray::new(Vec3::new(x, y, z), unit.as_vec3())
            };
            (ray, length)
        };
        rays.iter().map(unit).unzip()
    }
}

/// Whether there is any hit for each of some checked rays.
pub(crate) fn occluded(built: &Built, rays: &Rays, limits: Limits) -> Vec<bool> {
    let rays = rays.rows();
    let mut occluded = vec![false; rays.len()];
    let tasks = rays.par_chunks(TASK).zip(occluded.par_chunks_mut(TASK));
    tasks.for_each(|(rays, occluded)| {
        let (rays, _) = limits.unit_rays(rays);
        built.caster.are_occluded(&rays, occluded);
    });
    occluded
}

/// The columns of hits.
pub(crate) struct Hits {
    pub(crate) distances: Vec<f32>,
    pub(crate) meshes: Vec<u32>,
    pub(crate) primitives: Vec<u32>,
    pub(crate) uvs: Vec<[f32; 2]>,
    pub(crate) normals: Vec<[f32; 3]>,
    pub(crate) instances: Vec<u32>,
    pub(crate) semantics: Vec<u32>,
}

/// A hit's place in each column.
struct Place<'a> {
    distance: &'a mut f32,
    mesh: &'a mut u32,
    primitive: &'a mut u32,
    uv: &'a mut [f32; 2],
    normal: &'a mut [f32; 3],
    instance: &'a mut u32,
    semantic: &'a mut u32,
}

impl Hits {
    /// Casts checked rays by the threads of the current pool, each of which writes the hits of its
    /// tasks.
    pub(crate) fn cast(built: &Built, rays: &Rays, limits: Limits) -> Self {
        let rays = rays.rows();
        let count = rays.len();
        // Zeros come from the system untouched, so that each thread touches its own part first.
        let mut hits = Self {
            distances: vec![0.0; count],
            meshes: vec![0; count],
            primitives: vec![0; count],
            uvs: vec![[0.0; 2]; count],
            normals: vec![[0.0; 3]; count],
            instances: vec![0; count],
            semantics: vec![0; count],
        };
        let columns = (
            rays.par_chunks(TASK),
            hits.distances.par_chunks_mut(TASK),
            hits.meshes.par_chunks_mut(TASK),
            hits.primitives.par_chunks_mut(TASK),
            hits.uvs.par_chunks_mut(TASK),
            hits.normals.par_chunks_mut(TASK),
            hits.instances.par_chunks_mut(TASK),
            hits.semantics.par_chunks_mut(TASK),
        );
        columns.into_par_iter().for_each(|columns| {
            let (rays, distances, meshes, primitives, uvs, normals, instances, semantics) = columns;
            let (rays, lengths) = limits.unit_rays(rays);
            let mut records = vec![None; rays.len()];
            built.caster.closest_records(&rays, &mut records);
            for (i, record) in records.iter().enumerate() {
                let place = Place {
                    distance: &mut distances[i],
                    mesh: &mut meshes[i],
                    primitive: &mut primitives[i],
                    uv: &mut uvs[i],
                    normal: &mut normals[i],
                    instance: &mut instances[i],
                    semantic: &mut semantics[i],
                };
                place.write(built, record.as_ref(), lengths[i]);
            }
        });
        hits
    }
}

impl Place<'_> {
    fn write(self, built: &Built, record: Option<&HitRecord>, length: f32) {
        let Some(record) = record else {
            *self.distance = f32::INFINITY;
            *self.mesh = INVALID;
            *self.primitive = INVALID;
            *self.instance = INVALID;
            return;
        };
        [*self.mesh, *self.semantic, *self.instance] = built.labels[record.instance as usize];
        *self.distance = record.distance_m / length;
        *self.uv = record.place.map(|x| x as f32);
        // Meshes have no cards.
        let (Primitive::Triangle(number) | Primitive::Card(number)) = record.primitive;
        *self.primitive = number;
        *self.normal = record.geometric_normal.to_array();
    }
}
