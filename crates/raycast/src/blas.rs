//! The bottom-level acceleration structure: a prototype with its tree.

use std::sync::Arc;

use glam::{DVec3, Vec2};
use nemoral_scene::{AlphaMask, Bounds, MaterialLibrary, Mesh, Prototype, Quad, Triangle};
use rayon::prelude::*;

use crate::block::{Block, PackedPrimitive, Shape};
use crate::bvh8::{BuildEffort, Bvh8};
use crate::hull::{SQUARE, opaque_hull, window_hull};
use crate::intersection::{self, Intersection, LocalRay};
use crate::nearest::{Nearest, PrimitiveHit, PrimitiveRef, Rank};
use crate::node::{LEAF, LaneRay, Node, bounds_of, extent};
use crate::quantization_grid::QuantizationGrid;
use crate::quantized_node::QuantizedNode;
use crate::shape_surfaces::{QuadPart, ShapeSurface, ShapeSurfaces};
use crate::simd::Isa;
use crate::traversal::{LeafVisitor, Stack, traverse};

/// A prototype with its acceleration structure: made once, shared by all its instances.
///
/// Primitives are numbered: the triangles of the mesh in their order, then the cards in theirs. A
/// [`Quad`](nemoral_scene::Quad) of the mesh is one primitive with the number of its first
/// triangle. Degenerate ones (without area) are never hit.
#[derive(Debug)]
pub struct Blas {
    prototype: Arc<Prototype>,
    surfaces: ShapeSurfaces,
    parts: Vec<Part>,
    grid: QuantizationGrid,
    nodes: Vec<QuantizedNode>,
    blocks: Vec<Block>,
    /// The largest coordinate, in absolute value.
    extent: f32,
}

/// The quality with which a [`Blas`] is built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildQuality {
    /// For shapes that are used briefly: building takes about 1 ms for 1,000 primitives.
    #[default]
    Fast,
    /// For shapes that are instanced often or used for long: several times slower to build, and
    /// about a tenth faster to cast rays at.
    High,
}

impl BuildQuality {
    fn effort(self) -> BuildEffort {
        match self {
            Self::Fast => BuildEffort {
                passes: 0,
                share: 0.0,
            },
            Self::High => BuildEffort {
                passes: 2,
                share: 1.0,
            },
        }
    }
}

/// A part of a prototype that instances enter on its own.
#[derive(Debug)]
pub(crate) struct Part {
    pub(crate) root: u32,
    /// Boxes that together contain the part. After a rotation they are tighter than one box around
    /// all of it.
    pub(crate) boxes: Vec<Bounds>,
}

impl Blas {
    /// Prepares a prototype that is valid against `materials` (see [`Prototype::new`]).
    #[must_use]
    pub fn build(prototype: Arc<Prototype>, materials: &MaterialLibrary) -> Self {
        Self::with_quality(prototype, materials, BuildQuality::Fast)
    }

    /// The same, built with this quality. Results do not depend on it, only their speed.
    #[must_use]
    pub fn with_quality(
        prototype: Arc<Prototype>,
        materials: &MaterialLibrary,
        quality: BuildQuality,
    ) -> Self {
        let mut blas = Self {
            extent: extent(&prototype.bounds()),
            surfaces: ShapeSurfaces::of(&prototype, materials),
            prototype,
            parts: Vec::new(),
            grid: QuantizationGrid::IDENTITY,
            nodes: Vec::new(),
            blocks: Vec::new(),
        };
        let (primitives, boxes) = blas.pack();
        let grow = |part: Vec<u32>| Bvh8::over(&boxes, &part, 8, quality.effort());
        let trees: Vec<Bvh8> = parts(&boxes).into_iter().map(grow).collect();
        // The boxes are freed before the blocks are built, because shapes may be large.
        drop(boxes);
        let whole = trees.iter().map(Bvh8::bounds);
        let grid = QuantizationGrid::over(&whole.fold(Bounds::EMPTY, Bounds::union));
        let (mut nodes, mut blocks): (Vec<QuantizedNode>, Vec<Block>) = (Vec::new(), Vec::new());
        blocks.reserve_exact(trees.iter().map(Bvh8::leaves).sum());
        for tree in trees {
            let node = |children: &[(Bounds, u32)]| QuantizedNode::new(&Node::new(children), &grid);
            let root = tree.write(&mut nodes, node, |lanes| {
                let lanes = lanes.iter().map(|&i| primitives[i as usize]);
                let lanes: Vec<PackedPrimitive> = lanes.filter_map(|p| blas.packed(p)).collect();
                blocks.push(Block::new(&lanes));
                (blocks.len() - 1) as u32
            });
            let boxes = tree.cover();
            blas.parts.push(Part { root, boxes });
        }
        blas.grid = grid;
        blas.nodes = nodes;
        blas.blocks = blocks;
        blas
    }

