//! All instances of a scene on the GPU, sorted by shape: they come when chunks come or go, and serve
//! all pictures between.

use std::collections::BTreeMap;
use std::sync::{Arc, Weak};

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3, Vec3};
use nemoral_scene::{Instance, InstanceGroup, ObjectId, PlacedGroup, Prototype};

use super::frame::GRID_PER_M;
use super::pipeline::storage;
use super::sight::{Ball, Sight};
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
    /// About the herd's origin, from which the group lies at `offset`.
    fn new(instance: &Instance, offset: DVec3) -> Self {
        let exact = offset + instance.position_m.as_dvec3();
        // On the grid, so that what a frame's origin, which is there too, takes off leaves no rounding.
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

/// A group of the scene, known again by its address, which no other can take as long as this is here.
#[derive(Debug)]
struct Member {
    group: Weak<dyn InstanceGroup>,
    offset: Vec3,
    /// Around its instances, about the herd's origin; `None` if nothing of it is ever hit.
    ball: Option<Ball>,
    /// Numbers of its shapes.
    shapes: Vec<usize>,
}

/// The instances of one shape, side by side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Alike {
    pub(crate) first: u32,
    pub(crate) count: u32,
}

/// All instances of some groups.
#[derive(Debug)]
pub(crate) struct Herd {
    members: Vec<Member>,
    /// What places are told from, in the scene.
    pub(crate) origin_m: DVec3,
    shapes: Vec<(Weak<Prototype>, Alike)>,
    /// Of the instances.
    pub(crate) objects: Arc<[ObjectId]>,
    pub(crate) instances: wgpu::Buffer,
    pub(crate) balls: wgpu::Buffer,
}

/// Places so far from the origin are still exact.
const REACH_M: f64 = 4096.0;

/// An instance before it is sorted.
struct Placed {
    shape: usize,
    object: ObjectId,
    ball: Ball,
    record: InstanceRecord,
}

impl Herd {
    /// The instances of groups, told from `origin_m`, the nearest of a shape first.
    pub(crate) fn gather(
        gpu: &Gpu,
        groups: &[PlacedGroup],
        origin_m: DVec3,
    ) -> Result<Self, GpuError> {
        let mut numbers: BTreeMap<usize, usize> = BTreeMap::new();
        let mut prototypes: Vec<Weak<Prototype>> = Vec::new();
        let mut placed: Vec<Placed> = Vec::new();
        let mut members = Vec::new();
        for (offset, group) in groups {
            let from_origin = offset.as_dvec3() - origin_m;
            let first = placed.len();
            for instance in group.instances() {
                let Some(ball) = ball(instance, from_origin) else {
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
                    ball,
                    record: InstanceRecord::new(instance, from_origin),
                });
            }
            let mut shapes: Vec<usize> = placed[first..].iter().map(|p| p.shape).collect();
            shapes.sort_unstable();
            shapes.dedup();
            members.push(Member {
                group: Arc::downgrade(group),
                offset: *offset,
                ball: around(&placed[first..]),
                shapes,
            });
        }
        placed.sort_by(|a, b| {
            let far = |p: &Placed| p.ball.centre.length_squared();
            a.shape.cmp(&b.shape).then(far(a).total_cmp(&far(b)))
        });
        let mut first = 0;
        let alike = placed.chunk_by(|a, b| a.shape == b.shape).map(|alike| {
            let count = alike.len() as u32;
            first += count;
            let first = first - count;
            Alike { first, count }
        });
        let records: Vec<InstanceRecord> = placed.iter().map(|p| p.record).collect();
        let told = |p: &Placed| {
            // What f32 rounds off the centre.
            let radius = p.ball.radius + 1e-3 + 1e-6 * p.ball.centre.length();
            p.ball.centre.extend(radius).as_vec4().to_array()
        };
        let balls: Vec<[f32; 4]> = placed.iter().map(told).collect();
        Ok(Self {
            members,
            origin_m,
            shapes: prototypes.into_iter().zip(alike).collect(),
            objects: placed.iter().map(|p| p.object).collect(),
            instances: storage(gpu, "instances", bytemuck::cast_slice(&records))?,
            balls: storage(gpu, "balls", bytemuck::cast_slice(&balls))?,
        })
    }

    /// Are these the instances of these groups, and exact for frames about `origin_m`?
    pub(crate) fn is_of(&self, groups: &[PlacedGroup], origin_m: DVec3) -> bool {
        let same = |(member, (offset, group)): (&Member, &PlacedGroup)| {
            let (held, asked) = (member.group.as_ptr(), Arc::as_ptr(group));
            std::ptr::addr_eq(held, asked) && member.offset == *offset
        };
        self.members.len() == groups.len()
            && self.members.iter().zip(groups).all(same)
            && (origin_m - self.origin_m).abs().max_element() < REACH_M
            && self.shapes.iter().all(|(p, _)| p.strong_count() > 0)
    }

    /// The shapes of the groups that any of these may see; sights are told from `origin_m`.
    pub(crate) fn seen(&self, sights: &[Sight], origin_m: DVec3) -> Vec<(Arc<Prototype>, Alike)> {
        let away = self.origin_m - origin_m;
        let mut seen = vec![false; self.shapes.len()];
        for member in &self.members {
            let ball = member.ball.map(|ball| Ball {
                centre: ball.centre + away,
                ..ball
            });
            if ball.is_some_and(|ball| sights.iter().any(|sight| sight.sees(&ball))) {
                for &shape in &member.shapes {
                    seen[shape] = true;
                }
            }
        }
        let shapes = self.shapes.iter().zip(seen).filter(|(_, seen)| *seen);
        shapes
            .filter_map(|((shape, alike), _)| Some((shape.upgrade()?, *alike)))
            .collect()
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.instances.size() + self.balls.size()
    }
}

/// A ball around others.
fn around(placed: &[Placed]) -> Option<Ball> {
    let reach = |p: &Placed| DVec3::splat(p.ball.radius);
    let low = placed.iter().map(|p| p.ball.centre - reach(p));
    let high = placed.iter().map(|p| p.ball.centre + reach(p));
    let (low, high) = (low.reduce(DVec3::min)?, high.reduce(DVec3::max)?);
    Some(Ball {
        centre: (low + high) * 0.5,
        radius: (high - low).length() * 0.5,
    })
}

/// `None` if the instance is never hit.
pub(crate) fn ball(instance: &Instance, offset: DVec3) -> Option<Ball> {
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
    sound.then(|| Ball {
        centre: offset + instance.position_m.as_dvec3() + linear * middle,
        // A hair more, for what f32 rounds.
        radius: extent.length() + 1e-3,
    })
}
