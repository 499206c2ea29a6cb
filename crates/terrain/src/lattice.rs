//! Right triangles on a square lattice, which are halved where smaller ones are needed.

/// A vertex of a chunk's fine lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Vertex {
    pub(crate) x: u32,
    pub(crate) y: u32,
}

/// The vertices of the fine lattice that split a triangle.
///
/// Squares have a side of `1 << level` fine cells. A square is two right triangles on a common
/// hypotenuse; splitting at its *centre* makes four triangles whose hypotenuses are its sides;
/// splitting these at the *middles of sides* makes four squares of half the side. Invariant after
/// [`Lattice::refine`]: a marked vertex is on the hypotenuse of triangles that exist, on both
/// sides, so that there is no vertex in the middle of an unsplit side (a T-junction).
pub(crate) struct Lattice {
    cells: u32,
    levels: u32,
    side: u32,
    marked: Vec<bool>,
}

impl Lattice {
    pub(crate) fn new(cells: u32, levels: u32) -> Self {
        let side = cells << levels;
        Self {
            cells,
            levels,
            side,
            marked: vec![false; (side as usize + 1).pow(2)],
        }
    }

    /// Quarters squares for which `asks(centre, side)` is true, and the border down to the finest
    /// level.
    pub(crate) fn refine(&mut self, mut asks: impl FnMut(Vertex, u32) -> bool) {
        let size = 1 << self.levels;
        for y in 0..self.cells {
            for x in 0..self.cells {
                self.quarter(x * size, y * size, size, &mut asks);
            }
        }
        for i in 0..=self.side {
            for (x, y) in [(i, 0), (i, self.side), (0, i), (self.side, i)] {
                self.mark(x, y);
            }
        }
        self.close();
    }

    fn quarter(&mut self, x: u32, y: u32, size: u32, asks: &mut impl FnMut(Vertex, u32) -> bool) {
        let h = size / 2;
        let centre = Vertex { x: x + h, y: y + h };
        if h == 0 || !asks(centre, size) {
            return;
        }
        for (dx, dy) in [(h, h), (h, 0), (0, h), (h, size), (size, h)] {
            self.mark(x + dx, y + dy);
        }
        for (dx, dy) in [(0, 0), (h, 0), (0, h), (h, h)] {
            self.quarter(x + dx, y + dy, h, asks);
        }
    }

    /// Marks the vertices that marked vertices depend on, from fine to coarse.
    fn close(&mut self) {
        for level in 1..=self.levels {
            let size = 1_u32 << level;
            let h = size / 2;
            // A middle of a side needs the centres of the squares on both sides.
            for y in (0..=self.side).step_by(h as usize) {
                let odd_row = (y / h) % 2 == 1;
                let start = if odd_row { 0 } else { h };
                for x in (start..=self.side).step_by(size as usize) {
                    if !self.is_marked(x, y) {
                        continue;
                    }
                    let (dx, dy) = if odd_row { (h, 0) } else { (0, h) };
                    if x >= dx && y >= dy {
                        self.mark(x - dx, y - dy);
                    }
                    if x + dx <= self.side && y + dy <= self.side {
                        self.mark(x + dx, y + dy);
                    }
                }
            }
            // A centre needs the two corners that are off the hypotenuse.
            for y in (h..self.side).step_by(size as usize) {
                for x in (h..self.side).step_by(size as usize) {
                    if self.is_marked(x, y) {
                        for (cx, cy) in apexes(x - h, y - h, size) {
                            self.mark(cx, cy);
                        }
                    }
                }
            }
        }
    }

    /// Every triangle, counter-clockwise.
    pub(crate) fn triangles(&self, mut emit: impl FnMut([Vertex; 3])) {
        let size = 1 << self.levels;
        for y in (0..self.side).step_by(size as usize) {
            for x in (0..self.side).step_by(size as usize) {
                for (ax, ay) in apexes(x, y, size) {
                    // The corners, counter-clockwise from the apex.
                    let corner = |dx: u32, dy: u32| Vertex {
                        x: x + dx,
                        y: y + dy,
                    };
                    let (b, c) = match (ax == x, ay == y) {
                        (true, true) => (corner(size, 0), corner(0, size)),
                        (false, true) => (corner(size, size), corner(0, 0)),
                        (false, false) => (corner(0, size), corner(size, 0)),
                        (true, false) => (corner(0, 0), corner(size, size)),
                    };
                    self.split(Vertex { x: ax, y: ay }, b, c, &mut emit);
                }
            }
        }
    }

    /// A triangle with its right angle at `a`, halved as often as its vertices are marked.
    fn split(&self, a: Vertex, b: Vertex, c: Vertex, emit: &mut impl FnMut([Vertex; 3])) {
        let (x, y) = (b.x + c.x, b.y + c.y);
        if x % 2 == 0 && y % 2 == 0 && self.is_marked(x / 2, y / 2) {
            let middle = Vertex { x: x / 2, y: y / 2 };
            self.split(middle, a, b, emit);
            self.split(middle, c, a, emit);
        } else {
            emit([a, b, c]);
        }
    }

    fn index(&self, x: u32, y: u32) -> usize {
        y as usize * (self.side as usize + 1) + x as usize
    }

    fn mark(&mut self, x: u32, y: u32) {
        let index = self.index(x, y);
        self.marked[index] = true;
    }

    fn is_marked(&self, x: u32, y: u32) -> bool {
        self.marked[self.index(x, y)]
    }
}

/// The two corners of a square that are not on its hypotenuse: those whose sum of coordinates is
/// odd, so that diagonals alternate and meet in the middles of larger squares.
fn apexes(x: u32, y: u32, size: u32) -> [(u32, u32); 2] {
    if (x / size + y / size).is_multiple_of(2) {
        [(x + size, y), (x, y + size)]
    } else {
        [(x, y), (x + size, y + size)]
    }
}
