//! All instances of a scene on the GPU, sorted by prototype. They are uploaded anew when chunks
//! come or go, and serve all pictures between.

use std::collections::BTreeMap;
use std::sync::{Arc, Weak};

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3, Vec3};
use nemoral_scene::{Instance, InstanceGroup, ObjectId, PlacedGroup, Prototype};

use super::frame::GRID_PER_M;
use super::frustum::{BoundingSphere, Frustum};
use super::pipeline::storage;
use super::{Gpu, GpuError};

/// `Instance` in `surface.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct InstanceRecord {
    x: [f32; 3],
    rest_x: f32,
    y: [f32; 3],
    rest_y: f32,
    z: [f32; 3],
    rest_z: f32,
    place: [f32; 3],
    variation: f32,
}

impl InstanceRecord {
    /// The record of an instance of a group at `offset` from the buffer's origin.
    fn new(instance: &Instance, offset: DVec3) -> Self {
        let exact = offset + instance.position_m.as_dvec3();
        // The position is on the grid, so that the difference to a frame's origin, which is on the
        // grid too, is exact.
        let place = ((exact * GRID_PER_M).round() / GRID_PER_M).as_vec3();
        let rest = (exact - place.as_dvec3()).as_vec3();
        let axes = instance.linear;
        Self {
            x: axes.x_axis.to_array(),
            rest_x: rest.x,
            y: axes.y_axis.to_array(),
            rest_y: rest.y,
            z: axes.z_axis.to_array(),
            rest_z: rest.z,
            place: place.to_array(),
            variation: instance.variation,
        }
    }
}

/// A group of the scene. It is recognised by its address, which no other group can take while this
/// weak pointer is held.
#[derive(Debug)]
struct GroupEntry {
    group: Weak<dyn InstanceGroup>,
    offset: Vec3,
    /// A sphere around its instances, relative to the buffer's origin; `None` if none can be hit.
    bounds: Option<BoundingSphere>,
    /// The numbers of its prototypes.
    shapes: Vec<usize>,
}

/// The instances of one prototype, which are consecutive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InstanceRange {
    pub(crate) first: u32,
    pub(crate) count: u32,
}

/// The instances of some groups.
#[derive(Debug)]
pub(crate) struct InstanceBuffer {
    groups: Vec<GroupEntry>,
    /// The point of the scene that positions are relative to.
    pub(crate) origin_m: DVec3,
    shapes: Vec<(Weak<Prototype>, InstanceRange)>,
    /// The objects of the instances.
    pub(crate) objects: Arc<[ObjectId]>,
    pub(crate) instances: wgpu::Buffer,
    pub(crate) bounding_spheres: wgpu::Buffer,
}

/// The distance from the origin up to which positions are exact.
const REACH_M: f64 = 4096.0;

/// An instance before the sort.
struct Placed {
    shape: usize,
    object: ObjectId,
    bounds: BoundingSphere,
    record: InstanceRecord,
}

impl InstanceBuffer {
    /// Uploads the instances of groups relative to `origin_m`; those of one prototype are sorted by
    /// distance.
    pub(crate) fn upload(
        gpu: &Gpu,
        groups: &[PlacedGroup],
        origin_m: DVec3,
    ) -> Result<Self, GpuError> {
        let mut numbers: BTreeMap<usize, usize> = BTreeMap::new();
        let mut prototypes: Vec<Weak<Prototype>> = Vec::new();
        let mut placed: Vec<Placed> = Vec::new();
        let mut entries = Vec::new();
        for (offset, group) in groups {
            let from_origin = offset.as_dvec3() - origin_m;
            let first = placed.len();
            for instance in group.instances() {
                let Some(sphere) = bounding_sphere(instance, from_origin) else {
                    continue;
                };
                let prototype = &instance.prototype;
                let shape = *numbers
                    .entry(Arc::as_ptr(prototype) as usize)
                    .or_insert_with(|| {
                        prototypes.push(Arc::downgrade(prototype));
                        prototypes.len() - 1
                    });
                placed.push(Placed {
                    shape,
                    object: instance.object,
                    bounds: sphere,
                    record: InstanceRecord::new(instance, from_origin),
                });
            }
            let mut shapes: Vec<usize> = placed[first..].iter().map(|p| p.shape).collect();
            shapes.sort_unstable();
            shapes.dedup();
            entries.push(GroupEntry {
                group: Arc::downgrade(group),
                offset: *offset,
                bounds: sphere_around(&placed[first..]),
                shapes,
            });
        }
        placed.sort_by(|a, b| {
            let far = |p: &Placed| p.bounds.centre.length_squared();
            a.shape.cmp(&b.shape).then(far(a).total_cmp(&far(b)))
        });
        let mut first = 0;
        let ranges = placed.chunk_by(|a, b| a.shape == b.shape).map(|of_shape| {
            let count = of_shape.len() as u32;
            first += count;
            let first = first - count;
            InstanceRange { first, count }
        });
        let records: Vec<InstanceRecord> = placed.iter().map(|p| p.record).collect();
        let sphere = |p: &Placed| {
            // The radius is enlarged by the rounding of the centre to f32.
            let radius = p.bounds.radius + 1e-3 + 1e-6 * p.bounds.centre.length();
            p.bounds.centre.extend(radius).as_vec4().to_array()
        };
        let bounding_spheres: Vec<[f32; 4]> = placed.iter().map(sphere).collect();
        Ok(Self {
            groups: entries,
            origin_m,
            shapes: prototypes.into_iter().zip(ranges).collect(),
            objects: placed.iter().map(|p| p.object).collect(),
            instances: storage(gpu, "instances", bytemuck::cast_slice(&records))?,
            bounding_spheres: storage(
                gpu,
                "bounding spheres",
                bytemuck::cast_slice(&bounding_spheres),
            )?,
        })
    }

