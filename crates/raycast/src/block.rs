//! A conservative test of eight primitives at once, which never loses a hit.
//!
//! Triangles and cards share blocks. With corner `p`, edges `e` and `f`, direction `d` and
//! `s = p − origin`, Cramer's rule gives (Möller and Trumbore 1997)
//! `u = (s × d)·f / D`, `v = −(s × d)·e / D`, `t = (e × f)·s / D` with `D = (e × f)·d`.
//! The filter compares the numerators with `D`, loosened by a bound on their rounding error; what
//! passes is decided by [`crate::intersection`].
//!
//! The bound: with unit roundoff `r` (half of `f32::EPSILON`), `|s| ≤ R`, `|d| ≤ d₀`, edges ≤ `E`
//! per axis and inputs rounded once, the error of `s × d` is at most 10 r R d₀, that of each
//! numerator 52 r R d₀ E, and that of `D` 46 r E² d₀ ≤ 92 r R d₀ E, so `u + v ≤ 1` becomes false by
//! no more than 200 r R d₀ E; the filter uses 256 r = 128 ε. Likewise, the error of `t D` is at
//! most 52 r E² R and that of `t · D` 46 r E² d₀ t, where d₀ t ≤ 4 R: together 236 r E² R, for
//! which 256 r is used.

use glam::{DVec3, Vec3};

use crate::nearest::Nearest;
use crate::node::LaneRay;
use crate::simd::{F8, Isa, V3};

/// Up to eight triangles and cards.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Block {
    /// First corner. Lanes without a primitive are at infinity, where all comparisons fail.
    corner: [F8; 3],
    /// Second corner of a triangle, edge u of a card.
    second: [F8; 3],
    /// Third corner of a triangle, edge v of a card.
    third: [F8; 3],
    /// 1 for a triangle, 0 for a card.
    triangle: F8,
    primitives: [u32; 8],
    /// The surface of each primitive, numbered by the shape.
    surfaces: [u16; 8],
    /// The largest coordinate of any edge, in absolute value.
    edge: f32,
}

/// A primitive as a block holds it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PackedPrimitive {
    pub(crate) primitive: u32,
    /// Numbered by the shape.
    pub(crate) surface: u16,
    pub(crate) shape: Shape,
}

/// The two kinds of primitive.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    /// Three corners.
    Triangle([Vec3; 3]),
    /// Corner, edge u, edge v.
    Card([Vec3; 3]),
}

impl Shape {
    /// The two edges from the first corner.
    #[inline(always)]
    pub(crate) fn edges(self) -> [DVec3; 2] {
        match self {
            Self::Triangle(corners) => {
                let [a, b, c] = corners.map(|p| p.as_dvec3());
                [b - a, c - a]
            }
            Self::Card([_, u, v]) => [u.as_dvec3(), v.as_dvec3()],
        }
    }
}

impl Block {
    /// A block of at most eight primitives.
    pub(crate) fn new(primitives: &[PackedPrimitive]) -> Self {
        let mut block = Self {
            corner: [F8::splat(f32::INFINITY); 3],
            second: [F8::splat(0.0); 3],
            third: [F8::splat(0.0); 3],
            triangle: F8::splat(0.0),
            primitives: [u32::MAX; 8],
            surfaces: [0; 8],
            edge: 0.0,
        };
        for (lane, packed) in primitives.iter().enumerate() {
            let (points, edges, triangle) = match packed.shape {
                Shape::Triangle([a, b, c]) => ([a, b, c], [b - a, c - a], 1.0),
                Shape::Card([p, u, v]) => ([p, u, v], [u, v], 0.0),
            };
            let rows = [&mut block.corner, &mut block.second, &mut block.third];
            for (row, point) in rows.into_iter().zip(points) {
                for (lanes, coordinate) in row.iter_mut().zip(point.to_array()) {
                    lanes.0[lane] = coordinate;
                }
            }
            block.triangle.0[lane] = triangle;
            block.primitives[lane] = packed.primitive;
            block.surfaces[lane] = packed.surface;
            for edge in edges {
                block.edge = block.edge.max(edge.abs().max_element());
            }
        }
        block
    }

