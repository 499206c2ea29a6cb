//! Combinations of keys that are impossible, though each value alone is allowed.

use nemoral_assets::Species;
use nemoral_files::{DEVICE_NAMES, InnerPath};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, ObjectId};

use super::lidar_problems::lidar_problems;
use super::sensors::RESERVED;
use super::way_model::{TRACK, trail_params};
use super::{
    Config, ModelKind, PathTrail, RobotPath, SunPosition, TerrainNoise, WAYS, lines_m, sky_image,
};
use crate::world::outcrops::{least_soil_effect, most_rocks};
use crate::{Error, InputFiles, site};

/// `.label` files number the objects of a chunk from 1 to this.
pub(crate) const OBJECTS_OF_A_CHUNK_MAX: f64 = ObjectId::LABEL_ITEM_MAX as f64;

/// The number of chunks along each axis that instance images can distinguish.
const CHUNKS_OF_A_VIEW_MAX: f64 = 16.0;

/// The greatest number of lamps, each of which takes 21 bytes a pixel and a shadow ray.
const LAMPS_MAX: usize = 16;

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

    fn placement_problems(&self, inputs: &InputFiles, out: &mut Problems) {
        let p = &self.placement;
        out.ordered(
            ("placement.rocks_min", f64::from(p.rocks_min)),
            ("placement.rocks_max", f64::from(p.rocks_max)),
        );
        let (gaps, young) = (&p.gaps, &p.regeneration);
        out.ordered(
            ("placement.gaps.radius_min_m", gaps.radius_min_m),
            ("placement.gaps.radius_max_m", gaps.radius_max_m),
        );
        out.ordered(
            ("placement.regeneration.radius_min_m", young.radius_min_m),
            ("placement.regeneration.radius_max_m", young.radius_max_m),
        );
        let most = self.most_objects_of_a_chunk(inputs);
        if most > OBJECTS_OF_A_CHUNK_MAX {
            let message = format!(
                ": up to {most:.0} things in a chunk, and .label files number only \
                 {OBJECTS_OF_A_CHUNK_MAX}: lower trees, stumps, shrubs, regeneration.saplings, \
                 rocks_max, outcrops, trails.rocks_max, or mantle_* and open_* of meadows"
            );
            out.add("placement", &message);
        }
    }

    /// The most things with an id that are placed in a chunk, within six standard deviations.
    pub(crate) fn most_objects_of_a_chunk(&self, inputs: &InputFiles) -> f64 {
        let (p, c) = (&self.placement, &self.chunks);
        let young = &p.regeneration;
        // Saplings grow in clusters, so the variance of their number in a chunk is that of
        // scattered points times the mean number of saplings in a cluster.
        let radius_m = f64::midpoint(young.radius_min_m, young.radius_max_m);
        let cluster_m2 = std::f64::consts::PI * radius_m * radius_m;
        let clusters = young.share * c.size_m * c.size_m / cluster_m2;
        // A chunk may lie along the edge of a meadow, which winds.
        let edge = if p.meadows.share > 0.0 {
            (2.8 * p.meadows.mantle_m / c.size_m).min(1.0)
        } else {
            0.0
        };
        let (m, open) = (&p.meadows, f64::from(u8::from(p.meadows.share > 0.0)));
        let raised = |number: f64, in_mantle: f64, in_open: f64| {
            number * (1.0 + edge * (in_mantle - 1.0).max(0.0)).max(open * in_open)
        };
        let saplings = raised(young.saplings, m.mantle_saplings, m.open_saplings);
        let mean = p.trees
            + raised(p.stumps, 1.0, m.open_stumps)
            + raised(p.shrubs, m.mantle_shrubs, m.open_shrubs)
            + saplings;
        // Six standard deviations of the number are left as a margin.
        let variance = mean + saplings * saplings / clusters.max(1.0);
        let born = 2 * usize::from(self.trails.enabled);
        // A file that cannot be read is refused elsewhere.
        let lines = lines_m(&self.site, inputs).unwrap_or_default();
        let given = most_lines_of_a_chunk(&lines, self.trails.width_m, c.size_m);
        let ways = trail_params(&self.trails).ways.into_iter();
        let stones = ways
            .filter(|w| w.1 > 0.0)
            .map(|w| w.0.rocks_max_per_trail)
            .max();
        let trail_rocks = born as f64 * f64::from(stones.unwrap_or(0))
            + given as f64 * f64::from(self.trails.rocks_max);
        let rocks = f64::from(p.rocks_max) + most_rocks(p.outcrops, c.size_m);
        mean + 6.0 * variance.sqrt() + rocks + trail_rocks
    }

    fn ground_problems(&self, out: &mut Problems) {
        let (terrain, trails) = (&self.terrain, &self.trails);
        out.ordered(
            ("terrain.fine_cell_m", terrain.fine_cell_m),
            ("terrain.cell_m", terrain.cell_m),
        );
        let any = trails.enabled || !self.site.trails.path.is_empty();
        if any && trails.width_m < 2.0 * terrain.fine_cell_m {
            let must = format!(
                "be at least twice terrain.fine_cell_m = {}",
                terrain.fine_cell_m
            );
            out.refuse("trails.width_m", trails.width_m, &must);
        }
        if let Err(problem) = trails.section.points() {
            out.add("trails.section.curve", &format!(": {problem}"));
        }
        if trails.kinds.shares().iter().sum::<f64>() <= 0.0 {
            out.add("trails.kinds", ": the shares are all 0");
        }
        self.way_problems(out);
        self.relief_problems(out);
    }

    /// Forms of the terrain that do not fit into it.
    fn relief_problems(&self, out: &mut Problems) {
        let t = &self.terrain;
        if t.terraces > 0.0 && t.terrace_step_m > 0.5 * t.max_height_m {
            let must = format!(
                "be at most half of terrain.max_height_m = {}, or terrain.terraces 0",
                t.max_height_m
            );
            out.refuse("terrain.terrace_step_m", t.terrace_step_m, &must);
        }
        if t.cliffs > 0.0 && t.terraces <= 0.0 {
            let must = "be 0, or terrain.terraces above 0: cliffs are the rises between terraces";
            out.refuse("terrain.cliffs", t.cliffs, must);
        }
        if t.gully_depth_m > 0.4 * t.gully_spacing_m {
            let must = format!(
                "be at most 0.4 of terrain.gully_spacing_m = {}",
                t.gully_spacing_m
            );
            out.refuse("terrain.gully_depth_m", t.gully_depth_m, &must);
        }
        let is_shaped = t.ridges > 0.0 || t.warp > 0.0 || t.terraces > 0.0;
        if is_shaped && t.noise == TerrainNoise::PerlinSurflet {
            let must = "be \"nemoral\" where terrain.ridges, terrain.warp or terrain.terraces is \
                        above 0";
            out.refuse("terrain.noise", "\"perlin-surflet\"", must);
        }
    }

    /// Ways that are too narrow for the ground's mesh or too wide for a chunk, and a robot on a
    /// kind that there is not.
    fn way_problems(&self, out: &mut Problems) {
        let (terrain, trails) = (&self.terrain, &self.trails);
        let ways = trail_params(trails).ways.into_iter().enumerate();
        let born = ways.filter(|(_, w)| trails.enabled && w.1 > 0.0);
        for (i, (way, _)) in born {
            let key = match i {
                TRACK => "trails.width_m".to_owned(),
                _ => format!("trails.{}.width_m", WAYS[1 + i]),
            };
            // Its narrow places too are as wide as a cell.
            let cells = (1.0 / (1.0 - way.width_variation)).max(1.5);
            if way.width_m < cells * terrain.fine_cell_m {
                let must = format!(
                    "be at least {cells:.2} times terrain.fine_cell_m = {}, or trails.kinds.{} 0",
                    terrain.fine_cell_m,
                    WAYS[1 + i]
                );
                out.refuse(&key, way.width_m, &must);
            }
            if 4.0 * way.width_m > self.chunks.size_m {
                let must = format!(
                    "be at most a quarter of chunks.size_m = {}, or trails.kinds.{} 0",
                    self.chunks.size_m,
                    WAYS[1 + i]
                );
                out.refuse(&key, way.width_m, &must);
            }
        }
        let has_lines = !self.site.trails.path.is_empty();
        if let RobotPath::Trail(PathTrail { way, .. }) = &self.robot.path
            && let Some(i) = WAYS[1..].iter().position(|word| word == way)
            && (trails.enabled || has_lines)
            && !(trails.enabled && trails.kinds.shares()[i] > 0.0)
            && !(has_lines && i == TRACK)
        {
            let must = if trails.enabled {
                format!("be a kind that there is, and trails.kinds.{way} is 0")
            } else {
                "be \"any\" or \"track\", as which trails along lines are built: trails.enabled is \
                 false"
                    .to_owned()
            };
            out.refuse("robot.trail.way", format!("\"{way}\""), &must);
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
        if p.outcrops > 0.0 && u.ground.soil <= least_soil_effect() {
            let must = format!(
                "be 0, or undergrowth.ground.soil above {:.1}: rock crops out where soil is thin",
                least_soil_effect()
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
        if let Err(e) = sky_image(&self.sky, inputs) {
            out.0.push(("sky.image".to_owned(), e.to_string()));
        }
    }

    fn sensor_problems(&self, out: &mut Problems) {
        for (path, camera) in self.all_cameras() {
            let lens = camera.tone_and_lens().1;
            let checked = match camera.intrinsics() {
                Ok(intrinsics) => lens.check_for(&intrinsics),
                Err(e) => {
                    let key = format!("{path}.{}", e.field);
                    out.0.push((key, format!("{path}.{e}")));
                    lens.check()
                }
            };
            if let Err(e) = checked {
                out.add(&format!("{path}.vignetting"), &format!(": {e}"));
            }
        }
        for (path, lidar) in self.all_lidars() {
            lidar_problems(&path, lidar, out);
        }
        let lamps = self.all_lamps().count();
        if lamps > LAMPS_MAX {
            let message = format!(": at most {LAMPS_MAX} lamps may shine, and {lamps} do");
            out.add("lamps", &message);
        }
        for (name, camera) in &self.cameras {
            if camera.enabled && !self.camera.enabled {
                let must = "be false, as camera.enabled is: the first camera is what poses are \
                            about";
                out.refuse(&format!("cameras.{name}.enabled"), true, must);
            }
        }
        for (name, lidar) in &self.lidars {
            if lidar.enabled && !self.lidar.enabled {
                let must = "be false, as lidar.enabled is: the first LiDAR's files have the \
                            standard names";
                out.refuse(&format!("lidars.{name}.enabled"), true, must);
            }
        }
        if !self.camera.enabled && !self.lidar.enabled {
            let must = "be true, as camera.enabled is false: a robot needs a sensor";
            out.refuse("lidar.enabled", false, must);
        }
    }

    fn sensor_name_problems(&self, out: &mut Problems) {
        let of_cameras = self.cameras.keys().map(|name| ("cameras", "camera", name));
        let of_lidars = self.lidars.keys().map(|name| ("lidars", "LiDAR", name));
        let of_lamps = self.lamps.keys().map(|name| ("lamps", "lamp", name));
        for (table, what, name) in of_cameras.chain(of_lidars).chain(of_lamps) {
            let path = format!("{table}.{name}");
            let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
            // Lamps have no folders.
            let reserved: &[&str] = if table == "lamps" { &[] } else { &RESERVED };
            let has_folder = !reserved.is_empty();
            let taken = reserved.contains(&name.as_str())
                || has_folder && InnerPath::new(name.as_str()).is_err();
            if name.is_empty() || name.len() > 32 || !name.chars().all(plain) || taken {
                let mut message = format!(": a {what}'s name must be 1 to 32 of a-z, 0-9 and _");
                if has_folder {
                    let reserved = reserved.join(", ");
                    message += &format!(
                        ", and none of {reserved}, nor a device's name on Windows ({DEVICE_NAMES})"
                    );
                }
                out.add(&path, &message);
            }
            if table == "lidars" && self.cameras.contains_key(name) {
                let message = format!(": there is a camera of that name, cameras.{name}");
                out.add(&path, &message);
            }
        }
    }
}

/// The greatest number of lines whose bounding boxes touch the same chunk. Boxes are wider by what
/// a trail may swing out between two vertices, and by its width.
fn most_lines_of_a_chunk(lines_m: &[Vec<DVec2>], width_m: f64, chunk_size_m: f64) -> usize {
    let of_line = |line: &Vec<DVec2>| {
        let longest_m = line
            .windows(2)
            .map(|v| v[0].distance(v[1]))
            .fold(0.0, f64::max);
        let around = DVec2::splat(0.25 * longest_m + width_m);
        let low = line.iter().copied().fold(DVec2::INFINITY, DVec2::min) - around;
        let high = line.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max) + around;
        [low, high].map(|corner| ChunkCoord::containing(corner, chunk_size_m))
    };
    let boxes: Vec<[ChunkCoord; 2]> = lines_m.iter().map(of_line).collect();
    // Along y a box begins at its first chunk and has ended one after its last; those that end come
    // first.
    let mut ends: Vec<(i64, i8, usize)> = (0..boxes.len())
        .flat_map(|i| {
            let [low, high] = boxes[i].map(|c| i64::from(c.y));
            [(low, 1, i), (high + 1, -1, i)]
        })
        .collect();
    ends.sort_unstable();
    let mut columns: Vec<i32> = boxes.iter().map(|b| b[0].x).collect();
    columns.sort_unstable();
    columns.dedup();
    // Where most boxes meet, one begins.
    let most_of_column = |&x: &i32| {
        let here = |i: usize| (boxes[i][0].x..=boxes[i][1].x).contains(&x);
        let (mut open, mut most) = (0_isize, 0);
        for &(_, step, _) in ends.iter().filter(|end| here(end.2)) {
            open += isize::from(step);
            most = most.max(open);
        }
        most.unsigned_abs()
    };
    columns.iter().map(most_of_column).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_that_meet_in_a_chunk_are_counted() {
        let line = |x: f64, y: f64| vec![DVec2::new(x, y), DVec2::new(x + 10.0, y + 10.0)];
        let most = |lines: &[Vec<DVec2>]| most_lines_of_a_chunk(lines, 2.0, 50.0);
        assert_eq!(most(&[]), 0);
        // Each in a chunk of its own.
        let apart: Vec<_> = (0..30)
            .map(|i| line(20.0 + 50.0 * f64::from(i), 20.0))
            .collect();
        assert_eq!(most(&apart), 1);
        // Five that cross one chunk, which none of them begins in together with another.
        let mut star: Vec<_> = (0..5)
            .map(|i| {
                vec![
                    DVec2::splat(-60.0 * f64::from(i) - 10.0),
                    DVec2::splat(20.0),
                ]
            })
            .collect();
        assert_eq!(most(&star), 5);
        star.extend(apart);
        assert_eq!(most(&star), 6);
        // By all chunks, for lines anywhere.
        let at = |i: i32, k: i32| f64::from((i * k) % 997);
        let lines: Vec<_> = (0..60)
            .map(|i| {
                vec![
                    DVec2::new(at(i, 331), at(i, 577)),
                    DVec2::new(at(i, 151), at(i, 83)),
                ]
            })
            .collect();
        let boxes = lines.iter().map(|l| {
            let around = DVec2::splat(0.25 * l[0].distance(l[1]) + 2.0);
            let chunk = |p| ChunkCoord::containing(p, 50.0);
            [
                chunk(l[0].min(l[1]) - around),
                chunk(l[0].max(l[1]) + around),
            ]
        });
        let boxes: Vec<_> = boxes.collect();
        let of_chunk = |x: i32, y: i32| {
            let here =
                |[a, b]: &&[ChunkCoord; 2]| (a.x..=b.x).contains(&x) && (a.y..=b.y).contains(&y);
            boxes.iter().filter(here).count()
        };
        let all = (-10..40).flat_map(|x| (-10..40).map(move |y| of_chunk(x, y)));
        assert_eq!(Some(most(&lines)), all.max());
    }
}
