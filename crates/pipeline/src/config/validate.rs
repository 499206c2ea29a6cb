//! Combinations that cannot be, though each key is allowed.

use nemoral_assets::Species;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, ObjectId};

use super::{Assets, Camera, Config, Lidar, LidarPattern, RobotPath, SunPosition};
use crate::{Error, InputFiles};

/// Names of other sensors and of their folders.
const RESERVED: [&str; 16] = [
    "camera", "lidar", "image_2", "image_3", "semantic", "instance", "depth", "normals", "sky",
    "flow", "trunks", "boxes", "radiance", "velodyne", "labels", "points",
];

impl Assets {
    /// The built-in species with their shares; one's own is not among them, but for its share
    /// (`None`).
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
}

/// The name of the sensor whose table is at `path`: its last part.
pub(crate) fn sensor_name(path: &str) -> &str {
    path.rsplit_once('.').map_or(path, |(_, name)| name)
}

impl Config {
    /// Every camera that is there with the path of its table, the first one first.
    pub(crate) fn all_cameras(&self) -> impl Iterator<Item = (String, &Camera)> {
        let further = self
            .cameras
            .iter()
            .map(|(n, c)| (format!("cameras.{n}"), c));
        let all = std::iter::once(("camera".to_owned(), &self.camera)).chain(further);
        all.filter(|(_, camera)| camera.enabled)
    }

    /// Every LiDAR with the path of its table, the first one first.
    pub(crate) fn all_lidars(&self) -> impl Iterator<Item = (String, &Lidar)> {
        let further = self.lidars.iter().map(|(n, l)| (format!("lidars.{n}"), l));
        std::iter::once(("lidar".to_owned(), &self.lidar)).chain(further)
    }

