mod sensors;

use super::*;
use crate::{CameraOptics, RangeNoiseModel, SunPosition, TerrainNoise};

fn load(preset: &str, file: &str, settings: &[&str]) -> Result<Config, Error> {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("c.toml");
    nemoral_files::write(&path, file.as_bytes()).expect("written");
    ConfigLayers {
        preset: (!preset.is_empty()).then(|| preset.to_owned()),
        file: Some(path),
        settings: settings.iter().map(|&s| s.to_owned()).collect(),
    }
    .load()
}

fn message(result: Result<Config, Error>) -> String {
    result.expect_err("is refused").to_string()
}

#[test]
fn layers_lie_over_each_other() {
    let config = load(
        "",
        "preset = \"high\"\n[lidar]\npulses = 100\n[terrain]\nscale_m = 40",
        &["lidar.pulses=200", "terrain.noise=perlin-surflet"],
    )
    .expect("fine");
    assert_eq!((config.placement.trees, config.lidar.pulses), (210.0, 200));
    assert_eq!(
        (config.terrain.scale_m, config.terrain.noise),
        (40.0, TerrainNoise::PerlinSurflet)
    );
    // The argument overrides the file's preset.
    assert_eq!(
        load("low", "preset = \"high\"", &[])
            .expect("fine")
            .placement
            .trees,
        31.0
    );
}

#[test]
fn values_that_lie_deep_in_each_other_are_refused() {
    // 6,000 tables in each other in 12 kB, which the parser lets pass.
    let key = ["a"; 79].join(".");
    let value = (0..75).fold("1".to_owned(), |inner, _| format!("{{{key}={inner}}}"));
    let text = format!("[{key}]\n{key}={value}\n");
    let refused = message(load("", &text, &[]));
    assert!(refused.contains("deeper than 32 levels"), "{refused}");
    let argument = format!("{key}={value}");
    let refused = message(load("", "preset = \"demo\"", &[&argument]));
    assert!(refused.contains("deeper than 32 levels"), "{refused}");
}

#[test]
fn a_variant_replaces_the_presets() {
    let config = load("", "[lidar.lines]\nlines = 16\nlow_deg = -10", &[]).expect("fine");
    let LidarLinesOnly(lines) = lines(&config);
    assert_eq!(
        (lines.lines, lines.low_deg, lines.high_deg),
        (16, -10.0, 15.0)
    );
    let text = message(load("", "[lidar.lines]\n[lidar.mid40]", &[]));
    assert!(text.contains("both give the scan pattern"), "{text}");
}

struct LidarLinesOnly(crate::LidarLines);

fn lines(config: &Config) -> LidarLinesOnly {
    match &config.lidar.pattern {
        crate::LidarPattern::Lines(l) => LidarLinesOnly(l.clone()),
        other => panic!("{other:?}"),
    }
}

#[test]
fn errors_name_key_value_range_line_and_column() {
    let text = message(load("", "seed = 3\n[terrain]\noctaves = 99 # many", &[]));
    assert!(
        text.contains("c.toml:3:1: terrain.octaves = 99: must be a whole number from 1 to 16"),
        "{text}"
    );
    assert!(
        text.contains("3 | octaves = 99 # many\n  | ^^^^^^^^^^^^"),
        "{text}"
    );
    let text = message(load("", "[terrain]\noctave = 9", &[]));
    assert!(text.contains("did you mean `octaves`?"), "{text}");
    let text = message(load("", "\"site.stems\" = { path = \"stems.csv\" }", &[]));
    assert!(text.contains("site.stems: no such key"), "{text}");
    let text = message(load("", "[terain]\n", &[]));
    assert!(
        text.contains(":1:2: terain: no such key; did you mean `terrain`?"),
        "{text}"
    );
    let text = message(load("", "terrain = 4", &[]));
    assert!(text.contains("must be a table"), "{text}");
    let text = message(load("", "[terrain\n", &[]));
    assert!(text.contains("c.toml:1:"), "{text}");
    let text = message(load("", "", &["lidar.pulses=-5"]));
    assert!(
        text.contains("--set lidar.pulses=-5: lidar.pulses = -5: must"),
        "{text}"
    );
    let text = message(load("", "", &["lidar.pulses"]));
    assert!(text.contains("must be KEY=VALUE"), "{text}");
    let text = message(load("huge", "", &[]));
    assert!(
        text.contains("preset = \"huge\": must be one of default, low"),
        "{text}"
    );
}

