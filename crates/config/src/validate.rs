//! Combinations of keys that are impossible, though each value alone is allowed.

use nemoral_assets::Species;
use nemoral_stand::least_soil_effect_of_outcrops;

use super::{Config, Error, InputFiles, ModelKind, SunPosition, site};

/// The number of chunks along each axis that instance images can distinguish.
const CHUNKS_OF_A_VIEW_MAX: f64 = 16.0;

/// The impossible combinations found so far: the key and the message.
#[derive(Default)]
pub(super) struct Problems(Vec<(String, String)>);

impl Problems {
    /// Adds an error about the table or key at `path`, with which the message starts.
    pub(super) fn add(&mut self, path: &str, message: &str) {
        self.0.push((path.to_owned(), format!("{path}{message}")));
    }

    /// Adds an error about the value of a key: `key = value: must …`.
    pub(super) fn refuse(&mut self, key: &str, value: impl std::fmt::Display, must: &str) {
        self.add(key, &format!(" = {value}: must {must}"));
    }

    /// Adds an error about `low` if it is above `high`.
    pub(super) fn ordered(&mut self, low: (&str, f64), high: (&str, f64)) {
        if low.1 > high.1 {
            let must = format!("be at most {} = {}", high.0, high.1);
            self.refuse(low.0, low.1, &must);
        }
    }
}

impl Config {
    /// Every impossible combination: the key and the message.
    pub(super) fn problems(&self, inputs: &InputFiles) -> Vec<(String, String)> {
        let mut out = Problems::default();
        self.chunk_problems(&mut out);
        self.placement_problems(inputs, &mut out);
        self.ground_problems(&mut out);
        self.asset_problems(&mut out);
        self.undergrowth_problems(&mut out);
        self.sward_problems(&mut out);
        self.floor_problems(&mut out);
        self.species_file_problems(inputs, &mut out);
        self.light_problems(inputs, &mut out);
        self.sensor_problems(&mut out);
        self.sensor_name_problems(&mut out);
        self.robot_problems(inputs, &mut out);
        out.0.extend(self.balance_problems());
        out.0.extend(self.imu_problems());
        out.0.extend(self.navigation_problems());
        out.0.extend(self.model_problems(inputs));
        out.0.extend(site::problems(self, inputs));
        out.0
    }

    fn chunk_problems(&self, out: &mut Problems) {
        let c = &self.chunks;
        let visible = ("chunks.visible_radius_m", c.visible_radius_m);
        out.ordered(
            ("chunks.undergrowth_radius_m", c.undergrowth_radius_m),
            visible,
        );
        if c.delete_radius_m < c.visible_radius_m {
            let must = format!("be at least {} = {}", visible.0, visible.1);
            out.refuse("chunks.delete_radius_m", c.delete_radius_m, &must);
        }
        let widest = 2.0 * (c.visible_radius_m / c.size_m).floor() + 2.0;
        if widest > CHUNKS_OF_A_VIEW_MAX {
            let below_m = 0.5 * CHUNKS_OF_A_VIEW_MAX * c.size_m;
            let message = format!(
                " = {}: views would span {widest} chunks of {} m, and instance images tell only \
                 {CHUNKS_OF_A_VIEW_MAX} apart: must be below {below_m}",
                visible.1, c.size_m
            );
            out.add(visible.0, &message);
        }
    }

    fn asset_problems(&self, out: &mut Problems) {
        let (a, p) = (&self.assets, &self.placement);
        let is_grown = a.shares().iter().any(|(_, share)| *share > 0.0);
        if p.trees > 0.0 && !is_grown && self.share_of_models(ModelKind::Tree) <= 0.0 {
            out.add(
                "assets",
                ": the species shares are all 0, and placement.trees asks for trees",
            );
        }
        if a.dbh_min_m >= a.dbh_max_m {
            let must = format!("be below assets.dbh_max_m = {}", a.dbh_max_m);
            out.refuse("assets.dbh_min_m", a.dbh_min_m, &must);
        }
        if !(a.dbh_min_m..=a.dbh_max_m).contains(&a.dbh_mean_m) {
            let must = format!(
                "be from assets.dbh_min_m = {} to assets.dbh_max_m = {}",
                a.dbh_min_m, a.dbh_max_m
            );
            out.refuse("assets.dbh_mean_m", a.dbh_mean_m, &must);
        }
        let shrubs = a.gorse + a.heather + a.bramble + self.share_of_models(ModelKind::Shrub);
        if p.shrubs > 0.0 && shrubs <= 0.0 {
            out.add(
                "assets",
                ": the shares of gorse, heather and bramble are all 0, and placement.shrubs asks \
                 for shrubs",
            );
        }
    }

    fn undergrowth_problems(&self, out: &mut Problems) {
        let u = &self.undergrowth;
        if u.floor.leaf_litter + u.floor.needle_litter + u.floor.moss <= 0.0 {
            out.add(
                "undergrowth.floor",
                ": the shares are all 0: something must cover the ground",
            );
        }
        if u.cover > 0.0 && u.grass + u.herbs + u.ferns <= 0.0 {
            out.add(
                "undergrowth",
                ": the weights of grass, herbs and ferns are all 0, and undergrowth.cover asks \
                 for plants",
            );
        }
    }

    fn sward_problems(&self, out: &mut Problems) {
        let s = &self.undergrowth.sward;
        if s.cover > 0.0 && s.rank + s.grazed + s.tussocks + s.dry + s.lodged <= 0.0 {
            out.add(
                "undergrowth.sward",
                ": the weights of rank, grazed, tussocks, dry and lodged are all 0, and \
                 undergrowth.sward.cover asks for grass",
            );
        }
    }

    /// What is asked for by one key, and made impossible by another.
    fn floor_problems(&self, out: &mut Problems) {
        let (p, u) = (&self.placement, &self.undergrowth);
        if p.meadows.share > 0.0 && p.meadows.kept > 0.0 && u.sward.cover <= 0.0 {
            let must = "be 0, or undergrowth.sward.cover above 0: a kept meadow is of its grass";
            out.refuse("placement.meadows.kept", p.meadows.kept, must);
        }
        let least_soil_effect = least_soil_effect_of_outcrops();
        if p.outcrops > 0.0 && u.ground.soil <= least_soil_effect {
            let must = format!(
                "be 0, or undergrowth.ground.soil above {least_soil_effect:.1}: rock crops out \
                 where soil is thin"
            );
            out.refuse("placement.outcrops", p.outcrops, &must);
        }
    }

    fn species_file_problems(&self, inputs: &InputFiles, out: &mut Problems) {
        const KEY: &str = "assets.own_species";
        match inputs.get(&self.assets.own_species) {
            Some(file) => {
                let species = file.text().and_then(|text| {
                    let origin = file.path().display().to_string();
                    Species::from_toml(text, &origin).map_err(|e| Error::request(e.to_string()))
                });
                if let Err(e) = species {
                    out.add(KEY, &format!(": {e}"));
                }
            }
            None if self.assets.own_share > 0.0 => {
                let must = "name a species file, as assets.own_share is above 0";
                out.refuse(KEY, "\"\"", must);
            }
            None => {}
        }
    }

    fn light_problems(&self, inputs: &InputFiles, out: &mut Problems) {
        // These errors name their key themselves.
        if let SunPosition::Date(date) = &self.sun.position
            && let Err(e) = date.time()
        {
            out.0.push(("sun.date.utc".to_owned(), e.to_string()));
        }
        if let Err(e) = self.sky.photograph(inputs) {
            out.0.push(("sky.image".to_owned(), e.to_string()));
        }
    }
}
