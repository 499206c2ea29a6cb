//! Square cells on the map.

use nemoral_scene::ParamError;
use nemoral_scene::glam::DVec2;

/// The cells of a map, numbered from south to north, in each row from west to east.
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
    /// The most cells of a grid: 2.5 km a side in cells of half a metre.
    pub const MAX_CELLS: usize = 25_000_000;

    /// The most cells of a side, as pictures have them.
    pub const MAX_CELLS_PER_SIDE: usize = 65_535;

    /// The cells that a rectangle of the world is made of, from its south-west corner on.
    ///
    /// # Errors
    /// If a corner is not finite, `cell_m` is not 0.01 to 1000 m, a side of the rectangle is not a
    /// whole number of cells (within a millionth of one), or there are more than
    /// [`MAX_CELLS_PER_SIDE`](Self::MAX_CELLS_PER_SIDE) or [`MAX_CELLS`](Self::MAX_CELLS).
    pub fn of(low_m: DVec2, high_m: DVec2, cell_m: f64) -> Result<Self, ParamError> {
        ParamError::check_within("cell_m", cell_m, 0.01, 1000.0)?;
        let sides = (high_m - low_m) / cell_m;
        let whole = sides.round();
        let most = DVec2::splat(Self::MAX_CELLS_PER_SIDE as f64);
        let fits = whole.cmpge(DVec2::ONE).all()
            && whole.cmple(most).all()
            && (sides - whole).abs().cmple(DVec2::splat(1e-6)).all()
            && whole.x * whole.y <= Self::MAX_CELLS as f64;
        let allowed = format!(
            "a whole number of cells a side, at least 1 and at most {}, and at most {} in all",
            Self::MAX_CELLS_PER_SIDE,
            Self::MAX_CELLS
        );
        let given = format!("{} x {} of {cell_m} m", sides.x, sides.y);
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

    /// World position of the south-west corner of a cell, metres.
    #[must_use]
    pub fn corner_m(&self, number: usize) -> DVec2 {
        let place = [number % self.columns, number / self.columns];
        self.south_west_m + DVec2::from(place.map(|n| n as f64)) * self.cell_m
    }

    /// World position of a cell's middle, metres.
    #[must_use]
    pub fn middle_m(&self, number: usize) -> DVec2 {
        self.corner_m(number) + 0.5 * self.cell_m
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

    /// The numbers of the cells that a rectangle touches, in order; cells that a corner is at the
    /// border of may be among them.
    pub(crate) fn touched(&self, low_m: DVec2, high_m: DVec2) -> impl Iterator<Item = usize> {
        let most = DVec2::new(self.columns as f64, self.rows as f64);
        let at = |place_m: DVec2| (place_m - self.south_west_m) / self.cell_m;
        let from = at(low_m).floor().clamp(DVec2::ZERO, most);
        let to = at(high_m).ceil().clamp(DVec2::ZERO, most);
        let columns = from.x as usize..to.x as usize;
        let wide = self.columns;
        let row = move |row: usize| columns.clone().map(move |column| row * wide + column);
        (from.y as usize..to.y as usize).flat_map(row)
    }

    /// Values of all cells as maps are stored: rows from north to south, each from west to east.
    pub fn from_north<T: Copy>(&self, of_cell: impl Fn(usize) -> T) -> Vec<T> {
        let row = |row: usize| (0..self.columns).map(move |column| row * self.columns + column);
        let numbers = (0..self.rows).rev().flat_map(row);
        numbers.map(of_cell).collect()
    }
}
