//! The ground mesh of a chunk.

use std::collections::HashMap;

use glam::{DVec2, Vec2, Vec3};
use nemoral_scene::{Blend, ChunkCoord, MaterialId, Mesh, Surface, SurfaceSample, Triangle};

use crate::lattice::{Lattice, Vertex};
use crate::{GroundZones, ZoneSample};
use nemoral_scene::ParamError;

/// A break-line this close to a vertex of the lattice goes through the vertex, metres.
const SNAP_M: f64 = 1e-3;

/// The precision with which break-lines are found on the edges of the lattice, metres.
const ROOT_M: f64 = 1e-4;

/// Texture coordinates repeat after this, metres, so that they stay exact in f32.
const UV_PERIOD_M: f64 = 1024.0;

/// Sizes of a ground mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshParams {
    /// Side of a chunk, metres, 1..=1000.
    pub chunk_size_m: f64,
    /// Cells where no smaller ones are needed, metres; a chunk has a whole number of them, so they
    /// may be slightly larger or smaller.
    pub cell_m: f64,
    /// The smallest cells, at break-lines and on the border of a chunk, metres; rounded down to
    /// `cell_m` / 2^k. There are at most 2048 of them along a chunk.
    pub fine_cell_m: f64,
    /// Cells are halved where their middle misses the surface by more than this, metres;
    /// `f64::INFINITY` for never.
    pub tolerance_m: f64,
}

impl Default for MeshParams {
    /// 50 m chunks of 1 m cells, refined down to 0.25 m where they would be 5 cm off.
    fn default() -> Self {
        Self {
            chunk_size_m: 50.0,
            cell_m: 1.0,
            fine_cell_m: 0.25,
            tolerance_m: 0.05,
        }
    }
}

/// Makes the ground mesh of any chunk from a [`Surface`] and the break-lines of [`GroundZones`].
///
/// Right triangles on a lattice of global integer indices are halved (newest-vertex bisection) as
/// finely as the zones and the surface's curvature require. The border of a chunk is always at the
/// finest level, so that chunks do not depend on their neighbours. Then triangles are cut along the
/// break-lines.
#[derive(Clone, Copy, Debug)]
pub struct GroundMesher {
    chunk_size_m: f64,
    tolerance_m: f64,
    /// Coarse cells along a chunk.
    cells: u32,
    /// Halvings from the coarse to the fine cell.
    levels: u32,
}

impl GroundMesher {
    /// A mesher for chunks of one size.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: MeshParams) -> Result<Self, ParamError> {
        let MeshParams {
            chunk_size_m,
            cell_m,
            fine_cell_m,
            tolerance_m,
        } = params;
        ParamError::check_range("chunk_size_m", chunk_size_m, 1.0..=1000.0, "1..=1000 m")?;
        ParamError::check_range(
            "cell_m",
            cell_m,
            0.05..=chunk_size_m,
            "0.05 m..=chunk_size_m",
        )?;
        ParamError::check_range("fine_cell_m", fine_cell_m, 0.01..=cell_m, "0.01 m..=cell_m")?;
        ParamError::check_range(
            "tolerance_m",
            tolerance_m,
            1e-3..=f64::INFINITY,
            "at least 0.001 m",
        )?;
        let cells = (chunk_size_m / cell_m).round() as u32;
        let cell_m = chunk_size_m / f64::from(cells);
        // The small margin makes 1 m / 0.25 m two halvings in spite of rounding.
        let levels = libm::log2(cell_m / fine_cell_m * (1.0 - 1e-9))
            .ceil()
            .max(0.0) as u32;
        let fine = f64::from(cells) * f64::from(1_u32 << levels);
        if fine > 2048.0 {
            let allowed = "such that at most 2048 of them go along a chunk";
            return Err(ParamError::new("fine_cell_m", fine_cell_m, allowed));
        }
        Ok(Self {
            chunk_size_m,
            tolerance_m,
            cells,
            levels,
        })
    }

    /// The side of the smallest cells, metres.
    #[must_use]
    pub fn fine_cell_m(&self) -> f64 {
        self.chunk_size_m / f64::from(self.cells << self.levels)
    }

    /// The ground mesh of a chunk.
    ///
    /// Positions are chunk-local (x and y in 0..=`chunk_size_m`, z above the world's zero), normals
    /// are the surface's, uv are metres: x and y from the chunk's corner, plus the corner's world
    /// position modulo 1024 m. Triangles are counter-clockwise seen from above. `material` is
    /// called for each vertex, with its world position and whether it is inside the zone, on both
    /// sides if it is on a break-line. A triangle is of the material of its corners; where these
    /// differ, of that of its centroid. Where materials meet, their colours pass over into each
    /// other within a cell, half and half on the line ([`Blend`]).
    ///
    /// Vertices on a border shared by two chunks have the same bits on both sides, if `surface` and
    /// `zones` are pure functions of the world position there.
    pub fn mesh(
        &self,
        coord: ChunkCoord,
        surface: &dyn Surface,
        zones: &dyn GroundZones,
        material: &dyn Fn(DVec2, bool) -> MaterialId,
    ) -> Mesh {
        let mut work = Work::new(self, coord, surface, zones);
        let mut lattice = Lattice::new(self.cells, self.levels);
        lattice.refine(|centre, side| work.asks(centre, side));
        let mut cutter = Cutter {
            cuts: HashMap::new(),
            sides: Vec::new(),
            material,
        };
        lattice.triangles(|corners| cutter.triangle(&mut work, corners));
        work.mesh
    }
}

