//! Philox4x32-10, a counter-based generator.

use std::convert::Infallible;

use rand::{SeedableRng, TryRng};

/// One block of Philox4x32-10 (Salmon et al. 2011, section 4): four words from a counter and a key.
///
/// For a fixed key this is a bijection of the counter.
#[inline]
#[must_use]
pub const fn philox4x32(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    const M0: u64 = 0xD251_1F53;
    const M1: u64 = 0xCD9E_8D57;
    let [mut c0, mut c1, mut c2, mut c3] = counter;
    let [mut k0, mut k1] = key;
    let mut round = 0;
    while round < 10 {
        let p0 = M0 * c0 as u64;
        let p1 = M1 * c2 as u64;
        let (a, b, c, d) = (
            (p1 >> 32) as u32 ^ c1 ^ k0,
            p1 as u32,
            (p0 >> 32) as u32 ^ c3 ^ k1,
            p0 as u32,
        );
        (c0, c1, c2, c3) = (a, b, c, d);
        // The Weyl sequence of the paper, by the golden ratio and sqrt(3) - 1.
        k0 = k0.wrapping_add(0x9E37_79B9);
        k1 = k1.wrapping_add(0xBB67_AE85);
        round += 1;
    }
    [c0, c1, c2, c3]
}

/// A stream of Philox blocks with a 64-bit block counter: 2^66 words before it repeats.
///
/// Use it through [`Key::rng`](crate::Key::rng) and the [`Draw`](crate::Draw) methods, or through
/// rand's traits.
#[derive(Clone, Debug)]
pub struct PhiloxRng {
    key: [u32; 2],
    /// The upper half of the counter: fixed for a stream.
    stream: [u32; 2],
    next_block: u64,
    block: [u32; 4],
    /// Invariant: words `block[4 - left ..]` have not been handed out.
    left: u8,
}

impl PhiloxRng {
    /// The stream addressed by 128 bits.
    #[must_use]
    pub const fn new(state: [u32; 4]) -> Self {
        Self {
            key: [state[0], state[1]],
            stream: [state[2], state[3]],
            next_block: 0,
            block: [0; 4],
            left: 0,
        }
    }

    #[inline]
    fn word(&mut self) -> u32 {
        if self.left == 0 {
            let n = self.next_block;
            let counter = [n as u32, (n >> 32) as u32, self.stream[0], self.stream[1]];
            self.block = philox4x32(counter, self.key);
            self.next_block = n.wrapping_add(1);
            self.left = 4;
        }
        let word = self.block[usize::from(4 - self.left)];
        self.left -= 1;
        word
    }
}

impl TryRng for PhiloxRng {
    type Error = Infallible;

    #[inline]
    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(self.word())
    }

    #[inline]
    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        let low = u64::from(self.word());
        Ok(low | u64::from(self.word()) << 32)
    }

    fn try_fill_bytes(&mut self, dst: &mut [u8]) -> Result<(), Infallible> {
        for chunk in dst.chunks_mut(4) {
            chunk.copy_from_slice(&self.word().to_le_bytes()[..chunk.len()]);
        }
        Ok(())
    }
}

impl SeedableRng for PhiloxRng {
    type Seed = [u8; 16];

    fn from_seed(seed: Self::Seed) -> Self {
        let word = |i: usize| {
            u32::from_le_bytes([
                seed[4 * i],
                seed[4 * i + 1],
                seed[4 * i + 2],
                seed[4 * i + 3],
            ])
        };
        Self::new([word(0), word(1), word(2), word(3)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng;

    /// The known-answer vectors of Random123 1.09 (`kat_vectors`, philox4x32 10 rounds).
    #[test]
    fn known_answers() {
        assert_eq!(
            philox4x32([0; 4], [0; 2]),
            [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]
        );
        assert_eq!(
            philox4x32([u32::MAX; 4], [u32::MAX; 2]),
            [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]
        );
        assert_eq!(
            philox4x32(
                [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344],
                [0xa409_3822, 0x299f_31d0]
            ),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }

    #[test]
    fn words_are_the_blocks_in_order() {
        let mut rng = PhiloxRng::new([1, 2, 3, 4]);
        let words: Vec<u32> = (0..8).map(|_| rng.next_u32()).collect();
        assert_eq!(words[..4], philox4x32([0, 0, 3, 4], [1, 2]));
        assert_eq!(words[4..], philox4x32([1, 0, 3, 4], [1, 2]));
    }

    #[test]
    fn bytes_and_words_agree() {
        let (mut a, mut b) = (PhiloxRng::new([9; 4]), PhiloxRng::new([9; 4]));
        let mut bytes = [0; 8];
        a.fill_bytes(&mut bytes);
        assert_eq!(u64::from_le_bytes(bytes), b.next_u64());
    }
}
