//! The teeth with which the materials of trails end, where they change and where kinds of way meet.

use glam::DVec2;
use nemoral_seed::{Domain, Draw, Key};

use crate::profile::smoothstep;

const RAGGED: Domain = Domain::new("trails.ragged");

/// The size of the teeth, metres.
const CELL_M: f64 = 0.8;

/// Keyed noise of the plane in -1..=1, a metre across.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ragged(Key);

impl Ragged {
    pub(crate) fn new(key: Key) -> Self {
        Self(key.domain(RAGGED))
    }

    pub(crate) fn at(&self, p: DVec2) -> f64 {
        let place = p / CELL_M;
        let cell = place.floor();
        let t = place - cell;
        let (x, y) = (smoothstep(t.x), smoothstep(t.y));
        let [a, b, c, d] = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| {
            let corner = [cell.x as i32 + i, cell.y as i32 + j];
            self.0.chunk(corner).rng().range_f64(-1.0, 1.0)
        });
        let (low, high) = (a + x * (b - a), c + x * (d - c));
        low + y * (high - low)
    }
}
