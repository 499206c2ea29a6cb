//! A prototype, ready for rays.

use std::sync::Arc;

use glam::{DVec3, Vec2};
use nemoral_scene::{AlphaMask, Bounds, MaterialId, MaterialLibrary, Prototype};
use rayon::prelude::*;

use crate::block::{Block, Packed, Shape};
use crate::exact::{self, LocalRay, Meeting};
use crate::grid::{Grid, GridNode};
use crate::hull::opaque_hull;
use crate::nearest::{Found, Nearest, Place, Rank};
use crate::node::{LEAF, LaneRay, Node, bounds_of, extent};
use crate::simd::Isa;
use crate::stack::{Leaves, Stack, walk};
use crate::surface;
use crate::tree::{Effort, Tree};

/// A prototype with its acceleration structure: made once, shared by all its instances.
///
/// Primitives are numbered: the triangles of the mesh in their order, then the cards in theirs.
/// Degenerate ones (without area) are never hit.
#[derive(Debug)]
pub struct Blas {
    prototype: Arc<Prototype>,
    /// By material id.
    masks: Vec<Option<Arc<AlphaMask>>>,
    parts: Vec<Part>,
    grid: Grid,
    nodes: Vec<GridNode>,
    blocks: Vec<Block>,
    /// The largest coordinate, in absolute value.
    extent: f32,
}

/// How much care a [`Blas`] is built with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// For shapes that are cast at for a moment: about 1 ms for 1,000 primitives.
    #[default]
    Fast,
    /// For shapes that are instanced often, cast at for long or kept: several times slower to build,
    /// about a tenth faster to cast at.
    High,
}

