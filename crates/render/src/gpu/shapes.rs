//! Prototypes on the GPU: they are uploaded when they are first drawn, and dropped when no chunk
//! has them any more or when others need the room.

use std::collections::BTreeMap;
use std::sync::{Arc, Weak};

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use nemoral_scene::{AmbientOcclusion, Blend, Card, MaterialId, Prototype, TextureWindow};

use super::buffer_pool::{BufferPool, Range, bytes_of_pages};
use super::octahedral::octahedral;
use super::primitive::PrimitiveKind;
use super::{Gpu, GpuError};

/// A triangle: five vectors of `primitives` in `surface.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct TriangleRecord {
    a: [f32; 3],
    /// See `materials_of`.
    material: u32,
    b: [f32; 3],
    normal_a: u32,
    c: [f32; 3],
    normal_b: u32,
    uv_a: [f32; 2],
    uv_b: [f32; 2],
    uv_c: [f32; 2],
    normal_c: u32,
    /// The blend of a triangle that has one, otherwise the ambient occlusion of its corners: see
    /// `packed_blend` and `packed_ambient_occlusion`.
    extra: u32,
}

/// A card: three vectors of `primitives` in `surface.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct CardRecord {
    corner: [f32; 3],
    material: u32,
    edge_u: [f32; 3],
    /// A byte for each of the four corners, the first in the lowest byte.
    ambient_occlusion: u32,
    edge_v: [f32; 3],
    unused_v: u32,
}

#[derive(Debug)]
struct Shape {
    /// While this pointer exists, no other prototype can get its address.
    prototype: Weak<Prototype>,
    /// The ranges of each `PrimitiveKind`.
    ranges: [Vec<Range>; 2],
    /// The last frame that drew it.
    used: u64,
}

#[derive(Debug)]
pub(crate) struct Shapes {
    pub(crate) pool: BufferPool,
    /// The resident shapes, by the address of the prototype.
    shapes: BTreeMap<usize, Shape>,
    frame: u64,
    pub(crate) evicted: u64,
    /// The most bytes that the camera may use.
    pub(crate) limit: u64,
    /// The part of these bytes that is used outside of the pool.
    pub(crate) held: u64,
}

impl Shapes {
    pub(crate) fn new(limit: u64) -> Self {
        Self {
            pool: BufferPool::default(),
            shapes: BTreeMap::new(),
            frame: 0,
            evicted: 0,
            limit,
            held: 0,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.shapes.len()
    }

    /// Makes all of these prototypes resident, and evicts others if it must.
    pub(crate) fn ensure<'a>(
        &mut self,
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        prototypes: impl Iterator<Item = &'a Arc<Prototype>> + Clone,
    ) -> Result<(), GpuError> {
        self.frame += 1;
        self.drop_dead();
        for prototype in prototypes.clone() {
            if let Some(shape) = self.shapes.get_mut(&address(prototype)) {
                shape.used = self.frame;
            }
        }
        for prototype in prototypes.clone() {
            if self.shapes.contains_key(&address(prototype)) {
                continue;
            }
            let triangles = triangles(prototype);
            let cards = cards(prototype);
            let mut ranges = [Vec::new(), Vec::new()];
            let parts = [
                (
                    PrimitiveKind::Triangles,
                    triangles.len(),
                    bytemuck::cast_slice(&triangles),
                ),
                (
                    PrimitiveKind::Cards,
                    cards.len(),
                    bytemuck::cast_slice(&cards),
                ),
            ];
            for (ranges, (kind, count, bytes)) in ranges.iter_mut().zip(parts) {
                *ranges = self.room(gpu, layout, kind, count as u32, prototypes.clone())?;
                self.pool.write(gpu, kind, ranges, bytes)?;
            }
            let shape = Shape {
                prototype: Arc::downgrade(prototype),
                ranges,
                used: self.frame,
            };
            self.shapes.insert(address(prototype), shape);
        }
        Ok(())
    }

    /// Where a resident prototype's primitives of a kind are.
    pub(crate) fn ranges(&self, prototype: &Arc<Prototype>, kind: PrimitiveKind) -> &[Range] {
        &self.shapes[&address(prototype)].ranges[kind as usize]
    }