    /// The prototype.
    #[must_use]
    pub fn prototype(&self) -> &Arc<Prototype> {
        &self.prototype
    }

    /// The memory that the tree takes, bytes: what it holds besides its prototype and the masks.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let boxes: usize = self
            .parts
            .iter()
            .map(|p| size_of::<Part>() + size_of_val(p.boxes.as_slice()))
            .sum();
        size_of::<Self>()
            + boxes
            + size_of_val(self.nodes.as_slice())
            + size_of_val(self.blocks.as_slice())
            + self.surfaces.memory_bytes()
    }

    /// The masks of its primitives.
    pub(crate) fn masks(&self) -> impl Iterator<Item = &Arc<AlphaMask>> {
        self.surfaces.all().iter().filter_map(|s| s.mask.as_ref())
    }

    pub(crate) fn parts(&self) -> &[Part] {
        &self.parts
    }

    pub(crate) fn primitive_count(&self) -> usize {
        self.prototype.mesh().triangles.len() + self.prototype.cards().len()
    }

    /// The quad that is numbered by its first triangle.
    pub(crate) fn quad(&self, primitive: u32) -> Option<&Quad> {
        match self.surfaces.part(primitive) {
            QuadPart::First(quad) => Some(&self.prototype.quads()[quad]),
            _ => None,
        }
    }

    /// A primitive with its surface, unless it is degenerate or the second triangle of a quad.
    fn shape(&self, primitive: usize) -> Option<(Shape, u16)> {
        let mesh = self.prototype.mesh();
        let (shape, surface) = match mesh.triangles.get(primitive) {
            Some(t) => match self.surfaces.part(primitive as u32) {
                QuadPart::None => {
                    let corners = t.corners.map(|i| mesh.positions[i as usize]);
                    let surface = self.surfaces.of_material(t.material);
                    (Shape::Triangle(corners), surface)
                }
                QuadPart::First(quad) => {
                    let (c, _) = self.prototype.quads()[quad].card(mesh);
                    let card = Shape::Card([c.corner, c.edge_u, c.edge_v]);
                    (card, self.surfaces.of_quad(quad))
                }
                QuadPart::Second => return None,
            },
            None => {
                let number = primitive - mesh.triangles.len();
                let c = &self.prototype.cards()[number];
                let card = Shape::Card([c.corner, c.edge_u, c.edge_v]);
                (card, self.surfaces.of_card(number, c.material))
            }
        };
        let [u, v] = shape.edges();
        // The products of f32 are exact in f64: this is zero if and only if there is no area.
        (u.cross(v) != DVec3::ZERO).then_some((shape, surface))
    }

    /// The primitive of a hit, from the block that the traversal has just looked at if there is
    /// one.
    #[inline(always)]
    pub(crate) fn shape_at(
        &self,
        primitive: u32,
        place: &PrimitiveRef,
    ) -> Option<(Shape, &ShapeSurface)> {
        let (shape, surface) = match self.block(place.block) {
            Some(block) => {
                let lane = place.lane as usize;
                (block.shape(lane), block.primitive(lane).1)
            }
            None => self.shape(primitive as usize)?,
        };
        Some((shape, self.surfaces.get(surface)))
    }

    /// A primitive as a block stores it, unless it is degenerate.
    fn packed(&self, primitive: u32) -> Option<PackedPrimitive> {
        let (shape, surface) = self.shape(primitive as usize)?;
        Some(PackedPrimitive {
            primitive,
            surface,
            shape,
        })
    }

    /// The primitives that can be hit, and the boxes of their opaque parts.
    fn pack(&self) -> (Vec<u32>, Vec<Bounds>) {
        let mut hulls = vec![None; self.surfaces.all().len()];
        let mut primitives = Vec::with_capacity(self.primitive_count());
        let mut boxes = Vec::with_capacity(self.primitive_count());
        for primitive in 0..self.primitive_count() {
            let Some((shape, surface)) = self.shape(primitive) else {
                continue;
            };
            let bounds = match shape {
                Shape::Triangle(corners) => Bounds::of_points(corners),
                Shape::Card(card) => {
                    let [corner, u, v] = card.map(|p| p.as_dvec3());
                    let hull = hulls[usize::from(surface)].get_or_insert_with(|| {
                        let ShapeSurface { mask, window, .. } = self.surfaces.get(surface);
                        match (mask, window) {
                            (Some(mask), Some(window)) => window_hull(mask, window),
                            (Some(mask), None) => opaque_hull(mask),
                            (None, _) => SQUARE.to_vec(),
                        }
                    });
                    if hull.is_empty() {
                        continue;
                    }
                    bounds_of(hull.iter().map(|h| corner + u * h.x + v * h.y))
                }
            };
            primitives.push(primitive as u32);
            boxes.push(bounds);
        }
        (primitives, boxes)
    }

    /// The intersection of a ray with an opaque point of a primitive, at any distance.
    pub(crate) fn intersect(&self, primitive: u32, ray: &LocalRay) -> Option<Intersection> {
        let (shape, surface) = self.shape(primitive as usize)?;
        let (is_triangle, intersection) = match shape {
            Shape::Triangle(corners) => (
                true,
                intersection::triangle(ray, corners.map(|p| p.as_dvec3())),
            ),
            Shape::Card(card) => (false, intersection::card(ray, card.map(|p| p.as_dvec3()))),
        };
        intersection.filter(|m| self.is_opaque(is_triangle, primitive, surface, m))
    }

    #[inline(always)]
    fn is_opaque(&self, is_triangle: bool, primitive: u32, surface: u16, m: &Intersection) -> bool {
        let surface = self.surfaces.get(surface);
        let Some(mask) = &surface.mask else {
            return true;
        };
        let uv = if is_triangle {
            let mesh = self.prototype.mesh();
            triangle_uv(mesh, &mesh.triangles[primitive as usize], m)
        } else {
            surface.card_uv(m.u, m.v)
        };
        mask.is_opaque(uv.x, uv.y)
    }

    /// Offers the hits below one of the parts' roots to the search of a ray.
    #[inline(always)]
    pub(crate) fn cast<I: Isa, const ANY: bool>(
        &self,
        isa: I,
        root: u32,
        ray: &LocalRay,
        source: Source,
        nearest: &mut Nearest,
        stack: &mut Stack,
    ) {
        let lanes = LaneRay::new(ray, self.extent, &self.grid);
        let blocks = Blocks::<ANY> {
            blas: self,
            ray,
            lanes: &lanes,
            source,
        };
        traverse::<I, _, _, ANY>(isa, (&self.nodes, root), &lanes, &blocks, nearest, stack);
    }

    /// Offers the hits of a block that are among the proposed lanes; with `ANY`, one of them.
    #[inline(always)]
    pub(crate) fn decide<const ANY: bool>(
        &self,
        number: u32,
        mut lanes: u32,
        ray: &LocalRay,
        source: Source,
        nearest: &mut Nearest,
    ) {
        let Some(block) = self.block(number) else {
            return;
        };
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let (intersection, counts) = self.intersect_lane(block, lane, ray);
            if counts {
                nearest.offer(source.hit(block, (number, lane), intersection));
                if ANY && nearest.found().is_some() {
                    return;
                }
            }
        }
    }

    /// The intersection of a ray with the primitive of a lane, at any distance, and whether the
    /// point is opaque.
    #[inline(always)]
    pub(crate) fn intersect_lane(
        &self,
        block: &Block,
        lane: usize,
        ray: &LocalRay,
    ) -> (Intersection, bool) {
        let points = block.points(lane);
        let is_triangle = block.is_triangle(lane);
        let intersection = if is_triangle {
            intersection::triangle(ray, points)
        } else {
            intersection::card(ray, points)
        };
        let Some(m) = intersection else {
            return (Intersection::NONE, false);
        };
        let (primitive, surface) = block.primitive(lane);
        (m, self.is_opaque(is_triangle, primitive, surface, &m))
    }

    /// Asks the processor to fetch a node or a block.
    #[inline(always)]
    pub(crate) fn prefetch<I: Isa>(&self, isa: I, at: u32) {
        if at & LEAF == 0 {
            isa.prefetch(&self.nodes[at as usize]);
        } else if let Some(block) = self.block(at & !LEAF) {
            isa.prefetch(block);
        }
    }

    #[inline(always)]
    pub(crate) fn nodes(&self) -> &[QuantizedNode] {
        &self.nodes
    }

    /// A block; `None` for the number in a node's lane without a child.
    #[inline(always)]
    pub(crate) fn block(&self, number: u32) -> Option<&Block> {
        self.blocks.get(number as usize)
    }

    #[inline(always)]
    pub(crate) fn grid(&self) -> &QuantizationGrid {
        &self.grid
    }

    /// The largest coordinate, in absolute value.
    #[inline(always)]
    pub(crate) fn extent(&self) -> f32 {
        self.extent
    }
}

