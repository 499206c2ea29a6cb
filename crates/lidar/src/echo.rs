//! Grouping the hits of a pulse's sub-rays into echoes, and choosing which echoes are reported.

use std::ops::Range;

use crate::waveform::peaks;

/// Which echoes of a pulse a scanner reports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ReturnMode {
    /// The echo with the most received power.
    #[default]
    Strongest,
    /// The nearest echo.
    First,
    /// The farthest echo.
    Last,
    /// The strongest and the last echo; where these are the same, the strongest and the second
    /// strongest (Velodyne's dual mode).
    Dual,
    /// All echoes, nearest first, at most this number, 1..=15 (as many as LAS can number).
    All(u8),
}

/// The sub-ray of an echo of air.
pub(crate) const AIR: usize = usize::MAX;

/// An echo of the air, or of something in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AirEcho {
    pub(crate) range_m: f64,
    /// As of a surface: reflectance times cosine.
    pub(crate) sent_back: f64,
}

/// What one sub-ray hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SubRayHit {
    /// The number of the sub-ray; [`AIR`] for what the air before them sends back.
    pub(crate) ray: usize,
    /// The number in the batch of what it met by way of a liquid's surface; `None` for what it hit.
    pub(crate) mirrored: Option<u32>,
    pub(crate) range_m: f64,
    /// The share of the pulse's light that it reflects: weight × reflectance × cos(incidence).
    pub(crate) sent_back: f64,
    /// Cosine of the angle between beam and surface normal.
    pub(crate) incidence_cos: f64,
}

impl SubRayHit {
    /// Received power, up to a factor that all hits share.
    pub(crate) fn power(&self) -> f64 {
        self.sent_back / (self.range_m * self.range_m).max(1e-12)
    }
}

/// Light of one or several hits that the receiver cannot tell apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Echo {
    /// True range: the mean, weighted by received power.
    pub(crate) range_m: f64,
    /// Cosine of the incidence, the same mean.
    pub(crate) incidence_cos: f64,
    /// The measured range; the true one until the range model has measured.
    pub(crate) measured_m: f64,
    /// The index in the sorted hits of the one with the most power.
    pub(crate) strongest: usize,
    /// The index in the sorted hits of the first one.
    pub(crate) first: usize,
    /// The index after the last one.
    pub(crate) end: usize,
    /// The sum of what its hits reflect.
    pub(crate) sent_back: f64,
    /// The sum of their received powers.
    pub(crate) power: f64,
    /// The greatest power that comes back at once, as a share of that sum: 1 unless the echo is
    /// longer than the pulse.
    pub(crate) peak_share: f64,
    /// Its place among the echoes of its pulse, from 0.
    pub(crate) place: u32,
}

impl Echo {
    /// The echo of some of the hits, which are sorted by range.
    fn of(hits: &[SubRayHit], range: Range<usize>, place: u32) -> Self {
        let merged = &hits[range.clone()];
        let power: f64 = merged.iter().map(SubRayHit::power).sum();
        let sent_back = merged.iter().map(|c| c.sent_back).sum();
        // The first of equal ones. If nothing is reflected, all powers are 0 and the nearest hit
        // counts.
        let mut strongest = range.start;
        for i in range.start + 1..range.end {
            if hits[i].power() > hits[strongest].power() {
                strongest = i;
            }
        }
        let mean = |of: fn(&SubRayHit) -> f64| {
            if merged.len() == 1 || power <= 0.0 {
                return of(&hits[strongest]);
            }
            merged.iter().map(|hit| hit.power() * of(hit)).sum::<f64>() / power
        };
        let range_m = mean(|c| c.range_m);
        Self {
            range_m,
            incidence_cos: mean(|c| c.incidence_cos),
            measured_m: range_m,
            strongest,
            first: range.start,
            end: range.end,
            sent_back,
            power,
            peak_share: 1.0,
            place,
        }
    }

    /// The greatest power that comes back at once, which the receiver compares with its threshold.
    pub(crate) fn peak(&self) -> f64 {
        self.power * self.peak_share
    }
}

