//! A user's rays, and what they hit.

use nemoral_raycast::{HitRecord, Primitive};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{Ray, RayCaster};
use numpy::PyReadonlyArray2;
use rayon::prelude::*;

use crate::built_scene::Built;
use crate::failure::Failure;

/// What is nothing's number.
const INVALID: u32 = u32::MAX;
/// The most rays of a task. One thread casts them, in one order, and writes their results.
const TASK: usize = 1 << 15;
/// The least rays of a task: fewer have few similar neighbours.
const TASK_LEAST: usize = 1 << 11;
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

    /// How many rays a task has: there are several for each thread, as they take different times.
    fn per_task(&self) -> usize {
        let share = self.rows().len().div_ceil(4 * rayon::current_num_threads());
        share.clamp(TASK_LEAST, TASK)
    }

    /// Does the tasks. One that cannot be done gives the number, in it, of the first ray that
    /// cannot be cast; the first of all is refused.
    fn do_tasks(
        &self,
        tasks: impl IndexedParallelIterator<Item = Result<(), usize>>,
    ) -> Result<(), Failure> {
        let tasks = tasks.enumerate();
        let wrong = tasks.filter_map(|(task, done)| Some(task * self.per_task() + done.err()?));
        let Some(first) = wrong.min() else {
            return Ok(());
        };
        let found = format!("{:?}", self.rows()[first]);
        let allowed = "finite numbers and a direction whose length is 1e-30 to 3.4e38";
        Err(Failure::argument(&format!("rays[{first}]"), found, allowed))
    }
}

/// The length of a ray's direction, if it can be cast. In double precision no direction is too
/// short or too long.
fn length(&[x, y, z, dx, dy, dz]: &[f32; 6]) -> Option<f64> {
    let length = Vec3::new(dx, dy, dz).as_dvec3().length();
    let is_sound = [x, y, z].iter().all(|x| x.is_finite())
        // Not a number is not within.
        && length >= SHORTEST
        && (length as f32).is_finite();
    is_sound.then_some(length)
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

    /// Rays of unit directions, and the lengths of the given ones; or the number of the first that
    /// cannot be cast.
    fn unit_rays(self, rays: &[[f32; 6]]) -> Result<(Vec<Ray>, Vec<f32>), usize> {
        let mut units = Vec::with_capacity(rays.len());
        let mut lengths = Vec::with_capacity(rays.len());
        for (number, ray) in rays.iter().enumerate() {
            let &[x, y, z, dx, dy, dz] = ray;
            let length = length(ray).ok_or(number)?;
            let unit = DVec3::new(dx.into(), dy.into(), dz.into()) / length;
            let length = length as f32;
            units.push(Ray {
                t_min_m: self.near * length,
                t_max_m: self.far * length,
                ..Ray::new(Vec3::new(x, y, z), unit.as_vec3())
            });
            lengths.push(length);
        }
        Ok((units, lengths))
    }
}

/// Whether there is any hit for each ray.
pub(crate) fn occluded(built: &Built, rays: &Rays, limits: Limits) -> Result<Vec<bool>, Failure> {
    let task = rays.per_task();
    let mut occluded = vec![false; rays.rows().len()];
    let tasks = (rays.rows().par_chunks(task), occluded.par_chunks_mut(task));
    rays.do_tasks(tasks.into_par_iter().map(|(rays, occluded)| {
        let (rays, _) = limits.unit_rays(rays)?;
        built.caster.are_occluded(&rays, occluded);
        Ok(())
    }))?;
    Ok(occluded)
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
    /// Casts rays by the threads of the current pool, each of which writes the hits of its tasks.
    pub(crate) fn cast(built: &Built, rays: &Rays, limits: Limits) -> Result<Self, Failure> {
        let (count, task) = (rays.rows().len(), rays.per_task());
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
            rays.rows().par_chunks(task),
            hits.distances.par_chunks_mut(task),
            hits.meshes.par_chunks_mut(task),
            hits.primitives.par_chunks_mut(task),
            hits.uvs.par_chunks_mut(task),
            hits.normals.par_chunks_mut(task),
            hits.instances.par_chunks_mut(task),
            hits.semantics.par_chunks_mut(task),
        );
        rays.do_tasks(columns.into_par_iter().map(|columns| {
            let (rays, distances, meshes, primitives, uvs, normals, instances, semantics) = columns;
            let (rays, lengths) = limits.unit_rays(rays)?;
            built.caster.for_each_closest_record(&rays, |i, record| {
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
            });
            Ok(())
        }))?;
        Ok(hits)
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