#[test]
fn every_error_is_reported_at_once() {
    let text = message(load(
        "",
        "[terrain]\noctaves = 0\nlacunarity = 1\n[sky]\noverast = 1",
        &[],
    ));
    assert_eq!(text.matches("c.toml:").count(), 3, "{text}");
}

#[test]
fn impossible_combinations_are_refused_where_they_stand() {
    for (file, expected) in [
        (
            "[chunks]\nvisible_radius_m = 500\ndelete_radius_m = 600",
            "tell only 16 apart",
        ),
        (
            "[chunks]\ndelete_radius_m = 50",
            "must be at least chunks.visible_radius_m",
        ),
        (
            "[placement]\nrocks_min = 30",
            "must be at most placement.rocks_max = 14",
        ),
        (
            "[placement]\ntrees = 400\nshrubs = 400\nregeneration.saplings = 400",
            "number only 1310",
        ),
        (
            "[placement]\nshrubs = 200\nmeadows.share = 0.5\nmeadows.mantle_m = 20",
            "number only 1310",
        ),
        (
            "[terrain]\nterraces = 0.5\nterrace_step_m = 12",
            "must be at most half of terrain.max_height_m = 22",
        ),
        (
            "[terrain]\ngully_depth_m = 13",
            "must be at most 0.4 of terrain.gully_spacing_m = 30",
        ),
        (
            "[terrain]\nwarp = 0.1\nnoise = \"perlin-surflet\"",
            "terrain.noise = \"perlin-surflet\": must be \"nemoral\"",
        ),
        (
            "[placement]\nmeadows.share = 0.5\n[undergrowth]\nsward.cover = 0",
            "placement.meadows.kept = 1: must be 0, or undergrowth.sward.cover above 0",
        ),
        (
            "[placement]\noutcrops = 0.5\n[undergrowth]\nground.soil = 0.4",
            "placement.outcrops = 0.5: must be 0, or undergrowth.ground.soil above 0.4",
        ),
        ("[robot]\nspacing_m = 0", "one must be above 0"),
        ("[robot.file]\nformat = \"kitti\"", "must name a file"),
        (
            "[assets]\nmaritime_pine = 0\neucalyptus = 0\nenglish_oak = 0",
            "are all 0",
        ),
        (
            "[assets]\ndbh_mean_m = 0.7",
            "assets.dbh_mean_m = 0.7: must be from assets.dbh_min_m = 0.1 to assets.dbh_max_m",
        ),
        (
            "[imu]\nenabled = true\n[robot.stations]",
            "imu.enabled = true: must be false with [robot.stations]: the robot stands still",
        ),
        ("[lidar]\nwavelength_nm = 1000", "must be 905 or 1550"),
        (
            "[lidar.mirror]\nkind = \"sine\"\nhalf_angle_deg = 91",
            "lidar.mirror.half_angle_deg = 91: must be at most 90 with lidar.mirror.kind = \
             \"sine\"",
        ),
        (
            "[lidar.mirror]\nrate_hz = 190",
            "lidar.mirror.lines_hz = 100: must be so few that each has a pulse of \
             lidar.mirror.rate_hz = 190",
        ),
        (
            "[robot]\nstart_x_m = 1e8\n[chunks]\nsize_m = 20\nvisible_radius_m = 100\n\
             undergrowth_radius_m = 50",
            "ids reach",
        ),
    ] {
        let text = message(load("", file, &[]));
        assert!(text.contains(expected), "{file}: {text}");
    }
}

