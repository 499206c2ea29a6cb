//! Crowns as they are seen from above, as polygons.

use std::collections::BTreeMap;

use nemoral_scene::ObjectId;
use nemoral_scene::glam::DVec2;

use crate::CanopyMaps;

/// The cells of a map of which an object is the top.
#[derive(Clone, Debug, PartialEq)]
pub struct VisibleCrown {
    /// The object.
    pub object: ObjectId,
    /// Area of its cells, m².
    pub area_m2: f64,
    /// Its parts, which touch at corners at most.
    pub polygons: Vec<CrownPolygon>,
}

/// Connected cells of a crown.
#[derive(Clone, Debug, PartialEq)]
pub struct CrownPolygon {
    /// Rings of corners in the world, metres; the first is the border, counter-clockwise, the
    /// others are around holes, clockwise. The first corner is not repeated.
    pub rings: Vec<Vec<DVec2>>,
}

/// A corner of cells: column and row.
type Corner = [usize; 2];

/// The crowns of all objects that are the top of a cell, in order of their ids.
///
/// # Panics
/// If there are other than one cell for each of the map's grid.
#[must_use]
pub fn visible_crowns(maps: &CanopyMaps) -> Vec<VisibleCrown> {
    let grid = &maps.grid;
    assert_eq!(
        maps.cells.len(),
        grid.cells(),
        "a map has all cells of its grid"
    );
    let cell_m2 = grid.cell_m * grid.cell_m;
    let world = |[column, row]: Corner| {
        grid.south_west_m + DVec2::new(column as f64, row as f64) * grid.cell_m
    };
    let mut crowns: BTreeMap<ObjectId, VisibleCrown> = BTreeMap::new();
    let mut parts = Parts::new(maps);
    for start in 0..grid.cells() {
        let object = maps.cells[start].top;
        if object.is_none() {
            continue;
        }
        let Some(cells) = parts.take(start) else {
            continue;
        };
        let rings = parts.rings(&cells);
        let crown = crowns.entry(object).or_insert_with(|| VisibleCrown {
            object,
            area_m2: 0.0,
            polygons: Vec::new(),
        });
        crown.area_m2 += cells.len() as f64 * cell_m2;
        let corners = |ring: Vec<Corner>| ring.into_iter().map(world).collect();
        crown.polygons.push(CrownPolygon {
            rings: rings.into_iter().map(corners).collect(),
        });
    }
    crowns.into_values().collect()
}

/// The connected parts of a map of tops.
struct Parts<'a> {
    maps: &'a CanopyMaps,
    /// The part of each cell, from 1 on; 0 is not known yet.
    of_cells: Vec<u32>,
    known: u32,
}

impl<'a> Parts<'a> {
    fn new(maps: &'a CanopyMaps) -> Self {
        Self {
            maps,
            of_cells: vec![0; maps.grid.cells()],
            known: 0,
        }
    }

    /// The cells that share the object of a cell and are connected with it by sides; `None` if they
    /// were taken before.
    fn take(&mut self, start: usize) -> Option<Vec<usize>> {
        if self.of_cells[start] > 0 {
            return None;
        }
        self.known += 1;
        self.of_cells[start] = self.known;
        let mut cells = vec![start];
        let mut next = 0;
        while let Some(&cell) = cells.get(next) {
            next += 1;
            for neighbour in self.neighbours(cell).into_iter().flatten() {
                let is_same = self.maps.cells[neighbour].top == self.maps.cells[start].top;
                if is_same && self.of_cells[neighbour] == 0 {
                    self.of_cells[neighbour] = self.known;
                    cells.push(neighbour);
                }
            }
        }
        Some(cells)
    }

    /// The cells south, east, north and west of a cell.
    fn neighbours(&self, cell: usize) -> [Option<usize>; 4] {
        let (columns, rows) = (self.maps.grid.columns, self.maps.grid.rows);
        let (column, row) = (cell % columns, cell / columns);
        [
            (row > 0).then(|| cell - columns),
            (column + 1 < columns).then(|| cell + 1),
            (row + 1 < rows).then(|| cell + columns),
            (column > 0).then(|| cell - 1),
        ]
    }

    /// The rings around the cells of a part, its border first.
    ///
    /// Each side that a part does not share is an edge with the part at its left. Where two parts
    /// of the border meet at a corner, turning right keeps rings from touching themselves.
    fn rings(&self, cells: &[usize]) -> Vec<Vec<Corner>> {
        let columns = self.maps.grid.columns;
        // Of each corner, the directions of the edges that begin there: east, north, west, south.
        let mut edges: BTreeMap<Corner, [bool; 4]> = BTreeMap::new();
        for &cell in cells {
            let (x, y) = (cell % columns, cell / columns);
            let begins = [[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1]];
            for (side, neighbour) in self.neighbours(cell).into_iter().enumerate() {
                let is_shared = neighbour.is_some_and(|n| self.of_cells[n] == self.of_cells[cell]);
                if !is_shared {
                    edges.entry(begins[side]).or_default()[side] = true;
                }
            }
        }
        let mut rings = Vec::new();
        // The lowest corner is one of the border.
        while let Some(&start) = edges.keys().next() {
            rings.push(take_ring(&mut edges, start));
        }
        let border = rings.iter().position(|ring| is_counter_clockwise(ring));
        rings.swap(0, border.expect("a part has a border"));
        rings
    }
}

/// Takes the edges of the ring through a corner, and gives the corners where it turns.
fn take_ring(edges: &mut BTreeMap<Corner, [bool; 4]>, start: Corner) -> Vec<Corner> {
    let (mut at, mut heading, mut ring) = (start, None, Vec::new());
    while let Some(begin) = edges.get_mut(&at) {
        // Right, ahead, left.
        let turns = heading.map_or([0, 1, 2, 3], |h| [h + 3, h, h + 1, h + 2].map(|d| d % 4));
        let Some(direction) = turns.into_iter().find(|&d| begin[d]) else {
            break;
        };
        begin[direction] = false;
        if begin.iter().all(|edge| !edge) {
            edges.remove(&at);
        }
        if heading != Some(direction) {
            ring.push(at);
        }
        heading = Some(direction);
        at = match direction {
            0 => [at[0] + 1, at[1]],
            1 => [at[0], at[1] + 1],
            2 => [at[0] - 1, at[1]],
            _ => [at[0], at[1] - 1],
        };
        if at == start {
            break;
        }
    }
    ring
}

fn is_counter_clockwise(ring: &[Corner]) -> bool {
    let next = ring.iter().cycle().skip(1);
    let cross = |([x0, y0], [x1, y1]): (&Corner, &Corner)| (x0 * y1) as i64 - (x1 * y0) as i64;
    ring.iter().zip(next).map(cross).sum::<i64>() > 0
}
