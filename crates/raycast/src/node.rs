//! Eight boxes at once.

use glam::{DVec3, Vec3};
use nemoral_scene::Bounds;

use crate::exact::LocalRay;
use crate::nearest::Nearest;
use crate::simd::{F8, Isa};

/// Set in a child that is a leaf; the other bits are the leaf's number.
pub(crate) const LEAF: u32 = 1 << 31;

/// How much farther boxes reach for a ray, in units of f32's epsilon times the largest coordinate
/// involved. Rounding of the ray to f32 (1/2), of the box (1/2), of the slab arithmetic (3/2) and
/// of the f64 meeting point to an f32 distance (1/2, times √3) stay well below.
const BOX_SLACK: f32 = 8.0;

/// The same for the eight-wide primitive filter, derived in [`crate::block`].
const PRIMITIVE_SLACK: f32 = 128.0;

/// A ray ready for eight-wide tests in one space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LaneRay {
    pub(crate) origin: [f32; 3],
    pub(crate) direction: [f32; 3],
    /// The origin, moved so that the planes where boxes are entered come nearer.
    enter: [f32; 3],
    /// The origin, moved so that the planes where boxes are left go farther.
    leave: [f32; 3],
    inverse: [f32; 3],
    /// 1 where the ray runs towards smaller coordinates.
    negative: [usize; 3],
    /// Bound on the rounding error of the primitive filter, per metre of edge.
    pub(crate) slack: f32,
    /// Bound, per axis, on the coordinates of the origin and of all points relative to it.
    pub(crate) reach: f32,
}

impl LaneRay {
    /// `extent` is the largest coordinate, in absolute value, of what is in this space.
    #[inline(always)]
    pub(crate) fn new(ray: &LocalRay, extent: f32) -> Self {
        let origin = ray.origin.as_vec3();
        let direction = ray.direction.as_vec3();
        let reach = origin.abs().max_element() + extent;
        let pad = BOX_SLACK * f32::EPSILON * reach;
        let (origin, direction) = (origin.to_array(), direction.to_array());
        // A finite inverse keeps the slab arithmetic free of NaN.
        let inverse = direction.map(|d| {
            1.0 / if d.abs() > 1e-20 {
                d
            } else {
                1e-20_f32.copysign(d)
            }
        });
        let signed_pad = inverse.map(|i| pad.copysign(i));
        let largest = direction[0]
            .abs()
            .max(direction[1].abs())
            .max(direction[2].abs());
        Self {
            origin,
            direction,
            enter: [0, 1, 2].map(|k| origin[k] + signed_pad[k]),
            leave: [0, 1, 2].map(|k| origin[k] - signed_pad[k]),
            inverse,
            negative: inverse.map(|i| usize::from(i < 0.0)),
            slack: PRIMITIVE_SLACK * f32::EPSILON * reach * largest,
            reach,
        }
    }
}

/// Eight boxes and what is in them.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Node {
    /// x low, x high, y low, y high, z low, z high. Lanes without a child are inside out.
    planes: [F8; 6],
    children: [u32; 8],
}

impl Node {
    /// A node of at most eight children.
    pub(crate) fn new(children: &[(Bounds, u32)]) -> Self {
        let mut node = Self {
            planes: [0, 1, 2, 3, 4, 5].map(|k| {
                F8::splat(if k % 2 == 0 {
                    f32::INFINITY
                } else {
                    f32::NEG_INFINITY
                })
            }),
            children: [u32::MAX; 8],
        };
        for (lane, (bounds, child)) in children.iter().enumerate() {
            for k in 0..3 {
                node.planes[2 * k].0[lane] = bounds.min[k];
                node.planes[2 * k + 1].0[lane] = bounds.max[k];
            }
            node.children[lane] = *child;
        }
        node
    }

    /// The boxes with a child, and the children.
    pub(crate) fn children(&self) -> impl Iterator<Item = (Bounds, u32)> + '_ {
        let corner = |lane: usize, side: usize| {
            Vec3::from_array([0, 1, 2].map(|k| self.planes[2 * k + side].0[lane]))
        };
        (0..8)
            .map(move |lane| {
                let (min, max) = (corner(lane, 0), corner(lane, 1));
                (Bounds { min, max }, self.children[lane])
            })
            .filter(|(bounds, _)| bounds.min.x <= bounds.max.x)
    }

    #[inline(always)]
    pub(crate) fn child(&self, lane: usize) -> u32 {
        self.children[lane & 7]
    }

    /// Where the ray enters the boxes, never later than in truth, and which of them it meets in the
    /// range that is still of interest.
    #[inline(always)]
    pub(crate) fn test<I: Isa>(&self, isa: I, ray: &LaneRay, nearest: &Nearest) -> (F8, u32) {
        let plane = |k: usize, far: usize, origin: &[f32; 3]| {
            let side = (ray.negative[k] & 1) ^ far;
            (self.planes[2 * k + side] - F8::splat(origin[k])) * F8::splat(ray.inverse[k])
        };
        let enter = |k| plane(k, 0, &ray.enter);
        let leave = |k| plane(k, 1, &ray.leave);
        let first = enter(0)
            .max(enter(1))
            .max(enter(2).max(F8::splat(nearest.t_min())));
        let last = leave(0)
            .min(leave(1))
            .min(leave(2).min(F8::splat(nearest.t())));
        (first, isa.signs(first.le(last)))
    }
}

/// Half the surface of a box: proportional to the chance that a ray meets it.
pub(crate) fn half_area(b: &Bounds) -> f32 {
    let d = b.max - b.min;
    d.x * (d.y + d.z) + d.y * d.z
}

/// The largest coordinate of a box, in absolute value.
pub(crate) fn extent(b: &Bounds) -> f32 {
    b.min.abs().max(b.max.abs()).max_element()
}

/// The box of points in f64. Rounding to f32 is covered by the slack of [`LaneRay`].
pub(crate) fn bounds_of(points: impl IntoIterator<Item = DVec3>) -> Bounds {
    Bounds::of_points(points.into_iter().map(|p| p.as_vec3()))
}
