//! What of the stand's table decides how plants are grown.

use nemoral_plan::Encoder;

use super::Assets;

impl Assets {
    /// Encodes what decides how plants are grown, between whose fields lies how densely trees
    /// stand: not the seed, which has a place of its own in keys, and not how frequent shrubs are.
    pub fn encode_grown(&self, trees_per_ha: f64, encoder: &mut dyn Encoder) {
        let Self {
            seed: _,
            individuals,
            trunk_radius_m,
            dbh_mean_m,
            dbh_shape,
            dbh_min_m,
            dbh_max_m,
            maritime_pine,
            eucalyptus,
            english_oak,
            scots_pine,
            norway_spruce,
            douglas_fir,
            cork_oak,
            beech,
            silver_birch,
            own_species,
            own_share,
            snags,
            gorse: _,
            heather: _,
            bramble: _,
        } = self;
        encoder.field("individuals", individuals);
        encoder.field("trees_per_ha", &trees_per_ha);
        encoder.field("trunk_radius_m", trunk_radius_m);
        encoder.field("dbh_mean_m", dbh_mean_m);
        encoder.field("dbh_shape", dbh_shape);
        encoder.field("dbh_min_m", dbh_min_m);
        encoder.field("dbh_max_m", dbh_max_m);
        encoder.field("maritime_pine", maritime_pine);
        encoder.field("eucalyptus", eucalyptus);
        encoder.field("english_oak", english_oak);
        encoder.field("scots_pine", scots_pine);
        encoder.field("norway_spruce", norway_spruce);
        encoder.field("douglas_fir", douglas_fir);
        encoder.field("cork_oak", cork_oak);
        encoder.field("beech", beech);
        encoder.field("silver_birch", silver_birch);
        encoder.field("own_species", own_species);
        encoder.field("own_share", own_share);
        encoder.field("snags", snags);
    }
}
