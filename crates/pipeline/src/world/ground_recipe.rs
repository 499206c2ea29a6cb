//! The ground that a config asks for.

use nemoral_seed::Key;
use nemoral_stand::Hemisphere;

use super::ground::{GroundModel, GroundTables, SiteGround};
use super::plot::Plot;
use crate::config::{self, Config};
use crate::plan::{Encode, Encoder, Hasher};
use crate::{Error, InputFiles};

/// How a config wants the ground to be, and the files that it names.
#[derive(Clone, Debug)]
pub(crate) struct GroundRecipe {
    terrain: config::Terrain,
    trails: config::Trails,
    water: config::Water,
    deadwood: config::Deadwood,
    meadows: config::Meadows,
    effects: config::GroundEffects,
    hemisphere: Hemisphere,
    dbh_mean_m: f64,
    chunk_size_m: f64,
    site: config::Site,
    inputs: InputFiles,
}

impl GroundRecipe {
    pub(crate) fn new(config: &Config, inputs: &InputFiles) -> Self {
        Self {
            terrain: config.terrain.clone(),
            trails: config.trails.clone(),
            water: config.water.clone(),
            deadwood: config.deadwood.clone(),
            meadows: config.placement.meadows.clone(),
            effects: config.undergrowth.ground.clone(),
            hemisphere: config.season.hemisphere(&config.sun),
            dbh_mean_m: config.assets.dbh_mean_m,
            chunk_size_m: config.chunks.size_m,
            site: config.site.clone(),
            inputs: inputs.clone(),
        }
    }

    pub(crate) fn fingerprint(&self, hasher: &mut Hasher) {
        self.inputs.encode(hasher, self);
    }

    /// The ground of a world.
    pub(crate) fn make(&self, world: Key) -> Result<GroundModel, Error> {
        let (site, inputs) = (&self.site, &self.inputs);
        let map = site.height_map(inputs)?;
        let of_site = SiteGround {
            plot: Plot::new(site, inputs, self.dbh_mean_m, self.chunk_size_m)?,
            posts: map.map(|map| (site.height_posts(&map), site.terrain.blend_m)),
            lines_m: site.trail_lines_m(inputs)?,
        };
        let tables = GroundTables {
            terrain: &self.terrain,
            trails: &self.trails,
            water: &self.water,
            deadwood: &self.deadwood,
            meadows: &self.meadows,
            effects: &self.effects,
            hemisphere: self.hemisphere,
            dbh_mean_m: self.dbh_mean_m,
        };
        GroundModel::new(tables, of_site, self.chunk_size_m, world)
    }
}

impl Encode for GroundRecipe {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            terrain,
            trails,
            water,
            deadwood,
            meadows,
            effects,
            hemisphere,
            dbh_mean_m,
            chunk_size_m,
            site,
            inputs: _,
        } = self;
        encoder.field("terrain", terrain);
        encoder.field("trails", trails);
        encoder.field("water", water);
        encoder.field("thrown_per_ha", &deadwood.thrown_per_ha);
        encoder.field("across_trails", &deadwood.across_trails);
        // How dense the layers are at their edges belongs to the placement.
        encoder.field("meadows_share", &meadows.share);
        encoder.field("meadows_scale_m", &meadows.scale_m);
        encoder.field("meadows_mantle_m", &meadows.mantle_m);
        encoder.field("meadows_kept", &meadows.kept);
        encoder.field("effects", effects);
        // Only there the sun stands elsewhere.
        if *hemisphere == Hemisphere::Southern {
            encoder.field("southern", &true);
        }
        encoder.field("dbh_mean_m", dbh_mean_m);
        encoder.field("chunk_size_m", chunk_size_m);
        encoder.field("origin_x_m", &site.origin_x_m);
        encoder.field("origin_y_m", &site.origin_y_m);
        encoder.field("stems", &site.stems.path);
        encoder.field("margin_m", &site.stems.margin_m);
        encoder.field("site_terrain", &site.terrain);
        encoder.field("site_trails", &site.trails);
    }
}