/// The part of an instance that primitives belong to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source {
    /// The rank of what is hit there, without the primitive's number.
    pub(crate) rank: Rank,
    /// The number of the instance part in its group.
    pub(crate) part: u32,
}

impl Source {
    /// A hit of the primitive in a lane of a block.
    #[inline(always)]
    pub(crate) fn hit(
        &self,
        block: &Block,
        (number, lane): (u32, usize),
        intersection: Intersection,
    ) -> PrimitiveHit {
        let (primitive, _) = block.primitive(lane);
        PrimitiveHit {
            rank: Rank {
                primitive,
                ..self.rank
            },
            intersection,
            primitive: PrimitiveRef {
                part: self.part,
                block: number,
                lane: lane as u32,
            },
        }
    }
}

/// The leaves of a shape's tree: blocks of primitives.
pub(crate) struct Blocks<'a, const ANY: bool> {
    pub(crate) blas: &'a Blas,
    pub(crate) ray: &'a LocalRay,
    pub(crate) lanes: &'a LaneRay,
    pub(crate) source: Source,
}

impl<const ANY: bool> LeafVisitor for Blocks<'_, ANY> {
    #[inline(always)]
    fn visit<I: Isa>(&self, isa: I, leaf: u32, nearest: &mut Nearest, _: &mut Stack) {
        let Some(block) = self.blas.block(leaf) else {
            return;
        };
        let lanes = block.edges(isa).candidates(isa, self.lanes, nearest);
        (self.blas).decide::<ANY>(leaf, lanes, self.ray, self.source, nearest);
    }
}

