//! What of a scene is drawn: instances before the camera, sorted by shape.

use std::collections::BTreeMap;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3};
use nemoral_scene::{Instance, Intrinsics, ObjectId, PlacedGroup, Prototype};

use super::bend::{Bend, widest_rad};
use super::pages::Kind;
use super::shapes::Shapes;

/// `Instance` in `surface.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct InstanceRecord {
    x: [f32; 3],
    /// What f32 rounds off the place.
    rest_x: f32,
    y: [f32; 3],
    rest_y: f32,
    z: [f32; 3],
    rest_z: f32,
    place: [f32; 3],
    variation: f32,
}

impl InstanceRecord {
    fn new(instance: &Instance, offset: DVec3) -> Self {
        let exact = offset + instance.position_m.as_dvec3();
        let place = exact.as_vec3();
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

/// A ball about the frame's origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ball {
    pub(crate) centre: DVec3,
    pub(crate) radius: f64,
}

/// One of a frame's instances.
#[derive(Clone, Copy, Debug)]
struct Placed {
    /// In `Crowd::prototypes`.
    shape: usize,
    object: ObjectId,
    ball: Ball,
    record: InstanceRecord,
}

/// All instances of a frame, about its origin.
#[derive(Debug)]
pub(crate) struct Crowd {
    /// In the order of their first instances.
    prototypes: Vec<Arc<Prototype>>,
    placed: Vec<Placed>,
}

impl Crowd {
    /// The instances of groups about `origin_m`, those that `wanted` wants.
    pub(crate) fn gather(
        groups: &[PlacedGroup],
        origin_m: DVec3,
        wanted: impl Fn(&Ball) -> bool,
    ) -> Self {
        let mut crowd = Self {
            prototypes: Vec::new(),
            placed: Vec::new(),
        };
        let mut shapes: BTreeMap<usize, usize> = BTreeMap::new();
        for (offset, group) in groups {
            let offset = offset.as_dvec3() - origin_m;
            for instance in group.instances() {
                let Some(ball) = ball(instance, offset) else {
                    continue;
                };
                if !wanted(&ball) {
                    continue;
                }
                let prototype = &instance.prototype;
                let shape = *shapes
                    .entry(Arc::as_ptr(prototype) as usize)
                    .or_insert_with(|| {
                        crowd.prototypes.push(Arc::clone(prototype));
                        crowd.prototypes.len() - 1
                    });
                crowd.placed.push(Placed {
                    shape,
                    object: instance.object,
                    ball,
                    record: InstanceRecord::new(instance, offset),
                });
            }
        }
        crowd
    }

    pub(crate) fn prototypes(&self) -> &[Arc<Prototype>] {
        &self.prototypes
    }

    /// The draws of those instances that are seen, nearest first among those of a shape.
    pub(crate) fn draws(&self, shapes: &Shapes, seen: impl Fn(&Ball) -> bool) -> Draws {
        let mut order: Vec<u32> = (0..self.placed.len() as u32)
            .filter(|&i| seen(&self.placed[i as usize].ball))
            .collect();
        order.sort_by(|&a, &b| {
            let [a, b] = [a, b].map(|i| &self.placed[i as usize]);
            let far = |p: &Placed| p.ball.centre.length_squared();
            a.shape.cmp(&b.shape).then(far(a).total_cmp(&far(b)))
        });
        let placed = |i: &u32| &self.placed[*i as usize];
        let mut draws = Draws {
            instances: order.iter().map(|i| placed(i).record).collect(),
            objects: order.iter().map(|i| placed(i).object).collect(),
            of_pages: Vec::new(),
        };
        let mut of_pages: BTreeMap<usize, Vec<Draw>> = BTreeMap::new();
        let mut first = 0;
        for alike in order.chunk_by(|a, b| placed(a).shape == placed(b).shape) {
            let prototype = &self.prototypes[placed(&alike[0]).shape];
            for kind in Kind::ALL {
                for range in shapes.ranges(prototype, kind) {
                    of_pages.entry(range.page).or_default().push(Draw {
                        vertices: range.count * kind.vertices(),
                        instances: alike.len() as u32,
                        first_vertex: range.first * kind.vertices(),
                        first_instance: first,
                    });
                }
            }
            first += alike.len() as u32;
        }
        draws.of_pages = of_pages.into_iter().collect();
        draws
    }
}

/// The arguments of an indirect draw.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct Draw {
    pub(crate) vertices: u32,
    pub(crate) instances: u32,
    pub(crate) first_vertex: u32,
    pub(crate) first_instance: u32,
}

/// What one view draws.
#[derive(Debug)]
pub(crate) struct Draws {
    pub(crate) instances: Vec<InstanceRecord>,
    /// Of the instances.
    pub(crate) objects: Vec<ObjectId>,
    /// By page.
    pub(crate) of_pages: Vec<(usize, Vec<Draw>)>,
}

/// `None` if the instance is never hit.
fn ball(instance: &Instance, offset: DVec3) -> Option<Ball> {
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

/// What a camera sees, up to a distance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frustum {
    eye: DVec3,
    range_m: f64,
    field: Field,
}

#[derive(Clone, Copy, Debug)]
enum Field {
    /// Inwards, unit, through the eye: left, right, top, bottom, front.
    Pyramid([DVec3; 5]),
    /// All that is so far from the axis, seen from wherever the camera comes by.
    Cone {
        axis: DVec3,
        half_angle_rad: f64,
        way_m: f64,
    },
}

