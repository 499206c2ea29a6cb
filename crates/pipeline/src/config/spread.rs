//! Draws that are spread evenly over the sequences of a data set.

use nemoral_seed::Key;

/// A number in 0..1 for the `index`-th sequence; different keys give independent numbers.
///
/// The numbers of the first 2, 4, 8, … sequences are stratified: each half, quarter, eighth, … of
/// the interval has one. So few sequences cover a range better than independent draws, and a data
/// set can be continued with further sequences without changing those before.
///
/// This is the first dimension of Sobol's sequence, its order shuffled and its values scrambled by
/// Owen's nested uniform scrambling, as B. Burley, "Practical Hash-based Owen Scrambling", Journal
/// of Computer Graphics Techniques 9(4), 2020, computes it.
pub(super) fn spread(key: Key, index: u32) -> f64 {
    let (order, value) = (key.item(0).to_u64() as u32, key.item(1).to_u64() as u32);
    // The dimension's values are its indices with their bits reversed.
    let sobol = scrambled(index, order).reverse_bits();
    (f64::from(scrambled(sobol, value)) + 0.5) / 2_f64.powi(32)
}

/// Owen's scrambling of the bits of `x`, the most significant first.
fn scrambled(x: u32, seed: u32) -> u32 {
    permuted(x.reverse_bits(), seed).reverse_bits()
}

/// The permutation of S. Laine and T. Karras, "Stratified Sampling for Stochastic Transparency",
/// 2011, in which each bit depends on lower ones alone.
fn permuted(x: u32, seed: u32) -> u32 {
    let mut x = x.wrapping_add(seed);
    for factor in [0x6C50_B47C, 0xB82F_1E52, 0xC7AF_E638, 0x8D22_F6E6_u32] {
        x ^= x.wrapping_mul(factor);
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(seed: u64) -> Key {
        Key::world(seed)
    }

    #[test]
    fn every_power_of_two_is_stratified() {
        for seed in 0..50 {
            for bits in 0..8 {
                let count = 1_u32 << bits;
                let mut strata: Vec<u32> = (0..count)
                    .map(|i| (spread(key(seed), i) * f64::from(count)) as u32)
                    .collect();
                strata.sort_unstable();
                assert_eq!(strata, (0..count).collect::<Vec<_>>(), "seed {seed}");
            }
        }
    }

    #[test]
    fn keys_and_seeds_are_independent() {
        // Over many pairs of keys, the numbers of 64 sequences fill the square evenly.
        let mut cells = [0_u32; 64];
        for seed in 0..200 {
            for i in 0..64 {
                let (x, y) = (spread(key(2 * seed), i), spread(key(2 * seed + 1), i));
                cells[(x * 8.0) as usize * 8 + (y * 8.0) as usize] += 1;
            }
        }
        // 200 are expected; the numbers of one pair are stratified, so chance deviates less.
        assert!(cells.iter().all(|n| (130..270).contains(n)), "{cells:?}");
        // A single sequence's number is uniform over seeds.
        let mut counts = [0_u32; 10];
        for seed in 0..1000 {
            counts[(spread(key(seed), 0) * 10.0) as usize] += 1;
        }
        assert!(counts.iter().all(|n| (60..140).contains(n)), "{counts:?}");
    }

    #[test]
    fn values_are_stable() {
        let values: Vec<f64> = (0..3).map(|i| spread(key(7), i)).collect();
        assert_eq!(
            values,
            [
                0.503_415_488_987_229_8,
                0.489_422_101_643_867_8,
                0.802_700_792_788_527_9
            ]
        );
    }
}
