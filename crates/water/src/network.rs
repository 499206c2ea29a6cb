//! Streams that join: what all springs above bring to a place.

use std::collections::BTreeMap;
use std::sync::Arc;

use nemoral_seed::{Domain, Draw};

use crate::channel::CrossSection;
use crate::course::{Place, course, lengths_m};
use crate::lattice::Node;
use crate::pond::Pond;
use crate::stream::{Finder, Stream};

const BANKS: Domain = Domain::new("water.banks");

/// The way before a node on which the water falls to the level there, metres.
const FALL_M: f64 = 6.0;
/// Water is a pond's where it is so far inside of its edge, metres.
const IN_POND_M: f64 = -0.2;
/// The width of a stream is that of its params where this length of streams is above, metres.
const OF_WIDTH_M: f64 = 100.0;
/// The narrowest and the widest, in widths of the params.
const WIDTHS: [f64; 2] = [0.35, 1.7];
/// How wide it is at a node, and how much wider between two, relative to its mean width.
const WIDE: [f64; 2] = [0.75, 1.25];
const WIDE_BETWEEN: [f64; 2] = [-0.2, 0.35];
/// Depth of the water over half its mean width, and the least depth, metres.
const DEPTH: f64 = 0.3;
const LEAST_DEPTH_M: f64 = 0.09;
/// How steep banks are, at the least and at most.
const BANKS_RISE: [f64; 2] = [0.8, 1.4];

/// A reach of a stream: all water that runs from one node to the next.
#[derive(Clone, Debug)]
pub(crate) struct StreamReach {
    /// Whether nothing comes from above.
    pub(crate) is_spring: bool,
    /// The pond that it ends in.
    pub(crate) pond: Option<Arc<Pond>>,
    pub(crate) sections: Vec<CrossSection>,
}

/// What is known of a reach before those below it are.
struct Draft {
    to: Node,
    /// The hollow that all water of this reach comes to.
    hollow: Node,
    levels_m: Vec<f64>,
    places: Vec<Place>,
}

/// The reaches of streams that come near enough. For a place of which *all* streams through it are
/// given, they are what the whole world's streams would make.
pub(crate) fn reaches(
    finder: &Finder<'_>,
    streams: &[Arc<Stream>],
    ponds: &BTreeMap<Node, Arc<Pond>>,
) -> Vec<StreamReach> {
    let mut drafts: BTreeMap<Node, Draft> = BTreeMap::new();
    for stream in streams {
        let hollow = stream.nodes[stream.nodes.len() - 1];
        for (pair, levels) in stream.nodes.windows(2).zip(&stream.levels_m) {
            drafts
                .entry(pair[0])
                .and_modify(|draft| {
                    for (least, level) in draft.levels_m.iter_mut().zip(levels) {
                        *least = least.min(*level);
                    }
                })
                .or_insert_with(|| Draft {
                    to: pair[1],
                    hollow,
                    levels_m: levels.clone(),
                    places: course(finder.lattice, pair[0], pair[1]),
                });
        }
    }
    let mut above = Above::new(&drafts);
    let reach = |(&from, draft): (&Node, &Draft)| {
        let pond = ponds.get(&draft.hollow).cloned();
        let along_m = lengths_m(&draft.places);
        // All water of the next reach comes to the same pond.
        let next_m = drafts.get(&draft.to).map(|next| {
            let along_m = lengths_m(&next.places);
            next.levels_m(&along_m, pond.as_deref(), None)[0]
        });
        let levels_m = draft.levels_m(&along_m, pond.as_deref(), next_m);
        // The rise of the banks and the width at a node, and how much wider the reach between is.
        let shape = |node: Node| {
            let mut rng = finder.key.domain(BANKS).chunk(node).rng();
            let rise = rng.range_f64(BANKS_RISE[0], BANKS_RISE[1]);
            let wide = rng.range_f64(WIDE[0], WIDE[1]);
            (rise, wide, rng.range_f64(WIDE_BETWEEN[0], WIDE_BETWEEN[1]))
        };
        let ((rise_here, wide_here, between), (rise_there, wide_there, _)) =
            (shape(from), shape(draft.to));
        let before_m = above.length_m(from);
        let total_m = along_m[along_m.len() - 1];
        let sections = draft.places.iter().zip(&levels_m).zip(&along_m);
        let sections = sections.map(|((place, &level_m), &along)| {
            let mean_m = half_width_m(finder.params.stream_width_m, before_m + along);
            let t = along / total_m;
            let bulge = between * 4.0 * t * (1.0 - t);
            let half_m = mean_m * (wide_here + t * (wide_there - wide_here) + bulge);
            CrossSection {
                middle_m: place.middle_m,
                along: place.along,
                level_m,
                half_m,
                depth_m: (DEPTH * mean_m).max(LEAST_DEPTH_M),
                bank: rise_here + t * (rise_there - rise_here),
            }
        });
        StreamReach {
            is_spring: before_m == 0.0,
            sections: sections.collect(),
            pond,
        }
    };
    drafts.iter().map(reach).collect()
}

