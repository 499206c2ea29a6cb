//! Where water flows: a lattice of smoothed heights, and from each node the next one.

use std::cell::RefCell;
use std::collections::HashMap;

use glam::DVec2;
use nemoral_scene::Surface;
use nemoral_seed::{Domain, Draw, Key};

/// A node of the lattice, by its global indices.
pub(crate) type Node = [i32; 2];

/// Distance between nodes, metres.
pub(crate) const SPACING_M: f64 = 8.0;

/// How far nodes are off the lattice, in spacings, so that no course follows its directions.
const JITTER: f64 = 0.32;

/// The least fall that counts, metres per metre. Everything flatter is a hollow.
const LEAST_FALL: f64 = 2e-4;

/// Water leaves a hollow to a lower node that is this near, in spacings …
const BREACH: i32 = 3;
/// … if the ground between is higher than the hollow by no more than this, metres.
const BARRIER_M: f64 = 0.7;

const JITTERED: Domain = Domain::new("water.nodes");

/// Binomial weights of smoothing, whose standard deviation is one spacing.
const KERNEL: [f64; 5] = [1.0 / 16.0, 4.0 / 16.0, 6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0];

/// The lattice of a terrain. Everything that it says is a pure function of a node; it remembers
/// what it computed.
pub(crate) struct Lattice<'a> {
    base: &'a dyn Surface,
    key: Key,
    heights: RefCell<HashMap<Node, f64>>,
    smooth: RefCell<HashMap<Node, f64>>,
}

impl<'a> Lattice<'a> {
    pub(crate) fn new(base: &'a dyn Surface, key: Key) -> Self {
        Self {
            base,
            key: key.domain(JITTERED),
            heights: RefCell::default(),
            smooth: RefCell::default(),
        }
    }

    /// The node nearest to a place.
    pub(crate) fn nearest(world_m: DVec2) -> Node {
        let at = (world_m / SPACING_M).round();
        [at.x as i32, at.y as i32]
    }

    /// The place of a node on the lattice.
    pub(crate) fn corner_m([x, y]: Node) -> DVec2 {
        DVec2::new(f64::from(x), f64::from(y)) * SPACING_M
    }

    /// The place of a node: off the lattice by its key, but for hollows, where ponds are.
    pub(crate) fn position_m(&self, node: Node) -> DVec2 {
        if self.next(node).is_none() {
            return Self::corner_m(node);
        }
        let mut rng = self.key.chunk(node).rng();
        let off = DVec2::new(rng.range_f64(-1.0, 1.0), rng.range_f64(-1.0, 1.0));
        Self::corner_m(node) + off * (JITTER * SPACING_M)
    }

    fn height_m(&self, node: Node) -> f64 {
        if let Some(height) = self.heights.borrow().get(&node) {
            return *height;
        }
        let height = self.base.height_m(Self::corner_m(node));
        self.heights.borrow_mut().insert(node, height);
        height
    }

    /// The smoothed height at a node, metres.
    pub(crate) fn smooth_m(&self, node: Node) -> f64 {
        if let Some(height) = self.smooth.borrow().get(&node) {
            return *height;
        }
        let mut sum = 0.0;
        for (i, wx) in (-2..).zip(KERNEL) {
            for (j, wy) in (-2..).zip(KERNEL) {
                sum += wx * wy * self.height_m([node[0] + i, node[1] + j]);
            }
        }
        self.smooth.borrow_mut().insert(node, sum);
        sum
    }

    /// How much lower a node is than those around it, metres.
    pub(crate) fn hollow_m(&self, node: Node) -> f64 {
        let around = around(node, 2).map(|n| self.smooth_m(n)).sum::<f64>() / 8.0;
        around - self.smooth_m(node)
    }

    /// Where water flows from a node; `None` if it is a hollow that nothing leaves. The smoothed
    /// height falls from each node to the next, so there are no circles.
    pub(crate) fn next(&self, node: Node) -> Option<Node> {
        let here = self.smooth_m(node);
        let fall = |to: Node| {
            let way = Self::corner_m(to).distance(Self::corner_m(node));
            (here - self.smooth_m(to)) / way
        };
        let steepest = around(node, 1)
            .map(|to| (to, fall(to)))
            .filter(|(_, fall)| *fall > LEAST_FALL)
            .reduce(|a, b| if b.1 > a.1 { b } else { a });
        if let Some((to, _)) = steepest {
            return Some(to);
        }
        self.breach(node)
    }