/// The mesh of one chunk while it is made.
struct Work<'a> {
    surface: &'a dyn Surface,
    zones: &'a dyn GroundZones,
    tolerance_m: f64,
    fine_m: f64,
    /// Global index of the chunk's south-west corner.
    first: [i64; 2],
    uv_origin: DVec2,
    /// Fine cells along the chunk.
    side: u32,
    /// For each lattice vertex, its index in `samples` and in `mesh`.
    slots: Vec<Slot>,
    samples: Vec<SurfaceSample>,
    /// `edge_m` at lattice vertices, snapped; NaN where it is not known yet.
    edges: Vec<f64>,
    mesh: Mesh,
    /// World position of each vertex of the mesh.
    world: Vec<DVec2>,
}

#[derive(Clone, Copy)]
struct Slot {
    sample: u32,
    vertex: u32,
}

const NONE: u32 = u32::MAX;

impl<'a> Work<'a> {
    fn new(
        mesher: &GroundMesher,
        coord: ChunkCoord,
        surface: &'a dyn Surface,
        zones: &'a dyn GroundZones,
    ) -> Self {
        let side = mesher.cells << mesher.levels;
        let origin = coord.origin_m(mesher.chunk_size_m);
        let empty = Slot {
            sample: NONE,
            vertex: NONE,
        };
        Self {
            surface,
            zones,
            tolerance_m: mesher.tolerance_m,
            fine_m: mesher.fine_cell_m(),
            first: [coord.x, coord.y].map(|c| i64::from(c) * i64::from(side)),
            uv_origin: DVec2::new(
                origin.x.rem_euclid(UV_PERIOD_M),
                origin.y.rem_euclid(UV_PERIOD_M),
            ),
            side,
            slots: vec![empty; (side as usize + 1).pow(2)],
            edges: vec![f64::NAN; (side as usize + 1).pow(2)],
            samples: Vec::new(),
            mesh: Mesh::default(),
            world: Vec::new(),
        }
    }

    fn index(&self, v: Vertex) -> usize {
        v.y as usize * (self.side as usize + 1) + v.x as usize
    }

    /// The world position, which is computed from the global integer index, so that both sides of a
    /// border get the same bits.
    fn world_m(&self, v: Vertex) -> DVec2 {
        let x = (self.first[0] + i64::from(v.x)) as f64;
        let y = (self.first[1] + i64::from(v.y)) as f64;
        DVec2::new(x, y) * self.fine_m
    }

    fn local_m(&self, v: Vertex) -> DVec2 {
        DVec2::new(f64::from(v.x), f64::from(v.y)) * self.fine_m
    }

    fn sample(&mut self, v: Vertex) -> SurfaceSample {
        let index = self.index(v);
        if self.slots[index].sample == NONE {
            self.slots[index].sample = self.samples.len() as u32;
            self.samples.push(self.surface.sample(self.world_m(v)));
        }
        self.samples[self.slots[index].sample as usize]
    }

