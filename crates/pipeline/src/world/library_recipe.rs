//! The library, as a config describes it.

use nemoral_assets::{
    AssetParams, ClimberParams, LitterParams, Season, Species, StandParams, StandSpecies, StemMoss,
};
use nemoral_scene::glam::Vec3;
use nemoral_scene::{PlantCommunity, TrailSurfaceKind};
use nemoral_seed::Key;

use super::communities::community_params;
use super::ways::{has_wayside, skid_brash, surfaces};
use crate::config::{self, Config, MeasuredStems, SiteSpecies};
use crate::plan::{Encode, Encoder, Hasher};
use crate::{Error, InputFiles};

/// The plants that are to be grown.
#[derive(Clone, Debug)]
pub(crate) struct LibraryRecipe {
    assets: config::Assets,
    /// Trees on a hectare of the stand, in steps.
    trees_per_ha: f64,
    saplings: bool,
    seedlings: bool,
    deadwood: bool,
    climbers: Option<ClimberParams>,
    communities: Vec<PlantCommunity>,
    trail_surfaces: Vec<TrailSurfaceKind>,
    wayside: bool,
    stream_stones: bool,
    rock_faces: bool,
    surface_roots: bool,
    /// Whether trees stand at edges of the wood.
    edge_trees: bool,
    /// The amounts of leaves, of wood and of stones in litter; `None` without litter.
    litter: Option<[f64; 3]>,
    /// High summer without one.
    season: Option<Season>,
    /// Whether anything is to be looked at.
    textures: bool,
    /// Its materials do not change what is grown.
    water: bool,
    /// Neither does that.
    snow: [f64; 2],
    /// The trees of a stem map; of their places, how densely they stand.
    site: config::Site,
    /// The models that it may name.
    tree_models: Vec<String>,
    inputs: InputFiles,
}

impl Encode for LibraryRecipe {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            assets,
            trees_per_ha,
            saplings,
            seedlings,
            deadwood,
            climbers,
            communities,
            trail_surfaces,
            wayside,
            stream_stones,
            rock_faces,
            surface_roots,
            edge_trees,
            litter,
            season,
            textures,
            water: _,
            snow: _,
            site,
            tree_models,
            inputs: _,
        } = self;
        // The seed is in the context of the stage that grows the plants.
        assets.encode_grown(*trees_per_ha, encoder);
        encoder.field("saplings", saplings);
        encoder.field("seedlings", seedlings);
        encoder.field("deadwood", deadwood);
        let communities: Vec<&str> = communities.iter().map(|c| c.name()).collect();
        encoder.field("communities", &communities.join(" "));
        let trail_surfaces: Vec<&str> = trail_surfaces.iter().map(|k| k.name()).collect();
        encoder.field("trail_surfaces", &trail_surfaces.join(" "));
        encoder.field("wayside", wayside);
        encoder.field("stream_stones", stream_stones);
        encoder.field("rock_faces", rock_faces);
        encoder.field("surface_roots", surface_roots);
        // Without edges, none of their trees.
        if *edge_trees {
            encoder.field("edge_trees", edge_trees);
        }
        // Without litter, no leaves.
        encoder.field("litter", &litter.unwrap_or([0.0; 3]));
        if let Some(Season {
            day_of_year,
            latitude_deg,
        }) = season
        {
            encoder.field("season", &[*day_of_year, *latitude_deg]);
        }
        if !textures {
            encoder.field("textures", textures);
        }
        // Without climbers, no moss of any height.
        let moss = climbers.map(|of| [of.moss.amount, of.moss.height_m]);
        encoder.field("climbers", &moss.unwrap_or([-1.0, 0.0]));
        if let Some(of) = climbers {
            encoder.field("lianas", &of.lianas);
            encoder.field("resin", &of.resin);
        }
        encoder.field("stems", &site.stems.path);
        if !site.stems.path.is_empty() {
            encoder.field("stems_margin_m", &site.stems.margin_m);
        }
        encoder.field("other_species", &site.stems.other_species);
        encoder.field("shapes", &site.stems.shapes);
        // Without a stem map, models do not change what is grown.
        if !site.stems.path.is_empty() && !tree_models.is_empty() {
            encoder.field("tree_models", &tree_models.join(" "));
        }
    }
}

/// The number of living trees for each dead one that is grown.
const LIVING_PER_SNAG: u32 = 4;

