//! Keys, which say what a random number is for.

use crate::philox::{PhiloxRng, philox4x32};

/// The purpose of a family of keys: a literal constant of whoever draws the numbers.
///
/// The tag is a 64-bit hash of the name, so the numbers of one domain do not change when others are
/// added, reordered or removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Domain(u64);

impl Domain {
    /// A domain by its name, `"crate.purpose"` by convention.
    #[must_use]
    pub const fn new(name: &str) -> Self {
        // FNV-1a of 64 bits only has to tell names apart; Philox does the mixing.
        let bytes = name.as_bytes();
        let mut hash = 0xCBF2_9CE4_8422_2325_u64;
        let mut i = 0;
        while i < bytes.len() {
            hash = (hash ^ bytes[i] as u64).wrapping_mul(0x0000_0100_0000_01B3);
            i += 1;
        }
        Self(hash)
    }
}

/// A 128-bit address in the space of all randomness of a world.
///
/// Derivation is one Philox block keyed by the step's tag. For a given step it is a bijection:
/// two different keys never become equal by taking the same step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Key([u32; 4]);

/// Tags of the other steps, so that `chunk([1, 0])` and `item(1)` differ.
const CHUNK: u32 = 0x6368_756E;
const ITEM: u32 = 0x6974_656D;

impl Key {
    /// The root key of a world.
    #[must_use]
    pub const fn world(seed: u64) -> Self {
        Self(philox4x32(
            [seed as u32, (seed >> 32) as u32, 0, 0],
            [0x6E65_6D6F, 0x7261_6C00],
        ))
    }

    /// The key of one domain below this key: separates the numbers of one purpose from all others.
    #[must_use]
    pub const fn domain(self, domain: Domain) -> Self {
        Self(philox4x32(
            self.0,
            [domain.0 as u32, (domain.0 >> 32) as u32],
        ))
    }

    /// The key of a chunk, by its integer coordinate.
    #[must_use]
    pub fn chunk(self, coord: impl Into<[i32; 2]>) -> Self {
        let [x, y] = coord.into();
        let first = philox4x32(self.0, [CHUNK, x as u32]);
        Self(philox4x32(first, [CHUNK, y as u32]))
    }

    /// The key of the `index`-th thing.
    #[must_use]
    pub const fn item(self, index: u64) -> Self {
        let first = philox4x32(self.0, [ITEM, index as u32]);
        Self(philox4x32(first, [ITEM, (index >> 32) as u32]))
    }

    /// The keys of many things, each equal to what [`item`](Self::item) returns for its index.
    ///
    /// A key takes two Philox blocks, the second of which needs the first. Here the first blocks of
    /// all keys are computed side by side, and then the second blocks, which a processor does
    /// faster.
    #[must_use]
    pub fn items(self, indices: &[u64]) -> Vec<Self> {
        let first = |&index: &u64| Self(philox4x32(self.0, [ITEM, index as u32]));
        let mut keys: Vec<Self> = indices.iter().map(first).collect();
        for (key, &index) in keys.iter_mut().zip(indices) {
            *key = Self(philox4x32(key.0, [ITEM, (index >> 32) as u32]));
        }
        keys
    }

    /// The generator of this key. Every call starts the same stream.
    #[must_use]
    pub const fn rng(self) -> PhiloxRng {
        PhiloxRng::new(self.0)
    }

    /// 64 bits of this key: a hash, for priorities and for u32-seeded libraries.
    #[must_use]
    pub const fn to_u64(self) -> u64 {
        self.0[0] as u64 | (self.0[1] as u64) << 32
    }

    /// The whole key, for cache keys.
    #[must_use]
    pub fn to_bytes(self) -> [u8; 16] {
        let mut bytes = [0; 16];
        for (out, word) in bytes.chunks_exact_mut(4).zip(self.0) {
            out.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    const A: Domain = Domain::new("a");
    const B: Domain = Domain::new("b");

    #[test]
    fn no_two_chunks_share_a_key() {
        let mut seen = HashSet::new();
        for x in -128..128 {
            for y in -128..128 {
                assert!(seen.insert(Key::world(7).domain(A).chunk([x, y]).to_u64()));
            }
        }
    }

    #[test]
    fn the_world_seed_matters_in_every_chunk() {
        // A linear chunk hash would lose the seed at x = -1, as happened in Feather's world
        // generator.
        let seen: HashSet<_> = (0..1000)
            .map(|seed| Key::world(seed).domain(A).chunk([-1, 5]))
            .collect();
        assert_eq!(seen.len(), 1000);
    }

    #[test]
    fn steps_do_not_commute_or_coincide() {
        let w = Key::world(1);
        assert_ne!(w.domain(A).domain(B), w.domain(B).domain(A));
        assert_ne!(w.chunk([1, 2]), w.chunk([2, 1]));
        assert_ne!(w.chunk([1, 0]), w.item(1));
        assert_ne!(w.item(0), w);
        assert_ne!(w.item(1), w.item(1 << 32));
    }

    #[test]
    fn many_keys_are_those_of_each() {
        let indices = [0, 1, 12, u64::MAX, 1 << 32, 0x1234_5678_9ABC];
        let key = Key::world(3).domain(A);
        assert_eq!(key.items(&indices), indices.map(|index| key.item(index)));
    }

    #[test]
    fn value_stability() {
        let key = Key::world(7)
            .domain(Domain::new("seed.test"))
            .chunk([-3, 5])
            .item(9);
        assert_eq!(key.to_u64(), VALUE);
    }
    const VALUE: u64 = 0x95AE_D791_1DE5_F169;
}
