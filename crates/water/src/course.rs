//! The course of water from one node to the next: a smooth curve, sampled.

use glam::DVec2;

use crate::lattice::{Lattice, Node};

/// The greatest distance between samples along a course, metres.
const STEP_M: f64 = 0.8;

/// Length of the tangents of a course, in lengths of its chord.
const TANGENT: f64 = 0.85;

/// A place of a course.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    pub(crate) middle_m: DVec2,
    /// Unit vector downstream.
    pub(crate) along: DVec2,
}

/// The course from a node to the one after it. It leaves every node in the direction of the next
/// one, whatever comes from above, so that all waters that meet at a node go on as one.
pub(crate) fn course(lattice: &Lattice<'_>, from: Node, to: Node) -> Vec<Place> {
    let (a, b) = (lattice.position_m(from), lattice.position_m(to));
    let chord = b - a;
    let length = chord.length();
    let onwards = lattice
        .next(to)
        .map_or(chord, |next| lattice.position_m(next) - b);
    let out = chord * TANGENT;
    let on = onwards.normalize_or(chord / length) * (length * TANGENT);
    // A curve is at most so much longer than its chord.
    let steps = (1.25 * length / STEP_M).ceil().max(2.0) as u32;
    let place = |i: u32| {
        let t = f64::from(i) / f64::from(steps);
        let (t2, t3) = (t * t, t * t * t);
        let middle_m = a * (2.0 * t3 - 3.0 * t2 + 1.0)
            + out * (t3 - 2.0 * t2 + t)
            + b * (3.0 * t2 - 2.0 * t3)
            + on * (t3 - t2);
        let speed = a * (6.0 * t2 - 6.0 * t)
            + out * (3.0 * t2 - 4.0 * t + 1.0)
            + b * (6.0 * t - 6.0 * t2)
            + on * (3.0 * t2 - 2.0 * t);
        Place {
            middle_m,
            along: speed.normalize_or(chord / length),
        }
    };
    (0..=steps).map(place).collect()
}

/// The lengths from the start of a course to each of its places, metres.
pub(crate) fn lengths_m(course: &[Place]) -> Vec<f64> {
    let mut lengths = Vec::with_capacity(course.len());
    let mut sum = 0.0;
    for (i, place) in course.iter().enumerate() {
        if i > 0 {
            sum += place.middle_m.distance(course[i - 1].middle_m);
        }
        lengths.push(sum);
    }
    lengths
}
