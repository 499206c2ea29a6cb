//! Eight-wide nodes, and rays prepared to be tested with eight boxes at once.

use glam::{DVec3, Vec3};
use nemoral_scene::Bounds;

use crate::intersection::LocalRay;
use crate::nearest::Nearest;
use crate::quantization_grid::QuantizationGrid;
use crate::simd::{F8, Isa, V3};

/// Set in a child that is a leaf; the other bits are the leaf's number.
pub(crate) const LEAF: u32 = 1 << 31;

/// By how much boxes are enlarged for a ray, in units of f32's epsilon times the largest coordinate
/// involved. Rounding of the ray to f32 (1/2), of the box (1/2, or none on a grid), of the slab
/// arithmetic (3, with the grid's step times the inverse) and of the f64 intersection to an f32
/// distance (1/2, times √3) stay well below.
pub(crate) const BOX_SLACK: f32 = 8.0;

/// The same for the eight-wide primitive filter, derived in [`crate::block`].
pub(crate) const PRIMITIVE_SLACK: f32 = 128.0;

/// A ray ready for eight-wide tests in one space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LaneRay {
    pub(crate) origin: [f32; 3],
    pub(crate) direction: [f32; 3],
    /// The direction's inverse, kept finite, times the grid's step: the distance along the ray from
    /// plane to plane, negative where the ray runs towards smaller coordinates.
    pub(crate) scale: [f32; 3],
    /// The origin times the direction's inverse, plus a margin that lets boxes be entered early
    /// enough.
    pub(crate) enter: [f32; 3],
    /// The same, minus the margin, which lets boxes be left late enough.
    pub(crate) leave: [f32; 3],
    /// Bound on the rounding error of the primitive filter, per metre of edge.
    pub(crate) slack: f32,
    /// Bound, per axis, on the coordinates of the origin and of all points relative to it.
    pub(crate) reach: f32,
}

impl LaneRay {
    /// A placeholder before a ray is set.
    pub(crate) const NONE: Self = Self {
        origin: [0.0; 3],
        direction: [0.0; 3],
        scale: [0.0; 3],
        enter: [0.0; 3],
        leave: [0.0; 3],
        slack: 0.0,
        reach: 0.0,
    };

    /// Prepares a ray. `extent` is the largest coordinate, in absolute value, of what is in this
    /// space; boxes are on the grid.
    #[inline(always)]
    pub(crate) fn new(ray: &LocalRay, extent: f32, grid: &QuantizationGrid) -> Self {
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
        let from_grid = (ray.origin - grid.origin).as_vec3().to_array();
        let scaled = [0, 1, 2].map(|k| from_grid[k] * inverse[k]);
        let pad = inverse.map(|i| pad * i.abs());
        let largest = direction[0]
            .abs()
            .max(direction[1].abs())
            .max(direction[2].abs());
        Self {
            origin,
            direction,
            scale: [0, 1, 2].map(|k| inverse[k] * grid.step[k]),
            enter: [0, 1, 2].map(|k| scaled[k] + pad[k]),
            leave: [0, 1, 2].map(|k| scaled[k] - pad[k]),
            slack: PRIMITIVE_SLACK * f32::EPSILON * reach * largest,
            reach,
        }
    }
}

/// A ray in registers, ready to be tested with eight boxes at a time.
#[derive(Clone, Copy)]
pub(crate) struct Slabs<I: Isa> {
    scale: V3<I>,
    enter: V3<I>,
    leave: V3<I>,
    /// 1 where the ray runs towards smaller coordinates.
    negative: [usize; 3],
    t_min: I::V,
}

impl<I: Isa> Slabs<I> {
    #[inline(always)]
    pub(crate) fn new(isa: I, ray: &LaneRay, nearest: &Nearest) -> Self {
        Self {
            scale: V3::splat(isa, ray.scale),
            enter: V3::splat(isa, ray.enter),
            leave: V3::splat(isa, ray.leave),
            negative: ray.scale.map(|s| usize::from(s.is_sign_negative())),
            t_min: isa.splat(nearest.t_min()),
        }
    }
}

/// Eight boxes and the child in each of them.
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

    /// The children with their boxes.
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

    /// A node with these planes and children.
    #[inline(always)]
    pub(crate) fn of(planes: [F8; 6], children: [u32; 8]) -> Self {
        Self { planes, children }
    }
}

impl Boxes for Node {
    #[inline(always)]
    fn plane<I: Isa>(&self, isa: I, axis: usize, side: usize) -> I::V {
        isa.load(&self.planes[2 * axis + (side & 1)])
    }

    #[inline(always)]
    fn child(&self, lane: usize) -> u32 {
        self.children[lane & 7]
    }
}

/// Eight boxes and the child in each of them, however they are stored.
pub(crate) trait Boxes {
    /// The lower or upper planes of an axis.
    fn plane<I: Isa>(&self, isa: I, axis: usize, side: usize) -> I::V;

    /// The child in a box.
    fn child(&self, lane: usize) -> u32;

    /// Distances of the ray to one plane of each axis, `sides` saying which.
    #[inline(always)]
    fn planes<I: Isa>(&self, isa: I, sides: [usize; 3], scale: &V3<I>, origin: &V3<I>) -> V3<I> {
        V3(
            isa.mul_sub(self.plane(isa, 0, sides[0]), scale.0, origin.0),
            isa.mul_sub(self.plane(isa, 1, sides[1]), scale.1, origin.1),
            isa.mul_sub(self.plane(isa, 2, sides[2]), scale.2, origin.2),
        )
    }

    /// The distances at which the ray enters the boxes, never too large, and the mask of the boxes
    /// that it passes through within the range still of interest.
    #[inline(always)]
    fn test<I: Isa>(&self, isa: I, ray: &Slabs<I>, nearest: &Nearest) -> (I::V, I::V) {
        let [x, y, z] = ray.negative;
        let enter = self.planes(isa, [x, y, z], &ray.scale, &ray.enter);
        let leave = self.planes(isa, [x ^ 1, y ^ 1, z ^ 1], &ray.scale, &ray.leave);
        let first = isa.max(isa.max(enter.0, enter.1), isa.max(enter.2, ray.t_min));
        let t = isa.splat(nearest.t());
        let last = isa.min(isa.min(leave.0, leave.1), isa.min(leave.2, t));
        (first, isa.le(first, last))
    }
}

/// Half the surface area of a box, which is proportional to the chance that a ray hits it.
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