    /// Every impossible combination: the key to blame and what is wrong.
    pub(super) fn problems(&self, inputs: &InputFiles) -> Vec<(String, String)> {
        let mut out = Vec::new();
        let mut wrong = |path: &str, message: String| out.push((path.to_owned(), message));
        let c = &self.chunks;
        if c.undergrowth_radius_m > c.visible_radius_m {
            let (radius, limit) = (c.undergrowth_radius_m, c.visible_radius_m);
            wrong(
                "chunks.undergrowth_radius_m",
                format!(
                    "chunks.undergrowth_radius_m = {radius}: must be at most \
                     chunks.visible_radius_m = {limit}"
                ),
            );
        }
        if c.delete_radius_m < c.visible_radius_m {
            let (radius, limit) = (c.delete_radius_m, c.visible_radius_m);
            wrong(
                "chunks.delete_radius_m",
                format!(
                    "chunks.delete_radius_m = {radius}: must be at least chunks.visible_radius_m = \
                     {limit}"
                ),
            );
        }
        // Instance images tell chunks apart modulo 16: a view may span at most 16 chunks.
        let widest = 2.0 * (c.visible_radius_m / c.size_m).floor() + 2.0;
        if widest > 16.0 {
            let allowed = 7.0 * c.size_m;
            wrong(
                "chunks.visible_radius_m",
                format!(
                    "chunks.visible_radius_m = {}: views would span {widest} chunks of {} m, and \
                     instance images tell only 16 apart: must be below {}",
                    c.visible_radius_m,
                    c.size_m,
                    allowed + c.size_m
                ),
            );
        }
        let p = &self.placement;
        if p.rocks_min > p.rocks_max {
            wrong(
                "placement.rocks_min",
                format!(
                    "placement.rocks_min = {}: must be at most placement.rocks_max = {}",
                    p.rocks_min, p.rocks_max
                ),
            );
        }
        let (gaps, young) = (&p.gaps, &p.regeneration);
        for (path, least, most) in [
            ("placement.gaps", gaps.radius_min_m, gaps.radius_max_m),
            (
                "placement.regeneration",
                young.radius_min_m,
                young.radius_max_m,
            ),
        ] {
            if least > most {
                let key = format!("{path}.radius_min_m");
                let message =
                    format!("{key} = {least}: must be at most {path}.radius_max_m = {most}");
                wrong(&key, message);
            }
        }
        // Saplings come in clusters, and so do their numbers: as many are in a cluster on average,
        // so much wider than scattered points' is the spread.
        let radius_m = f64::midpoint(young.radius_min_m, young.radius_max_m);
        let cluster_m2 = std::f64::consts::PI * radius_m * radius_m;
        let clusters = young.share * c.size_m * c.size_m / cluster_m2;
        let clumping = young.saplings / clusters.max(1.0);
        // `.label` files number the things of a chunk 1..=1023; leave six sigma of a count's
        // spread.
        let mean = p.trees + p.stumps + p.shrubs + young.saplings;
        let variance = mean + young.saplings * clumping;
        let stones = if self.trails.enabled {
            self.trails.rocks_max
        } else {
            0
        };
        let most = mean + 6.0 * variance.sqrt() + f64::from(p.rocks_max) + f64::from(stones) * 2.0;
        if most > 1023.0 {
            wrong(
                "placement",
                format!(
                    "placement: up to {most:.0} things in a chunk, and .label files number only \
                     1023: lower trees, stumps, shrubs, regeneration.saplings, rocks_max or \
                     trails.rocks_max"
                ),
            );
        }
        if self.terrain.fine_cell_m > self.terrain.cell_m {
            wrong(
                "terrain.fine_cell_m",
                format!(
                    "terrain.fine_cell_m = {}: must be at most terrain.cell_m = {}",
                    self.terrain.fine_cell_m, self.terrain.cell_m
                ),
            );
        }
        if self.trails.enabled && self.trails.width_m < 2.0 * self.terrain.fine_cell_m {
            wrong(
                "trails.width_m",
                format!(
                    "trails.width_m = {}: must be at least twice terrain.fine_cell_m = {}",
                    self.trails.width_m, self.terrain.fine_cell_m
                ),
            );
        }
        let a = &self.assets;
        if p.trees > 0.0 && a.shares().iter().all(|(_, share)| *share <= 0.0) {
            wrong(
                "assets",
                "assets: the species shares are all 0, and placement.trees asks for trees"
                    .to_owned(),
            );
        }
        if a.dbh_min_m >= a.dbh_max_m {
            let (least, most) = (a.dbh_min_m, a.dbh_max_m);
            wrong(
                "assets.dbh_min_m",
                format!("assets.dbh_min_m = {least}: must be below assets.dbh_max_m = {most}"),
            );
        }
        if p.shrubs > 0.0 && a.gorse + a.heather + a.bramble <= 0.0 {
            let message = "assets: the shares of gorse, heather and bramble are all 0, and \
                placement.shrubs asks for shrubs";
            wrong("assets", message.to_owned());
        }
        let f = &self.undergrowth.floor;
        if f.leaf_litter + f.needle_litter + f.moss <= 0.0 {
            let message =
                "undergrowth.floor: the shares are all 0: something must cover the ground";
            wrong("undergrowth.floor", message.to_owned());
        }
        let u = &self.undergrowth;
        if u.cover > 0.0 && u.grass + u.herbs + u.ferns <= 0.0 {
            let message = "undergrowth: the weights of grass, herbs and ferns are all 0, and \
                undergrowth.cover asks for plants";
            wrong("undergrowth", message.to_owned());
        }
        match inputs.get(&a.own_species) {
            Some(file) => {
                let species = file.text().and_then(|text| {
                    let origin = file.path().display().to_string();
                    Species::from_toml(text, &origin).map_err(|e| Error::request(e.to_string()))
                });
                if let Err(e) = species {
                    wrong("assets.own_species", format!("assets.own_species: {e}"));
                }
            }
            None if a.own_share > 0.0 => {
                let message = "assets.own_species = \"\": must name a species file, as \
                    assets.own_share is above 0";
                wrong("assets.own_species", message.to_owned());
            }
            None => {}
        }
        if let SunPosition::Date(date) = &self.sun.position
            && let Err(e) = date.time()
        {
            wrong("sun.date.utc", e.to_string());
        }
        if let Err(e) = super::sky_image(&self.sky, inputs) {
            wrong("sky.image", e.to_string());
        }
        for (path, camera) in self.all_cameras() {
            if let Err(e) = camera.intrinsics() {
                wrong(&format!("{path}.{}", e.field), format!("{path}.{e}"));
            }
        }
        for (path, lidar) in self.all_lidars() {
            lidar_problems(&path, lidar, &mut wrong);
        }
        for (path, camera) in &self.cameras {
            if camera.enabled && !self.camera.enabled {
                wrong(
                    &format!("cameras.{path}.enabled"),
                    format!(
                        "cameras.{path}.enabled = true: must be false, as camera.enabled is: the \
                         first camera is what poses are about"
                    ),
                );
            }
        }
        let of_cameras = self.cameras.keys().map(|name| ("cameras", "camera", name));
        let of_lidars = self.lidars.keys().map(|name| ("lidars", "LiDAR", name));
        for (table, what, name) in of_cameras.chain(of_lidars) {
            let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
            let taken = RESERVED.contains(&name.as_str());
            if name.is_empty() || name.len() > 32 || !name.chars().all(plain) || taken {
                wrong(
                    &format!("{table}.{name}"),
                    format!(
                        "{table}.{name}: a {what}'s name must be 1 to 32 of a-z, 0-9 and _, and \
                         none of {}",
                        RESERVED.join(", ")
                    ),
                );
            }
            if table == "lidars" && self.cameras.contains_key(name) {
                wrong(
                    &format!("lidars.{name}"),
                    format!("lidars.{name}: there is a camera of that name, cameras.{name}"),
                );
            }
        }
        let r = &self.robot;
        if r.spacing_m == 0.0 && r.spacing_s == 0.0 {
            wrong(
                "robot.spacing_m",
                "robot.spacing_m = 0 and robot.spacing_s = 0: one must be above 0".to_owned(),
            );
        }
        if let RobotPath::File(file) = &r.path
            && file.path.is_empty()
        {
            wrong(
                "robot.file.path",
                "robot.file.path = \"\": must name a file of poses".to_owned(),
            );
        }
        let start = ChunkCoord::containing(DVec2::new(r.start_x_m, r.start_y_m), c.size_m);
        if ObjectId::new(start.offset(20_000, 20_000), 1).is_none()
            || ObjectId::new(start.offset(-20_000, -20_000), 1).is_none()
        {
            wrong(
                "robot.start_x_m",
                format!(
                    "robot.start_x_m = {}, robot.start_y_m = {}: ids reach chunk ±2,097,151, and \
                     that is chunk {start}",
                    r.start_x_m, r.start_y_m
                ),
            );
        }
        out
    }
}