/// The number of seedlings that are grown of each species.
const SEEDLINGS: u32 = 8;

/// The surfaces of trails whose textures the beds of waters have.
const BEDS: [TrailSurfaceKind; 2] = [TrailSurfaceKind::Gravel, TrailSurfaceKind::Mud];

/// The number of living trees for each sapling that is grown.
const LIVING_PER_SAPLING: u32 = 2;

/// How many trees stand on a hectare outside of gaps, by which their crowns are grown, in steps of
/// half an octave: so worlds of similar density share their plants, and in stands of up to 60 m² of
/// basal area per hectare crown ratios differ by at most 0.05 from those of the very density.
fn trees_per_ha(config: &Config) -> f64 {
    const STEPS_PER_OCTAVE: f64 = 2.0;
    let placement = &config.placement;
    let m2 = config.chunks.size_m * config.chunks.size_m * (1.0 - placement.gaps.share);
    let per_ha = (10_000.0 * placement.trees / m2).clamp(1.0, 16_384.0);
    libm::exp2((STEPS_PER_OCTAVE * libm::log2(per_ha)).round() / STEPS_PER_OCTAVE)
}

impl LibraryRecipe {
    pub(crate) fn new(config: &Config, inputs: &InputFiles) -> Self {
        let mut recipe = Self {
            assets: config.assets.clone(),
            trees_per_ha: trees_per_ha(config),
            saplings: config.placement.regeneration.saplings > 0.0,
            seedlings: config.placement.regeneration.seedlings > 0.0,
            deadwood: config.deadwood.is_any() || skid_brash(&config.trails) > 0.0,
            climbers: {
                let c = &config.climbers;
                let wanted = ClimberParams {
                    moss: StemMoss {
                        amount: c.moss,
                        height_m: c.moss_height_m,
                    },
                    lianas: c.honeysuckle > 0.0 || c.clematis > 0.0,
                    resin: c.resin > 0.0,
                };
                let any = c.ivy > 0.0 || c.moss > 0.0 || wanted.lianas || wanted.resin;
                any.then_some(wanted)
            },
            communities: community_params(&config.undergrowth, &config.water).wanted(),
            trail_surfaces: {
                let mut surfaces = surfaces(&config.trails);
                if config.water.has_beds() {
                    for bed in BEDS {
                        if !surfaces.contains(&bed) {
                            surfaces.push(bed);
                        }
                    }
                }
                surfaces
            },
            wayside: has_wayside(&config.trails)
                || config.water.springs_per_km2 > 0.0
                || config.placement.outcrops > 0.0,
            stream_stones: config.water.springs_per_km2 > 0.0,
            rock_faces: config.terrain.has_cliffs(),
            surface_roots: config.undergrowth.surface_roots > 0.0,
            edge_trees: {
                let of = &config.placement.meadows;
                of.share > 0.0 && of.edge_trees > 0.0
            },
            litter: {
                let of = &config.litter;
                of.is_any().then_some([of.leaves, of.wood, of.stones])
            },
            season: config.season.place(&config.sun),
            textures: config.all_cameras().next().is_some(),
            water: config.water.is_any(),
            snow: [config.weather.snow_depth_m, config.weather.snow_on_crowns],
            site: config.site.clone(),
            tree_models: config.tree_models(),
            inputs: inputs.clone(),
        };
        // On days without any difference all worlds share their plants.
        if let Some((season, species)) = recipe.season.zip(recipe.species().ok()) {
            let grown: Vec<Species> = (recipe.params(&species).species.into_iter())
                .map(|of| of.species)
                .collect();
            recipe.season = (!season.is_high_summer(&grown)).then_some(season);
        }
        recipe
    }

    /// The same with textures, which a forest without cameras has not.
    pub(crate) fn textured(self) -> Self {
        Self {
            textures: true,
            ..self
        }
    }

    pub(crate) fn fingerprint(&self, hasher: &mut Hasher) {
        self.inputs.encode(hasher, self);
    }

    /// Whether anything is to be looked at.
    pub(crate) fn has_textures(&self) -> bool {
        self.textures
    }

    /// Whether there is any water in the world.
    pub(crate) fn has_water(&self) -> bool {
        self.water
    }

    /// The depth of snow on level ground in the open, metres, and the share of shoots that hold
    /// some.
    pub(crate) fn snow(&self) -> [f64; 2] {
        self.snow
    }

