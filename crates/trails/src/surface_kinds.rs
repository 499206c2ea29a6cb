//! The kinds of surface along a trail, and the depth of ruts in them.

use nemoral_seed::{Draw, Key};

use crate::value_noise::ValueNoise1d;
use crate::{TrailSurfaceKind, WayKind};

/// The wavelength of the noise by which kinds change, metres.
const CHANGE_WAVE_M: f64 = 24.0;

/// The step in which that noise is looked at, metres.
const CHANGE_STEP_M: f64 = 0.5;

/// The stretches of a trail with one kind of surface each; none by default.
#[derive(Clone, Debug, Default)]
pub(crate) struct SurfaceKinds {
    /// The arc length in metres at which a stretch begins, and its kind; the first begins at 0.
    stretches: Vec<(f64, TrailSurfaceKind)>,
}

impl SurfaceKinds {
    /// Draws the kinds of a trail: a main kind and others, as the way says.
    pub(crate) fn draw(way: &WayKind, key: Key, length_m: f64) -> Self {
        let weights = &way.surfaces;
        if let Some(kind) = only(weights) {
            return Self {
                stretches: vec![(0.0, kind)],
            };
        }
        let mut rng = key.rng();
        let own = draw_kind(weights, &mut rng);
        if way.change > 0.0 {
            return Self::changing(way, own, key, length_m);
        }
        let mut stretches = vec![(0.0, own)];
        let mut s = rng.range_f64(60.0, 180.0);
        while s < length_m {
            // Two thirds of the stretches have the main kind.
            let kind = if rng.chance(2.0 / 3.0) {
                own
            } else {
                draw_kind(weights, &mut rng)
            };
            stretches.push((s, kind));
            s += rng.range_f64(60.0, 180.0);
        }
        Self { stretches }
    }

    /// Kinds that come and go with smooth noise: where that of another kind is above a threshold,
    /// the surface is of the kind with the greatest noise.
    fn changing(way: &WayKind, own: TrailSurfaceKind, key: Key, length_m: f64) -> Self {
        let most = way.surfaces.iter().fold(0.0_f64, |a, &b| a.max(b));
        let others: Vec<_> = (TrailSurfaceKind::ALL.into_iter().zip(way.surfaces))
            .enumerate()
            .filter(|(_, (kind, weight))| *kind != own && *weight > 0.0)
            .map(|(i, (kind, weight))| {
                let noise = ValueNoise1d::new(key.item(i as u64), length_m, CHANGE_WAVE_M);
                // A rare kind has a higher threshold.
                let threshold = 1.0 - way.change * (0.4 + 0.6 * libm::sqrt(weight / most));
                (kind, noise, threshold)
            })
            .collect();
        let at = |s: f64| {
            let mut best = (0.0, own);
            for (kind, noise, threshold) in &others {
                let above = noise.at(s) - threshold;
                if above > best.0 {
                    best = (above, *kind);
                }
            }
            best.1
        };
        let mut stretches = vec![(0.0, at(0.0))];
        for i in 1..(length_m / CHANGE_STEP_M) as usize {
            let s = CHANGE_STEP_M * i as f64;
            let kind = at(s);
            if stretches[stretches.len() - 1].1 != kind {
                stretches.push((s, kind));
            }
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

fn draw_kind(
    weights: &[f64; TrailSurfaceKind::ALL.len()],
    rng: &mut impl Draw,
) -> TrailSurfaceKind {
    TrailSurfaceKind::ALL[rng.weighted(weights).unwrap_or(0)]
}

/// The only kind with a weight, if it is one.
fn only(weights: &[f64; TrailSurfaceKind::ALL.len()]) -> Option<TrailSurfaceKind> {
    let mut all = (TrailSurfaceKind::ALL.into_iter().zip(weights)).filter(|k| *k.1 > 0.0);
    let (first, _) = all.next()?;
    all.next().is_none().then_some(first)
}
