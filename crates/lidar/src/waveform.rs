//! Where the light of hits that follow each other closely comes back as one peak, and where not.
//!
//! The pulse of each hit is a Gaussian as long as the receiver resolves. Their sum is sampled at
//! the hits, and half-way between those that are apart. Of two surfaces less than that length apart
//! it has one peak, and so it has of one surface that slants through any distance.

use std::ops::Range;

use crate::echo::SubRayHit;
use crate::exponential::exp;

/// A receiver tells two peaks apart if less than this share of the lower one comes back between
/// them.
const DIP: f64 = 0.8;

/// Between hits that are farther apart than this share of the resolution, the waveform is sampled
/// as well.
const MOST_GAP: f64 = 0.125;

/// Hits whose light comes back as one peak.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Peak {
    /// Their places in the list.
    pub(crate) hits: Range<usize>,
    /// The greatest power that comes back at once.
    pub(crate) power: f64,
}

/// The peaks of hits, which are sorted by range and not empty, nearest first.
pub(crate) fn peaks(hits: &[SubRayHit], resolution_m: f64) -> Vec<Peak> {
    let wave = Waveform::of(hits, resolution_m);
    let gap_m = |i: usize| hits[i + 1].range_m - hits[i].range_m;
    let mut peaks = Vec::new();
    let mut start = 0;
    // The greatest power since the last cut; and the least since then, with the hit before which it
    // would be cut there.
    let (mut top, mut dip) = (wave.at_once(hits[0].range_m), (f64::INFINITY, 0));
    for i in 1..hits.len() {
        let here = wave.at_once(hits[i].range_m);
        // Between hits that are apart there is less than at both.
        if gap_m(i - 1) > MOST_GAP * resolution_m {
            let between = wave.at_once(0.5 * (hits[i - 1].range_m + hits[i].range_m));
            if between < dip.0 {
                dip = (between, i);
            }
        }
        if here < dip.0 {
            // There may be a hit on each side of it. It goes with the nearer one.
            let is_of_next = i + 1 < hits.len() && gap_m(i - 1) > gap_m(i);
            dip = (here, if is_of_next { i } else { i + 1 });
        } else if dip.0 < DIP * top.min(here) {
            peaks.push(Peak {
                hits: start..dip.1,
                power: top,
            });
            start = dip.1;
            (top, dip) = (here, (f64::INFINITY, i));
        } else if here > top {
            (top, dip) = (here, (f64::INFINITY, i));
        }
    }
    peaks.push(Peak {
        hits: start..hits.len(),
        power: top,
    });
    peaks
}

/// The power that comes back at a time, as a sum of Gaussians.
struct Waveform {
    /// Range and power of each hit.
    pulses: Vec<(f64, f64)>,
    narrowness: f64,
}

impl Waveform {
    fn of(hits: &[SubRayHit], resolution_m: f64) -> Self {
        Self {
            pulses: hits.iter().map(|hit| (hit.range_m, hit.power())).collect(),
            // Half of a Gaussian's top at half of its width.
            narrowness: 4.0 * std::f64::consts::LN_2 / (resolution_m * resolution_m),
        }
    }

