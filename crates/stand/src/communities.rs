//! Where vegetation closes over the ground, and which: swards and thickets.

use nemoral_scene::PlantCommunity;
use nemoral_scene::glam::DVec2;

use crate::quantiles::Quantiles;
use crate::{FieldParams, ScalarField, SiteHistory};

/// The field that makes stands of one community, some metres to tens of metres wide.
pub const COMMUNITY_FIELD: FieldParams = FieldParams {
    octaves: 4,
    scale_m: 26.0,
    lacunarity: 2.1,
    persistence: 0.55,
};

/// The field by which a sward changes from one kind of grass to another.
pub const SWARD_FIELD: FieldParams = FieldParams {
    octaves: 3,
    scale_m: 19.0,
    lacunarity: 2.3,
    persistence: 0.5,
};

/// How much more of the ground thickets cover at the edge of a wood, for small shares.
const FRINGE: f64 = 1.6;
/// Reeds stand as far from water as the first, metres, and nowhere farther than the second.
const REEDS_M: [f64; 2] = [1.2, 2.8];
/// Over this part of a field's quantiles, plants get lower, and thickets sparser, towards the
/// border of their stand.
const BORDER: f64 = 0.06;
/// The density of a thicket at its border.
const SPARSE: f64 = 0.2;

/// The conditions for low plants at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommunitySite {
    /// The sky view factor near the ground, 0..1.
    pub sky_view: f64,
    /// From 0, dry, over 0.5, as most of the ground, to 1, wet.
    pub moisture: f64,
    /// Rise over run.
    pub slope: f64,
    /// Sun on the slope, as [`GroundConditions::heat_load`](crate::GroundConditions); 0 for level
    /// ground.
    pub heat_load: f64,
    /// Depth of the soil, metres, 0 and more; 0.5 where it has no effect.
    pub soil_m: f64,
    /// The share of a meadow's grass, 0..=1: at 1 there is grass alone, without gaps.
    pub meadow: f64,
    /// How near the edge of a wood is, 0..=1, where thickets close up; 0 far from any.
    pub fringe: f64,
    /// The distance from the edge of a stream or pond, metres; infinite where there is none.
    pub bank_m: f64,
    /// What happened there to the vegetation.
    pub history: SiteHistory,
}

/// Closed vegetation at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommunityCover {
    /// What grows there.
    pub community: PlantCommunity,
    /// Its size relative to that in the middle of a stand, 0.45..=1.
    pub vigour: f64,
    /// How dense it is relative to the middle of a stand, above 0 and at most 1: thickets end in
    /// single plants, grass closes up to its border.
    pub density: f64,
}

/// The abundance of vegetation that closes over the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommunityParams {
    /// The share of the ground, where all conditions suit it, under grass, 0..=1.
    pub sward: f64,
    /// The weights of the five kinds of grass in the order of [`PlantCommunity::ALL`]; none is
    /// negative, and their sum is positive if there is a sward.
    pub grasses: [f64; 5],
    /// The shares of the other communities in that order, each 0..=1: reeds of the banks of
    /// streams and ponds, the others of the ground.
    pub thickets: [f64; 6],
}

impl CommunityParams {
    /// The communities that may grow somewhere.
    #[must_use]
    pub fn wanted(&self) -> Vec<PlantCommunity> {
        let [grass, thickets] = [&PlantCommunity::ALL[..5], &PlantCommunity::ALL[5..]];
        let grass = grass.iter().zip(&self.grasses);
        // Trodden trails have short grass, whatever its weight.
        let grass = grass.filter(|(community, weight)| {
            let is_trodden = **community == PlantCommunity::GrazedGrass;
            self.sward > 0.0 && (**weight > 0.0 || is_trodden)
        });
        let thickets = thickets.iter().zip(&self.thickets);
        let thickets = thickets.filter(|(_, share)| **share > 0.0);
        grass.chain(thickets).map(|(c, _)| *c).collect()
    }
}

/// The stands of closed vegetation of a world.
///
/// Each community has a field of its own, which is cut at its own quantile so that it covers its
/// share of the ground where light, moisture and slope suit it, and less elsewhere. Where several
/// would grow, that one does which is farthest within its stand.
#[derive(Clone, Debug)]
pub struct Communities<F> {
    /// Grass is `None`: its kind is chosen by `sward`.
    members: Vec<(Option<PlantCommunity>, f64, Quantiles<F>)>,
    grasses: [f64; 5],
    sward: Quantiles<F>,
}

impl<F: ScalarField> Communities<F> {
    /// The communities of a world. `field` makes the i-th independent field of these octaves.
    ///
    /// # Errors
    /// If a field cannot be made.
    pub fn new<E>(
        params: &CommunityParams,
        mut field: impl FnMut(u64, FieldParams) -> Result<F, E>,
    ) -> Result<Self, E> {
        let grass = std::iter::once((None, params.sward));
        let thickets = PlantCommunity::ALL[5..].iter().zip(params.thickets);
        let thickets = thickets.map(|(community, share)| (Some(*community), share));
        let mut members = Vec::new();
        for (i, (community, share)) in grass.chain(thickets).enumerate() {
            if share > 0.0 {
                let field = Quantiles::of(field(i as u64 + 1, COMMUNITY_FIELD)?);
                members.push((community, share, field));
            }
        }
        Ok(Self {
            members,
            grasses: params.grasses,
            sward: Quantiles::of(field(0, SWARD_FIELD)?),
        })
    }