/// Cuts a shape at one height if that much reduces the area that rays see from the side, as for a
/// trunk under its crown. Returns the box numbers of each part; there is no part if there are no
/// boxes.
fn parts(boxes: &[Bounds]) -> Vec<Vec<u32>> {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    if order.is_empty() {
        return Vec::new();
    }
    let middle = |i: &u32| boxes[*i as usize].min.z + boxes[*i as usize].max.z;
    order.par_sort_unstable_by(|a, b| middle(a).total_cmp(&middle(b)).then(a.cmp(b)));
    let side = |b: &Bounds| {
        let d = b.max - b.min;
        (d.x + d.y) * d.z
    };
    let join = |b: &mut Bounds, i: &u32| {
        *b = b.union(boxes[*i as usize]);
        Some(side(b))
    };
    let above: Vec<f32> = order.iter().rev().scan(Bounds::EMPTY, join).collect();
    let below: Vec<f32> = order.iter().scan(Bounds::EMPTY, join).collect();
    let n = order.len();
    let least = (1..n)
        .map(|k| (below[k - 1] + above[n - 1 - k], k))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    match least {
        Some((cost, k)) if cost < WORTH_CUTTING * below[n - 1] => {
            let top = order.split_off(k);
            vec![order, top]
        }
        _ => vec![order],
    }
}

/// The area after a cut, relative to that before it, below which the cut pays, as two parts are
/// entered more often than one.
const WORTH_CUTTING: f32 = 0.8;

/// The texture coordinate of a triangle at an intersection, interpolated.
#[inline(always)]
pub(crate) fn triangle_uv(mesh: &Mesh, triangle: &Triangle, at: &Intersection) -> Vec2 {
    let [a, b, c] = triangle.corners.map(|i| mesh.uv(i).as_dvec2());
    (a * (1.0 - at.u - at.v) + b * at.u + c * at.v).as_vec2()
}