    fn room<'a>(
        &mut self,
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        kind: PrimitiveKind,
        count: u32,
        wanted: impl Iterator<Item = &'a Arc<Prototype>> + Clone,
    ) -> Result<Vec<Range>, GpuError> {
        loop {
            if let Some(ranges) = self.pool.take(kind, count) {
                return Ok(ranges);
            }
            if self.held + self.pool.bytes() + BufferPool::PAGE_COST <= self.limit {
                self.pool.grow(gpu, kind, layout);
                gpu.check()?;
            } else if !self.evict_oldest() {
                let count = |kind| -> u64 {
                    let of = |p: &Arc<Prototype>| match kind {
                        PrimitiveKind::Triangles => triangles(p).len() as u64,
                        PrimitiveKind::Cards => cards(p).len() as u64,
                    };
                    wanted.clone().map(of).sum()
                };
                let pages = PrimitiveKind::ALL.map(|kind| bytes_of_pages(kind, count(kind)));
                let needed = self.held + pages.iter().sum::<u64>();
                let allowed_mib = self.limit >> 20;
                return Err(GpuError::OutOfMemory {
                    // Earlier shapes may leave pages half full.
                    needed_mib: needed.div_ceil(1 << 20).max(allowed_mib + 1),
                    allowed_mib,
                });
            }
        }
    }

    /// Evicts the prototype that was drawn longest ago; false if all that are left are drawn now.
    fn evict_oldest(&mut self) -> bool {
        let oldest = self.shapes.iter().min_by_key(|(_, shape)| shape.used);
        match oldest {
            Some((&at, shape)) if shape.used < self.frame => {
                self.evicted += 1;
                self.forget(at);
                true
            }
            _ => false,
        }
    }

    fn drop_dead(&mut self) {
        let dead = |shape: &Shape| shape.prototype.strong_count() == 0;
        let gone: Vec<usize> = self
            .shapes
            .iter()
            .filter(|(_, s)| dead(s))
            .map(|(&at, _)| at)
            .collect();
        for at in gone {
            self.forget(at);
        }
    }

    fn forget(&mut self, at: usize) {
        if let Some(shape) = self.shapes.remove(&at) {
            for range in shape.ranges.into_iter().flatten() {
                self.pool.give_back(range);
            }
        }
    }
}

fn address(prototype: &Arc<Prototype>) -> usize {
    Arc::as_ptr(prototype) as usize
}

fn triangles(prototype: &Prototype) -> Vec<TriangleRecord> {
    let mesh = prototype.mesh();
    let record = |(i, t): (usize, &nemoral_scene::Triangle)| {
        let [a, b, c] = t.corners.map(|i| mesh.positions[i as usize]);
        let flat = (b - a).cross(c - a).normalize_or(Vec3::Z);
        let [normal_a, normal_b, normal_c] =
            (t.corners).map(|i| octahedral(mesh.normal(i).unwrap_or(flat)));
        let [uv_a, uv_b, uv_c] = t.corners.map(|i| mesh.uv(i).to_array());
        let blend = mesh.blends.get(i).filter(|b| !b.is_uniform());
        let lowest = blend.map_or(t.material, |b| b.materials()[0]);
        TriangleRecord {
            a: a.to_array(),
            material: materials_of(t.material, lowest),
            b: b.to_array(),
            normal_a,
            c: c.to_array(),
            normal_b,
            uv_a,
            uv_b,
            uv_c,
            normal_c,
            extra: match (blend, prototype.ambient_occlusion()) {
                (Some(blend), _) => packed_blend(blend),
                (None, Some(near)) => packed_ambient_occlusion(near, t.corners),
                (None, None) => 0,
            },
        }
    };
    let of_mesh = mesh.triangles.iter().enumerate().map(record);
    of_mesh.chain(windowed_cards(prototype)).collect()
}

fn shows_whole(prototype: &Prototype, card: usize) -> bool {
    prototype.card_window(card) == TextureWindow::WHOLE
}

/// Cards that show a part of their texture, as two triangles each: those have texture coordinates.
fn windowed_cards(prototype: &Prototype) -> impl Iterator<Item = TriangleRecord> {
    let windowed = |(i, _): &(usize, &Card)| !shows_whole(prototype, *i);
    let cards = prototype.cards().iter().enumerate().filter(windowed);
    cards.flat_map(|(i, card)| {
        let window = prototype.card_window(i);
        let normal = octahedral(card.edge_u.cross(card.edge_v).normalize_or(Vec3::Z));
        let places = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let uvs = places.map(|(s, t)| window.uv(s, t).to_array());
        let points = card.corners().map(|p| p.to_array());
        let near = prototype.ambient_occlusion().map(|near| near.cards[i]);
        [[0, 1, 2], [0, 2, 3]].map(|[a, b, c]: [usize; 3]| TriangleRecord {
            a: points[a],
            material: materials_of(card.material, card.material),
            b: points[b],
            normal_a: normal,
            c: points[c],
            normal_b: normal,
            uv_a: uvs[a],
            uv_b: uvs[b],
            uv_c: uvs[c],
            normal_c: normal,
            extra: near.map_or(0, |n| packed_shares([a, b, c].map(|k| n[k]))),
        })
    })
}

