//! From what the sub-rays of a pulse meet to the echoes of that pulse.

/// Which echoes of a pulse a scanner reports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Returns {
    /// The one that brings back most light.
    #[default]
    Strongest,
    /// The nearest.
    First,
    /// The farthest.
    Last,
    /// The strongest and the last; if they are one, the second strongest (Velodyne's dual mode).
    Dual,
    /// All, nearest first, at most so many, 1..=15 (what LAS can number).
    All(u8),
}

/// What one sub-ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Contact {
    /// Which sub-ray.
    pub(crate) ray: usize,
    pub(crate) range_m: f64,
    /// Its share of the pulse, as sent back: weight × reflectance × cos(incidence).
    pub(crate) sent_back: f64,
    /// Cosine of the angle between beam and surface normal.
    pub(crate) incidence_cos: f64,
}

impl Contact {
    /// Received power, up to a factor that all share.
    fn power(&self) -> f64 {
        self.sent_back / (self.range_m * self.range_m).max(1e-12)
    }
}

/// Light that comes back as one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Echo {
    /// True range: the mean, weighted by received power.
    pub(crate) range_m: f64,
    /// Cosine of the incidence, the same mean.
    pub(crate) incidence_cos: f64,
    /// What the receiver makes of the range; the true one until it has measured.
    pub(crate) measured_m: f64,
    /// The contact that brings most of it, by its place in the sorted contacts.
    pub(crate) strongest: usize,
    /// All of it, by place in the sorted contacts.
    pub(crate) first: usize,
    pub(crate) end: usize,
    /// Sum of what is sent back.
    pub(crate) sent_back: f64,
    pub(crate) power: f64,
}

/// Groups a pulse's contacts, those from `first` on, into echoes, nearest first, which it adds. Sorts the
/// contacts by range.
///
/// A receiver that has been raised by a surface is busy for the pulse's length: whatever lies within
/// `resolution_m` behind the first surface of an echo melts into it. The measured range is the
/// centroid, "a beam-weighted average over the footprint" (Chaudhry et al. 2021).
pub(crate) fn group(
    contacts: &mut [Contact],
    mut first: usize,
    resolution_m: f64,
    echoes: &mut Vec<Echo>,
) {
    contacts[first..]
        .sort_unstable_by(|a, b| a.range_m.total_cmp(&b.range_m).then(a.ray.cmp(&b.ray)));
    while first < contacts.len() {
        let reach = contacts[first].range_m + resolution_m;
        let end = first + contacts[first..].partition_point(|c| c.range_m <= reach);
        let group = &contacts[first..end];
        let power: f64 = group.iter().map(Contact::power).sum();
        let sent_back = group.iter().map(|c| c.sent_back).sum();
        // The first of equals. Light that is not sent back weighs nothing; then the nearest counts.
        let mut strongest = first;
        for i in first + 1..end {
            if contacts[i].power() > contacts[strongest].power() {
                strongest = i;
            }
        }
        let mean = |of: fn(&Contact) -> f64| {
            if group.len() == 1 || power <= 0.0 {
                return of(&contacts[strongest]);
            }
            group.iter().map(|c| c.power() * of(c)).sum::<f64>() / power
        };
        let range_m = mean(|c| c.range_m);
        echoes.push(Echo {
            range_m,
            incidence_cos: mean(|c| c.incidence_cos),
            measured_m: range_m,
            strongest,
            first,
            end,
            sent_back,
            power,
        });
        first = end;
    }
}

impl Returns {
    /// Keeps what is reported of echoes that are sorted by range.
    pub(crate) fn select(self, echoes: &mut Vec<Echo>) {
        if echoes.len() < 2 {
            return;
        }
        let strongest = |echoes: &[Echo], but: Option<usize>| {
            (0..echoes.len())
                .filter(|i| Some(*i) != but)
                .reduce(|a, b| {
                    if echoes[b].power > echoes[a].power {
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
        let mut contacts: Vec<Contact> = list
            .iter()
            .enumerate()
            .map(|(ray, &(range_m, sent_back))| Contact {
                ray,
                range_m,
                sent_back,
                incidence_cos: 1.0,
            })
            .collect();
        let mut found = Vec::new();
        super::group(&mut contacts, 0, resolution_m, &mut found);
        found
    }

    #[test]
    fn near_surfaces_melt_and_far_ones_do_not() {
        let one = grouped(&[(10.0, 0.5), (10.4, 0.5)], 0.6);
        assert_eq!(one.len(), 1);
        assert!(one[0].range_m > 10.0 && one[0].range_m < 10.4);
        let two = grouped(&[(10.0, 0.2), (10.7, 0.5)], 0.6);
        assert_eq!((two[0].range_m, two[1].range_m), (10.0, 10.7));
        // A chain does not melt into one without end.
        let chain: Vec<_> = (0..20).map(|i| (10.0 + 0.29 * f64::from(i), 0.1)).collect();
        assert_eq!(grouped(&chain, 0.6).len(), 7);
    }

    #[test]
    fn every_mode_reports_what_its_name_says() {
        let list = [(5.0, 0.02), (9.0, 0.3), (14.0, 0.1), (30.0, 0.4)];
        let kept = |mode: Returns| {
            let mut found = grouped(&list, 0.6);
            mode.select(&mut found);
            found.iter().map(|e| e.range_m).collect::<Vec<_>>()
        };
        assert_eq!(kept(Returns::Strongest), [9.0]);
        assert_eq!(kept(Returns::First), [5.0]);
        assert_eq!(kept(Returns::Last), [30.0]);
        assert_eq!(kept(Returns::Dual), [9.0, 30.0]);
        assert_eq!(kept(Returns::All(3)), [5.0, 9.0, 14.0]);
        let mut near = grouped(&[(2.0, 0.1), (9.0, 0.1), (3.0, 0.5)], 0.1);
        near.truncate(2);
        Returns::Dual.select(&mut near);
        assert_eq!(
            near.len(),
            2,
            "the last is the strongest: the other one too"
        );
        let mut none = Vec::new();
        for mode in [
            Returns::Strongest,
            Returns::First,
            Returns::Last,
            Returns::Dual,
        ] {
            mode.select(&mut none);
            assert!(none.is_empty());
        }
    }

    proptest! {
        #[test]
        fn echoes_share_out_all_contacts(
            list in prop::collection::vec((0.5_f64..40.0, 0.0_f64..0.1), 0..40), resolution in 0.0_f64..2.0,
        ) {
            let found = grouped(&list, resolution);
            let mut end = 0;
            for e in &found {
                prop_assert_eq!(e.first, end);
                prop_assert!(e.end > e.first && (e.first..e.end).contains(&e.strongest));
                end = e.end;
            }
            prop_assert_eq!(end, list.len());
            let (all, sum): (f64, f64) = (list.iter().map(|c| c.1).sum(), found.iter().map(|e| e.sent_back).sum());
            prop_assert!((all - sum).abs() < 1e-12);
            // Echoes do not overlap, and a range is within its echo.
            prop_assert!(found.windows(2).all(|w| w[0].range_m < w[1].range_m));
        }
    }
}