#[test]
fn presets_are_valid_and_survive_a_round_trip() {
    for preset in Preset::ALL {
        let config = preset.config();
        assert_eq!(
            config.problems(&InputFiles::default()),
            [],
            "{}",
            preset.name
        );
        assert_eq!(Config::from_toml(&config.to_toml()).expect("fine"), config);
        let annotated = crate::annotated_toml(&config);
        assert_eq!(
            Config::from_toml(&annotated).expect("fine"),
            config,
            "{annotated}"
        );
    }
}

/// With fewer individuals, copies would be noticeable. Only the preset of the tests may have fewer.
#[test]
fn presets_grow_enough_individuals() {
    for preset in Preset::ALL.iter().filter(|p| p.name != "demo") {
        let individuals = preset.config().assets.individuals;
        assert!(individuals >= 8, "{}: {individuals}", preset.name);
    }
}

/// Dead trees stand in every preset; saplings in every stand but a plantation, whose rows are kept
/// clean.
#[test]
fn presets_have_saplings_and_snags() {
    let without = ["default", "low", "medium", "high", "eucalyptus-plantation"];
    for preset in Preset::ALL.iter().filter(|p| p.name != "demo") {
        let config = preset.config();
        assert!(config.assets.snags > 0.0, "{}", preset.name);
        let saplings = config.placement.regeneration.saplings;
        let none = without.contains(&preset.name);
        assert_eq!(saplings == 0.0, none, "{}: {saplings}", preset.name);
    }
}

#[test]
fn a_commented_config_has_its_further_sensors() {
    let file = "[cameras.right]\nmount_y_m = -0.12\n[cameras.wide.fisheye]\nk1 = -0.01\n\
                [cameras.wide.noise]\nenabled = true\n\
                [lidars.top]\ndevice = \"vlp16\"\npulses = 50000\n";
    let config = load("", file, &[]).expect("fine");
    let annotated = crate::annotated_toml(&config);
    assert_eq!(
        Config::from_toml(&annotated).expect("fine"),
        config,
        "{annotated}"
    );
    // Values that a further camera takes from the first one are not repeated.
    let right = annotated.split("[cameras.right]").nth(1).expect("there");
    assert!(right.starts_with("\nmount_y_m = -0.12\n\n"), "{right}");

    // Without any there is a commented example, which is valid once the comment marks are removed.
    let plain = crate::annotated_toml(&Config::default());
    let uncommented: Vec<&str> = plain
        .lines()
        .skip_while(|l| *l != "# [cameras.right]          # the right eye of a stereo pair")
        .take_while(|l| l.starts_with("# "))
        .map(|l| &l[2..])
        .collect();
    let config = load("", &uncommented.join("\n"), &[]).expect("fine");
    assert_eq!(config.cameras.len(), 2);
}

#[test]
fn every_default_is_allowed_and_every_key_is_defined() {
    let checked = Config::default().check_values(&InputFiles::default());
    assert_eq!(checked.map_err(|e| e.to_string()), Ok(()));
    let schema = crate::json_schema();
    assert_eq!(
        schema["properties"]["terrain"]["properties"]["octaves"]["maximum"],
        16
    );
    assert_eq!(
        schema["properties"]["lidar"]["properties"]["lines"]["type"],
        "object"
    );
    let page = crate::reference_page();
    for section in SECTIONS {
        assert!(page.contains(section.path));
    }
}

