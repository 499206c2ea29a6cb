//! Value noise: random values at the points of a lattice, with smooth steps between them.

use glam::DVec2;
use nemoral_seed::{Domain, Draw, Key};

use crate::curve::smoothstep;

const RAGGED: Domain = Domain::new("trails.ragged");

/// The size of the teeth with which the materials of trails end, metres.
const CELL_M: f64 = 0.8;

/// Keyed noise in -1..=1 over a length: random values `wavelength_m` apart.
#[derive(Debug)]
pub(crate) struct ValueNoise1d {
    wavelength_m: f64,
    values: Vec<f64>,
}

impl ValueNoise1d {
    pub(crate) fn new(key: Key, length_m: f64, wavelength_m: f64) -> Self {
        let mut rng = key.rng();
        let n = (length_m / wavelength_m) as usize + 2;
        Self {
            wavelength_m,
            values: (0..n).map(|_| rng.range_f64(-1.0, 1.0)).collect(),
        }
    }

    pub(crate) fn at(&self, s_m: f64) -> f64 {
        let x = (s_m / self.wavelength_m).max(0.0);
        let i = (x as usize).min(self.values.len() - 2);
        let t = smoothstep(x - i as f64);
        self.values[i] + t * (self.values[i + 1] - self.values[i])
    }
}

/// Keyed noise of the plane in -1..=1, with a random value at each corner of square cells: the
/// teeth with which the materials of trails end, where they change and where kinds of way meet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ValueNoise2d(Key);

impl ValueNoise2d {
    pub(crate) fn new(key: Key) -> Self {
        Self(key.domain(RAGGED))
    }

    pub(crate) fn at(&self, p: DVec2) -> f64 {
        let place = p / CELL_M;
        let cell = place.floor();
        let t = place - cell;
        let (x, y) = (smoothstep(t.x), smoothstep(t.y));
        let [a, b, c, d] = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| {
            // Beyond the cells that have numbers, any corner does.
            let corner = [
                (cell.x as i32).wrapping_add(i),
                (cell.y as i32).wrapping_add(j),
            ];
            self.0.chunk(corner).rng().range_f64(-1.0, 1.0)
        });
        let (low, high) = (a + x * (b - a), c + x * (d - c));
        low + y * (high - low)
    }
}
