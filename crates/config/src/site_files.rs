//! The config of a plot, from the files of a site alone.

use std::path::{Path, PathBuf};

use nemoral_assets::Species;
use nemoral_import::{HeightMap, HeightPngSidecar, ImportError, Stem, read_stem_map};
use nemoral_scene::glam::DVec2;
use nemoral_stand::{area_around_m2, convex_hull};
use toml::{Table, Value};

use super::dotted_keys::{greatest, most_bytes};
use super::source::Source;
use super::{Config, ConfigLayers, Error, RobotPath, Sequences};

/// The origin is rounded to this, metres, so that people can add it in their heads.
const ORIGIN_STEP_M: f64 = 10.0;
/// No more trees are asked for on a hectare of the forest around: not all stands of thin trees find
/// room for the trees of a thicket (our choice).
const TREES_PER_HA: f64 = 500.0;

/// The files of a site, by paths that start at the working folder.
#[derive(Clone, Debug, Default)]
pub struct SiteFiles {
    /// The stem map.
    pub stems: PathBuf,
    /// The height map, if there is one; the sidecar of a PNG is the `.json` of its name, or if
    /// there is none the `.toml`.
    pub terrain: Option<PathBuf>,
    /// The trail lines, if there are any.
    pub trails: Option<PathBuf>,
}

impl ConfigLayers {
    /// The sequences of a plot: over the preset, and below the file and the settings, lies a config
    /// that the plot's files suggest. Its origin is the middle of the trees, the forest around has
    /// their species, mean diameter and density, there are no trails but given ones, and the robot
    /// follows the nearest of these, or wanders from the south-west corner through the plot.
    ///
    /// # Errors
    /// As [`ConfigLayers::sequences`], and for files that cannot be read.
    pub fn plot(&self, files: &SiteFiles) -> Result<Sequences, Error> {
        let asked = self.sources()?;
        let usual = Sequences::unchecked(self.preset.clone(), asked.clone())?;
        let mut sources = vec![suggested(files, &usual)?];
        sources.extend(asked);
        Sequences::new(self.preset.clone(), sources)
    }
}

/// The config that the files suggest, where `usual` is what was asked for without them.
fn suggested(files: &SiteFiles, usual: &Config) -> Result<Source, Error> {
    let path = &files.stems;
    let bytes = nemoral_files::read(path, most_bytes("site.stems.path"))?;
    let stems =
        read_stem_map(&bytes).map_err(|e| Error::request(format!("{}: {e}", path.display())))?;
    let feet = || stems.iter().map(|s| DVec2::new(s.x_m, s.y_m));
    let (low, high) = feet().fold(
        (DVec2::INFINITY, DVec2::NEG_INFINITY),
        |(low, high), foot| (low.min(foot), high.max(foot)),
    );
    let origin = (0.5 * (low + high) / ORIGIN_STEP_M).round() * ORIGIN_STEP_M;
    let mut site = table([
        ("origin_x_m", origin.x.into()),
        ("origin_y_m", origin.y.into()),
    ]);
    site.insert("stems".into(), Value::Table(table([("path", text(path)?)])));
    let ground = (files.terrain.as_deref())
        .map(|path| ground(path, usual))
        .transpose()?;
    if let Some((of_site, _)) = &ground {
        site.insert("terrain".into(), Value::Table(of_site.clone()));
    }
    if let Some(path) = &files.trails {
        let lines = table([("path", text(path)?)]);
        site.insert("trails".into(), Value::Table(lines));
    }
    // Stations, lanes and flight lines are around their start, and a drive leads through the plot.
    let start = match usual.robot.path {
        RobotPath::Stations(_) | RobotPath::Lanes(_) | RobotPath::Flight(_) => {
            0.5 * (low + high) - origin
        }
        _ => low - origin,
    };
    let ahead = high - low;
    // Clockwise from north.
    let heading_deg = libm::atan2(ahead.x, ahead.y).to_degrees();
    let mut robot = table([
        ("start_x_m", start.x.into()),
        ("start_y_m", start.y.into()),
        ("heading_deg", heading_deg.into()),
    ]);
    // It follows the nearest of the trails.
    let path = if files.trails.is_some() {
        "trail"
    } else {
        "wander"
    };
    robot.insert(path.into(), Value::Table(Table::new()));
    let margin_m = usual.site.stems.margin_m;
    let per_m2 = stems.len() as f64 / area_around_m2(&convex_hull(feet().collect()), margin_m);
    let per_m2 = per_m2.min(TREES_PER_HA / 10_000.0);
    let chunk_m = usual.chunks.size_m;
    let per_chunk = (per_m2 * chunk_m * chunk_m).min(greatest("placement.trees"));
    let placement = table([("trees", per_chunk.into())]);
    let mut all = table([]);
    for (name, inner) in [
        ("site", site),
        ("robot", robot),
        ("placement", placement),
        ("trails", table([("enabled", false.into())])),
        ("assets", stand(&stems)),
    ] {
        all.insert(name.into(), Value::Table(inner));
    }
    if let Some((_, mesh)) = ground {
        all.insert("terrain".into(), Value::Table(mesh));
    }
    let text = toml::to_string(&all).expect("a table is plain data");
    Source::parse("the plot's files", true, text)
}