#[test]
fn ranges_are_drawn_from_the_seed_and_recorded() {
    let file = "[ranges]\n\"placement.trees\" = [60, 140]\nterrain.octaves = [3, 5]\n\
        assets.dbh_mean_m = [0.2, 0.3]";
    let at = |seed: u64| load("", file, &[&format!("seed={seed}")]).expect("fine");
    let drawn: Vec<Config> = (0..200).map(at).collect();
    let trees: Vec<f64> = drawn.iter().map(|c| c.placement.trees).collect();
    assert!(trees.iter().all(|t| (60.0..=140.0).contains(t)));
    let mean = trees.iter().sum::<f64>() / 200.0;
    assert!(
        (mean - 100.0).abs() < 4.0 * 80.0 / 12.0_f64.sqrt() / 200.0_f64.sqrt(),
        "{mean}"
    );
    for octaves in 3..=5 {
        let count = drawn
            .iter()
            .filter(|c| c.terrain.octaves == octaves)
            .count();
        assert!((40..95).contains(&count), "{octaves}: {count}");
    }
    // Keys are drawn independently: diameters do not correlate with numbers.
    let covariance: f64 = drawn
        .iter()
        .map(|c| (c.placement.trees - 100.0) / 23.1 * (c.assets.dbh_mean_m - 0.25) / 0.0289)
        .sum::<f64>()
        / 200.0;
    assert!(covariance.abs() < 0.3, "{covariance}");
    // The same seed draws the same numbers, and the result is a config like any other.
    assert_eq!(drawn[7], at(7));
    assert_eq!(
        Config::from_toml(&drawn[7].to_toml()).expect("fine"),
        drawn[7]
    );
    assert_eq!(drawn[7].placement.trees.to_string(), "137.1144486812409");
}

#[test]
fn weather_time_and_exposure_are_drawn_too() {
    let file = "[sun.date]\nlatitude_deg = 52\n[ranges]\nweather.visibility_m = [300, 20000]\n\
                sky.overcast = [0, 1]\n\
                sun.date.later_h = [-8, 4]\ncamera.exposure_bias_ev = [-1, 0.5]";
    let of = |seed: u64| {
        let config = load("", file, &[&format!("seed={seed}")]).expect("fine");
        let SunPosition::Date(date) = &config.sun.position else {
            panic!("by its date");
        };
        let c = &config;
        let (overcast, later_h) = (c.sky.overcast, date.later_h);
        [
            c.weather.visibility_m,
            overcast,
            later_h,
            c.camera.exposure_bias_ev,
        ]
    };
    let drawn: Vec<[f64; 4]> = (0..100).map(of).collect();
    for (k, (low, high)) in [(300.0, 20000.0), (0.0, 1.0), (-8.0, 4.0), (-1.0, 0.5)]
        .into_iter()
        .enumerate()
    {
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for d in &drawn {
            (least, most) = (least.min(d[k]), most.max(d[k]));
        }
        // Draws cover the whole range and nothing else: of a hundred, the outermost are about a
        // hundredth from its ends.
        let tenth = 0.1 * (high - low);
        assert!(least >= low && least < low + tenth, "{k}: {least}");
        assert!(most <= high && most > high - tenth, "{k}: {most}");
    }
}

#[test]
fn what_is_set_later_wins_over_a_range() {
    let file = "[ranges]\n\"placement.trees\" = [60, 140]";
    let config = load("", file, &["placement.trees=33"]).expect("fine");
    assert_eq!(config.placement.trees, 33.0);
    let config = load(
        "",
        "[placement]\ntrees = 33",
        &["ranges.placement.trees=[50, 50]"],
    );
    assert_eq!(config.expect("fine").placement.trees, 50.0);
}

