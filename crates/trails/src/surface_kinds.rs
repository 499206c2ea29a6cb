//! The kinds of surface along a trail, and the depth of ruts in them.

use nemoral_seed::{Draw, Key};

use crate::{TrailParams, TrailSurfaceKind};

/// The stretches of a trail with one kind of surface each; none by default.
#[derive(Clone, Debug, Default)]
pub(crate) struct SurfaceKinds {
    /// The arc length in metres at which a stretch begins, and its kind; the first begins at 0.
    stretches: Vec<(f64, TrailSurfaceKind)>,
}

impl SurfaceKinds {
    /// Draws the kinds of a trail: a main kind, which two thirds of the stretches of 60 to 180 m
    /// have, and others.
    pub(crate) fn draw(params: &TrailParams, key: Key, length_m: f64) -> Self {
        if let Some(kind) = params.surface {
            return Self {
                stretches: vec![(0.0, kind)],
            };
        }
        let mut rng = key.rng();
        let own = draw_kind(&mut rng);
        let mut stretches = vec![(0.0, own)];
        let mut s = rng.range_f64(60.0, 180.0);
        while s < length_m {
            let kind = if rng.chance(2.0 / 3.0) {
                own
            } else {
                draw_kind(&mut rng)
            };
            stretches.push((s, kind));
            s += rng.range_f64(60.0, 180.0);
        }
        Self { stretches }
    }

    /// The kind at an arc length in metres.
    pub(crate) fn at(&self, s_m: f64) -> TrailSurfaceKind {
        let after = self.stretches.partition_point(|k| k.0 <= s_m);
        self.stretches[after.max(1) - 1].1
    }
}

/// The depth of ruts in a kind of surface, relative to the mean.
pub(crate) fn rut_factor(kind: TrailSurfaceKind) -> f64 {
    match kind {
        TrailSurfaceKind::Mud => 2.5,
        TrailSurfaceKind::Sand => 1.4,
        TrailSurfaceKind::DryEarth | TrailSurfaceKind::Grassy => 1.0,
        TrailSurfaceKind::LeafLitter | TrailSurfaceKind::Needles => 0.8,
        TrailSurfaceKind::Gravel => 0.5,
        TrailSurfaceKind::Rock => 0.1,
    }
}

/// Draws a kind; common ones are drawn more often.
fn draw_kind(rng: &mut impl Draw) -> TrailSurfaceKind {
    const WEIGHTS: [f64; 8] = [0.2, 0.2, 0.13, 0.14, 0.13, 0.1, 0.05, 0.05];
    TrailSurfaceKind::ALL[rng.weighted(&WEIGHTS).unwrap_or(0)]
}