impl Quality {
    fn effort(self) -> Effort {
        match self {
            Self::Fast => Effort {
                passes: 0,
                share: 0.0,
            },
            Self::High => Effort {
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
    /// Boxes that together hold the part: tighter, once turned, than one box around all.
    pub(crate) boxes: Vec<Bounds>,
}

impl Blas {
    /// Prepares a prototype that is valid against `materials` (see [`Prototype::new`]).
    #[must_use]
    pub fn build(prototype: Arc<Prototype>, materials: &MaterialLibrary) -> Self {
        Self::with_quality(prototype, materials, Quality::Fast)
    }

    /// The same, built with this much care. Answers do not depend on it, only their speed.
    #[must_use]
    pub fn with_quality(
        prototype: Arc<Prototype>,
        materials: &MaterialLibrary,
        quality: Quality,
    ) -> Self {
        let masks: Vec<Option<Arc<AlphaMask>>> = materials
            .materials()
            .iter()
            .map(|m| m.mask.clone())
            .collect();
        let mut blas = Self {
            extent: extent(&prototype.bounds()),
            prototype,
            masks,
            parts: Vec::new(),
            grid: Grid::NONE,
            nodes: Vec::new(),
            blocks: Vec::new(),
        };
        let (primitives, boxes) = blas.pack();
        let grow = |part: Vec<u32>| Tree::over(&boxes, &part, 8, quality.effort());
        let trees: Vec<Tree> = parts(&boxes).into_iter().map(grow).collect();
        // Gone before the blocks are there: shapes may be large.
        drop(boxes);
        let whole = trees.iter().map(Tree::bounds);
        let grid = Grid::over(&whole.fold(Bounds::EMPTY, Bounds::union));
        let (mut nodes, mut blocks): (Vec<GridNode>, Vec<Block>) = (Vec::new(), Vec::new());
        blocks.reserve_exact(trees.iter().map(Tree::leaves).sum());
        for tree in trees {
            let node = |children: &[(Bounds, u32)]| GridNode::new(&Node::new(children), &grid);
            let root = tree.write(&mut nodes, node, |lanes| {
                let lanes = lanes.iter().map(|&i| primitives[i as usize]);
                let lanes: Vec<Packed> = lanes.filter_map(|p| blas.packed(p)).collect();
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

    pub(crate) fn parts(&self) -> &[Part] {
        &self.parts
    }

    pub(crate) fn primitive_count(&self) -> usize {
        self.prototype.mesh().triangles.len() + self.prototype.cards().len()
    }

    /// A primitive, unless it is degenerate.
    fn shape(&self, primitive: usize) -> Option<(Shape, MaterialId)> {
        let mesh = self.prototype.mesh();
        let (shape, material) = match mesh.triangles.get(primitive) {
            Some(t) => {
                let corners = t.corners.map(|i| mesh.positions[i as usize]);
                (Shape::Triangle(corners), t.material)
            }
            None => {
                let c = &self.prototype.cards()[primitive - mesh.triangles.len()];
                (Shape::Card([c.corner, c.edge_u, c.edge_v]), c.material)
            }
        };
        let [u, v] = shape.edges();
        // The products of f32 are exact in f64: this is zero if and only if there is no area.
        (u.cross(v) != DVec3::ZERO).then_some((shape, material))
    }

    /// A primitive that was met, from the block that casting has just looked at where there is one.
    pub(crate) fn shape_at(&self, primitive: u32, place: &Place) -> Option<(Shape, MaterialId)> {
        let Some(block) = self.block(place.block) else {
            return self.shape(primitive as usize);
        };
        let lane = place.lane as usize;
        Some((block.shape(lane), MaterialId(block.primitive(lane).1)))
    }

    /// The same, as a block holds it.
    fn packed(&self, primitive: u32) -> Option<Packed> {
        let (shape, material) = self.shape(primitive as usize)?;
        Some(Packed {
            primitive,
            material: material.0,
            shape,
        })
    }

    /// The primitives that can be hit, and the boxes of their opaque parts.
    fn pack(&self) -> (Vec<u32>, Vec<Bounds>) {
        let mut hulls = vec![None; self.masks.len()];
        let mut primitives = Vec::with_capacity(self.primitive_count());
        let mut boxes = Vec::with_capacity(self.primitive_count());
        for primitive in 0..self.primitive_count() {
            let Some((shape, material)) = self.shape(primitive) else {
                continue;
            };
            let bounds = match shape {
                Shape::Triangle(corners) => Bounds::of_points(corners),
                Shape::Card(card) => {
                    let [corner, u, v] = card.map(|p| p.as_dvec3());
                    let index = usize::from(material.0);
                    let hull = hulls[index].get_or_insert_with(|| match &self.masks[index] {
                        Some(mask) => opaque_hull(mask),
                        None => vec![
                            glam::DVec2::ZERO,
                            glam::DVec2::X,
                            glam::DVec2::ONE,
                            glam::DVec2::Y,
                        ],
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

    /// Where the ray meets an opaque point of a primitive, whatever the distance.
    pub(crate) fn meet(&self, primitive: u32, ray: &LocalRay) -> Option<Meeting> {
        let (shape, material) = self.shape(primitive as usize)?;
        let (is_triangle, meeting) = match shape {
            Shape::Triangle(corners) => (true, exact::triangle(ray, corners.map(|p| p.as_dvec3()))),
            Shape::Card(card) => (false, exact::card(ray, card.map(|p| p.as_dvec3()))),
        };
        meeting.filter(|m| self.is_opaque(is_triangle, primitive, material.0, m))
    }

    #[inline(always)]
    fn is_opaque(&self, is_triangle: bool, primitive: u32, material: u16, m: &Meeting) -> bool {
        let Some(mask) = &self.masks[usize::from(material)] else {
            return true;
        };
        let uv = if is_triangle {
            let mesh = self.prototype.mesh();
            surface::triangle_uv(mesh, &mesh.triangles[primitive as usize], m)
        } else {
            Vec2::new(m.u as f32, m.v as f32)
        };
        mask.is_opaque(uv.x, uv.y)
    }

    /// Offers the hits below one of the parts' roots.
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
        walk::<I, _, _, ANY>(isa, (&self.nodes, root), &lanes, &blocks, nearest, stack);
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
            let (meeting, counts) = self.meeting(block, lane, ray);
            if counts {
                nearest.offer(source.found(block, (number, lane), meeting));
                if ANY && nearest.found().is_some() {
                    return;
                }
            }
        }
    }

    /// Where a ray meets the primitive of a lane, whatever the distance, and whether there is something opaque.
    #[inline(always)]
    pub(crate) fn meeting(&self, block: &Block, lane: usize, ray: &LocalRay) -> (Meeting, bool) {
        let points = block.points(lane);
        let is_triangle = block.is_triangle(lane);
        let meeting = if is_triangle {
            exact::triangle(ray, points)
        } else {
            exact::card(ray, points)
        };
        let Some(m) = meeting else {
            return (Meeting::NONE, false);
        };
        let (primitive, material) = block.primitive(lane);
        (m, self.is_opaque(is_triangle, primitive, material, &m))
    }

    /// Asks for a node or a block.
    #[inline(always)]
    pub(crate) fn fetch<I: Isa>(&self, isa: I, at: u32) {
        if at & LEAF == 0 {
            isa.fetch(&self.nodes[at as usize]);
        } else if let Some(block) = self.block(at & !LEAF) {
            isa.fetch(block);
        }
    }

    #[inline(always)]
    pub(crate) fn nodes(&self) -> &[GridNode] {
        &self.nodes
    }

    /// A block; none of a node's lane without a child.
    #[inline(always)]
    pub(crate) fn block(&self, number: u32) -> Option<&Block> {
        self.blocks.get(number as usize)
    }

    #[inline(always)]
    pub(crate) fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The largest coordinate, in absolute value.
    #[inline(always)]
    pub(crate) fn extent(&self) -> f32 {
        self.extent
    }
}

/// What primitives are part of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source {
    /// Of what is hit there, but for the primitive.
    pub(crate) rank: Rank,
    /// The part of an instance, in its group.
    pub(crate) entry: u32,
}

impl Source {
    /// A hit of the primitive in a lane of a block.
    #[inline(always)]
    pub(crate) fn found(
        &self,
        block: &Block,
        (number, lane): (u32, usize),
        meeting: Meeting,
    ) -> Found {
        let (primitive, _) = block.primitive(lane);
        Found {
            rank: Rank {
                primitive,
                ..self.rank
            },
            meeting,
            place: Place {
                entry: self.entry,
                block: number,
                lane: lane as u32,
            },
        }
    }
}

/// The blocks of primitives.
pub(crate) struct Blocks<'a, const ANY: bool> {
    pub(crate) blas: &'a Blas,
    pub(crate) ray: &'a LocalRay,
    pub(crate) lanes: &'a LaneRay,
    pub(crate) source: Source,
}

impl<const ANY: bool> Leaves for Blocks<'_, ANY> {
    #[inline(always)]
    fn visit<I: Isa>(&self, isa: I, leaf: u32, nearest: &mut Nearest, _: &mut Stack) {
        let Some(block) = self.blas.block(leaf) else {
            return;
        };
        let lanes = block.sides(isa).candidates(isa, self.lanes, nearest);
        (self.blas).decide::<ANY>(leaf, lanes, self.ray, self.source, nearest);
    }
}

/// Cuts a shape at one height, if that takes away much of the side that rays see: a trunk under its
/// crown. Returns the box numbers of each part; none if there are no boxes.
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

/// Parts are entered twice as often as a whole of the same size: the cut must save this much.
const WORTH_CUTTING: f32 = 0.8;
