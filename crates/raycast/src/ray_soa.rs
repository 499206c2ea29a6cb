//! Rays as a structure of arrays, transformed to the space of a shape eight at a time.
//!
//! The results are those of [`Pose::local`] and [`LaneRay::new`], to the bit. Loops over eight
//! numbers without a branch become a few instructions in a kernel, which the transform of a single
//! ray would not.

use glam::{DMat3, DVec3, Vec3};
use nemoral_scene::Ray;

use crate::group::Pose;
use crate::intersection::LocalRay;
use crate::node::{BOX_SLACK, LaneRay, PRIMITIVE_SLACK};
use crate::quantization_grid::QuantizationGrid;
use crate::ray_mask::{MAX_RAYS, RayMask};

/// One vector for each ray in f64, axis by axis.
type Wide = [[f64; MAX_RAYS]; 3];

/// The same in f32.
type Narrow = [[f32; MAX_RAYS]; 3];

/// Eight vectors in f64, axis by axis.
type Eight = [[f64; 8]; 3];

/// Rays in one space.
#[derive(Debug)]
pub(crate) struct RaySoa {
    origin: Wide,
    direction: Wide,
}

impl RaySoa {
    pub(crate) const NONE: Self = Self {
        origin: [[0.0; MAX_RAYS]; 3],
        direction: [[0.0; MAX_RAYS]; 3],
    };

    #[inline(always)]
    pub(crate) fn put(&mut self, i: usize, ray: &Ray) {
        for axis in 0..3 {
            self.origin[axis][i] = f64::from(ray.origin[axis]);
            self.direction[axis][i] = f64::from(ray.direction[axis]);
        }
    }

    #[inline(always)]
    fn get(&self, i: usize) -> LocalRay {
        let at = |v: &Wide| DVec3::new(v[0][i], v[1][i], v[2][i]);
        LocalRay {
            origin: at(&self.origin),
            direction: at(&self.direction),
        }
    }
}

/// Rays in the space of a shape, in f64 and prepared for eight-wide tests (see [`LaneRay`]).
#[derive(Debug)]
pub(crate) struct LocalRaySoa {
    rays: RaySoa,
    origin: Narrow,
    direction: Narrow,
    scale: Narrow,
    enter: Narrow,
    leave: Narrow,
    slack: [f32; MAX_RAYS],
    reach: [f32; MAX_RAYS],
}

impl LocalRaySoa {
    pub(crate) const NONE: Self = Self {
        rays: RaySoa::NONE,
        origin: [[0.0; MAX_RAYS]; 3],
        direction: [[0.0; MAX_RAYS]; 3],
        scale: [[0.0; MAX_RAYS]; 3],
        enter: [[0.0; MAX_RAYS]; 3],
        leave: [[0.0; MAX_RAYS]; 3],
        slack: [0.0; MAX_RAYS],
        reach: [0.0; MAX_RAYS],
    };

    /// Transforms rays of the scene to the space of a shape, posed in a group at `offset`: the rays
    /// of the set, and those that share eight lanes with one of them.
    #[inline(always)]
    pub(crate) fn place(
        &mut self,
        (scene, set): (&RaySoa, RayMask),
        (offset, pose): (Vec3, &Pose),
        (extent, grid): (f32, &QuantizationGrid),
    ) {
        let offset = offset.as_dvec3();
        for first in (0..MAX_RAYS).step_by(8) {
            if set >> first & 0xFF != 0 {
                let from_offset = less(eight(&scene.origin, first), offset);
                let from_position = less(from_offset, pose.position);
                let origin = turned(&pose.inverse, from_position);
                let direction = turned(&pose.inverse, eight(&scene.direction, first));
                self.put(first, (origin, direction), (extent, grid));
            }
        }
    }

