//! The leaves of a species in their season.

use std::sync::Arc;

use nemoral_scene::{AlphaMask, MaterialId};
use nemoral_seed::{Domain, Draw, Key};

use super::plant_phenology;
use crate::tree::{LeafLook, PhenologyState, Season, SeasonalLeaves, Species};

const TIMING: Domain = Domain::new("assets.tree.timing");

/// Standard deviation of the days by which trees of a species are early or late: of 146 beeches on
/// one hectare 23 were always 3 to 6 days early and 22 always 3 to 10 days late (Malyshev 2022).
const TREE_SD_DAYS: f64 = 4.0;

/// Less fresh litter than this is not seen.
const FRESH_LITTER_SEEN: f64 = 0.1;

/// When a tree unfolds and drops its leaves, by what others of its species do. Three equal groups
/// have the standard deviation of all trees; the young are a group of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LeafingGroup {
    Early,
    Middle,
    Late,
    Young,
}

impl LeafingGroup {
    pub(crate) const ALL: [Self; 4] = [Self::Early, Self::Middle, Self::Late, Self::Young];

    /// That of the grown tree of a key.
    pub(crate) fn of_tree(key: Key) -> Self {
        Self::ALL[key.domain(TIMING).rng().below(3) as usize]
    }

    fn late_days(self) -> f64 {
        let group = TREE_SD_DAYS * f64::sqrt(1.5);
        match self {
            Self::Early => -group,
            Self::Middle | Self::Young => 0.0,
            Self::Late => group,
        }
    }
}

/// What the leaves of a species look like in each of its groups.
#[derive(Clone, Debug)]
pub(super) struct SpeciesLeaves {
    /// The leaves of summer, as in a shoot.
    pub(super) summer: LeafLook,
    /// Different leaves, of which each group has some; without any, they are those of summer.
    pub(super) seasonal: Vec<SeasonalLeaves>,
    /// Which of them each group has.
    group: [usize; LeafingGroup::ALL.len()],
}

impl SpeciesLeaves {
    /// Those of a species; those of summer, if there is no season.
    pub(super) fn new(species: &Species, season: Option<&Season>) -> Self {
        let mut leaves = Self {
            summer: species.shoot(),
            seasonal: Vec::new(),
            group: [0; LeafingGroup::ALL.len()],
        };
        let Some((season, phenology)) = season.zip(species.phenology) else {
            return leaves;
        };
        let phases = LeafingGroup::ALL
            .map(|group| phenology.phase(season, group.late_days(), group == LeafingGroup::Young));
        if phases == [PhenologyState::SUMMER; LeafingGroup::ALL.len()] {
            return leaves;
        }
        let mut different: Vec<PhenologyState> = Vec::new();
        for (group, phase) in leaves.group.iter_mut().zip(phases) {
            let known = different.iter().position(|other| *other == phase);
            *group = known.unwrap_or_else(|| {
                different.push(phase);
                different.len() - 1
            });
        }
        let factor = species.foliage.silhouette_factor;
        let of = |phase| SeasonalLeaves::new(species.leaves.clone(), phenology, phase, factor);
        leaves.seasonal = different.into_iter().map(of).collect();
        leaves
    }

    /// The number of a group's leaves among those that are different.
    pub(super) fn number(&self, group: LeafingGroup) -> usize {
        self.group[group as usize]
    }

    /// Those of seedlings, which stand alone; `None` in summer.
    pub(super) fn of_seedlings(&self) -> Option<SeasonalLeaves> {
        let young = self.seasonal.get(self.number(LeafingGroup::Young))?;
        Some(young.clone().alone())
    }
}

impl Season {
    /// Whether nothing differs from high summer in a forest of these species.
    #[must_use]
    pub fn is_high_summer(&self, species: &[Species]) -> bool {
        let is_green = |species: &Species| {
            let leaves = SpeciesLeaves::new(species, Some(self));
            let litter = species.phenology.map_or(0.0, |p| p.fresh_litter(self));
            leaves.seasonal.is_empty() && litter < FRESH_LITTER_SEEN
        };
        species.iter().all(is_green) && plant_phenology::is_high_summer(self)
    }
}

/// The masks that surfaces have in full leaf, where the season has taken leaves away.
pub(crate) type FullLeafMasks = Vec<(MaterialId, Arc<AlphaMask>)>;
