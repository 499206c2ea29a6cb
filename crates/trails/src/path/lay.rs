//! How the run of a trail is laid: its heights, widths and all else that varies along it.

use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::Surface;
use nemoral_seed::{Domain, Key};

use super::{Knot, KnotAttributes, STEP_M, TrailPath};
use crate::WayKind;
use crate::bends::Bends;
use crate::curve::smoothstep;
use crate::grading::{formation, smooth};
use crate::layout::Course;
use crate::surface_kinds::{SurfaceKinds, rut_factor};
use crate::value_noise::ValueNoise1d;

const RUTS: Domain = Domain::new("trails.ruts");
const KINDS: Domain = Domain::new("trails.kinds");
const WIDTH: Domain = Domain::new("trails.width");
const GROWTH: Domain = Domain::new("trails.growth");

/// Trails narrow and fade over this length at their free ends, metres.
const TAPER_M: f64 = 10.0;

/// Width at the very free ends, relative to the usual one.
const END_WIDTH: f64 = 0.3;

/// A path that is wider than this somewhere is nowhere narrower, so that a mesh has all of it,
/// metres.
const NARROWEST_M: f64 = 0.4;

/// The wavelength with which the width varies, metres.
const WIDTH_WAVE_M: f64 = 7.0;

/// The wavelength with which grass is thick or missing on a way that changes, metres.
const GROWTH_WAVE_M: f64 = 15.0;

/// Standard deviation of the last smoothing of heights and of depths, metres.
const ROUNDING_M: f64 = 3.0;

impl TrailPath {
    /// Lays a trail over the ground.
    pub(crate) fn new(
        (number, way): (usize, Arc<WayKind>),
        world: Key,
        course: Course,
        base: &dyn Surface,
    ) -> Self {
        let Course {
            id,
            points,
            transits,
            free,
        } = course;
        let places: Vec<f64> = points.iter().map(|p| p.2).collect();
        let length = places[places.len() - 1];
        let kinds = SurfaceKinds::draw(&way, id.key(world.domain(KINDS)), length);

        let ground: Vec<_> = points.iter().map(|p| base.sample(p.0)).collect();
        let section = &way.section;
        let low_pass = |values: Vec<f64>| smooth(&values, section.smoothing_m / STEP_M);
        let heights = low_pass(ground.iter().map(|g| g.height_m).collect());
        let limits = (section.max_grade, section.earth_m);
        let heights = formation(&heights, &places, limits, ROUNDING_M / STEP_M);
        let sides = (ground.iter().zip(&points)).map(|(g, p)| g.gradient.dot(p.1.perp()));
        let tilts = low_pass(sides.clone().map(|side| section.tilt(side)).collect());
        let sides = match section.ditch {
            Some(_) => low_pass(sides.collect()),
            None => vec![0.0; points.len()],
        };

        let key = id.key(world.domain(RUTS));
        let depth = ValueNoise1d::new(key.item(0), length, 9.0);
        let wander = ValueNoise1d::new(key.item(1), length, 12.0);
        let fade = |s: f64| fade(s, length, free);
        let widths = Widths::new(&way, id.key(world.domain(WIDTH)), (length, free));
        let ruts = places
            .iter()
            .map(|&s| fade(s) * rut_factor(kinds.at(s)) * (1.0 + 0.6 * depth.at(s)));
        let ruts = smooth(&ruts.collect::<Vec<_>>(), ROUNDING_M / STEP_M);

        let last = points.len() - 1;
        let knots: Vec<Knot> = (0..=last)
            .map(|i| {
                let (position, tangent, arc) = points[i];
                let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
                let grade = (heights[b] - heights[a]) / (places[b] - places[a]);
                Knot {
                    position,
                    tangent,
                    arc,
                    height: heights[i],
                    grade,
                    attributes: KnotAttributes {
                        half_width: widths.half_m(&way, arc),
                        tilt: tilts[i],
                        rut: ruts[i].max(0.0),
                        wander: 0.1 * wander.at(arc),
                        sink: fade(arc) * section.sink_m(grade),
                        ditches: section.ditches(sides[i]).map(|share| fade(arc) * share),
                    },
                }
            })
            .collect();
        let key = id.key(world.domain(GROWTH));
        let growth = (way.change > 0.0)
            .then(|| [0, 1].map(|i| ValueNoise1d::new(key.item(i), length, GROWTH_WAVE_M)));
        Self {
            id,
            way,
            number,
            bends: Bends::new(&knots),
            knots,
            transits,
            free,
            kinds,
            growth,
            stones: Vec::new(),
        }
    }

    /// The same trail on the map only: all heights are 0, and it has no stones. That takes a small
    /// part of the work.
    pub(crate) fn outline(
        (number, way): (usize, Arc<WayKind>),
        world: Key,
        course: Course,
    ) -> Self {
        let Course {
            id,
            points,
            transits,
            free,
        } = course;
        let length = points[points.len() - 1].2;
        let widths = Widths::new(&way, id.key(world.domain(WIDTH)), (length, free));
        let knot = |(position, tangent, arc): (DVec2, DVec2, f64)| Knot {
            position,
            tangent,
            arc,
            height: 0.0,
            grade: 0.0,
            attributes: KnotAttributes {
                half_width: widths.half_m(&way, arc),
                tilt: 0.0,
                rut: 0.0,
                wander: 0.0,
                sink: 0.0,
                ditches: [0.0; 2],
            },
        };
        let knots: Vec<Knot> = points.into_iter().map(knot).collect();
        Self {
            id,
            way,
            number,
            bends: Bends::new(&knots),
            knots,
            transits,
            free,
            kinds: SurfaceKinds::default(),
            growth: None,
            stones: Vec::new(),
        }
    }
}

/// The share of its full width and depth that a trail of this length has at an arc length, 0..1:
/// less than 1 near those of its ends that are free.
fn fade(s_m: f64, length_m: f64, free: [bool; 2]) -> f64 {
    let taper = TAPER_M.min(length_m / 3.0);
    let to_end_m = match free {
        [true, true] => s_m.min(length_m - s_m),
        [true, false] => s_m,
        [false, true] => length_m - s_m,
        [false, false] => return 1.0,
    };
    smoothstep(to_end_m / taper)
}

/// The widths along a trail.
struct Widths {
    length_m: f64,
    free: [bool; 2],
    variation: Option<ValueNoise1d>,
}

impl Widths {
    fn new(way: &WayKind, key: Key, (length_m, free): (f64, [bool; 2])) -> Self {
        let varied = way.width_variation > 0.0;
        Self {
            length_m,
            free,
            variation: varied.then(|| ValueNoise1d::new(key, length_m, WIDTH_WAVE_M)),
        }
    }

    /// Half the width at an arc length, metres.
    fn half_m(&self, way: &WayKind, s_m: f64) -> f64 {
        let fade = fade(s_m, self.length_m, self.free);
        let noise = self.variation.as_ref().map_or(0.0, |v| v.at(s_m));
        let width = way.width_m
            * (1.0 + way.width_variation * noise)
            * (END_WIDTH + (1.0 - END_WIDTH) * fade);
        0.5 * width.max(NARROWEST_M.min(way.width_m))
    }
}
