//! Draws that are spread evenly over the sequences of a data set.

use nemoral_seed::{Draw, Key};

/// So many sequences, from the first on, have one number each of as many equal parts of the
/// interval.
const BLOCK: u32 = 8;

/// A number in 0..1 for the `index`-th sequence; different keys give independent numbers.
///
/// Each [`BLOCK`] of sequences has a number in each of as many parts of the interval, in random
/// order, and over the blocks the numbers of a part fill it evenly. So some sequences cover a range
/// better than independent draws, and a data set can be continued with further sequences without
/// changing those before.
///
/// Within a block this is Latin hypercube sampling (McKay, Beckman and Conover 1979). To be even
/// for the first 2 and 4 sequences, too, neighbours would have to be in opposite halves with all
/// keys, and so a few sequences would have keys that go together.
///
/// Over the blocks it is [`even`].
pub(super) fn spread(key: Key, index: u32) -> f64 {
    let (block, place) = (index / BLOCK, (index % BLOCK) as usize);
    let part = order(key.item(0).item(u64::from(block)))[place];
    let within = even(key.item(1).item(u64::from(part)), block);
    (f64::from(part) + within) / f64::from(BLOCK)
}

/// A random order of a block's parts (Fisher and Yates).
fn order(key: Key) -> [u32; BLOCK as usize] {
    let mut rng = key.rng();
    let mut parts = std::array::from_fn(|i| i as u32);
    for last in (1..BLOCK).rev() {
        parts.swap(last as usize, rng.below(last + 1) as usize);
    }
    parts
}

/// A number in 0..1 for the `index`-th sequence, the numbers of the first 2, 4, 8, … of which are
/// stratified: each half, quarter, eighth, … of the interval has one. With many keys, these numbers
/// go together more than by chance.
///
/// This is the first dimension of Sobol's sequence, its order shuffled and its values scrambled by
/// Owen's nested uniform scrambling, as B. Burley, "Practical Hash-based Owen Scrambling", Journal
/// of Computer Graphics Techniques 9(4), 2020, computes it.
pub(super) fn even(key: Key, index: u32) -> f64 {
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
    fn every_block_is_stratified_and_so_are_all_blocks() {
        for seed in 0..50 {
            for count in [BLOCK, 2 * BLOCK, 4 * BLOCK, 8 * BLOCK] {
                let parts = |range: std::ops::Range<u32>, of: u32| {
                    let part = |i| (spread(key(seed), i) * f64::from(of)) as u32;
                    let mut parts: Vec<u32> = range.map(part).collect();
                    parts.sort_unstable();
                    parts
                };
                assert_eq!(parts(0..count, count), (0..count).collect::<Vec<_>>());
                let last = parts(count - BLOCK..count, BLOCK);
                assert_eq!(last, (0..BLOCK).collect::<Vec<_>>(), "seed {seed}");
            }
        }
    }

    #[test]
    fn keys_go_together_no_more_than_by_chance() {
        // The root mean square of the correlation of two keys: 1 / sqrt(n - 1) by chance.
        for count in [4_u32, 8, 16, 64] {
            let mut squares = 0.0;
            let pairs = 2000;
            for pair in 0..pairs {
                let column = |k: u64| -> Vec<f64> {
                    let all: Vec<f64> = (0..count).map(|i| spread(key(k), i)).collect();
                    let mean = all.iter().sum::<f64>() / f64::from(count);
                    all.iter().map(|x| x - mean).collect()
                };
                let (x, y) = (column(2 * pair), column(2 * pair + 1));
                let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                let r = dot(&x, &y) / (dot(&x, &x) * dot(&y, &y)).sqrt();
                squares += r * r;
            }
            let relative = (squares / pairs as f64 * f64::from(count - 1)).sqrt();
            assert!((0.9..1.1).contains(&relative), "{count}: {relative}");
        }
    }

    #[test]
    fn halves_of_two_keys_rarely_coincide() {
        // Of 8 sequences, 4 are in the same half with both keys, or none is: by chance, of the 70
        // ways to halve them, 2.
        let half = |k: u64| (0..8).map(|i| spread(key(k), i) < 0.5).collect::<Vec<_>>();
        let mut same = 0;
        for pair in 0..4000 {
            let (x, y) = (half(2 * pair), half(2 * pair + 1));
            let equal = x.iter().zip(&y).filter(|(x, y)| x == y).count();
            same += u32::from(equal == 0 || equal == 8);
        }
        assert!(same < 4000 * 2 / 70 + 40, "{same}");
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
    fn even_numbers_are_stratified_from_the_first_on() {
        for seed in 0..50 {
            for bits in 0..8 {
                let count = 1_u32 << bits;
                let mut strata: Vec<u32> = (0..count)
                    .map(|i| (even(key(seed), i) * f64::from(count)) as u32)
                    .collect();
                strata.sort_unstable();
                assert_eq!(strata, (0..count).collect::<Vec<_>>(), "seed {seed}");
            }
        }
    }

    #[test]
    fn values_are_stable() {
        let of = |number: fn(Key, u32) -> f64| [0, 1, 2].map(|i| number(key(7), i));
        let spread_ones = [
            0.221_427_897_442_481_48,
            0.618_810_853_120_521_6,
            0.019_427_729_348_535_65,
        ];
        assert_eq!(of(spread), spread_ones);
        let even_ones = [
            0.503_415_488_987_229_8,
            0.489_422_101_643_867_8,
            0.802_700_792_788_527_9,
        ];
        assert_eq!(of(even), even_ones);
    }
}
