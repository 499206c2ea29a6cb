//! The random numbers of the sampler, which come from keys instead of a stream.

use nemoral_seed::{Domain, Key, PhiloxRng, Rng};

const SEEDS: Domain = Domain::new("placement.seeds");
const DARTS: Domain = Domain::new("placement.darts");

/// A key that the sampler derives all of its random numbers from.
///
/// An endless plane has no first point, so there is no stream to draw from: every cell of the plane
/// and every point has a key of its own, and what is drawn with it depends on nothing else. A key
/// is a value of at least 64 bits, derived by a good hash: [`nemoral_seed::Key`] is one, and a hash
/// such as BLAKE3 with a seeded generator makes another in a few lines.
pub trait SampleKey: Copy + Ord {
    /// The generator of a key.
    type Rng: Rng;

    /// The key of a cell of the plane, by its integer coordinates; for the initial samples.
    #[must_use]
    fn seed_cell(self, cell: [i32; 2]) -> Self;

    /// The key of the `index`-th sample of a cell, or of the `index`-th dart of a point.
    #[must_use]
    fn child(self, index: u64) -> Self;

    /// The stream that a cell draws its samples from; each call starts it anew.
    fn seed_rng(self) -> Self::Rng;

    /// The stream that a point draws its darts from; each call starts it anew.
    fn dart_rng(self) -> Self::Rng;

    /// A hash of the key. Of two darts that overlap, the one with the lower value wins.
    fn priority(self) -> u64;
}

impl SampleKey for Key {
    type Rng = PhiloxRng;

    fn seed_cell(self, cell: [i32; 2]) -> Self {
        self.domain(SEEDS).chunk(cell)
    }

    fn child(self, index: u64) -> Self {
        self.item(index)
    }

    fn seed_rng(self) -> PhiloxRng {
        self.rng()
    }

    fn dart_rng(self) -> PhiloxRng {
        self.domain(DARTS).rng()
    }

    fn priority(self) -> u64 {
        self.to_u64()
    }
}