    /// The lower node to which the water of a hollow breaks through, over the lowest barrier.
    fn breach(&self, node: Node) -> Option<Node> {
        let here = self.smooth_m(node);
        let mut best: Option<(f64, Node)> = None;
        for x in -BREACH..=BREACH {
            for y in -BREACH..=BREACH {
                let to = [node[0] + x, node[1] + y];
                let way = Self::corner_m(to).distance(Self::corner_m(node));
                if way == 0.0 || (here - self.smooth_m(to)) / way <= LEAST_FALL {
                    continue;
                }
                let steps = 2 * x.abs().max(y.abs());
                let barrier = (1..steps)
                    .map(|i| {
                        let t = f64::from(i) / f64::from(steps);
                        self.between_m(node, to, t) - here
                    })
                    .fold(0.0, f64::max);
                let cost = barrier + 0.004 * way;
                if barrier <= BARRIER_M && best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, to));
                }
            }
        }
        best.map(|(_, to)| to)
    }

    /// The smoothed height between two nodes, bilinear in the lattice.
    fn between_m(&self, from: Node, to: Node, t: f64) -> f64 {
        let at = |i: usize| f64::from(from[i]) + t * f64::from(to[i] - from[i]);
        let (x, y) = (at(0), at(1));
        let (i, j) = (x.floor(), y.floor());
        let (u, v) = (x - i, y - j);
        let (i, j) = (i as i32, j as i32);
        let row = |j: i32| {
            let left = self.smooth_m([i, j]);
            if u == 0.0 {
                left
            } else {
                left + u * (self.smooth_m([i + 1, j]) - left)
            }
        };
        let low = row(j);
        if v == 0.0 {
            low
        } else {
            low + v * (row(j + 1) - low)
        }
    }
}

/// The eight nodes around one, so many spacings away.
fn around([x, y]: Node, far: i32) -> impl Iterator<Item = Node> {
    const WAYS: [[i32; 2]; 8] = [
        [1, 0],
        [1, 1],
        [0, 1],
        [-1, 1],
        [-1, 0],
        [-1, -1],
        [0, -1],
        [1, -1],
    ];
    WAYS.into_iter()
        .map(move |[i, j]| [x + far * i, y + far * j])
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::{FlatSurface, SurfaceSample};

    /// Hills and hollows 90 m across.
    struct Waves;

    impl Surface for Waves {
        fn sample(&self, p: DVec2) -> SurfaceSample {
            let k = std::f64::consts::TAU / 90.0;
            SurfaceSample {
                height_m: 3.0 * libm::sin(k * p.x) * libm::sin(k * p.y),
                gradient: DVec2::ZERO,
            }
        }
    }

    #[test]
    fn water_falls_to_a_hollow_and_stays() {
        let lattice = Lattice::new(&Waves, Key::world(1));
        for x in -20..20 {
            for y in -20..20 {
                let (mut node, mut steps) = ([x, y], 0);
                while let Some(next) = lattice.next(node) {
                    assert!(lattice.smooth_m(next) < lattice.smooth_m(node));
                    (node, steps) = (next, steps + 1);
                    assert!(steps < 60);
                }
                let depth = lattice.smooth_m(node);
                // A binomial of two spacings leaves most of the waves' height.
                assert!(depth < -1.5, "{depth}");
            }
        }
    }

    #[test]
    fn a_plain_is_all_hollows_and_a_slope_has_none() {
        let plain = FlatSurface::default();
        assert_eq!(Lattice::new(&plain, Key::world(1)).next([3, 4]), None);
        let slope = FlatSurface {
            height_m: 0.0,
            gradient: DVec2::new(0.1, 0.0),
        };
        let lattice = Lattice::new(&slope, Key::world(1));
        assert_eq!(lattice.next([3, 4]), Some([2, 4]));
    }
}
