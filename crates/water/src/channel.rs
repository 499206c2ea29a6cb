//! The channel of a stream: its section, and how it changes the ground.

use glam::DVec2;
use nemoral_scene::Dual;

use crate::pond::without_bound;

/// The rim that is guaranteed beside the water, metres above it …
const RIM_M: f64 = 0.13;
/// … up to this distance from its edge, metres.
const RIM_WIDTH_M: f64 = 0.45;
/// Fall of the ground that is filled, beyond the rim.
const FILL: f64 = 0.5;
/// A channel changes the ground within this distance from where its banks become straight, metres.
const BANK_M: f64 = 6.5;

/// The greatest distance at which any channel changes the ground, metres.
pub(crate) const CHANNEL_REACH_M: f64 = BANK_M + 6.0;

/// A cross-section of a stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossSection {
    /// Its middle on the map, metres.
    pub middle_m: DVec2,
    /// Unit vector downstream.
    pub along: DVec2,
    /// The level of the water, metres above the world's zero.
    pub level_m: f64,
    /// Half the width of the water, metres.
    pub half_m: f64,
    /// The greatest depth of the water, metres.
    pub depth_m: f64,
    /// Rise of the banks, metres per metre.
    pub bank: f64,
}

/// A straight piece of a channel, between two sections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Segment {
    pub(crate) ends: [CrossSection; 2],
}

impl CrossSection {
    /// Half the width of the bed up to where the banks are straight, metres.
    fn bed_half_m(&self) -> f64 {
        self.bank * self.half_m * self.half_m / (2.0 * self.depth_m)
    }

    /// How far from its middle it changes the ground, metres.
    pub(crate) fn reach_m(&self) -> f64 {
        self.bed_half_m().max(self.half_m + RIM_WIDTH_M) + BANK_M
    }

    /// Half the width of its surface, whose borders are in the banks, metres.
    pub(crate) fn surface_half_m(&self) -> f64 {
        self.half_m + (0.3 * self.half_m).max(0.2)
    }
}

/// The place of a point beside a segment.
struct Beside {
    /// Share of the way from the first end to the second.
    t: Dual,
    /// Distance from the middle line, metres.
    d: Dual,
}

impl Segment {
    fn beside(&self, p: DVec2) -> Beside {
        let [a, b] = self.ends.map(|e| e.middle_m);
        let chord = b - a;
        let length2 = chord.length_squared();
        let t = (p - a).dot(chord) / length2;
        let t = if (0.0..=1.0).contains(&t) {
            Dual::new(t, chord / length2)
        } else {
            Dual::constant(t.clamp(0.0, 1.0))
        };
        let off = p - (a + chord * t.value);
        let d = off.length();
        // The foot moves along the chord, across which the distance is measured.
        let gradient = if d > 1e-9 { off / d } else { DVec2::ZERO };
        Beside {
            t,
            d: Dual::new(d, gradient),
        }
    }

    /// Signed distance from the edge of the water, metres: negative in it.
    pub(crate) fn edge_m(&self, p: DVec2) -> f64 {
        let Beside { t, d } = self.beside(p);
        let [a, b] = self.ends;
        d.value - (a.half_m + t.value * (b.half_m - a.half_m))
    }