/// A triangle's own material, and above it the lowest of those that meet in its colour.
fn materials_of(own: MaterialId, lowest: MaterialId) -> u32 {
    u32::from(lowest.0) << 16 | u32::from(own.0)
}

/// So many materials have ids that fit into a blend; those of grounds are among the first.
const BLENDED_MAX: u16 = 1 << 11;

/// The second and the third of a blend's materials, eleven bits each, in bits 16 to 31 and 9 to 14,
/// and three bits for each corner, which number the pairs of its halves. Materials whose ids are
/// too high are left out: the lowest stands for them.
fn packed_blend(blend: &Blend) -> u32 {
    let fits = |m: &MaterialId| m.0 < BLENDED_MAX;
    let materials = blend.materials();
    let [second, third] = [materials[1], materials[2]].map(|m| if fits(&m) { m.0 } else { 0 });
    let code = |halves: [usize; 2]| {
        let halves = halves.map(|n| if n == 0 || fits(&materials[n]) { n } else { 0 });
        let pair = [halves[0].min(halves[1]), halves[0].max(halves[1])];
        let known = PAIRS.iter().position(|known| *known == pair);
        known.expect("all pairs of three") as u32
    };
    let [a, b, c] = blend.numbers().map(code);
    let (second, third) = (u32::from(second), u32::from(third));
    third >> 6 << 27 | second << 16 | (third & 63) << 9 | c << 6 | b << 3 | a
}

/// The pairs of halves of a corner, as `shares_of` in `surface.wgsl` has them.
const PAIRS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [0, 2], [1, 2]];

/// A byte for each corner, and bit 15, which is not set in any blend.
fn packed_ambient_occlusion(near: &AmbientOcclusion, corners: [u32; 3]) -> u32 {
    packed_shares(corners.map(|i| near.vertices[i as usize]))
}

fn packed_shares(shares: [u8; 3]) -> u32 {
    let [a, b, c] = shares.map(u32::from);
    c << 24 | b << 16 | 1 << 15 | a
}

fn cards(prototype: &Prototype) -> Vec<CardRecord> {
    let ambient_occlusion = |i: usize| match prototype.ambient_occlusion() {
        Some(near) => u32::from_le_bytes(near.cards[i]),
        None => u32::MAX,
    };
    let record = |(i, c): (usize, &Card)| CardRecord {
        corner: c.corner.to_array(),
        material: u32::from(c.material.0),
        edge_u: c.edge_u.to_array(),
        ambient_occlusion: ambient_occlusion(i),
        edge_v: c.edge_v.to_array(),
        unused_v: 0,
    };
    let whole = |(i, _): &(usize, &Card)| shows_whole(prototype, *i);
    let cards = prototype.cards().iter().enumerate().filter(whole);
    cards.map(record).collect()
}

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use nemoral_scene::{Material, MaterialLibrary, Mesh, Semantic};

    use super::*;

    #[test]
    fn a_card_with_a_window_is_two_triangles_with_its_texture_coordinates() {
        let mut materials = MaterialLibrary::new();
        let material = materials.add(Material::plain("leaf", Semantic::Leaf, Vec3::ONE));
        let card = Card {
            corner: Vec3::ZERO,
            edge_u: Vec3::X,
            edge_v: Vec3::Y,
            material,
        };
        let shape = Prototype::new("two", Mesh::default(), vec![card; 2], &materials);
        let part = TextureWindow::rectangle(Vec2::new(0.5, 0.0), Vec2::new(1.0, 0.25));
        let windows = vec![TextureWindow::WHOLE, part.flipped()];
        let shape = (shape.expect("sound").with_card_windows(windows)).expect("one of each");
        let (triangles, cards) = (triangles(&shape), cards(&shape));
        assert_eq!((triangles.len(), cards.len()), (2, 1));
        let [first, second] = &triangles[..] else {
            panic!("two");
        };
        assert_eq!(
            [first.uv_a, first.uv_b, first.uv_c],
            [[1.0, 0.0], [0.5, 0.0], [0.5, 0.25]]
        );
        assert_eq!(second.uv_c, [1.0, 0.25]);
        assert_eq!((first.c, second.b), ([1.0, 1.0, 0.0], [1.0, 1.0, 0.0]));
    }
}
