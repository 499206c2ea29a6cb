//! Which ways are one piece of earthwork, and how far it reaches.

use std::ops::Range;
use std::sync::Arc;

use crate::{CrossSection, WayKind};

/// The distance from edges within which the ground has shapes as small as ruts, metres.
const FINE_M: f64 = 1.0;

/// Beyond this distance from its edge a trail does not change the ground, metres.
pub(crate) const REACH_M: f64 = 12.0;

/// A run of ways that are one piece of earthwork.
#[derive(Debug)]
pub(crate) struct Earthwork {
    /// The numbers of the ways.
    pub(crate) numbers: Range<usize>,
    pub(crate) section: CrossSection,
    pub(crate) width_m: f64,
    pub(crate) has_ditch: bool,
}

/// The pieces of earthwork of a world, and what they have in common.
#[derive(Debug)]
pub(crate) struct Earthworks {
    pub(crate) all: Vec<Earthwork>,
    /// The distance from a chunk within which trails must be known to carve its ground.
    pub(crate) reach_m: f64,
    /// The distance from edges within which the ground has shapes as small as ruts or ditches.
    pub(crate) fine_m: f64,
    /// Whether materials end raggedly, where they change and where kinds of way meet.
    pub(crate) ragged: bool,
}

impl Earthworks {
    /// The earthworks of ways, as far as they are used.
    pub(crate) fn new(ways: &[Arc<WayKind>], used: &[bool]) -> Self {
        let mut all: Vec<Earthwork> = Vec::new();
        let (mut width_m, mut ditch_m, mut ragged) = (0.0_f64, 0.0_f64, false);
        let ways_in_use = (ways.iter().enumerate()).filter(|(number, _)| used[*number]);
        for (number, way) in ways_in_use {
            let ditch = way.section.ditch;
            match all.last_mut() {
                Some(last) if ways[last.numbers.start].joins(way) => {
                    last.numbers.end = number + 1;
                    last.width_m = last.width_m.max(way.widest_m());
                    last.has_ditch |= ditch.is_some();
                }
                _ => all.push(Earthwork {
                    numbers: number..number + 1,
                    section: way.section.clone(),
                    width_m: way.widest_m(),
                    has_ditch: ditch.is_some(),
                }),
            }
            width_m = width_m.max(way.widest_m());
            ditch_m = ditch_m.max(ditch.map_or(0.0, |d| d.width_m));
            ragged |= way.change > 0.0;
        }
        Self {
            all,
            reach_m: reach_m(width_m),
            fine_m: FINE_M.max(ditch_m + 0.3),
            ragged,
        }
    }
}

/// The distance from its middle within which a way of this width is looked for.
pub(crate) fn reach_m(width_m: f64) -> f64 {
    // There is a knot at every metre, so the nearest one is less than a metre farther than the
    // trail.
    REACH_M + 0.5 * width_m + 1.0
}