fn lidar_problems(path: &str, lidar: &Lidar, wrong: &mut impl FnMut(&str, String)) {
    let mut blame = |key: &str, message: String| {
        wrong(&format!("{path}.{key}"), format!("{path}.{key}{message}"));
    };
    match &lidar.pattern {
        LidarPattern::Lines(l) if l.low_deg > l.high_deg => blame(
            "lines.low_deg",
            format!(
                " = {}: must be at most {path}.lines.high_deg = {}",
                l.low_deg, l.high_deg
            ),
        ),
        LidarPattern::Panorama(p) if p.low_deg > p.high_deg => blame(
            "panorama.low_deg",
            format!(
                " = {}: must be at most {path}.panorama.high_deg = {}",
                p.low_deg, p.high_deg
            ),
        ),
        LidarPattern::Table(table) if table.path.is_empty() => blame(
            "table.path",
            " = \"\": must name a CSV file of pulses".to_owned(),
        ),
        _ => {}
    }
    if !matches!(lidar.wavelength_nm, 905 | 1550) {
        blame(
            "wavelength_nm",
            format!(" = {}: must be 905 or 1550", lidar.wavelength_nm),
        );
    }
    if lidar.min_range_m >= lidar.max_range_m {
        blame(
            "min_range_m",
            format!(
                " = {}: must be below {path}.max_range_m = {}",
                lidar.min_range_m, lidar.max_range_m
            ),
        );
    }
}