    /// The heights down to which the ground is cut, and up to which it is filled, at a place.
    pub(crate) fn cut_and_fill(&self, p: DVec2) -> Option<(Dual, Dual)> {
        let [a, b] = self.ends;
        let reach = a.reach_m().max(b.reach_m());
        let Beside { t, d } = self.beside(p);
        if d.value >= reach {
            return None;
        }
        let mix = |from: f64, to: f64| Dual::constant(from) + t.scale(to - from);
        let level = mix(a.level_m, b.level_m);
        let half = mix(a.half_m, b.half_m);
        let depth = mix(a.depth_m, b.depth_m);
        let bank = mix(a.bank, b.bank);
        // A parabola to where it is as steep as the bank, then the bank.
        let inverse = half.chain((1.0 / half.value, -1.0 / (half.value * half.value)));
        let depth_inverse = depth.chain((1.0 / depth.value, -1.0 / (depth.value * depth.value)));
        let straight = bank * half * half * depth_inverse.scale(0.5);
        let x = d - straight;
        let parabola = |d: Dual| {
            let share = d * inverse;
            depth * (share * share - Dual::constant(1.0))
        };
        let cut = if x.value <= 0.0 {
            parabola(d)
        } else if x.value >= BANK_M {
            Dual::constant(f64::INFINITY)
        } else {
            let rise = x.chain(without_bound((x.value, 1.0), (x.value, BANK_M)));
            parabola(straight) + bank * rise
        };
        let x = d - half - Dual::constant(RIM_WIDTH_M);
        let fill = if x.value <= 0.0 {
            Dual::constant(RIM_M)
        } else if x.value >= BANK_M {
            Dual::constant(f64::NEG_INFINITY)
        } else {
            // It starts level, and is straight after half a metre.
            let bend = 0.5;
            let (drop, slope) = if x.value < bend {
                (
                    FILL * x.value * x.value / (2.0 * bend),
                    FILL * x.value / bend,
                )
            } else {
                (FILL * (x.value - 0.5 * bend), FILL)
            };
            let (drop, slope) = without_bound((drop, slope), (x.value, BANK_M));
            x.chain((RIM_M - drop, -slope))
        };
        let add = |part: Dual| {
            if part.value.is_finite() {
                part + level
            } else {
                part
            }
        };
        Some((add(cut), add(fill)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn segment() -> Segment {
        let section = |x: f64, level_m: f64, half_m: f64| CrossSection {
            middle_m: DVec2::new(x, 0.2 * x),
            along: DVec2::X,
            level_m,
            half_m,
            depth_m: 0.3 * half_m,
            bank: 0.8 + 0.1 * x,
        };
        Segment {
            ends: [section(0.0, 5.0, 0.5), section(1.0, 4.9, 0.6)],
        }
    }

    proptest! {
        #[test]
        fn gradients_are_difference_quotients(x in -7.0_f64..8.0, y in -7.0_f64..7.0) {
            let s = segment();
            let e = 1e-6;
            let p = DVec2::new(x, y);
            let at = |p: DVec2| s.cut_and_fill(p);
            let (Some(here), Some(east), Some(west), Some(north), Some(south)) = (
                at(p),
                at(p + DVec2::X * e),
                at(p - DVec2::X * e),
                at(p + DVec2::Y * e),
                at(p - DVec2::Y * e),
            ) else {
                return Ok(());
            };
            let pairs = [
                (here.0, [east.0, west.0, north.0, south.0]),
                (here.1, [east.1, west.1, north.1, south.1]),
            ];
            for (here, [east, west, north, south]) in pairs {
                if !here.value.is_finite() || here.value.abs() > 1e3 {
                    continue;
                }
                let measured = DVec2::new(east.value - west.value, north.value - south.value)
                    / (2.0 * e);
                let scale = 1.0 + here.gradient.length();
                prop_assert!(
                    (here.gradient - measured).length() < 1e-3 * scale * scale,
                    "{} {}", here.gradient, measured
                );
            }
        }
    }

    #[test]
    fn the_bed_is_below_the_water_and_the_rim_above() {
        let s = segment();
        let middle = s.cut_and_fill(DVec2::new(0.5, 0.1)).expect("near");
        assert!(middle.0.value < 4.95 - 0.14, "{}", middle.0.value);
        let level = 4.95;
        let beside = s.cut_and_fill(DVec2::new(0.35, 0.85)).expect("near");
        assert!(beside.0.value > level + 0.1 && beside.1.value > level + 0.1);
        let edge = s.edge_m(DVec2::new(0.5, 0.1));
        assert!((edge + 0.55).abs() < 1e-9, "{edge}");
    }
}
