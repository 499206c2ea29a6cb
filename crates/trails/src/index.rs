//! The search for knots near a point.

use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::ChunkCoord;

use crate::TrailPath;

/// Side of a cell, metres.
const CELL_M: f64 = 4.0;

/// A run of knots of one path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch {
    /// Its index in the list of paths.
    pub(crate) path: u32,
    pub(crate) first: u32,
    pub(crate) end: u32,
}

/// A grid over a square: for each cell the knots within reach of any of its points, by path and
/// number.
pub(crate) struct Index {
    low: DVec2,
    columns: usize,
    rows: usize,
    cells: Vec<Vec<Stretch>>,
}

impl Index {
    /// Makes the index from the transits through chunks that are `near`, of the knots that count.
    pub(crate) fn new(
        paths: &[Arc<TrailPath>],
        low: DVec2,
        high: DVec2,
        reach_m: f64,
        near: &dyn Fn(ChunkCoord) -> bool,
        counts: impl Fn(&TrailPath, usize) -> bool,
    ) -> Self {
        let size = ((high - low) / CELL_M).ceil().max(DVec2::ONE);
        let (columns, rows) = (size.x as usize, size.y as usize);
        let mut cells = vec![Vec::<Stretch>::new(); columns * rows];
        // The margin keeps rounding from losing a knot.
        let reach = reach_m + 1e-3;
        for (path, trail) in (0_u32..).zip(paths) {
            for (_, _, knots) in trail.transits().filter(|t| near(t.1)) {
                for i in knots.filter(|&i| counts(trail, i)) {
                    let place = trail.knots()[i].position - low;
                    let from = ((place - reach) / CELL_M).floor().max(DVec2::ZERO);
                    let to = ((place + reach) / CELL_M).floor().min(size - 1.0);
                    if to.cmplt(from).any() {
                        continue;
                    }
                    for y in from.y as usize..=to.y as usize {
                        for x in from.x as usize..=to.x as usize {
                            let corner = DVec2::new(x as f64, y as f64) * CELL_M;
                            let nearest = place.clamp(corner, corner + CELL_M);
                            if nearest.distance_squared(place) > reach * reach {
                                continue;
                            }
                            let i = i as u32;
                            let cell = &mut cells[y * columns + x];
                            match cell.last_mut() {
                                Some(last) if last.path == path && last.end == i => last.end += 1,
                                _ => cell.push(Stretch {
                                    path,
                                    first: i,
                                    end: i + 1,
                                }),
                            }
                        }
                    }
                }
            }
        }
        Self {
            low,
            columns,
            rows,
            cells,
        }
    }

    /// The knots within reach of a point, and some more; none outside the square.
    #[inline]
    pub(crate) fn at(&self, p: DVec2) -> &[Stretch] {
        let cell = (p - self.low) / CELL_M;
        // The high border belongs to the last cells.
        let inside = cell.x >= 0.0
            && cell.y >= 0.0
            && cell.x <= self.columns as f64
            && cell.y <= self.rows as f64;
        if !inside {
            return &[];
        }
        let (x, y) = (
            (cell.x as usize).min(self.columns - 1),
            (cell.y as usize).min(self.rows - 1),
        );
        &self.cells[y * self.columns + x]
    }
}