#[test]
fn wrong_ranges_are_named() {
    let refused = |ranges: &str| message(load("", &format!("[ranges]\n{ranges}"), &[]));
    let has = |text: String, parts: &[&str]| {
        for part in parts {
            assert!(text.contains(part), "{text}");
        }
    };
    has(
        refused("\"placement.trees\" = [60, 1400]"),
        &[
            "c.toml:2:1: ranges.\"placement.trees\" = [60, 1400]",
            "[least, most], each a number from 0 to 400",
        ],
    );
    has(
        refused("\"placement.trees\" = [140, 60]"),
        &["[least, most]"],
    );
    has(refused("\"placement.trees\" = 60"), &["[least, most]"]);
    has(
        refused("\"terrain.octaves\" = [1.5, 3]"),
        &["a whole number from 1 to 16"],
    );
    has(
        refused("\"placement.tree\" = [1, 2]"),
        &["there is no key placement.tree"],
    );
    has(
        refused("\"trails.surface\" = [1, 2]"),
        &["must be [a, b, …] or { a = weight", "\"varied\""],
    );
    has(
        refused("\"frames\" = [1, 2]"),
        &["the same in all sequences"],
    );
    has(refused("\"seed\" = [1, 2]"), &["drawn from it"]);
    let both = "placement.trees = 3\nranges.placement.trees = [1, 2]";
    has(
        message(load("", both, &[])),
        &["is set beside it", "c.toml:2"],
    );
    // Drawn values must be valid too, and the error names the range.
    has(
        refused("\"chunks.visible_radius_m\" = [500, 600]"),
        &["c.toml:2", "views would span"],
    );
    has(message(load("", "ranges = 3", &[])), &["must be a table"]);
}

/// A config that names a table of pulses, in a folder with that table.
fn with_table(dir: &std::path::Path, place: &str, path: &str) -> ConfigLayers {
    let file = dir.join(place);
    let folder = nemoral_files::Folder::new(file.parent().expect("below the folder"));
    folder.create_root().expect("a folder");
    let config = format!("[lidar.table]\npath = \"{path}\"\n");
    nemoral_files::write(&file, config.as_bytes()).expect("written");
    ConfigLayers {
        preset: None,
        file: Some(file),
        settings: vec![],
    }
}

const PULSES: &[u8] = b"0, 0, 0\n0.001, 1, 0\n";

#[test]
fn paths_start_at_the_config() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let table = dir.path().join("spiral.csv");
    nemoral_files::write(&table, PULSES).expect("written");
    let absolute = table.to_str().expect("UTF-8");
    for (place, path) in [("c.toml", "spiral.csv"), ("a/c.toml", "../spiral.csv")] {
        let layers = with_table(dir.path(), place, path);
        layers.load().expect(place);
    }
    with_table(dir.path(), "a/d.toml", absolute)
        .load()
        .expect("an absolute path");
    // Neither the folders above nor the working folder are searched.
    let text = message(with_table(dir.path(), "a/b/c.toml", "spiral.csv").load());
    assert!(text.contains("lidar.table.path: cannot read"), "{text}");
    let missing = "[lidar.table]\npath = \"Cargo.toml\"\n";
    let text = message(load("", missing, &[]));
    assert!(text.contains("lidar.table.path: cannot read"), "{text}");
    // Those of `--set` start at the working folder, which is the crate's.
    load("", "", &["lidar.table.path=Cargo.toml"]).expect("it is there");
}

