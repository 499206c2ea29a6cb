//! The species of a stand with their shares.

use super::{Assets, Deadwood};

impl Deadwood {
    /// Whether anything with an id is asked for: logs, root plates.
    #[must_use]
    pub fn has_objects(&self) -> bool {
        self.volume_m3_ha > 0.0 || self.thrown_per_ha > 0.0
    }

    /// Whether anything is asked for.
    #[must_use]
    pub fn is_any(&self) -> bool {
        [
            self.volume_m3_ha,
            self.thrown_per_ha,
            self.branches,
            self.brash,
        ]
        .iter()
        .any(|&wanted| wanted > 0.0)
    }
}

impl Assets {
    /// The built-in species with their shares, and the share of the user's own species (`None`).
    #[must_use]
    pub fn shares(&self) -> [(Option<&'static str>, f64); 10] {
        [
            (Some("maritime_pine"), self.maritime_pine),
            (Some("eucalyptus"), self.eucalyptus),
            (Some("english_oak"), self.english_oak),
            (Some("scots_pine"), self.scots_pine),
            (Some("norway_spruce"), self.norway_spruce),
            (Some("douglas_fir"), self.douglas_fir),
            (Some("cork_oak"), self.cork_oak),
            (Some("beech"), self.beech),
            (Some("silver_birch"), self.silver_birch),
            (None, self.own_share),
        ]
    }

    /// The seed of the plants, if it is not the world's.
    #[must_use]
    pub fn own_seed(&self) -> Option<u64> {
        (self.seed > 0).then_some(self.seed)
    }
}
