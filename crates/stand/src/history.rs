//! What happened to the vegetation of a place: browsing, and the years since it was disturbed.

use nemoral_scene::PlantCommunity;
use nemoral_scene::glam::DVec2;

use crate::quantiles::Quantiles;
use crate::{FieldParams, ScalarField};

/// The field of browsing: deer keep to places over hundreds of metres.
pub const BROWSING_FIELD: FieldParams = FieldParams {
    octaves: 2,
    scale_m: 140.0,
    lacunarity: 2.0,
    persistence: 0.4,
};

/// The field of the years since a place was disturbed, as large as what a storm or a harvest opens.
pub const SUCCESSION_FIELD: FieldParams = FieldParams {
    octaves: 3,
    scale_m: 75.0,
    lacunarity: 2.1,
    persistence: 0.45,
};

/// The history of a place, as plants show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SiteHistory {
    /// From −1, where nothing is eaten, over 0 to 1, where deer eat what they like.
    pub browsing: f64,
    /// From −1, just disturbed, over 0 to 1, long left alone.
    pub succession: f64,
    /// From −1, just disturbed or long left alone, to 1, in the years between, in which bushes
    /// close up; 0 on average.
    pub bushes: f64,
}

impl SiteHistory {
    /// A history without any effect.
    pub const NEUTRAL: Self = Self {
        browsing: 0.0,
        succession: 0.0,
        bushes: 0.0,
    };

    /// The history of a place by its ranks among all, 0..=1, in browsing and in the years since a
    /// disturbance; each counts as much as its effect says, 0..=1.
    #[must_use]
    pub fn of_ranks([browsed, old]: [f64; 2], effects: [f64; 2]) -> Self {
        let succession = 2.0 * old - 1.0;
        Self {
            browsing: effects[0] * (2.0 * browsed - 1.0),
            succession: effects[1] * succession,
            bushes: effects[1] * (1.0 - 2.0 * succession.abs()),
        }
    }

    /// How much more of the ground a community covers there; `None` is grass.
    ///
    /// Browsing takes brambles and bilberry, and leaves grass and bracken (Kirby 2001, "The impact
    /// of deer on the ground flora of British broadleaved woodland", Forestry 74, 219-229). After
    /// a disturbance grass and nettles come first, brambles next, bracken and dwarf shrubs stay.
    /// The factors are our choice; over all places their mean is 1.
    pub(crate) fn factor(&self, community: Option<PlantCommunity>) -> f64 {
        let Self {
            browsing: eaten,
            succession: age,
            bushes,
        } = *self;
        match community {
            None => (1.0 + 0.25 * eaten) * (1.0 - 0.5 * age),
            Some(PlantCommunity::Bramble) => (1.0 - 0.8 * eaten) * (1.0 + 0.6 * bushes),
            Some(PlantCommunity::Bracken) => (1.0 + 0.4 * eaten) * (1.0 + 0.4 * age),
            Some(PlantCommunity::Heath) => (1.0 - 0.3 * eaten) * (1.0 + 0.2 * age),
            Some(PlantCommunity::Bilberry) => (1.0 - 0.7 * eaten) * (1.0 + 0.6 * age),
            Some(PlantCommunity::Nettles) => (1.0 + 0.3 * eaten) * (1.0 - 0.6 * age),
            Some(_) => 1.0,
        }
    }

    /// How much more of the five kinds of grass there are, in the order of
    /// [`PlantCommunity::ALL`].
    pub(crate) fn grasses(&self) -> [f64; 5] {
        let eaten = self.browsing;
        [
            1.0 - 0.6 * eaten,
            1.0 + 0.9 * eaten,
            1.0 + 0.4 * eaten,
            1.0,
            1.0 - 0.6 * eaten,
        ]
    }

    /// The size of a community's plants relative to that where nothing is eaten.
    pub(crate) fn vigour(&self, community: PlantCommunity) -> f64 {
        match community {
            PlantCommunity::Bramble | PlantCommunity::Bilberry | PlantCommunity::Heath => {
                1.0 - 0.25 * self.browsing.max(0.0)
            }
            _ => 1.0,
        }
    }

    /// How many more young trees there are.
    #[must_use]
    pub fn young_trees(&self) -> f64 {
        (1.0 - 0.85 * self.browsing) * (1.0 + 0.7 * self.succession)
    }
}

/// The history of the vegetation of a world.
#[derive(Clone, Debug)]
pub struct VegetationHistory<F> {
    browsing: Quantiles<F>,
    succession: Quantiles<F>,
    effects: [f64; 2],
}

impl<F: ScalarField> VegetationHistory<F> {
    /// The history of a world; `effects` says how strongly browsing and succession show, 0..=1.
    /// `field` makes the i-th independent field of these octaves.
    ///
    /// # Errors
    /// If a field cannot be made.
    pub fn new<E>(
        effects: [f64; 2],
        mut field: impl FnMut(u64, FieldParams) -> Result<F, E>,
    ) -> Result<Self, E> {
        Ok(Self {
            browsing: Quantiles::of(field(0, BROWSING_FIELD)?),
            succession: Quantiles::of(field(1, SUCCESSION_FIELD)?),
            effects,
        })
    }

    /// The history of a world position, metres.
    pub fn at(&self, world_m: DVec2) -> SiteHistory {
        let ranks = [&self.browsing, &self.succession].map(|field| field.rank(world_m));
        SiteHistory::of_ranks(ranks, self.effects)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn on_average_nothing_changes() {
        let communities = PlantCommunity::ALL[5..].iter().map(|c| Some(*c));
        for community in std::iter::once(None).chain(communities) {
            let mut mean = 0.0;
            for i in 0..100 {
                let ranks = [i % 10, i / 10].map(|k| f64::from(2 * k + 1) / 20.0);
                mean += SiteHistory::of_ranks(ranks, [1.0, 1.0]).factor(community) / 100.0;
                assert_eq!(
                    SiteHistory::of_ranks(ranks, [0.0; 2]).factor(community),
                    1.0
                );
            }
            assert!((mean - 1.0).abs() < 1e-9, "{community:?}: {mean}");
        }
    }

    #[test]
    fn effects_bound_what_shows() {
        let wave = |_: u64, _: FieldParams| -> Result<_, ()> {
            Ok(|p: DVec2| 0.5 + 0.5 * libm::sin(0.031 * p.x + 0.017 * p.y))
        };
        let history = VegetationHistory::new([0.5, 0.0], wave).expect("fields");
        let (mut low, mut high) = (0.0_f64, 0.0_f64);
        for i in 0..400 {
            let here = history.at(DVec2::new(f64::from(i), 3.0));
            assert_eq!(here.succession, 0.0);
            (low, high) = (low.min(here.browsing), high.max(here.browsing));
        }
        assert!(low < -0.45 && high > 0.45 && low >= -0.5 && high <= 0.5);
    }
}