    /// Whether it has the instances of these groups, exactly enough for frames around `origin_m`.
    pub(crate) fn holds(&self, groups: &[PlacedGroup], origin_m: DVec3) -> bool {
        let same = |(entry, (offset, group)): (&GroupEntry, &PlacedGroup)| {
            let (held, given) = (entry.group.as_ptr(), Arc::as_ptr(group));
            std::ptr::addr_eq(held, given) && entry.offset == *offset
        };
        self.groups.len() == groups.len()
            && self.groups.iter().zip(groups).all(same)
            && (origin_m - self.origin_m).abs().max_element() < REACH_M
            && self.shapes.iter().all(|(p, _)| p.strong_count() > 0)
    }

    /// The prototypes, with their instances, of the groups that may be visible in any of these
    /// frustums, which are relative to `origin_m`.
    pub(crate) fn visible_prototypes(
        &self,
        frustums: &[Frustum],
        origin_m: DVec3,
    ) -> Vec<(Arc<Prototype>, InstanceRange)> {
        let away = self.origin_m - origin_m;
        let mut seen = vec![false; self.shapes.len()];
        for entry in &self.groups {
            let bounds = entry.bounds.map(|sphere| BoundingSphere {
                centre: sphere.centre + away,
                ..sphere
            });
            if bounds.is_some_and(|b| frustums.iter().any(|f| f.may_see(&b))) {
                for &shape in &entry.shapes {
                    seen[shape] = true;
                }
            }
        }
        let shapes = self.shapes.iter().zip(seen).filter(|(_, seen)| *seen);
        shapes
            .filter_map(|((shape, range), _)| Some((shape.upgrade()?, *range)))
            .collect()
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.instances.size() + self.bounding_spheres.size()
    }
}

/// A sphere around the spheres of some instances.
fn sphere_around(placed: &[Placed]) -> Option<BoundingSphere> {
    let reach = |p: &Placed| DVec3::splat(p.bounds.radius);
    let low = placed.iter().map(|p| p.bounds.centre - reach(p));
    let high = placed.iter().map(|p| p.bounds.centre + reach(p));
    let (low, high) = (low.reduce(DVec3::min)?, high.reduce(DVec3::max)?);
    Some(BoundingSphere {
        centre: (low + high) * 0.5,
        radius: (high - low).length() * 0.5,
    })
}

/// A sphere around an instance of a group at `offset`; `None` if the instance can never be hit.
pub(crate) fn bounding_sphere(instance: &Instance, offset: DVec3) -> Option<BoundingSphere> {
    let linear: DMat3 = instance.linear.as_dmat3();
    let sound = linear.determinant() != 0.0
        && linear.inverse().is_finite()
        && instance.position_m.is_finite();
    let bounds = instance.prototype.bounds();
    let half = (bounds.max.as_dvec3() - bounds.min.as_dvec3()) * 0.5;
    let middle = (bounds.max.as_dvec3() + bounds.min.as_dvec3()) * 0.5;
    let reach = |row: DVec3| row.abs().dot(half);
    let rows = linear.transpose();
    let extent = DVec3::new(reach(rows.x_axis), reach(rows.y_axis), reach(rows.z_axis));
    sound.then(|| BoundingSphere {
        centre: offset + instance.position_m.as_dvec3() + linear * middle,
        // The radius is slightly enlarged for the rounding to f32.
        radius: extent.length() + 1e-3,
    })
}