/// Groups the hits of a pulse, which are those from `first` on, into echoes, and adds these,
/// nearest first. Sorts the hits by range.
///
/// A receiver that was triggered by a surface is busy for the length of the pulse: surfaces within
/// `resolution_m` are merged. Where hits follow each other closely over more than that, as on a
/// surface that slants away, each [peak](peaks) of their light is an echo. The measured range is
/// the centroid, "a beam-weighted average over the footprint" (Chaudhry et al. 2021).
pub(crate) fn group_hits(
    hits: &mut [SubRayHit],
    first: usize,
    resolution_m: f64,
    echoes: &mut Vec<Echo>,
) {
    hits[first..].sort_unstable_by(|a, b| a.range_m.total_cmp(&b.range_m).then(a.ray.cmp(&b.ray)));
    let hits = &*hits;
    let merges = |near: &SubRayHit, far: &SubRayHit| far.range_m <= near.range_m + resolution_m;
    let (mut start, mut place) = (first, 0);
    while start < hits.len() {
        let follow = |pair: &&[SubRayHit]| merges(&pair[0], &pair[1]);
        let end = start + 1 + hits[start..].windows(2).take_while(follow).count();
        if merges(&hits[start], &hits[end - 1]) {
            echoes.push(Echo::of(hits, start..end, place));
            place += 1;
        } else {
            for peak in peaks(&hits[start..end], resolution_m) {
                let range = start + peak.hits.start..start + peak.hits.end;
                let echo = Echo::of(hits, range, place);
                let peak_share = if echo.power > 0.0 {
                    peak.power / echo.power
                } else {
                    1.0
                };
                echoes.push(Echo { peak_share, ..echo });
                place += 1;
            }
        }
        start = end;
    }
}