impl Frustum {
    /// `bend` is the view's.
    pub(crate) fn new(
        view: &crate::View,
        bend: Option<&Bend>,
        origin_m: DVec3,
        range_m: f64,
    ) -> Self {
        let pose = &view.scene_from_camera;
        let k = &view.intrinsics;
        let field = if bend.is_none() && !view.blurs() {
            Field::Pyramid(pyramid(k).map(|n| pose.transform_vector(n)))
        } else {
            let half_s = 0.5 * view.shutter.duration_s();
            let turn_rad = view.motion.angular_rad_s.length() * half_s;
            Field::Cone {
                axis: pose.transform_vector(DVec3::Z),
                half_angle_rad: bend.map_or_else(|| widest_rad(k), |b| b.widest_rad)
                    + turn_rad
                    + 1e-3,
                way_m: view.motion.linear_m_s.length() * half_s,
            }
        };
        Self {
            eye: pose.translation_m - origin_m,
            range_m,
            field,
        }
    }

    pub(crate) fn sees(&self, ball: &Ball) -> bool {
        let at = ball.centre - self.eye;
        let distance_m = at.length();
        match self.field {
            Field::Pyramid(planes) => {
                distance_m - ball.radius <= self.range_m
                    && planes.iter().all(|n| n.dot(at) >= -ball.radius)
            }
            Field::Cone {
                axis,
                half_angle_rad,
                way_m,
            } => {
                let radius = ball.radius + way_m;
                if distance_m <= radius {
                    return true;
                }
                let seen_rad = libm::asin(radius / distance_m);
                distance_m - radius <= self.range_m
                    && at.angle_between(axis) <= half_angle_rad + seen_rad
            }
        }
    }
}

/// Planes of a pinhole in its optical frame.
fn pyramid(k: &Intrinsics) -> [DVec3; 5] {
    let (w, h) = (f64::from(k.width), f64::from(k.height));
    [
        DVec3::new(k.fx, 0.0, k.cx),
        DVec3::new(-k.fx, 0.0, w - k.cx),
        DVec3::new(0.0, k.fy, k.cy),
        DVec3::new(0.0, -k.fy, h - k.cy),
        DVec3::Z,
    ]
    .map(|n| n / n.length())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::View;
    use glam::{DQuat, DVec2};
    use nemoral_scene::{Distortion, Intrinsics, RigidTransform, Shutter, Twist};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_a_bent_and_moving_picture_shows_is_seen(
            x in -30.0_f64..94.0, y in -20.0_f64..56.0, range_m in 0.05_f64..60.0,
            linear in prop::array::uniform3(-3.0_f64..3.0), angular in prop::array::uniform3(-2.0_f64..2.0),
        ) {
            let fisheye = Distortion::Fisheye { k1: -0.01, k2: 0.0, k3: 0.0, k4: 0.0 };
            let k = Intrinsics::through_lens(64, 36, 2.3, fisheye).expect("valid");
            let pose = RigidTransform { rotation: DQuat::from_rotation_z(0.7), translation_m: DVec3::new(3.0, -2.0, 1.0) };
            let view = View {
                shutter: Shutter { exposure_s: 0.02, readout_s: 0.04 },
                motion: Twist { linear_m_s: DVec3::from_array(linear), angular_rad_s: DVec3::from_array(angular) },
                ..View::new(k, pose)
            };
            let origin = DVec3::new(2.0, -2.0, 0.0);
            let frustum = Frustum::new(&view, Bend::of(&view).as_ref(), origin, 60.0);
            // Corners and borders often.
            let pixel = DVec2::new(x, y).clamp(DVec2::ZERO, DVec2::new(64.0, 36.0));
            let ray = view.ray(pixel, 60.0);
            let place = ray.origin.as_dvec3() + ray.direction.as_dvec3() * range_m;
            let ball = Ball { centre: place - origin, radius: 0.0 };
            prop_assert!(frustum.sees(&ball) || place.distance(pose.translation_m) > 60.0);
            // And what is behind is not.
            let behind = Ball { centre: pose.transform_point(DVec3::new(0.1 * x, 0.1 * y, -range_m - 10.0)) - origin, radius: 0.5 };
            prop_assert!(!frustum.sees(&behind));
        }

        #[test]
        fn what_projects_into_the_picture_is_seen(
            x in -50.0_f64..50.0, y in -50.0_f64..50.0, z in -20.0_f64..80.0, radius in 0.0_f64..9.0, yaw in 0.0_f64..6.3,
        ) {
            let k = Intrinsics::from_fov(64, 36, 1.2).expect("valid");
            let pose = RigidTransform { rotation: DQuat::from_rotation_z(yaw), translation_m: DVec3::new(3.0, -2.0, 1.0) };
            let origin = DVec3::new(2.0, -2.0, 0.0);
            let frustum = Frustum::new(&View::new(k, pose), None, origin, 60.0);
            let optical = DVec3::new(x, y, z);
            let inside = k.project(optical).is_some_and(|p| (0.0..=64.0).contains(&p.x) && (0.0..=36.0).contains(&p.y));
            let ball = Ball { centre: pose.transform_point(optical) - origin, radius };
            if inside && optical.length() <= 60.0 {
                prop_assert!(frustum.sees(&ball));
            }
            // And what is far outside is not.
            if optical.z < -radius - 1e-6 || optical.length() > 60.0 + radius + 1e-6 {
                prop_assert!(!frustum.sees(&ball));
            }
        }
    }
}