/// The tables `[site.terrain]` and `[terrain]` of a height map: the middle of its heights lies
/// where the middle of the terrain around does, and the mesh is as fine as the map.
fn ground(path: &Path, usual: &Config) -> Result<(Table, Table), Error> {
    let bytes = |path: &Path, key| nemoral_files::read(path, most_bytes(key));
    let wrong = |path: &Path, e: ImportError| Error::request(format!("{}: {e}", path.display()));
    let map = bytes(path, "site.terrain.path")?;
    let mut table = table([("path", text(path)?)]);
    let sidecar = if HeightMap::needs_sidecar(&map) {
        let [json, toml] = ["json", "toml"].map(|extension| path.with_extension(extension));
        let beside = if json.exists() { json } else { toml };
        table.insert("sidecar".into(), text(&beside)?);
        let sidecar = HeightPngSidecar::read(&bytes(&beside, "site.terrain.sidecar")?);
        Some(sidecar.map_err(|e| wrong(&beside, e))?)
    } else {
        None
    };
    let map = HeightMap::read(&map, sidecar.as_ref()).map_err(|e| wrong(path, e))?;
    let mut heights: Vec<f32> = map
        .heights_m
        .iter()
        .copied()
        .filter(|h| !h.is_nan())
        .collect();
    let middle = heights.len() / 2;
    let (_, median_m, _) = heights.select_nth_unstable_by(middle, f32::total_cmp);
    let zero_m = (f64::from(*median_m) - 0.5 * usual.terrain.max_height_m).round();
    table.insert("origin_z_m".into(), zero_m.into());
    let cell_m = map.spacing_m.clamp(0.5, usual.terrain.cell_m.max(0.5));
    Ok((
        table,
        Table::from_iter([("cell_m".to_owned(), cell_m.into())]),
    ))
}

/// The shares, diameters and dead trees of a stand like the plot's.
fn stand(stems: &[Stem]) -> Table {
    let mut all = Table::new();
    let species = Species::all();
    let count = |species: &Species| {
        let is_one = |stem: &&Stem| stem.species.as_ref().is_some_and(|s| species.is_named(s));
        stems.iter().filter(is_one).count()
    };
    let counts: Vec<usize> = species.iter().map(count).collect();
    let known: usize = counts.iter().sum();
    if known > 0 {
        for (species, n) in species.iter().zip(counts) {
            let share = (1000.0 * n as f64 / known as f64).round() / 1000.0;
            all.insert(species.name.clone(), share.into());
        }
    }
    // Thinner trees than those of inventories would not be trees of the stand around.
    let known: Vec<f64> = stems
        .iter()
        .filter_map(|s| s.dbh_m)
        .filter(|d| *d >= 0.1)
        .collect();
    if !known.is_empty() {
        let mean = known.iter().sum::<f64>() / known.len() as f64;
        all.insert("dbh_mean_m".into(), mean.clamp(0.12, 0.6).into());
    }
    let dead = stems.iter().filter(|s| !s.is_alive).count();
    all.insert(
        "snags".into(),
        (dead as f64 / stems.len() as f64).min(0.9).into(),
    );
    all
}

