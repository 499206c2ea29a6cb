//! The woody layers of a stand.

/// The woody layers of a stand, in the order in which they are placed: trees, stumps and shrubs
/// (Nunes, Ferreira and Peixoto, section IV-D), then saplings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandLayer {
    /// Living and dead standing trees.
    Trees,
    /// Stumps.
    Stumps,
    /// Shrubs.
    Shrubs,
    /// Saplings of the trees' species.
    Saplings,
}

impl StandLayer {
    /// All layers, by [`index`](Self::index).
    pub const ALL: [Self; 4] = [Self::Trees, Self::Stumps, Self::Shrubs, Self::Saplings];

    /// The place of the layer in [`ALL`](Self::ALL).
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }
}