#[test]
fn the_config_of_a_data_set_names_only_files_of_it() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let own = nemoral_dataset::input_path("spiral.csv", PULSES);
    let root = nemoral_files::Folder::new(dir.path());
    let put = |name: &str, bytes: &[u8]| {
        let name = nemoral_dataset::InnerPath::new(name).expect("a name");
        root.put(&name, bytes).expect("written");
    };
    put("dataset.json", b"{}");
    put(own.as_str(), PULSES);
    put("secret.csv", PULSES);
    put("inputs/0123456789abcdef-spiral.csv", PULSES);
    let refused = |place: &str, path: &str| {
        let text = message(with_table(dir.path(), place, path).load());
        assert!(text.contains("lidar.table.path"), "{text}");
        text
    };
    let deep = "sequences/00/config.toml";
    with_table(dir.path(), "config.toml", own.as_str())
        .load()
        .expect("its own");
    with_table(dir.path(), deep, &format!("../../{own}"))
        .load()
        .expect("its own");
    let outside = dir.path().join("secret.csv");
    let outside = outside.to_str().expect("UTF-8");
    for path in [
        "secret.csv",
        outside,
        "inputs/../secret.csv",
        "../x.csv",
        "inputs/a/b.csv",
    ] {
        let text = refused("config.toml", path);
        assert!(text.contains("must be inputs/NAME"), "{text}");
        let text = refused(deep, path);
        assert!(text.contains("must be ../../inputs/NAME"), "{text}");
    }
    assert!(refused("config.toml", "inputs/none.csv").contains("cannot read"));
    let text = refused("config.toml", "inputs/0123456789abcdef-spiral.csv");
    assert!(text.contains("checksum"), "{text}");
    #[cfg(unix)]
    {
        let link = dir.path().join("inputs/link.csv");
        std::os::unix::fs::symlink(dir.path().join("secret.csv"), link).expect("a link");
        assert!(refused("config.toml", "inputs/link.csv").contains("cannot read"));
    }
}

#[test]
fn stones_of_given_trails_count_among_the_things_of_a_chunk() {
    let of_lines = |count: i32, apart_m: i32, settings: &[&str]| {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("trails.csv");
        let mut table = "trail,x,y\n".to_owned();
        for i in 0..count {
            let x = i * apart_m;
            table += &format!("t{i},{x},0\nt{i},{},60\nt{i},{x},120\n", x + 10);
        }
        nemoral_files::write(&path, table.as_bytes()).expect("written");
        let lines = format!("[site.trails]\npath = {:?}", path.display().to_string());
        load("oak-mixed", &lines, settings)
    };
    // A site of ten trails that meet, and one of many that do not.
    of_lines(10, 5, &["trails.rocks_max=25"]).expect("a site");
    of_lines(200, 200, &["trails.rocks_max=25"]).expect("a site");
    let text = message(of_lines(60, 1, &["trails.rocks_max=25"]));
    assert!(
        text.contains("trails.rocks_max") && text.contains("number only 1310"),
        "{text}"
    );
    of_lines(60, 1, &["trails.rocks_max=2"]).expect("a site");
}

/// A stone, in metres with y up.
const STONE: &str = "v 0 0 0\nv 1 0 0\nv 0 0 -1\nv 0 0.5 0\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

/// The stone with materials beside it, and a config with these tables of models.
fn with_stone(tables: &str) -> (tempfile::TempDir, ConfigLayers) {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, text: &str| {
        nemoral_files::write(&dir.path().join(name), text.as_bytes()).expect("written");
    };
    write("plain.obj", STONE);
    write(
        "stone.obj",
        &format!("mtllib stone.mtl\nusemtl grey\n{STONE}"),
    );
    write("stone.mtl", "newmtl grey\nKd 0.3 0.3 0.3\n");
    write("lost.obj", &format!("mtllib ../secret.mtl\n{STONE}"));
    write("gone.obj", &format!("mtllib gone.mtl\n{STONE}"));
    write("c.toml", tables);
    let layers = ConfigLayers {
        preset: None,
        file: Some(dir.path().join("c.toml")),
        settings: Vec::new(),
    };
    (dir, layers)
}

#[test]
fn models_have_their_own_defaults() {
    let tables = "[models.stone]\nfile = \"stone.obj\"\nkind = \"rock\"\nscale_max = 2\n\
                  [models.other]\nfile = \"plain.obj\"\nkind = \"rock\"\nspecies = \"stone\"";
    let (_dir, layers) = with_stone(tables);
    let config = layers.load().expect("fine");
    let (stone, other) = (&config.models["stone"], &config.models["other"]);
    assert_eq!(
        (stone.share, stone.scale_min, stone.scale_max),
        (0.2, 0.9, 2.0)
    );
    assert_eq!(
        (stone.species_or("stone"), other.species_or("other")),
        ("stone", "stone")
    );
    assert!(
        stone.file.as_str().ends_with("/stone.obj"),
        "{}",
        stone.file
    );
    assert_eq!(
        Config::from_toml(&config.to_toml()).expect("our own"),
        config
    );
    let annotated = crate::annotated_toml(&config);
    assert!(annotated.contains("[models.stone]"), "{annotated}");
    let none = crate::annotated_toml(&Config::default());
    assert!(none.contains("# [models.old_oak]"), "{none}");
}

