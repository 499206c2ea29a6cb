//! What fits on a page of so many bytes.

/// Bytes that are left for something.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    left: usize,
}

impl Budget {
    pub(crate) fn new(bytes: usize) -> Self {
        Self { left: bytes }
    }

    /// Takes bytes, if so many are left.
    pub(crate) fn take(&mut self, bytes: usize) -> bool {
        let rest = self.left.checked_sub(bytes);
        self.left = rest.unwrap_or(self.left);
        rest.is_some()
    }
}

/// At most `most` of `count` things, evenly spread, the first and the last among them.
pub(crate) fn spread(count: usize, most: usize) -> Vec<usize> {
    if count <= most {
        return (0..count).collect();
    }
    (0..most).map(|i| i * (count - 1) / (most - 1)).collect()
}

/// All of `count` things in an order of which each beginning is spread over them: the first, the
/// last, the middle, the quarters, and so on, by the sequence of van der Corput.
pub(crate) fn halving_order(count: usize) -> Vec<usize> {
    let Some(last) = count.checked_sub(1) else {
        return Vec::new();
    };
    // Steps of at most half a thing, so that none is left out.
    let steps = (2 * count).next_power_of_two();
    let bits = steps.trailing_zeros();
    let share = |k: usize| k.reverse_bits() >> (usize::BITS - bits);
    let halves = (1..steps).map(|k| (share(k) * last + steps / 2) / steps);
    let mut is_new = vec![true; count];
    [0, last]
        .into_iter()
        .chain(halves)
        .filter(|&i| std::mem::replace(&mut is_new[i], false))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shown_is_spread_evenly() {
        assert_eq!(spread(3, 24), [0, 1, 2]);
        assert_eq!(spread(101, 3), [0, 50, 100]);
        let some = spread(1000, 24);
        assert_eq!((some.len(), some[0], some[23]), (24, 0, 999));
        assert!(some.windows(2).all(|w| (43..=44).contains(&(w[1] - w[0]))));
    }

    #[test]
    fn each_beginning_of_the_order_is_spread() {
        assert!(halving_order(0).is_empty());
        assert_eq!(halving_order(1), [0]);
        assert_eq!(halving_order(9), [0, 8, 4, 2, 6, 1, 5, 3, 7]);
        for count in [2, 3, 7, 24, 1000, 1024] {
            let order = halving_order(count);
            let mut all = order.clone();
            all.sort_unstable();
            assert_eq!(all, (0..count).collect::<Vec<_>>());
            for shown in 2..=count.min(40) {
                let mut some = order[..shown].to_vec();
                some.sort_unstable();
                let widest = some.windows(2).map(|w| w[1] - w[0]).max();
                // Twice the gap that even steps would leave, and a thing for rounding.
                let most = 2 * (count - 1) / (shown - 1) + 1;
                assert!(widest <= Some(most), "{shown} of {count}: {some:?}");
            }
        }
    }

    #[test]
    fn a_budget_gives_what_it_has() {
        let mut budget = Budget::new(10);
        assert!(budget.take(4) && !budget.take(7) && budget.take(6));
        assert!(!budget.take(1) && budget.take(0));
    }
}