impl Draft {
    /// The levels of a reach: those that the ground allows, no lower than the pond below, falling
    /// in time to that pond, or to `next_m`, where other water has cut the next reach deeper. Where
    /// the pond comes soon, the fall begins in the reach before: the first level is the same
    /// whatever `next_m` is, so that the reach before can fall to it.
    fn levels_m(&self, along_m: &[f64], pond: Option<&Pond>, next_m: Option<f64>) -> Vec<f64> {
        let least_m = pond.map_or(f64::NEG_INFINITY, |pond| pond.level_m);
        let mut levels_m: Vec<f64> = self.levels_m.iter().map(|l| l.max(least_m)).collect();
        let last = levels_m.len() - 1;
        let is_in_pond = |place: &Place| pond.is_some_and(|p| p.edge_m(place.middle_m) < IN_POND_M);
        let (end, goal_m, fall_m) = match self.places.iter().position(is_in_pond) {
            Some(end) => (end, least_m, FALL_M),
            None => (
                last,
                next_m.map_or(levels_m[last], |next| next.max(least_m)),
                FALL_M.min(0.8 * along_m[last]),
            ),
        };
        let drop_m = levels_m[end] - goal_m;
        for i in 0..=last {
            if i >= end {
                levels_m[i] = goal_m;
            } else {
                let t = ((along_m[i] - (along_m[end] - fall_m)) / fall_m).clamp(0.0, 1.0);
                levels_m[i] -= drop_m * t * t * (3.0 - 2.0 * t);
            }
        }
        levels_m
    }
}

/// The length of all reaches above each node, metres. Sums are in the order of nodes, whichever
/// streams were found first.
struct Above<'a> {
    drafts: &'a BTreeMap<Node, Draft>,
    /// The reaches that come to each node.
    coming: BTreeMap<Node, Vec<Node>>,
    known: BTreeMap<Node, f64>,
}

impl<'a> Above<'a> {
    fn new(drafts: &'a BTreeMap<Node, Draft>) -> Self {
        let mut coming: BTreeMap<Node, Vec<Node>> = BTreeMap::new();
        for (&from, draft) in drafts {
            coming.entry(draft.to).or_default().push(from);
        }
        Self {
            drafts,
            coming,
            known: BTreeMap::new(),
        }
    }

    fn length_m(&mut self, node: Node) -> f64 {
        if let Some(length) = self.known.get(&node) {
            return *length;
        }
        let coming = self.coming.get(&node).cloned().unwrap_or_default();
        let mut sum = 0.0;
        for from in coming {
            let own = lengths_m(&self.drafts[&from].places);
            sum += self.length_m(from) + own[own.len() - 1];
        }
        self.known.insert(node, sum);
        sum
    }
}

/// Half the width of the water where this length of streams is above.
fn half_width_m(width_m: f64, above_m: f64) -> f64 {
    let share = (above_m / OF_WIDTH_M).sqrt();
    0.5 * width_m * share.clamp(WIDTHS[0], WIDTHS[1])
}
