//! Weights by which frames are chosen, so that their mean shares are what is asked for.
//!
//! Of the candidates of a frame, one is taken with a probability proportional to exp(w · x), where
//! x are its capped shares over their goals. Among all ways to choose that reach the goals on
//! average, this one changes the distribution of candidates least (exponential tilting: Csiszár
//! 1975, "I-divergence geometry of probability distributions and minimization problems", Ann.
//! Probab. 3, 146–158); the weights are the multipliers of the goals. Where a goal is out of
//! reach, its weight is at its limit and the best candidate is taken.

use nemoral_seed::{Draw, Key};

/// The greatest weight. A candidate that has the whole goal more is then taken 20,000 times as
/// often.
pub(crate) const MOST: f64 = 10.0;
/// How many times the goal a view counts with at most, so that a few views full of a thing do not
/// stand for many without it.
pub(crate) const CAP: f64 = 4.0;
/// Rounds over all weights, and halvings of the interval of one.
const ROUNDS: usize = 50;
const HALVINGS: usize = 40;
/// Weights that change by less in a round are found.
const FOUND: f64 = 1e-6;

/// Shares of a view as they count: capped, over their goals.
pub(crate) fn capped(shares: &[f64], goals: &[f64]) -> Vec<f64> {
    (shares.iter().zip(goals))
        .map(|(share, goal)| (share / goal).min(CAP))
        .collect()
}

/// The mean of a value over groups of candidates, of each of which one is taken by the weights.
pub(crate) fn mean(
    groups: &[Vec<Vec<f64>>],
    weights: &[f64],
    value: impl Fn(usize, usize) -> f64,
) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (g, group) in groups.iter().enumerate().filter(|(_, g)| !g.is_empty()) {
        let scores: Vec<f64> = group.iter().map(|x| dot(weights, x)).collect();
        let best = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (mut of_group, mut total) = (0.0, 0.0);
        for (j, score) in scores.iter().enumerate() {
            let chance = libm::exp(score - best);
            of_group += chance * value(g, j);
            total += chance;
        }
        sum += of_group / total;
        count += 1.0;
    }
    if count > 0.0 { sum / count } else { 0.0 }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The weights with which the mean of each of `targets` capped shares over its goal is at least 1,
/// 0 to [`MOST`]; as close as that comes, if it is out of reach. Each is the least one, given the
/// others.
pub(crate) fn weights(groups: &[Vec<Vec<f64>>], targets: usize) -> Vec<f64> {
    let mut weights = vec![0.0; targets];
    for _ in 0..ROUNDS {
        let before = weights.clone();
        for t in 0..targets {
            // The mean increases with the weight, as its derivative is a variance.
            let mut reached = |weight: f64| {
                weights[t] = weight;
                mean(groups, &weights, |g, j| groups[g][j][t]) >= 1.0
            };
            let weight = if reached(0.0) {
                0.0
            } else if !reached(MOST) {
                MOST
            } else {
                let (mut low, mut high) = (0.0, MOST);
                for _ in 0..HALVINGS {
                    let middle = f64::midpoint(low, high);
                    if reached(middle) {
                        high = middle;
                    } else {
                        low = middle;
                    }
                }
                high
            };
            weights[t] = weight;
        }
        let changes = weights.iter().zip(&before).map(|(a, b)| (a - b).abs());
        if changes.fold(0.0, f64::max) < FOUND {
            break;
        }
    }
    weights
}

/// The candidate that is taken, by its place in the list; `None` of none. Candidate j of a frame
/// has a number of its own, keyed by (frame, j), that is added to its score: a Gumbel variate, with
/// which the greatest sum is at each candidate as often as exp(w · x) says (Gumbel 1954; Maddison,
/// Tarlow and Minka 2014, "A* sampling").
pub(crate) fn choice(candidates: &[(u32, Vec<f64>)], weights: &[f64], frame: Key) -> Option<usize> {
    let score = |(number, x): &(u32, Vec<f64>)| {
        let waiting = frame.item(u64::from(*number)).rng().exponential();
        dot(weights, x) - libm::log(waiting.max(f64::MIN_POSITIVE))
    };
    let scores: Vec<f64> = candidates.iter().map(score).collect();
    // Of equal ones the first.
    (0..scores.len())
        .rev()
        .max_by(|&a, &b| scores[a].total_cmp(&scores[b]))
}

#[cfg(test)]
mod tests {
    use nemoral_seed::Domain;
    use proptest::prelude::*;

    use super::*;

    fn key(number: u64) -> Key {
        Key::world(7)
            .domain(Domain::new("weights.test"))
            .item(number)
    }