    /// The block's edges and normals, which are the same for all rays.
    #[inline(always)]
    pub(crate) fn edges<I: Isa>(&self, isa: I) -> BlockEdges<I> {
        let triangle = isa.load(&self.triangle);
        let corner = V3::load(isa, &self.corner);
        let base = corner.scale(isa, triangle);
        let e = V3::load(isa, &self.second).sub(isa, base);
        let f = V3::load(isa, &self.third).sub(isa, base);
        BlockEdges {
            corner,
            e,
            f,
            normal: e.cross(isa, f),
            triangle,
            edge: self.edge,
        }
    }

    /// The number of a lane's primitive and that of its surface.
    #[inline(always)]
    pub(crate) fn primitive(&self, lane: usize) -> (u32, u16) {
        (self.primitives[lane & 7], self.surfaces[lane & 7])
    }

    /// A lane's primitive, as it is in its prototype.
    #[inline(always)]
    pub(crate) fn shape(&self, lane: usize) -> Shape {
        let at = |p: &[F8; 3]| Vec3::from_array([0, 1, 2].map(|k| p[k].0[lane & 7]));
        let points = [at(&self.corner), at(&self.second), at(&self.third)];
        if self.is_triangle(lane) {
            Shape::Triangle(points)
        } else {
            Shape::Card(points)
        }
    }

    /// Whether a lane's primitive is a triangle.
    #[inline(always)]
    pub(crate) fn is_triangle(&self, lane: usize) -> bool {
        self.triangle.0[lane & 7] != 0.0
    }

    /// The three vectors of a lane, as they are in its prototype.
    #[inline(always)]
    pub(crate) fn points(&self, lane: usize) -> [DVec3; 3] {
        let at = |p: &[F8; 3]| {
            let [x, y, z] = [0, 1, 2].map(|k| f64::from(p[k].0[lane & 7]));
            DVec3::new(x, y, z)
        };
        [at(&self.corner), at(&self.second), at(&self.third)]
    }
}

/// The primitives of a block in registers: corners, edges and normals.
#[derive(Clone, Copy)]
pub(crate) struct BlockEdges<I: Isa> {
    corner: V3<I>,
    e: V3<I>,
    f: V3<I>,
    normal: V3<I>,
    triangle: I::V,
    edge: f32,
}

impl<I: Isa> BlockEdges<I> {
    /// The lanes whose primitives the ray may hit within the range still of interest.
    #[inline(always)]
    pub(crate) fn candidates(&self, isa: I, ray: &LaneRay, nearest: &Nearest) -> u32 {
        let Self {
            corner,
            e,
            f,
            normal,
            triangle,
            edge,
        } = *self;
        let slack = ray.slack * edge;
        let slack_t = 128.0 * f32::EPSILON * ray.reach * edge * edge;
        // The range is made finite, because infinity times a denominator of 0 would be NaN.
        let (near, far) = (nearest.t_min().max(-1e30), nearest.t().min(1e30));
        let d = V3::splat(isa, ray.direction);
        let s = corner.sub(isa, V3::splat(isa, ray.origin));
        // The numerators, with the sign that makes the denominator positive.
        let det = normal.dot(isa, d);
        let sign = isa.and(det, isa.splat(-0.0));
        let size = isa.xor(det, sign);
        let t = isa.xor(normal.dot(isa, s), sign);
        let slack_t = isa.splat(slack_t);
        let early = isa.mul_sub(isa.splat(near), size, slack_t);
        let late = isa.mul_add(isa.splat(far), size, slack_t);
        let in_range = isa.and(isa.le(early, t), isa.le(t, late));
        let moment = s.cross(isa, d);
        let u = isa.xor(moment.dot(isa, f), sign);
        // This is −v.
        let v = isa.xor(moment.dot(isa, e), sign);
        let (low, slack) = (isa.splat(-slack), isa.splat(slack));
        // A triangle has u + v <= 1, from which v <= 1 follows; a card has u <= 1, and v <= 1 is
        // tested.
        let zero = isa.splat(0.0);
        let limit = isa.mul_add(size, isa.splat(1.0), slack);
        let sum = isa.sub(u, isa.mul(triangle, v));
        let inside = isa.and(isa.le(low, u), isa.le(v, slack));
        let below = isa.and(isa.le(sum, limit), isa.le(isa.sub(zero, v), limit));
        isa.signs(isa.and(isa.and(inside, below), in_range))
    }
}
