//! Single streams, from a spring to a hollow.

use glam::DVec2;
use nemoral_seed::{Domain, Draw, Key};

use crate::course::{Place, course};
use crate::lattice::{Lattice, Node, SPACING_M};
use crate::pond::Pond;
use crate::ways::GroundWithWays;
use crate::{REACH_M, WaterParams};

const SPRINGS: Domain = Domain::new("water.springs");
pub(crate) const PONDS: Domain = Domain::new("water.ponds");

/// Side of the cells of the plane of which each has one spring at most, metres.
pub(crate) const CELL_M: f64 = 96.0;

/// Places that are tried for a spring, of which the deepest hollow is taken.
const TRIED: u32 = 5;

/// Shorter streams are none, metres.
const SHORTEST_M: f64 = 35.0;

/// How far the water stays below the lowest ground beside it at a spring and farther down, metres.
const FREEBOARD_M: [f64; 2] = [0.14, 0.32];
/// The way from the one to the other, metres.
const DEEPENS_M: f64 = 18.0;

/// A stream whose bed would lie deeper than this below the ground is none, metres.
const DEEPEST_M: f64 = 2.6;

/// The distance from a way within which water goes under it, metres …
const UNDER_M: f64 = 1.2;
/// … and the longest way that it may go there: one that follows a way is none, metres.
const LONGEST_UNDER_M: f64 = 16.0;

/// A stream: its nodes from the spring to the hollow, and on each course between two of them the
/// level of its water by the ground alone, which falls all along.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Stream {
    pub(crate) nodes: Vec<Node>,
    pub(crate) levels_m: Vec<Vec<f64>>,
    /// The square around all of it.
    pub(crate) low_m: DVec2,
    pub(crate) high_m: DVec2,
}

/// What streams are found by.
pub(crate) struct Finder<'a> {
    pub(crate) params: &'a WaterParams,
    pub(crate) lattice: &'a Lattice<'a>,
    pub(crate) ways: &'a dyn GroundWithWays,
    pub(crate) key: Key,
}

impl Finder<'_> {
    /// The pond in a hollow, if there is room.
    pub(crate) fn pond(&self, hollow: Node) -> Option<Pond> {
        let key = self.key.domain(PONDS).chunk(hollow);
        let largest_m = self.params.pond_radius_m;
        Pond::dig(Lattice::corner_m(hollow), largest_m, self.ways, key)
    }

    /// The stream whose spring is in a cell, if there is one.
    pub(crate) fn stream(&self, cell: [i32; 2]) -> Option<Stream> {
        let mut rng = self.key.domain(SPRINGS).chunk(cell).rng();
        let mean = self.params.springs_per_km2 * CELL_M * CELL_M * 1e-6;
        if !rng.chance(mean.min(1.0)) {
            return None;
        }
        let corner = DVec2::new(f64::from(cell[0]), f64::from(cell[1])) * CELL_M;
        let spring = (0..TRIED)
            .map(|_| {
                let off = DVec2::new(rng.unit_f64(), rng.unit_f64()) * CELL_M;
                let node = Lattice::nearest(corner + off);
                (node, self.lattice.hollow_m(node))
            })
            .reduce(|a, b| if b.1 > a.1 { b } else { a })?
            .0;
        let nodes = self.descent(spring)?;
        self.pond(*nodes.last()?)?;
        self.levels(nodes)
    }

    /// The nodes from a spring to its hollow; `None` if that is too far or too near.
    fn descent(&self, spring: Node) -> Option<Vec<Node>> {
        let mut nodes = vec![spring];
        let mut node = spring;
        let reach = (REACH_M / SPACING_M) as i32 - 1;
        while let Some(next) = self.lattice.next(node) {
            let off = [next[0] - spring[0], next[1] - spring[1]];
            if off[0].abs().max(off[1].abs()) > reach {
                return None;
            }
            nodes.push(next);
            node = next;
        }
        let length: f64 = nodes
            .windows(2)
            .map(|w| Lattice::corner_m(w[0]).distance(Lattice::corner_m(w[1])))
            .sum();
        (length >= SHORTEST_M).then_some(nodes)
    }

    /// The levels along a stream: the lowest ground so far, less the freeboard.
    fn levels(&self, nodes: Vec<Node>) -> Option<Stream> {
        let (mut low_m, mut high_m) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (mut level, mut along_m, mut under_m) = (f64::INFINITY, 0.0, 0.0);
        let mut levels_m = Vec::with_capacity(nodes.len() - 1);
        let mut before: Option<DVec2> = None;
        for pair in nodes.windows(2) {
            let places = course(self.lattice, pair[0], pair[1]);
            let mut levels = Vec::with_capacity(places.len());
            for place in &places {
                let p = place.middle_m;
                let step = before.map_or(0.0, |q| q.distance(p));
                along_m += step;
                before = Some(p);
                (low_m, high_m) = (low_m.min(p), high_m.max(p));
                if self.ways.is_dry(p) {
                    return None;
                }
                under_m = if self.ways.edge_m(p) < UNDER_M {
                    under_m + step
                } else {
                    0.0
                };
                if under_m > LONGEST_UNDER_M {
                    return None;
                }
                let t = (along_m / DEEPENS_M).min(1.0);
                let freeboard = FREEBOARD_M[0] + t * (FREEBOARD_M[1] - FREEBOARD_M[0]);
                let lowest = self.lowest_across(place);
                level = level.min(lowest - freeboard);
                if lowest - level > DEEPEST_M {
                    return None;
                }
                levels.push(level);
            }
            levels_m.push(levels);
        }
        Some(Stream {
            nodes,
            levels_m,
            low_m,
            high_m,
        })
    }

    /// The lowest ground across a stream and beside it, metres.
    fn lowest_across(&self, place: &Place) -> f64 {
        let half_m = 0.6 * self.params.stream_width_m + 0.7;
        let left = place.along.perp();
        let offsets = [-1.0, -0.5, 0.0, 0.5, 1.0];
        let heights = offsets.map(|o| {
            let p = place.middle_m + left * (o * half_m);
            self.ways.ground(p).height_m
        });
        heights.into_iter().fold(f64::INFINITY, f64::min)
    }
}

impl Stream {
    /// Whether it may come nearer than `margin_m` to a square.
    pub(crate) fn is_near(&self, (low_m, high_m): (DVec2, DVec2), margin_m: f64) -> bool {
        self.low_m.cmple(high_m + margin_m).all() && self.high_m.cmpge(low_m - margin_m).all()
    }
}