    /// The power that comes back when that of a range does.
    fn at_once(&self, range_m: f64) -> f64 {
        let share = |&(of_m, power): &(f64, f64)| {
            let apart_m = range_m - of_m;
            power * exp(-self.narrowness * (apart_m * apart_m))
        };
        self.pulses.iter().map(share).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hits(list: &[(f64, f64)]) -> Vec<SubRayHit> {
        let hit = |(ray, &(range_m, power)): (usize, &(f64, f64))| SubRayHit {
            ray,
            mirrored: None,
            range_m,
            sent_back: power * range_m * range_m,
            incidence_cos: 1.0,
        };
        list.iter().enumerate().map(hit).collect()
    }

    fn ends(list: &[(f64, f64)], resolution_m: f64) -> Vec<usize> {
        let found = peaks(&hits(list), resolution_m);
        found.iter().map(|peak| peak.hits.end).collect()
    }

    /// The sum of Gaussians as a receiver samples it, every millimetre: how many peaks it has with
    /// a dip between neighbours below 0.8 of the lower one.
    fn brute_force(list: &[(f64, f64)], resolution_m: f64) -> usize {
        let wave = |m: f64| -> f64 {
            let of = |&(range_m, power): &(f64, f64)| {
                power * 0.5_f64.powf((2.0 * (m - range_m) / resolution_m).powi(2))
            };
            list.iter().map(of).sum()
        };
        let samples = (0..8000).map(|i| wave(8.0 + 0.001 * f64::from(i)));
        let (mut count, mut top, mut low) = (1, 0.0, f64::INFINITY);
        for here in samples {
            low = here.min(low);
            if low < DIP * here.min(top) {
                count += 1;
                (top, low) = (here, here);
            } else if here > top {
                (top, low) = (here, here);
            }
        }
        count
    }

    /// Each cluster is a surface that many sub-rays meet, 2 cm apart.
    #[test]
    fn peaks_are_those_of_a_sampled_waveform() {
        let clusters: [&[(f64, f64, f64)]; 6] = [
            // Range, depth, power.
            &[(10.0, 3.0, 1.0)],
            &[(10.0, 0.2, 1.0), (10.9, 0.2, 1.0)],
            &[(10.0, 0.5, 1.0), (10.7, 0.5, 1.0)],
            &[(10.0, 0.1, 1.0), (10.55, 0.02, 0.02), (11.1, 0.1, 1.0)],
            &[(10.0, 0.1, 1.0), (10.55, 0.1, 0.9), (11.1, 0.1, 1.0)],
            &[(10.0, 0.2, 0.3), (10.5, 0.3, 0.1), (11.3, 0.4, 1.0)],
        ];
        for clusters in clusters {
            let mut list = Vec::new();
            for &(range_m, depth_m, power) in clusters {
                let many = (depth_m / 0.02_f64).ceil();
                list.extend(
                    (0..many as u32).map(|i| (range_m + 0.02 * f64::from(i), power / many)),
                );
            }
            let found = ends(&list, 0.6);
            assert_eq!(
                found.len(),
                brute_force(&list, 0.6),
                "{clusters:?} {found:?}"
            );
        }
    }

    #[test]
    fn a_weak_hit_between_strong_ones_is_a_dip() {
        // Nearer to the first, so it goes with that.
        let list = [(10.0, 1.0), (10.5, 0.01), (11.1, 1.0)];
        let found = peaks(&hits(&list), 0.6);
        assert_eq!(ends(&list, 0.6), [2, 3]);
        assert!(found.iter().all(|peak| (1.0..1.1).contains(&peak.power)));
        assert_eq!(ends(&[(10.0, 1.0), (10.6, 0.01), (11.1, 1.0)], 0.6), [1, 3]);
        // A hit as strong as its neighbours fills the gap.
        assert_eq!(ends(&[(10.0, 1.0), (10.5, 1.0), (11.1, 1.0)], 0.6), [3]);
        // Nothing comes back from anywhere.
        assert_eq!(ends(&[(10.0, 0.0), (10.5, 0.0), (11.1, 0.0)], 0.6), [3]);
    }

    /// The light of a surface that slants through n times the resolution comes back in n times the
    /// length of a pulse: the greatest power at once is that share of the whole.
    #[test]
    fn a_long_echo_is_a_weak_one() {
        let list: Vec<_> = (0..600)
            .map(|i| (10.0 + 0.01 * f64::from(i), 1.0))
            .collect();
        let found = peaks(&hits(&list), 0.6);
        assert_eq!(found.len(), 1);
        // The integral of a Gaussian whose width at half of its top is 1.
        let pulse_m = 0.6 * 1.064_467_02;
        assert!((found[0].power / 600.0 / (pulse_m / 6.0) - 1.0).abs() < 1e-3);
    }
}
