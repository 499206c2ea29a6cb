//! The water near a chunk: how it shapes the ground, where it is, and its surfaces.

use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::{Dual, MaterialId, Mesh, Surface, SurfaceSample};

use crate::channel::{CrossSection, Segment};
use crate::network::StreamReach;
use crate::pond::Pond;
use crate::puddle::Puddle;
use crate::surface_mesh::{SurfaceMesh, WaterKind};

/// Side of the cells by which segments are found, metres.
const CELL_M: f64 = 2.0;

/// How the corners are rounded where the ground is filled and where it is cut, metres.
const ROUNDED_M: [f64; 2] = [0.1, 0.22];

/// The distances from the edge of a way between which a channel ends.
const VERGE_M: [f64; 2] = [0.4, 1.5];

/// How far from the edge of the water the ground bends, in ponds and on banks, metres.
const STEEP_M: [f64; 2] = [-1.0, 1.3];

/// Distances from water are known up to this, metres: cells list all segments that are so near.
const KNOWN_M: f64 = 5.0;

/// The water near a chunk.
#[derive(Debug)]
pub struct ChunkWater {
    origin_m: DVec2,
    chunk_size_m: f64,
    /// The south-western corner of the cells.
    corner_m: DVec2,
    cells: i64,
    segments: Vec<Segment>,
    /// The segments and ponds that change the ground of each cell.
    of_cell: Vec<Vec<u32>>,
    reaches: Vec<StreamReach>,
    ponds: Vec<Arc<Pond>>,
}

impl ChunkWater {
    pub(crate) fn new(
        origin_m: DVec2,
        chunk_size_m: f64,
        margin_m: f64,
        reaches: Vec<StreamReach>,
        ponds: impl Iterator<Item = Arc<Pond>>,
    ) -> Self {
        let corner_m = origin_m - margin_m;
        let cells = ((chunk_size_m + 2.0 * margin_m) / CELL_M).ceil() as i64;
        let mut water = Self {
            origin_m,
            chunk_size_m,
            corner_m,
            cells,
            segments: Vec::new(),
            of_cell: Vec::new(),
            reaches: Vec::new(),
            ponds: Vec::new(),
        };
        let far_m = corner_m + cells as f64 * CELL_M;
        water.ponds = ponds
            .filter(|pond| {
                let (low, high) = (
                    pond.middle_m - pond.reach_m(),
                    pond.middle_m + pond.reach_m(),
                );
                low.cmple(far_m).all() && high.cmpge(corner_m).all()
            })
            .collect();
        water.reaches = reaches;
        for reach in &water.reaches {
            for pair in reach.sections.windows(2) {
                let segment = Segment {
                    ends: [pair[0], pair[1]],
                };
                if let Some(cells) = water.cells_of(&segment) {
                    if water.of_cell.is_empty() {
                        water.of_cell = vec![Vec::new(); (water.cells * water.cells) as usize];
                    }
                    let number = water.segments.len() as u32;
                    water.segments.push(segment);
                    for cell in cells {
                        water.of_cell[cell].push(number);
                    }
                }
            }
        }
        water
    }

    /// The cells that a segment reaches; `None` if there are none.
    fn cells_of(&self, segment: &Segment) -> Option<impl Iterator<Item = usize> + use<>> {
        let [a, b] = &segment.ends;
        let reach = a.reach_m().max(b.reach_m());
        let low = ((a.middle_m.min(b.middle_m) - reach - self.corner_m) / CELL_M).floor();
        let high = ((a.middle_m.max(b.middle_m) + reach - self.corner_m) / CELL_M).floor();
        let cells = self.cells;
        let clamp = |v: f64| (v as i64).clamp(0, cells - 1);
        let is_out = high.min_element() < 0.0 || low.max_element() >= cells as f64;
        let (x, y) = (clamp(low.x)..=clamp(high.x), clamp(low.y)..=clamp(high.y));
        (!is_out).then(|| x.flat_map(move |x| y.clone().map(move |y| (y * cells + x) as usize)))
    }

