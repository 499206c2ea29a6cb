//! Vegetation that closes over the ground, for all who place it or grow it.

/// Low plants that stand so close that they hide the ground between them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum PlantCommunity {
    /// Tall grass that nobody cuts, with flower heads.
    RankGrass,
    /// Short grass, grazed or mown or trodden.
    GrazedGrass,
    /// Tussock grass, with dead blades between the tussocks.
    Tussocks,
    /// Grass that has dried on its stalks, with green blades among it.
    DryGrass,
    /// Lodged grass: tall, and laid by wind and rain.
    LodgedGrass,
    /// A thicket of brambles.
    Bramble,
    /// Bracken, frond beside frond.
    Bracken,
    /// Heather.
    Heath,
    /// Bilberry.
    Bilberry,
    /// Nettles.
    Nettles,
    /// Common reed, at the edge of water.
    Reeds,
}

impl PlantCommunity {
    /// All communities; those of grass come first.
    pub const ALL: [Self; 11] = [
        Self::RankGrass,
        Self::GrazedGrass,
        Self::Tussocks,
        Self::DryGrass,
        Self::LodgedGrass,
        Self::Bramble,
        Self::Bracken,
        Self::Heath,
        Self::Bilberry,
        Self::Nettles,
        Self::Reeds,
    ];

    /// The place of the community in [`ALL`](Self::ALL), for tables with an entry for each.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Whether it is grass.
    #[must_use]
    pub const fn is_grass(self) -> bool {
        matches!(
            self,
            Self::RankGrass
                | Self::GrazedGrass
                | Self::Tussocks
                | Self::DryGrass
                | Self::LodgedGrass
        )
    }

    /// The name used in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::RankGrass => "rank_grass",
            Self::GrazedGrass => "grazed_grass",
            Self::Tussocks => "tussocks",
            Self::DryGrass => "dry_grass",
            Self::LodgedGrass => "lodged_grass",
            Self::Bramble => "bramble_thicket",
            Self::Bracken => "bracken_stand",
            Self::Heath => "heath",
            Self::Bilberry => "bilberry",
            Self::Nettles => "nettles",
            Self::Reeds => "reeds",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_community_has_its_own_place_and_name() {
        for (i, community) in PlantCommunity::ALL.into_iter().enumerate() {
            assert_eq!(community.index(), i);
            assert_eq!(community.is_grass(), i < 5);
            let namesakes = PlantCommunity::ALL
                .into_iter()
                .filter(|c| c.name() == community.name());
            assert_eq!(namesakes.count(), 1, "{}", community.name());
        }
    }
}