    #[inline(always)]
    fn put(
        &mut self,
        first: usize,
        (origin, direction): (Eight, Eight),
        (extent, grid): (f32, &QuantizationGrid),
    ) {
        let from_grid = less(origin, grid.origin);
        let (mut reach, mut largest) = ([0.0; 8], [0.0; 8]);
        for axis in 0..3 {
            for k in 0..8 {
                let (o, d) = (origin[axis][k], direction[axis][k]);
                self.rays.origin[axis][first + k] = o;
                self.rays.direction[axis][first + k] = d;
                self.origin[axis][first + k] = o as f32;
                self.direction[axis][first + k] = d as f32;
                reach[k] = f32::max(reach[k], (o as f32).abs());
                largest[k] = f32::max(largest[k], (d as f32).abs());
            }
        }
        for k in 0..8 {
            reach[k] += extent;
            self.reach[first + k] = reach[k];
            self.slack[first + k] = PRIMITIVE_SLACK * f32::EPSILON * reach[k] * largest[k];
        }
        for axis in 0..3 {
            for k in 0..8 {
                let d = direction[axis][k] as f32;
                let inverse = 1.0
                    / if d.abs() > 1e-20 {
                        d
                    } else {
                        1e-20_f32.copysign(d)
                    };
                let pad = BOX_SLACK * f32::EPSILON * reach[k] * inverse.abs();
                let scaled = from_grid[axis][k] as f32 * inverse;
                self.scale[axis][first + k] = inverse * grid.step[axis];
                self.enter[axis][first + k] = scaled + pad;
                self.leave[axis][first + k] = scaled - pad;
            }
        }
    }

    /// A ray in f64.
    #[inline(always)]
    pub(crate) fn ray(&self, i: usize) -> LocalRay {
        self.rays.get(i & (MAX_RAYS - 1))
    }

    /// A ray prepared for eight-wide tests.
    #[inline(always)]
    pub(crate) fn lane(&self, i: usize) -> LaneRay {
        let i = i & (MAX_RAYS - 1);
        let at = |v: &Narrow| [v[0][i], v[1][i], v[2][i]];
        LaneRay {
            origin: at(&self.origin),
            direction: at(&self.direction),
            scale: at(&self.scale),
            enter: at(&self.enter),
            leave: at(&self.leave),
            slack: self.slack[i],
            reach: self.reach[i],
        }
    }
}

#[inline(always)]
fn eight(v: &Wide, first: usize) -> Eight {
    let mut out = [[0.0; 8]; 3];
    for axis in 0..3 {
        out[axis].copy_from_slice(&v[axis][first..first + 8]);
    }
    out
}

#[inline(always)]
fn less(mut v: Eight, b: DVec3) -> Eight {
    for axis in 0..3 {
        for x in &mut v[axis] {
            *x -= b[axis];
        }
    }
    v
}

/// Matrix times vectors, with the sums in glam's order.
#[inline(always)]
fn turned(m: &DMat3, v: Eight) -> Eight {
    let mut out = [[0.0; 8]; 3];
    for (axis, out) in out.iter_mut().enumerate() {
        let row = [m.x_axis[axis], m.y_axis[axis], m.z_axis[axis]];
        for (k, out) in out.iter_mut().enumerate() {
            *out = row[0] * v[0][k] + row[1] * v[1][k] + row[2] * v[2][k];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::Bounds;
    use proptest::prelude::*;

    fn vector(size: f32) -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-size..size).prop_map(Vec3::from_array)
    }

    proptest! {
        #[test]
        fn eight_rays_are_what_each_is_on_its_own(
            rays in prop::collection::vec((vector(300.0), vector(1.0), 0_usize..6), MAX_RAYS),
            (offset, position) in (vector(200.0), vector(50.0)),
            columns in prop::array::uniform3(vector(2.0)),
            set: RayMask,
            extent in 0.1_f32..40.0,
        ) {
            let [x, y, z] = columns.map(|c| c.as_dvec3());
            let pose = Pose {
                position: position.as_dvec3(),
                inverse: DMat3::from_cols(x, y, z),
            };
            let grid = QuantizationGrid::over(&Bounds {
                min: Vec3::splat(-extent),
                max: Vec3::splat(extent),
            });
            let (mut scene, mut lanes) = (RaySoa::NONE, LocalRaySoa::NONE);
            let rays: Vec<Ray> = rays
                .iter()
                .map(|&(origin, mut direction, level)| {
                    // Some of them along the axes.
                    if level < 3 {
                        direction[level] = 0.0;
                    }
                    Ray::new(origin, direction)
                })
                .collect();
            for (i, ray) in rays.iter().enumerate() {
                scene.put(i, ray);
            }
            lanes.place((&scene, set), (offset, &pose), (extent, &grid));
            for (i, ray) in rays.iter().enumerate().filter(|(i, _)| set >> i & 1 == 1) {
                let alone = pose.local(&LocalRay::in_group(ray, offset));
                let lane = LaneRay::new(&alone, extent, &grid);
                prop_assert_eq!(format!("{:?}", lanes.ray(i)), format!("{alone:?}"));
                prop_assert_eq!(format!("{:?}", lanes.lane(i)), format!("{lane:?}"));
            }
        }
    }
}