    /// The segments that may change the ground at a place.
    fn at(&self, world_m: DVec2) -> impl Iterator<Item = &Segment> {
        let cell = ((world_m - self.corner_m) / CELL_M).floor();
        let is_in = cell.min_element() >= 0.0 && cell.max_element() < self.cells as f64;
        let index = (cell.y as i64 * self.cells + cell.x as i64) as usize;
        let here = if is_in { self.of_cell.get(index) } else { None };
        let here = here.map_or(&[][..], Vec::as_slice);
        here.iter().map(|&i| &self.segments[i as usize])
    }

    /// Whether there is no water that concerns any of the places.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.segments.is_empty() && self.ponds.is_empty()
    }

    /// The ponds.
    pub fn ponds(&self) -> impl Iterator<Item = &Pond> {
        self.ponds.iter().map(|pond| &**pond)
    }

    /// Whether water may change the ground at a place, or be within a few metres.
    #[must_use]
    pub fn concerns(&self, world_m: DVec2) -> bool {
        let of_pond = |p: &Arc<Pond>| p.middle_m.distance(world_m) < p.reach_m();
        self.at(world_m).next().is_some() || self.ponds.iter().any(of_pond)
    }

    /// The ground at a place with the beds of water in it and their rims on it, where it was
    /// `ground`. The gradient is exact wherever there is one.
    #[must_use]
    pub fn carve(&self, world_m: DVec2, ground: SurfaceSample) -> SurfaceSample {
        let (mut cut, mut fill) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut cut_to, mut fill_to) = (None, None);
        let segments = self.at(world_m).filter_map(|s| s.cut_and_fill(world_m));
        let ponds = (self.ponds.iter()).filter_map(|p| p.cut_and_fill(world_m));
        for (c, f) in segments.chain(ponds) {
            if c.value < cut {
                (cut, cut_to) = (c.value, Some(c));
            }
            if f.value > fill {
                (fill, fill_to) = (f.value, Some(f));
            }
        }
        let mut here = Dual::new(ground.height_m, ground.gradient);
        if let Some(fill) = fill_to {
            here = here.smooth_max(fill, Dual::constant(ROUNDED_M[0]));
        }
        if let Some(cut) = cut_to {
            here = here.smooth_min(cut, Dual::constant(ROUNDED_M[1]));
        }
        SurfaceSample {
            height_m: here.value,
            gradient: here.gradient,
        }
    }

    /// As [`carve`](Self::carve), beside a way whose signed distance from its edge and the gradient
    /// of that are given: beds and rims end at its verges.
    #[must_use]
    pub fn carve_beside(
        &self,
        world_m: DVec2,
        ground: SurfaceSample,
        (edge_m, edge_gradient): (f64, DVec2),
    ) -> SurfaceSample {
        let [low, high] = VERGE_M;
        let t = (edge_m - low) / (high - low);
        if t <= 0.0 {
            return ground;
        }
        let carved = self.carve(world_m, ground);
        if t >= 1.0 {
            return carved;
        }
        let share = Dual::new(
            t * t * (3.0 - 2.0 * t),
            edge_gradient * (6.0 * t * (1.0 - t) / (high - low)),
        );
        let change = Dual::new(
            carved.height_m - ground.height_m,
            carved.gradient - ground.gradient,
        );
        let here = Dual::new(ground.height_m, ground.gradient) + share * change;
        SurfaceSample {
            height_m: here.value,
            gradient: here.gradient,
        }
    }

    /// Signed distance from the edge of the nearest stream or pond, metres, nearly: negative in its
    /// water, `f64::INFINITY` where none is within 5 m.
    #[must_use]
    pub fn edge_m(&self, world_m: DVec2) -> f64 {
        let of_streams = self.at(world_m).map(|s| s.edge_m(world_m));
        let of_ponds = self.ponds.iter().map(|p| p.edge_m(world_m));
        let edge_m = of_streams.chain(of_ponds).fold(f64::INFINITY, f64::min);
        if edge_m < KNOWN_M {
            edge_m
        } else {
            f64::INFINITY
        }
    }

    /// The sections of streams whose water is the chunk's: middle, direction downstream, half the
    /// width of the water, its level and its depth, metres.
    pub fn sections(&self) -> impl Iterator<Item = &[CrossSection]> {
        self.own_reaches().map(|reach| &reach.sections[..])
    }

    /// The sections of streams whose middle is in the chunk, whichever chunk's their water is.
    /// Where two reaches meet, each of them has one.
    pub fn sections_in_chunk(&self) -> impl Iterator<Item = &CrossSection> {
        let sections = self.reaches.iter().flat_map(|reach| &reach.sections);
        sections.filter(|section| self.is_own(section.middle_m))
    }

    /// Whether the ground at a place bends as beds and banks do, so that it has to be meshed
    /// finely.
    #[must_use]
    pub fn is_steep(&self, world_m: DVec2) -> bool {
        let [inside, outside] = STEEP_M;
        self.at(world_m).any(|s| s.edge_m(world_m) < outside)
            || (self.ponds.iter()).any(|p| (inside..outside).contains(&p.edge_m(world_m)))
    }

    /// Whether a place is in the chunk.
    fn is_own(&self, world_m: DVec2) -> bool {
        let local = world_m - self.origin_m;
        local.min_element() >= 0.0 && local.max_element() < self.chunk_size_m
    }

    /// The reaches whose water is the chunk's: those that begin in it.
    fn own_reaches(&self) -> impl Iterator<Item = &StreamReach> {
        self.reaches
            .iter()
            .filter(|reach| self.is_own(reach.sections[0].middle_m))
    }

    /// The ponds whose middle is in the chunk.
    fn own_ponds(&self) -> impl Iterator<Item = &Arc<Pond>> {
        self.ponds.iter().filter(|pond| self.is_own(pond.middle_m))
    }

    /// The surfaces of the chunk's waters: those of streams from their springs or joints in it, and
    /// of ponds whose middle is in it. They end below the ground of their banks, which is `ground`
    /// with the beds in it. `material` gives the material of each kind. Positions are chunk-local
    /// (z above the world's zero), uv are world metres modulo 1024. Triangles are counter-clockwise
    /// seen from above.
    pub fn surface_mesh(
        &self,
        ground: &dyn Surface,
        material: &dyn Fn(WaterKind) -> MaterialId,
    ) -> Mesh {
        let mut surfaces = SurfaceMesh {
            origin_m: self.origin_m,
            mesh: Mesh::default(),
            ground,
            material,
        };
        for reach in self.own_reaches() {
            surfaces.reach(reach);
        }
        for pond in self.own_ponds() {
            surfaces.pond(pond);
        }
        surfaces.mesh
    }

    /// Whether the surfaces of the chunk's waters, as [`surface_mesh`](Self::surface_mesh) makes
    /// them, may reach into a rectangle. None does that is farther than
    /// [`SURFACE_REACH_M`](crate::SURFACE_REACH_M) from the chunk.
    #[must_use]
    pub fn surface_reaches(&self, low_m: DVec2, high_m: DVec2) -> bool {
        let meets =
            |(low, high): (DVec2, DVec2)| low.cmple(high_m).all() && high.cmpge(low_m).all();
        let of_reach = |reach: &StreamReach| {
            let around = |section: &CrossSection| {
                // Rows end up to a tenth farther in the banks, and the first one is moved up from
                // a spring by half its width.
                let reach_m = 1.5 * section.surface_half_m();
                (section.middle_m - reach_m, section.middle_m + reach_m)
            };
            let nothing = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            let sections = reach.sections.iter().map(around);
            sections.fold(nothing, |(low, high), (a, b)| (low.min(a), high.max(b)))
        };
        let of_pond = |pond: &Arc<Pond>| {
            let reach_m = 1.1 * pond.widest_m();
            (pond.middle_m - reach_m, pond.middle_m + reach_m)
        };
        self.own_reaches().map(of_reach).any(meets) || self.own_ponds().map(of_pond).any(meets)
    }
}

/// Adds the surfaces of those puddles whose middle is in a square to a mesh, as
/// [`ChunkWater::surface_mesh`] does; positions are relative to the square's first corner.
pub fn puddle_surfaces(
    puddles: &[Puddle],
    (low_m, high_m): (DVec2, DVec2),
    ground: &dyn Surface,
    material: &dyn Fn(WaterKind) -> MaterialId,
    mesh: &mut Mesh,
) {
    let mut surfaces = SurfaceMesh {
        origin_m: low_m,
        mesh: std::mem::take(mesh),
        ground,
        material,
    };
    for puddle in puddles {
        let middle = puddle.middle_m();
        if middle.cmpge(low_m).all() && middle.cmplt(high_m).all() {
            surfaces.puddle(puddle);
        }
    }
    *mesh = surfaces.mesh;
}
