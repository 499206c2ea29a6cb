//! Square cells on the map.

use nemoral_scene::ParamError;
use nemoral_scene::glam::DVec2;

/// The cells of a map: rows from south to north, each from west to east.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapGrid {
    /// World position of the south-west corner, metres.
    pub south_west_m: DVec2,
    /// Side of a cell, metres.
    pub cell_m: f64,
    /// Cells from west to east.
    pub columns: usize,
    /// Cells from south to north.
    pub rows: usize,
}

impl MapGrid {
    /// The most cells of a grid.
    pub const MOST_CELLS: usize = 100_000_000;

    /// The cells of which a rectangle of the world is made, from its south-west corner on.
    ///
    /// # Errors
    /// If a number is not finite, a side of the rectangle is not a whole number of cells (within a
    /// millionth of one), or there are more than [`MOST_CELLS`](Self::MOST_CELLS).
    pub fn of(low_m: DVec2, high_m: DVec2, cell_m: f64) -> Result<Self, ParamError> {
        ParamError::check_positive("cell_m", cell_m)?;
        let sides = (high_m - low_m) / cell_m;
        let whole = sides.round();
        let fits = whole.cmpge(DVec2::ONE).all()
            && (sides - whole).abs().cmple(DVec2::splat(1e-6)).all()
            && whole.x * whole.y <= Self::MOST_CELLS as f64;
        let allowed = format!(
            "a whole number of cells a side, at least 1 and at most {} in all",
            Self::MOST_CELLS
        );
        let given = format!("{} x {} cells of {cell_m} m", sides.x, sides.y);
        ParamError::check(fits, "cells", given, &allowed)?;
        Ok(Self {
            south_west_m: low_m,
            cell_m,
            columns: whole.x as usize,
            rows: whole.y as usize,
        })
    }

    /// How many cells there are.
    #[must_use]
    pub const fn cells(&self) -> usize {
        self.columns * self.rows
    }

    /// Area on the map, m².
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        self.cells() as f64 * self.cell_m * self.cell_m
    }

    /// World position of a cell's middle, metres.
    #[must_use]
    pub fn middle_m(&self, column: usize, row: usize) -> DVec2 {
        self.south_west_m + (DVec2::new(column as f64, row as f64) + 0.5) * self.cell_m
    }

    /// The number of the cell that a place is in; `None` outside of the map. A border belongs to
    /// the cell east or north of it.
    #[must_use]
    pub fn cell_at(&self, place_m: DVec2) -> Option<usize> {
        let at = ((place_m - self.south_west_m) / self.cell_m).floor();
        let sides = DVec2::new(self.columns as f64, self.rows as f64);
        let is_inside = at.cmpge(DVec2::ZERO).all() && at.cmplt(sides).all();
        is_inside.then(|| at.y as usize * self.columns + at.x as usize)
    }
}