    fn zone(&mut self, v: Vertex) -> ZoneSample {
        let zone = self.zones.sample(self.world_m(v));
        let index = self.index(v);
        self.edges[index] = match zone.edge_m {
            e if e.abs() < SNAP_M => 0.0,
            e if e.is_nan() => f64::INFINITY,
            e => e,
        };
        zone
    }

    /// The snapped distance of a lattice vertex from the break-line.
    fn edge(&mut self, v: Vertex) -> f64 {
        let index = self.index(v);
        if self.edges[index].is_nan() {
            self.zone(v);
        }
        self.edges[index]
    }

    /// Whether the square around `centre` has to be quartered.
    fn asks(&mut self, centre: Vertex, side: u32) -> bool {
        let side_m = f64::from(side) * self.fine_m;
        let ZoneSample { edge_m, detail_m } = self.zone(centre);
        // The limit is half the diagonal, with a margin for the error of `edge_m`.
        if detail_m < 0.999 * side_m || edge_m.abs() <= 0.78 * side_m {
            return true;
        }
        if self.tolerance_m.is_infinite() {
            return false;
        }
        let h = side / 2;
        let corner = |x: u32, y: u32| Vertex {
            x: centre.x - h + x,
            y: centre.y - h + y,
        };
        let diagonals = [
            [corner(0, 0), corner(side, side)],
            [corner(side, 0), corner(0, side)],
        ];
        let middle = self.sample(centre).height_m;
        diagonals.iter().any(|[a, b]| {
            let mean = 0.5 * (self.sample(*a).height_m + self.sample(*b).height_m);
            (middle - mean).abs() > self.tolerance_m
        })
    }

    /// The mesh vertex of a lattice vertex.
    fn vertex(&mut self, v: Vertex) -> u32 {
        let index = self.index(v);
        if self.slots[index].vertex == NONE {
            let sample = self.sample(v);
            self.slots[index].vertex = self.push(self.world_m(v), self.local_m(v), sample);
        }
        self.slots[index].vertex
    }

    fn push(&mut self, world: DVec2, local: DVec2, sample: SurfaceSample) -> u32 {
        let p = local.as_vec2();
        self.mesh
            .positions
            .push(Vec3::new(p.x, p.y, sample.height_m as f32));
        self.mesh.normals.push(sample.normal());
        let uv: Vec2 = (self.uv_origin + local).as_vec2();
        self.mesh.uvs.push(uv);
        self.world.push(world);
        self.world.len() as u32 - 1
    }
}

/// Cuts triangles along the break-lines.
struct Cutter<'a> {
    /// Mesh vertices on cut lattice edges, by the lattice indices of their ends.
    cuts: HashMap<(usize, usize), u32>,
    /// The materials outside and inside at each vertex of the mesh, where they are known; they are
    /// equal except on a break-line.
    sides: Vec<Option<[MaterialId; 2]>>,
    material: &'a dyn Fn(DVec2, bool) -> MaterialId,
}