impl ReturnMode {
    /// Keeps those of the echoes, which are sorted by range, that are reported.
    pub(crate) fn select(self, echoes: &mut Vec<Echo>) {
        if echoes.len() < 2 {
            return;
        }
        let strongest = |echoes: &[Echo], but: Option<usize>| {
            (0..echoes.len())
                .filter(|i| Some(*i) != but)
                .reduce(|a, b| {
                    if echoes[b].peak() > echoes[a].peak() {
                        b
                    } else {
                        a
                    }
                })
        };
        let kept = match self {
            Self::Strongest => [strongest(echoes, None), None],
            Self::First => [(!echoes.is_empty()).then_some(0), None],
            Self::Last => [echoes.len().checked_sub(1), None],
            Self::Dual => {
                let best = strongest(echoes, None);
                let last = echoes.len().checked_sub(1);
                let other = if best == last {
                    strongest(echoes, best)
                } else {
                    last
                };
                [best, other]
            }
            Self::All(most) => {
                echoes.truncate(most.into());
                return;
            }
        };
        let mut place = 0;
        echoes.retain(|_| {
            place += 1;
            kept.contains(&Some(place - 1))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grouped(list: &[(f64, f64)], resolution_m: f64) -> Vec<Echo> {
        let mut hits: Vec<SubRayHit> = list
            .iter()
            .enumerate()
            .map(|(ray, &(range_m, sent_back))| SubRayHit {
                ray,
                mirrored: None,
                range_m,
                sent_back,
                incidence_cos: 1.0,
            })
            .collect();
        let mut found = Vec::new();
        group_hits(&mut hits, 0, resolution_m, &mut found);
        found
    }

    #[test]
    fn near_surfaces_merge_and_far_ones_do_not() {
        let one = grouped(&[(10.0, 0.5), (10.4, 0.5)], 0.6);
        assert_eq!(one.len(), 1);
        assert!(one[0].range_m > 10.0 && one[0].range_m < 10.4);
        let two = grouped(&[(10.0, 0.2), (10.7, 0.5)], 0.6);
        assert_eq!((two[0].range_m, two[1].range_m), (10.0, 10.7));
        assert!(two.iter().map(|e| e.place).eq([0, 1]));
    }

    /// A surface that slants away is one echo, whose light comes back bit by bit.
    #[test]
    fn a_long_chain_of_hits_is_one_echo() {
        let chain: Vec<_> = (0..20).map(|i| (10.0 + 0.29 * f64::from(i), 0.1)).collect();
        let [whole] = grouped(&chain, 0.6)[..] else {
            panic!("a surface has one echo")
        };
        // The means weighted by 1 / r², by sums.
        let weights = || chain.iter().map(|(m, _)| 1.0 / (m * m));
        let mean_m = chain.iter().map(|(m, _)| 1.0 / m).sum::<f64>() / weights().sum::<f64>();
        assert!((whole.range_m - mean_m).abs() < 1e-12, "{}", whole.range_m);
        assert!((whole.sent_back - 2.0).abs() < 1e-12);
        // A pulse of 0.6 m meets 0.64 m of the first metres at once.
        let share = whole.peak() / (0.1 * weights().sum::<f64>());
        assert!((0.12..0.2).contains(&share), "{share}");
        // What is within the resolution comes back at once.
        let near = grouped(&[(10.0, 0.5), (10.4, 0.5)], 0.6);
        assert_eq!(near[0].peak(), near[0].power);
        // A weak hit in the middle is a dip in the light, and there are two surfaces.
        let found = grouped(&[(10.0, 0.5), (10.5, 0.001), (11.1, 0.5)], 0.6);
        assert_eq!((found[0].end, found[1].end, found.len()), (2, 3, 2));
        // The power of the moment ranks echoes: what comes back at once beats what is spread out.
        let mut both: Vec<_> = (0..30).map(|i| (10.0 + 0.2 * f64::from(i), 0.01)).collect();
        both.push((20.0, 0.25));
        let mut found = grouped(&both, 0.6);
        assert!(found[0].power > found[1].power);
        ReturnMode::Strongest.select(&mut found);
        assert_eq!((found.len(), found[0].range_m), (1, 20.0));
    }

    #[test]
    fn every_mode_reports_what_its_name_says() {
        let list = [(5.0, 0.02), (9.0, 0.3), (14.0, 0.1), (30.0, 0.4)];
        let kept = |mode: ReturnMode| {
            let mut found = grouped(&list, 0.6);
            mode.select(&mut found);
            found.iter().map(|e| e.range_m).collect::<Vec<_>>()
        };
        assert_eq!(kept(ReturnMode::Strongest), [9.0]);
        assert_eq!(kept(ReturnMode::First), [5.0]);
        assert_eq!(kept(ReturnMode::Last), [30.0]);
        assert_eq!(kept(ReturnMode::Dual), [9.0, 30.0]);
        assert_eq!(kept(ReturnMode::All(3)), [5.0, 9.0, 14.0]);
        let mut near = grouped(&[(2.0, 0.1), (9.0, 0.1), (3.0, 0.5)], 0.1);
        near.truncate(2);
        ReturnMode::Dual.select(&mut near);
        assert_eq!(
            near.len(),
            2,
            "the last is the strongest: the other one too"
        );
        let mut none = Vec::new();
        for mode in [
            ReturnMode::Strongest,
            ReturnMode::First,
            ReturnMode::Last,
            ReturnMode::Dual,
        ] {
            mode.select(&mut none);
            assert!(none.is_empty());
        }
    }

    proptest! {
        #[test]
        fn every_hit_is_in_one_echo(
            list in prop::collection::vec((0.5_f64..40.0, 0.0_f64..0.1), 0..40),
            resolution in 0.0_f64..2.0,
        ) {
            let found = grouped(&list, resolution);
            let mut end = 0;
            for e in &found {
                prop_assert_eq!(e.first, end);
                prop_assert!(e.end > e.first && (e.first..e.end).contains(&e.strongest));
                end = e.end;
            }
            prop_assert_eq!(end, list.len());
            let (all, sum): (f64, f64) = (
                list.iter().map(|c| c.1).sum(),
                found.iter().map(|e| e.sent_back).sum(),
            );
            prop_assert!((all - sum).abs() < 1e-12);
            // Echoes do not overlap, and a range is within its echo.
            prop_assert!(found.windows(2).all(|w| w[0].range_m < w[1].range_m));
        }
    }
}
