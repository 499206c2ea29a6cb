//! The surfaces of waters as meshes.

use glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{MaterialId, Mesh, Surface, Triangle};

use crate::network::StreamReach;
use crate::pond::Pond;
use crate::puddle::Puddle;

/// Texture coordinates repeat after this, metres, so that they stay exact in f32.
const UV_PERIOD_M: f64 = 1024.0;

/// Where the vertices of a stream's surface are across, from one end to the other.
const ACROSS: [f64; 5] = [-1.0, -0.5, 0.0, 0.5, 1.0];

/// A stream's surface ends this far inside of a pond, metres, some millimetres below its water.
const INTO_POND_M: f64 = 0.8;
const UNDER_POND_M: f64 = 0.01;

/// The borders of surfaces are at least so far below the ground, metres.
const BURIED_M: f64 = 0.04;

/// A kind of water.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum WaterKind {
    /// Water that runs.
    Stream,
    /// Clear water that stands.
    Pond,
    /// Muddy water that stands on a way.
    Puddle,
}

/// Collects the surfaces of a chunk's waters in one mesh.
pub(crate) struct SurfaceMesh<'a> {
    pub(crate) origin_m: DVec2,
    pub(crate) mesh: Mesh,
    /// The ground with its beds.
    pub(crate) ground: &'a dyn Surface,
    pub(crate) material: &'a dyn Fn(WaterKind) -> MaterialId,
}

impl SurfaceMesh<'_> {
    fn vertex(&mut self, place: DVec2, level_m: f64, normal: DVec3) -> u32 {
        let local = place - self.origin_m;
        let wrapped = DVec2::new(
            self.origin_m.x.rem_euclid(UV_PERIOD_M),
            self.origin_m.y.rem_euclid(UV_PERIOD_M),
        );
        let mesh = &mut self.mesh;
        (mesh.positions).push(Vec3::new(local.x as f32, local.y as f32, level_m as f32));
        mesh.normals.push(normal.as_vec3());
        mesh.uvs.push((wrapped + local).as_vec2());
        mesh.positions.len() as u32 - 1
    }

    fn triangle(&mut self, corners: [u32; 3], kind: WaterKind) {
        let material = (self.material)(kind);
        self.mesh.triangles.push(Triangle { corners, material });
    }

    /// The end of a row in a direction: in the first bank, or, if there is none, where it would be.
    fn border(&self, middle_m: DVec2, out: DVec2, level_m: f64) -> (DVec2, f64) {
        let places = (10..=22).map(|i| middle_m + out * (0.05 * f64::from(i)));
        let is_bank = |p: &DVec2| self.ground.height_m(*p) >= level_m + BURIED_M;
        match places.into_iter().find(is_bank) {
            Some(bank) => (bank, level_m),
            None => (middle_m + out, self.buried_m(middle_m + out, level_m)),
        }
    }

    /// The height of a surface's border, which is nowhere above the ground: beside a lower stream,
    /// the water falls to that.
    fn buried_m(&self, place: DVec2, level_m: f64) -> f64 {
        level_m.min(self.ground.height_m(place) - BURIED_M)
    }

    /// The surface of a reach: rows across, whose ends are in the banks.
    pub(crate) fn reach(&mut self, reach: &StreamReach) {
        let mut rows = reach.sections.clone();
        if reach.is_spring {
            let mut first = rows[0];
            first.middle_m -= first.along * first.surface_half_m();
            rows.insert(0, first);
        }
        let mut before: Option<[u32; 5]> = None;
        for (i, row) in rows.iter().enumerate() {
            let (a, b) = (
                &rows[i.saturating_sub(1)],
                &rows[(i + 1).min(rows.len() - 1)],
            );
            let way = b.middle_m - a.middle_m;
            let fall = (b.level_m - a.level_m) / way.length().max(1e-6);
            let normal = DVec3::new(-row.along.x * fall, -row.along.y * fall, 1.0).normalize();
            let edge_m = reach.pond.as_ref().map(|pond| pond.edge_m(row.middle_m));
            let under = edge_m.is_some_and(|edge| edge < -0.1);
            let level_m = row.level_m - if under { UNDER_POND_M } else { 0.0 };
            let left = row.along.perp() * row.surface_half_m();
            let [right_end, left_end] =
                [-left, left].map(|out| self.border(row.middle_m, out, level_m));
            let row = ACROSS.map(|o| {
                let (end, end_m) = if o < 0.0 { right_end } else { left_end };
                let p = row.middle_m.lerp(end, o.abs());
                let level_m = if o.abs() < 1.0 { level_m } else { end_m };
                self.vertex(p, level_m, normal)
            });
            if let Some(before) = before {
                for k in 0..4 {
                    // Rows run from right to left.
                    let [a, b, c, d] = [before[k], row[k], row[k + 1], before[k + 1]];
                    self.triangle([a, b, c], WaterKind::Stream);
                    self.triangle([a, c, d], WaterKind::Stream);
                }
            }
            before = Some(row);
            if edge_m.is_some_and(|edge| edge < -INTO_POND_M) {
                break;
            }
        }
    }

    /// The surface of a pond: rings, of which the last is in the bank.
    pub(crate) fn pond(&mut self, pond: &Pond) {
        let (radii, count) = pond.rings();
        let rings = radii.iter().map(|&r| pond.surface_ring(r, count));
        let rings: Vec<Vec<DVec2>> = rings.collect();
        self.fan(pond.middle_m(), &rings, pond.level_m(), WaterKind::Pond);
    }

    /// The surface of a puddle.
    pub(crate) fn puddle(&mut self, puddle: &Puddle) {
        let rings = [0.5, 0.85, 1.02].map(|r| puddle.ring(r, 32).collect());
        self.fan(
            puddle.middle_m(),
            &rings,
            puddle.level_m(),
            WaterKind::Puddle,
        );
    }

    /// A level surface of rings of equal numbers of places, counter-clockwise, from the middle out.
    pub(crate) fn fan(
        &mut self,
        middle_m: DVec2,
        rings: &[Vec<DVec2>],
        level_m: f64,
        kind: WaterKind,
    ) {
        let middle = self.vertex(middle_m, level_m, DVec3::Z);
        let mut inner: Option<Vec<u32>> = None;
        for ring in rings {
            let is_border = std::ptr::eq(ring, &rings[rings.len() - 1]);
            let ring: Vec<u32> = ring
                .iter()
                .map(|&p| {
                    let level_m = if is_border {
                        self.buried_m(p, level_m)
                    } else {
                        level_m
                    };
                    self.vertex(p, level_m, DVec3::Z)
                })
                .collect();
            for i in 0..ring.len() {
                let j = (i + 1) % ring.len();
                match &inner {
                    None => self.triangle([middle, ring[i], ring[j]], kind),
                    Some(inner) => {
                        self.triangle([inner[i], ring[i], ring[j]], kind);
                        self.triangle([inner[i], ring[j], inner[j]], kind);
                    }
                }
            }
            inner = Some(ring);
        }
    }
}