impl Cutter<'_> {
    fn triangle(&mut self, work: &mut Work<'_>, corners: [Vertex; 3]) {
        // Everything is asked of one corner before the next, so that a ground can keep what it
        // found out about the last place.
        let all = corners.map(|corner| {
            let edge_m = work.edge(corner);
            let vertex = work.vertex(corner);
            self.look(work, vertex, edge_m);
            (edge_m, vertex)
        });
        let (e, v) = (all.map(|corner| corner.0), all.map(|corner| corner.1));
        let positive = e.iter().filter(|e| **e > 0.0).count();
        let negative = e.iter().filter(|e| **e < 0.0).count();
        if positive == 0 || negative == 0 {
            // It is very rare that all three corners are on the line; then either side will do.
            self.push(work, v, negative > 0);
            return;
        }
        // The triangle is rotated so that its first corner is alone on its side of the line, or, if
        // the line goes through a corner, so that this is the second one.
        let lone = |k: usize| {
            let same = |j: usize| e[j] * e[k] > 0.0;
            let [next, last] = [(k + 1) % 3, (k + 2) % 3];
            e[k] != 0.0
                && !same(next)
                && !same(last)
                && (e[next] == 0.0 || positive + negative == 3)
        };
        let k = (0..3).find(|&k| lone(k)).expect("both signs are there");
        let [a, b, c] = [k, (k + 1) % 3, (k + 2) % 3];
        let inside = e[a] < 0.0;
        let last = self.cut(work, [corners[c], corners[a]], [e[c], e[a]]);
        if e[b] == 0.0 {
            self.push(work, [v[a], v[b], last], inside);
            self.push(work, [last, v[b], v[c]], !inside);
            return;
        }
        let first = self.cut(work, [corners[a], corners[b]], [e[a], e[b]]);
        self.push(work, [v[a], first, last], inside);
        // The quadrilateral (first, b, c, last) is divided along its shorter diagonal.
        let length =
            |i: u32, j: u32| work.world[i as usize].distance_squared(work.world[j as usize]);
        if length(first, v[c]) <= length(v[b], last) {
            self.push(work, [first, v[b], v[c]], !inside);
            self.push(work, [first, v[c], last], !inside);
        } else {
            self.push(work, [first, v[b], last], !inside);
            self.push(work, [v[b], v[c], last], !inside);
        }
    }

    /// The mesh vertex where the break-line crosses a lattice edge.
    fn cut(&mut self, work: &mut Work<'_>, mut ends: [Vertex; 2], mut e: [f64; 2]) -> u32 {
        // The direction is always that of rising indices, so that both sides agree.
        if work.index(ends[0]) > work.index(ends[1]) {
            ends.reverse();
            e.reverse();
        }
        let key = (work.index(ends[0]), work.index(ends[1]));
        if let Some(&vertex) = self.cuts.get(&key) {
            return vertex;
        }
        let world = ends.map(|v| work.world_m(v));
        let local = ends.map(|v| work.local_m(v));
        let at = |t: f64, [a, b]: [DVec2; 2]| a + (b - a) * t;
        let step = ROOT_M / world[0].distance(world[1]);
        let t = root(e, step, |t| work.zones.sample(at(t, world)).edge_m);
        let world = at(t, world);
        let vertex = work.push(world, at(t, local), work.surface.sample(world));
        self.look(work, vertex, 0.0);
        self.cuts.insert(key, vertex);
        vertex
    }

    /// Stores the materials at a vertex that is `edge_m` from the break-line.
    fn look(&mut self, work: &Work<'_>, vertex: u32, edge_m: f64) {
        let index = vertex as usize;
        if self.sides.len() <= index {
            self.sides.resize(work.world.len(), None);
        }
        self.sides[index].get_or_insert_with(|| {
            let at = |inside| (self.material)(work.world[index], inside);
            if edge_m == 0.0 {
                [at(false), at(true)]
            } else {
                [at(edge_m < 0.0); 2]
            }
        });
    }

    fn push(&self, work: &mut Work<'_>, corners: [u32; 3], inside: bool) {
        let [a, b, c] = corners.map(|v| work.world[v as usize]);
        let sides = corners.map(|v| self.sides[v as usize].expect("looked at when it was made"));
        let of_corners = sides.map(|side| side[usize::from(inside)]);
        let material = if of_corners == [of_corners[0]; 3] {
            of_corners[0]
        } else {
            (self.material)((a + b + c) / 3.0, inside)
        };
        work.mesh.triangles.push(Triangle { corners, material });
        work.mesh.blends.push(Blend { corners: sides });
    }
}

/// A zero of `f` in 0..1 between values of different signs, to within `step` or [`ROOT_M`] of
/// value: false position with Illinois' halving, and bisection whenever that is slow or the values
/// are not finite.
fn root([mut low, mut high]: [f64; 2], step: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut a, mut b) = (0.0, 1.0);
    let rising = low < 0.0;
    for i in 0..60 {
        let guess = a + (b - a) * low / (low - high);
        let slow = i % 4 == 3 || !guess.is_finite() || !(a..=b).contains(&guess);
        let t = if slow { 0.5 * (a + b) } else { guess };
        let value = f(t);
        if value.abs() < ROOT_M {
            return t;
        }
        if (value < 0.0) == rising {
            (a, low) = (t, value);
            high *= 0.5;
        } else {
            (b, high) = (t, value);
            low *= 0.5;
        }
        if b - a <= step {
            break;
        }
    }
    0.5 * (a + b)
}