    /// The key that the plants of a world grow from: its own, unless they have a seed.
    pub(crate) fn key(&self, world: &Key) -> Key {
        self.assets.own_seed().map_or(*world, Key::world)
    }

    /// As [`SiteSpecies::all`].
    pub(crate) fn species(&self) -> Result<Vec<(Species, f64)>, Error> {
        Ok(self.of_site().all()?)
    }

    /// As [`SiteSpecies::measured`].
    pub(crate) fn measured(
        &self,
        species: &[(Species, f64)],
        key: Key,
    ) -> Result<MeasuredStems, Error> {
        Ok(self.of_site().measured(species, key)?)
    }

    /// An error in the stem map.
    pub(crate) fn of_stems(&self, message: &str) -> Error {
        self.of_site().of_stems(message).into()
    }

    fn of_site(&self) -> SiteSpecies<'_> {
        SiteSpecies {
            assets: &self.assets,
            site: &self.site,
            tree_models: &self.tree_models,
            inputs: &self.inputs,
        }
    }

    /// The share of the light on leaves that their shoots scatter, linear sRGB: the mean over all
    /// leaf area, by the species' shares and their leaf area at the stand's mean diameter.
    pub(crate) fn foliage_albedo(&self) -> Result<Vec3, Error> {
        let named = self.species()?;
        let share = |name: &str| {
            named
                .iter()
                .find(|(s, _)| s.name == name)
                .map_or(1.0, |n| n.1)
        };
        let (mut sum, mut total) = (Vec3::ZERO, 0.0);
        for StandSpecies {
            species,
            dbh_mean_m,
            ..
        } in self.params(&named).species
        {
            let (leaves, there) = species.shoot_in(self.season.as_ref());
            let in_summer = share(&species.name) * species.mean_leaf_area_m2(dbh_mean_m);
            let area = (in_summer * there.max(0.01)) as f32;
            sum += area * leaves.scattering();
            total += area;
        }
        Ok(sum / total)
    }

    /// Mean diameter of the stand's trees at breast height, metres.
    pub(crate) fn dbh_mean_m(&self) -> f64 {
        self.assets.dbh_mean_m
    }

    /// The share of standing trees that are dead.
    pub(crate) fn snag_share(&self) -> f64 {
        self.assets.snags
    }

    pub(crate) fn params(&self, species: &[(Species, f64)]) -> AssetParams {
        let a = &self.assets;
        let mut params = AssetParams {
            individuals_per_species: a.individuals,
            snags_per_species: if a.snags > 0.0 {
                a.individuals.div_ceil(LIVING_PER_SNAG)
            } else {
                0
            },
            saplings_per_species: if self.saplings {
                a.individuals.div_ceil(LIVING_PER_SAPLING)
            } else {
                0
            },
            seedlings_per_species: if self.seedlings { SEEDLINGS } else { 0 },
            deadwood: self.deadwood,
            climbers: self.climbers,
            communities: self.communities.clone(),
            trail_surfaces: self.trail_surfaces.clone(),
            wayside: self.wayside,
            stream_stones: self.stream_stones,
            rock_faces: self.rock_faces,
            surface_roots: self.surface_roots,
            edge_trees: self.edge_trees,
            season: self.season,
            textures: self.textures,
            trunk_radius_m: a.trunk_radius_m,
            stand: StandParams {
                shape: a.dbh_shape,
                dbh_min_m: a.dbh_min_m,
                dbh_max_m: a.dbh_max_m,
            },
            ..AssetParams::default()
        };
        if !species.is_empty() {
            let total: f64 = species.iter().map(|(_, share)| share).sum();
            let per_share = self.trees_per_ha / total.max(f64::MIN_POSITIVE);
            let of = |(species, share): &(Species, f64)| StandSpecies {
                species: species.clone(),
                dbh_mean_m: a.dbh_mean_m,
                trees_per_ha: per_share * share,
            };
            params.species = species.iter().map(of).collect();
        }
        params.litter = self.litter.map(|[leaves, wood, stones]| {
            let share = |i: usize| species.get(i).map_or(1.0, |(_, share)| *share);
            LitterParams {
                shares: (0..params.species.len()).map(share).collect(),
                leaves,
                wood,
                stones,
            }
        });
        params
    }
}