    /// Whether nothing closes over the ground anywhere.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    /// What closes over the ground at a world position, metres.
    pub fn at(&self, world_m: DVec2, site: &CommunitySite) -> Option<CommunityCover> {
        let depths = self.members.iter().filter_map(|(community, share, field)| {
            let share = share * suitability(*community, site);
            let share = (share * site.history.factor(*community)).min(1.0);
            let share = in_meadow(share, *community, site);
            let inside = field.rank(world_m) - (1.0 - share);
            (share > 0.0 && inside >= 0.0).then_some((community, inside, inside / share))
        });
        let (community, inside, _) = depths.max_by(|a, b| a.2.total_cmp(&b.2))?;
        let community = community.unwrap_or_else(|| self.grass(world_m, site));
        let within = (inside / BORDER).min(1.0);
        Some(CommunityCover {
            community,
            vigour: (0.6 + 0.4 * within) * site.history.vigour(community),
            density: if community.is_grass() {
                1.0
            } else {
                SPARSE + (1.0 - SPARSE) * within
            },
        })
    }

    /// The kind of grass at a place: dry kinds where it is dry, short ones where it is browsed.
    fn grass(&self, world_m: DVec2, site: &CommunitySite) -> PlantCommunity {
        // Rank, grazed, tussocks, dry, lodged.
        let dryness = (1.0 - site.moisture.clamp(0.0, 1.0)) * 2.0;
        let by_moisture = [1.0, 1.0, 2.0 - dryness, dryness, 1.0];
        let by_history = site.history.grasses();
        let weight = |i: usize| self.grasses[i] * by_moisture[i] * by_history[i];
        let total: f64 = (0..5).map(weight).sum();
        let mut rest = self.sward.rank(world_m) * total;
        for (i, community) in PlantCommunity::ALL[..5].iter().enumerate() {
            rest -= weight(i);
            if rest < 0.0 {
                return *community;
            }
        }
        // Where no kind suits the place, one that was asked for.
        let last = (0..5).rev().find(|&i| self.grasses[i] > 0.0);
        PlantCommunity::ALL[last.unwrap_or(0)]
    }

    /// A value from 0 to 1 that changes slowly from place to place, by which grass differs in
    /// colour and thickets in height.
    pub fn variant(&self, world_m: DVec2) -> f64 {
        // Beside the borders of the kinds of grass, which are made from the same field.
        self.sward.rank(world_m + DVec2::new(311.7, -173.9))
    }
}

/// How well a place suits a community, 0..=1; `None` is grass. The ranges of light follow the
/// order of Ellenberg's values for the species (bilberry 5, bracken and nettles 6, bramble 6 to 7,
/// grass of glades 7, reed 7, heather 8); their limits are our choice.
fn suitability(community: Option<PlantCommunity>, site: &CommunitySite) -> f64 {
    let (dark, light) = match community {
        Some(PlantCommunity::Bramble) => (0.12, 0.32),
        Some(PlantCommunity::Bracken | PlantCommunity::Nettles) => (0.10, 0.28),
        Some(PlantCommunity::Heath) => (0.20, 0.45),
        Some(PlantCommunity::Bilberry) => (0.08, 0.22),
        Some(PlantCommunity::Reeds) => (0.22, 0.45),
        _ => (0.14, 0.38),
    };
    let by_moisture = match community {
        Some(PlantCommunity::Nettles) => ramp(0.42, 0.70, site.moisture),
        Some(PlantCommunity::Heath) => 1.0 - ramp(0.55, 0.90, site.moisture),
        Some(PlantCommunity::Reeds) => 1.0 - ramp(REEDS_M[0], REEDS_M[1], site.bank_m),
        _ => 1.0,
    };
    // Nettles follow nutrients, which deep soil has; heather stays where others find too little.
    let by_soil = match community {
        Some(PlantCommunity::Nettles) => ramp(0.1, 0.5, site.soil_m),
        Some(PlantCommunity::Bracken) => ramp(0.05, 0.4, site.soil_m),
        Some(PlantCommunity::Bramble) => ramp(0.0, 0.25, site.soil_m),
        Some(PlantCommunity::Heath) => 1.0 - 0.6 * ramp(0.7, 1.2, site.soil_m),
        Some(PlantCommunity::Bilberry) => 1.0 - 0.3 * ramp(0.7, 1.2, site.soil_m),
        Some(PlantCommunity::Reeds) => 1.0,
        _ => ramp(-0.06, 0.16, site.soil_m),
    };
    let by_sun = match community {
        Some(PlantCommunity::Bilberry) => 1.0 - 0.8 * ramp(0.06, 0.28, site.heat_load),
        Some(PlantCommunity::Heath) => 1.0 - 0.6 * ramp(0.06, 0.28, -site.heat_load),
        _ => 1.0,
    };
    let by_slope = 1.0 - ramp(0.75, 1.1, site.slope);
    ramp(dark, light, site.sky_view) * by_moisture * by_slope * by_soil * by_sun
}

/// The share of a community by what people do: mowing leaves grass, and thickets creep out of the
/// edge of a wood as far as they are let.
fn in_meadow(share: f64, community: Option<PlantCommunity>, site: &CommunitySite) -> f64 {
    match community {
        None => share + (1.0 - share) * site.meadow,
        Some(_) => (share + FRINGE * site.fringe * share * (1.0 - share)) * (1.0 - site.meadow),
    }
}

/// From 0 at and below `low` to 1 at and above `high`.
fn ramp(low: f64, high: f64, value: f64) -> f64 {
    ((value - low) / (high - low)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests;