    /// Groups of candidates, of which a share has each of some things.
    fn groups(count: u64, of_each: u64, shares: &[f64]) -> Vec<Vec<Vec<f64>>> {
        let candidate = |g: u64, j: u64| {
            let mut rng = key(g).item(j).rng();
            let mut has = |share: &f64| {
                let amount = rng.range_f64(0.2, CAP);
                if rng.chance(*share) { amount } else { 0.0 }
            };
            shares.iter().map(&mut has).collect()
        };
        let group = |g| (0..of_each).map(|j| candidate(g, j)).collect();
        (0..count).map(group).collect()
    }

    #[test]
    fn goals_are_reached_and_no_more() {
        // Things that one view in 7 has, one in 4 and nearly every one: the last needs no weight.
        let groups = groups(64, 16, &[0.14, 0.25, 0.9]);
        let found = weights(&groups, 3);
        let mean_of = |t: usize| mean(&groups, &found, |g, j| groups[g][j][t]);
        assert!((mean_of(0) - 1.0).abs() < 1e-3, "{found:?}");
        assert!((mean_of(1) - 1.0).abs() < 1e-3, "{found:?}");
        assert!(mean_of(2) > 1.0 && found[2] == 0.0, "{found:?}");
        assert!(found[0] > found[1] && found[1] > 0.0, "{found:?}");
        assert_eq!(format!("{:.9?}", found), VALUES);
    }
    const VALUES: &str = "[0.657474439, 0.381416123, 0.000000000]";

    #[test]
    fn what_is_out_of_reach_gets_the_best() {
        let rare = groups(64, 8, &[0.01, 0.0]);
        assert_eq!(weights(&rare, 2), [MOST; 2]);
        assert_eq!(weights(&[], 1), [MOST]);
        let best = rare
            .iter()
            .map(|g| g.iter().map(|x| x[0]).fold(0.0, f64::max));
        let best: f64 = best.sum::<f64>() / rare.len() as f64;
        let taken = mean(&rare, &[MOST; 2], |g, j| rare[g][j][0]);
        assert!((taken - best).abs() < 0.05 * best, "{taken} {best}");
    }

    /// The choice of frames, drawn one by one, has the means for which the weights were found.
    #[test]
    fn frames_have_the_means_that_the_pilot_expects() {
        let shares = [0.14, 0.25];
        let found = weights(&groups(256, 16, &shares), 2);
        let n = 20_000;
        let others = groups(n, 16, &shares);
        let (mut sums, mut squares) = ([0.0; 2], [0.0; 2]);
        for (frame, group) in others.iter().enumerate() {
            let candidates: Vec<_> = (0..).zip(group.iter().cloned()).collect();
            let key = key(1 << 40).item(frame as u64);
            let taken = choice(&candidates, &found, key).expect("there are candidates");
            for t in 0..2 {
                sums[t] += group[taken][t];
                squares[t] += group[taken][t].powi(2);
            }
        }
        for t in 0..2 {
            let mean = sums[t] / n as f64;
            let expected = super::mean(&others, &found, |g, j| others[g][j][t]);
            let error = ((squares[t] / n as f64 - mean * mean) / n as f64).sqrt();
            assert!(
                (mean - expected).abs() < 4.0 * error,
                "{mean} {expected} {error}"
            );
            // The pilot's 256 groups know the mean to some percent.
            assert!((mean - 1.0).abs() < 0.15, "{mean}");
        }
    }

    proptest! {
        #[test]
        fn a_choice_depends_on_numbers_and_not_on_what_else_there_is(
            frame: u64,
            xs in prop::collection::vec(0.0_f64..CAP, 1..20),
        ) {
            let all: Vec<(u32, Vec<f64>)> = (0..).zip(xs.iter().map(|x| vec![*x])).collect();
            let taken = choice(&all, &[1.5], key(frame)).expect("there are some");
            prop_assert!(taken < all.len());
            // Without one that is not taken, the same one is.
            for other in (0..all.len()).filter(|&i| i != taken) {
                let mut fewer = all.clone();
                fewer.remove(other);
                let again = choice(&fewer, &[1.5], key(frame)).expect("there are some");
                prop_assert_eq!(fewer[again].0, all[taken].0);
            }
            prop_assert_eq!(choice(&[], &[1.5], key(frame)), None);
        }

        #[test]
        fn weights_are_within_their_limits(
            seed: u64,
            shares in prop::collection::vec(0.0_f64..1.0, 1..4),
        ) {
            let groups = groups(seed % 9, 1 + seed % 7, &shares);
            let found = weights(&groups, shares.len());
            prop_assert!(found.iter().all(|w| (0.0..=MOST).contains(w)));
        }
    }
}
