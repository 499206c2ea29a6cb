//! The surfaces that trails are made of, for all who lay, paint or drive on them.

/// What the surface of a trail is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum TrailSurfaceKind {
    /// Crushed stone.
    Gravel,
    /// Bare, dry soil.
    DryEarth,
    /// Wet soil.
    Mud,
    /// Short grass.
    Grassy,
    /// Fallen leaves.
    LeafLitter,
    /// Fallen needles.
    Needles,
    /// Sand.
    Sand,
    /// Bed rock and slabs.
    Rock,
}

impl TrailSurfaceKind {
    /// All kinds.
    pub const ALL: [Self; 8] = [
        Self::Gravel,
        Self::DryEarth,
        Self::Mud,
        Self::Grassy,
        Self::LeafLitter,
        Self::Needles,
        Self::Sand,
        Self::Rock,
    ];

    /// The place of this kind in [`ALL`](Self::ALL), for tables with an entry for each kind.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The name used in configurations and files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gravel => "gravel",
            Self::DryEarth => "dry_earth",
            Self::Mud => "mud",
            Self::Grassy => "grassy",
            Self::LeafLitter => "leaf_litter",
            Self::Needles => "needles",
            Self::Sand => "sand",
            Self::Rock => "rock",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_its_own_place_and_name() {
        for (i, kind) in TrailSurfaceKind::ALL.into_iter().enumerate() {
            assert_eq!(kind.index(), i);
            let namesakes = TrailSurfaceKind::ALL
                .into_iter()
                .filter(|k| k.name() == kind.name());
            assert_eq!(namesakes.count(), 1, "{}", kind.name());
        }
    }
}