fn table<const N: usize>(entries: [(&str, Value); N]) -> Table {
    entries
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect()
}

/// A path as a value of TOML.
fn text(path: &Path) -> Result<Value, Error> {
    let text = path
        .to_str()
        .ok_or_else(|| Error::request(format!("{}: the path must be UTF-8", path.display())))?;
    Ok(text.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_suggests_a_forest_like_it() {
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("stems.csv");
        // Two rows of 700 thin beeches and oaks, 100 m from west to east and 20 m from south to
        // north.
        let mut table = "x,y,species,dbh_cm,alive\n".to_owned();
        for i in 0..1400 {
            let (x, y) = (
                600_000.0 + f64::from(i / 2) / 7.0,
                5_000_004.0 + f64::from(i % 2) * 20.0,
            );
            let species = if i % 4 == 0 { "Quercus robur" } else { "beech" };
            table += &format!("{x},{y},{species},{},{}\n", 10 + i % 21, i % 10 > 0);
        }
        nemoral_files::write(&path, table.as_bytes()).expect("written");
        let files = SiteFiles {
            stems: path,
            ..SiteFiles::default()
        };
        let sequences = ConfigLayers::default().plot(&files).expect("a plot");
        let config = sequences.asked();
        assert_eq!(
            (config.site.origin_x_m, config.site.origin_y_m),
            (600_050.0, 5_000_010.0)
        );
        let shares = [
            config.assets.beech,
            config.assets.english_oak,
            config.assets.scots_pine,
        ];
        assert_eq!(shares, [0.75, 0.25, 0.0]);
        assert!(
            (config.assets.dbh_mean_m - 0.20).abs() < 1e-3,
            "{}",
            config.assets.dbh_mean_m
        );
        assert_eq!(config.assets.snags, 0.1);
        // 500 trees on a hectare at most.
        assert_eq!(config.placement.trees, 125.0);
        assert!(!config.trails.enabled);
        // East-north-east, from the south-west corner.
        assert!(
            (config.robot.heading_deg - 78.7).abs() < 0.1,
            "{}",
            config.robot.heading_deg
        );
        assert_eq!(
            (config.robot.start_x_m, config.robot.start_y_m),
            (-50.0, -6.0)
        );
        // Tripods stand in the middle.
        let stations = ConfigLayers {
            settings: vec!["robot.stations={}".to_owned()],
            ..ConfigLayers::default()
        };
        let stations = stations.plot(&files).expect("a plot");
        let robot = &stations.asked().robot;
        let middle = DVec2::new(robot.start_x_m, robot.start_y_m);
        assert!(middle.distance(DVec2::new(0.0, 4.0)) < 0.1, "{middle}");
        // What is asked for comes first.
        let settings = vec![
            "placement.trees=7".to_owned(),
            "robot.straight={}".to_owned(),
        ];
        let layers = ConfigLayers {
            settings,
            ..ConfigLayers::default()
        };
        let config = layers
            .plot(&files)
            .expect("a plot")
            .get(0)
            .expect("one")
            .config;
        assert_eq!(config.placement.trees, 7.0);
        // What follows from other values follows from those asked for: 500 trees on a hectare, as
        // long as a chunk may have so many.
        for (size_m, trees) in [(80, 320.0), (100, 400.0)] {
            let wider = ConfigLayers {
                settings: vec![format!("chunks.size_m={size_m}")],
                ..ConfigLayers::default()
            };
            let wider = wider.plot(&files).expect("a plot");
            assert_eq!(wider.asked().placement.trees, trees);
        }
        // The stem map is carried under its own name.
        let text = sequences.to_toml().expect("TOML");
        assert!(
            text.contains("inputs/") && text.contains("-stems.csv\""),
            "{text}"
        );
    }
}