#[test]
fn impossible_models_are_refused() {
    let stone = "[models.x]\nfile = \"stone.obj\"\nkind = \"rock\"\n";
    for (tables, expected) in [
        (
            "[models.x]\nkind = \"rock\"".to_owned(),
            "models.x.file = \"\": must name a glTF",
        ),
        (
            "[models.x]\nfile = \"none.glb\"".to_owned(),
            "models.x.file: cannot read",
        ),
        ("[models.x]\nfile = \"c.toml\"".to_owned(), "has no faces"),
        (
            "[models.x]\nfile = \"gone.obj\"".to_owned(),
            "names the file gone.mtl, which is not",
        ),
        (
            "[models.x]\nfile = \"lost.obj\"".to_owned(),
            "names a file: ",
        ),
        (
            "[models.x]\nfile = \"plain.obj\"".to_owned(),
            "[semantics] of its sidecar",
        ),
        (
            format!("{stone}colour = 1"),
            "no such key; there are file, kind, share",
        ),
        (format!("{stone}kinds = 1"), "did you mean `kind`?"),
        (
            format!("{stone}share = 1.5"),
            "models.x.share = 1.5: must be a number from 0 to 1",
        ),
        (
            format!("{stone}scale_min = 3"),
            "models.x.scale_min = 3: must be at most",
        ),
        (
            format!("{stone}scale_max = 20"),
            "models.x.scale_max = 20: its largest copy",
        ),
        (
            format!("{stone}species = \"Old Oak\""),
            "models.x.species = \"Old Oak\": must be 1 to",
        ),
        (stone.replace(".x]", ".\"X 1\"]"), "a model's name must be"),
        (
            format!(
                "{stone}share = 0.6\n{}share = 0.6",
                stone.replace(".x]", ".y]")
            ),
            "kind = \"rock\" add up to 1.2: must be at most 1",
        ),
        (
            "[models]\nx = 3".to_owned(),
            "models.x = 3: must be a table, [models.x]",
        ),
    ] {
        let (_dir, layers) = with_stone(&tables);
        let text = message(layers.load());
        assert!(text.contains(expected), "{tables}: {text}");
    }
}

#[test]
fn a_model_of_a_data_set_is_an_archive() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let root = nemoral_files::Folder::new(dir.path());
    let put = |name: &str, bytes: &[u8]| {
        let name = nemoral_dataset::InnerPath::new(name).expect("a name");
        root.put(&name, bytes).expect("written");
    };
    put("dataset.json", b"{}");
    let alone = nemoral_dataset::input_path("plain.obj", STONE.as_bytes());
    put(alone.as_str(), STONE.as_bytes());
    let files = nemoral_import::ModelFiles::single("plain.obj", STONE.into());
    let archive = files.to_tar().expect("a short name");
    let packed = nemoral_dataset::input_path("plain.obj.tar", &archive);
    put(packed.as_str(), &archive);
    let load = |name: &str| {
        let config = format!("[models.x]\nfile = \"{name}\"\nkind = \"rock\"\n");
        put("config.toml", config.as_bytes());
        let layers = ConfigLayers {
            preset: None,
            file: Some(dir.path().join("config.toml")),
            settings: Vec::new(),
        };
        layers.load()
    };
    load(packed.as_str()).expect("its own");
    let text = message(load(alone.as_str()));
    assert!(text.contains("must be an archive"), "{text}");
}
