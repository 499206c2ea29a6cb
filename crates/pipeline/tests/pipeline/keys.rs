//! Keys of plans, which depend on everything that decides a value, and on nothing else.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use nemoral_pipeline::config::{Config, ConfigLayers, Preset, RobotPath};
use nemoral_pipeline::{Backend, Error, ForestPlan, InputFiles};

/// Each stage's key, numbered as they repeat.
fn keys(config: &Config) -> Result<BTreeMap<String, String>, Error> {
    let forest = ForestPlan::new(config)?;
    let provenance = forest.plan().provenance().into_iter().enumerate();
    Ok(provenance
        .map(|(i, (id, key))| (format!("{i:02} {id}"), key.to_string()))
        .collect())
}

fn load(settings: &[String]) -> Config {
    let layers = ConfigLayers {
        preset: Some("demo".to_owned()),
        file: None,
        settings: settings.to_vec(),
    };
    layers.load().unwrap_or_else(|e| panic!("{e}"))
}

/// The stages whose keys differ.
fn differing(a: &Config, b: &Config) -> Vec<String> {
    let (a, b) = (keys(a).expect("readable"), keys(b).expect("readable"));
    let differ = |(name, key): (&String, &String)| (b[name] != *key).then(|| name[3..].to_owned());
    a.iter().filter_map(differ).collect()
}

/// A config with every table and every variant of a choice, whose keys are written down below.
const VARIED: &str = r#"
preset = "demo"
seed = 11
[sun.date]
later_h = 1.5
[camera.calibration]
fx_px = 90
fy_px = 90
cx_px = 80
cy_px = 48
[camera.fisheye]
k1 = 0.01
[cameras.left.sensor]
[cameras.left.brown_conrady]
[cameras.right.fov]
[cameras.right.pinhole]
[lidar.lines]
[lidars.a.mid40]
[lidars.b.mid70]
[lidars.c.avia]
[lidars.d.spinning]
[lidars.e.panorama]
[lidars.f.horizon]
[lidars.g.mirror]
[robot.stations]
rows = 5
"#;

/// One whose frames are chosen.
const BALANCED: &str = r#"
preset = "demo"
[balance.targets]
rocks = 0.05
"#;

/// A key that changes although nothing else did breaks `--resume` and `merge` of users' data sets.
/// If a stage's output changed, or what it depends on, write the new keys down here and say so
/// under *Dataset-changing* in the change log.
#[test]
fn keys_are_as_they_were() {
    let varied = Config::from_toml(VARIED).expect("a config");
    let balanced = Config::from_toml(BALANCED).expect("a config");
    let presets = [Preset::ALL[0].config(), varied, balanced];
    let mut text = String::new();
    for (name, config) in ["default", "varied", "balanced"].iter().zip(presets) {
        for (stage, key) in keys(&config).expect("a plan") {
            // 64 bits of each key are enough to tell keys apart.
            text += &format!("{name} {stage} {}\n", &key[..16]);
        }
    }
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/keys.txt");
    if std::env::var_os("NEMORAL_BLESS").is_some() {
        fs::write(&golden, &text).expect("a writable source tree");
    }
    let expected = fs::read_to_string(&golden).expect("it is beside this file");
    for (is, was) in text.lines().zip(expected.lines()) {
        assert_eq!(is, was);
    }
    assert_eq!(text.lines().count(), expected.lines().count());
}

/// Keys depend on the content of files and not on their names.
#[test]
fn files_count_by_what_is_in_them() {
    const BEECH: &str = include_str!("../../../assets/species/beech.toml");
    let folder = tempfile::tempdir().expect("a folder");
    let sky = |name: &str, blue: f32| {
        let image = image::Rgb32FImage::from_pixel(16, 8, image::Rgb([1.0, 1.0, blue]));
        let path = folder.path().join(name);
        image.save(&path).expect("written");
        fs::read(path).expect("it was written")
    };
    let species = BEECH.replace("apical_dominance = 0.7", "apical_dominance = 0.6");
    let cases = [
        (
            "lidar.table.path",
            "world.lidars",
            b"0, 0, 0\n0.001, 1, 0\n".to_vec(),
            b"0, 0, 0\n0.001, 2, 0\n".to_vec(),
        ),
        (
            "robot.file.path",
            "world.trajectory",
            b"0 0 0 0 0 0 0 1\n9 1 0 0 0 0 0 1\n".to_vec(),
            b"0 0 0 0 0 0 0 1\n9 2 0 0 0 0 0 1\n".to_vec(),
        ),
        (
            "assets.own_species",
            "world.library",
            BEECH.as_bytes().to_vec(),
            species.into_bytes(),
        ),
        (
            "sky.image",
            "world.cameras",
            sky("a.hdr", 1.0),
            sky("b.hdr", 2.0),
        ),
    ];
    for (key, stage, one, other) in cases {
        let ending = if key == "sky.image" { "hdr" } else { "txt" };
        let write = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(format!("{name}.{ending}"));
            fs::write(&path, bytes).expect("written");
            format!("{key}={}", path.display())
        };
        let first = load(&[write("first", &one)]);
        let moved = load(&[write("moved", &one)]);
        assert_eq!(differing(&first, &moved), [""; 0], "{key}");
        let edited = load(&[write("edited", &other)]);
        let changed = differing(&first, &edited);
        assert!(changed.iter().any(|id| id == stage), "{key}: {changed:?}");
        // The file is changed in place as well, as nothing remembers the old content.
        let before = keys(&first).expect("readable");
        write("first", &other);
        assert_ne!(keys(&first).expect("readable"), before, "{key}");
    }
}

#[test]
fn what_was_not_read_with_the_config_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("pulses.csv");
    fs::write(&path, "0, 0, 0\n0.001, 1, 0\n").expect("written");
    let config = load(&[format!("lidar.table.path={}", path.display())]);
    let read = InputFiles::read(&config).expect("readable");
    fs::remove_file(&path).expect("it is there");
    // Nothing opens the file again.
    assert!(ForestPlan::with_inputs(&config, &read, Backend::Cpu).is_ok());
    let refused = ForestPlan::with_inputs(&config, &InputFiles::default(), Backend::Cpu);
    let message = refused.expect_err("it has no file").to_string();
    assert!(message.contains("lidar.table.path"), "{message}");
    let gone = ForestPlan::new(&config).expect_err("the file is gone");
    assert!(
        gone.is_request() && gone.to_string().contains("lidar.table.path"),
        "{gone}"
    );
}

/// Code can give keys values that no file can.
#[test]
fn values_that_code_has_set_are_checked() {
    type Set = fn(&mut Config);
    let cases: [(&str, Set); 8] = [
        ("trails.surface", |c| c.trails.surface = "ice".to_owned()),
        ("robot.trail.way", |c| {
            if let RobotPath::Trail(path) = &mut c.robot.path {
                path.way = "motorway".to_owned();
            }
        }),
        ("lidar.device", |c| c.lidar.device = "vlp17".to_owned()),
        ("lidars.rear.device", |c| {
            let mut rear = c.lidar.clone();
            rear.device = "vlp17".to_owned();
            c.lidars.insert("rear".to_owned(), rear);
        }),
        ("output.formats", |c| {
            c.output.formats = vec!["paper".to_owned()];
        }),
        ("terrain.scale_m", |c| c.terrain.scale_m = f64::NAN),
        ("lidar.carrier", |c| c.lidar.carrier = vec![0.0; 5]),
        ("seed", |c| c.seed = u64::MAX),
    ];
    let none = InputFiles::default();
    for (key, set) in cases {
        let mut config = load(&[]);
        set(&mut config);
        let error = ForestPlan::with_inputs(&config, &none, Backend::Cpu).expect_err(key);
        let message = error.to_string();
        assert!(error.is_request(), "{message}");
        assert!(message.starts_with(&format!("{key} = ")), "{message}");
        let checked = config.check(&none).expect_err(key);
        assert_eq!(checked.to_string(), message);
    }
    // Each of these values is allowed, and both are not.
    let mut config = load(&[]);
    (config.terrain.cell_m, config.terrain.fine_cell_m) = (1.0, 2.0);
    let message = ForestPlan::new(&config).expect_err("finer").to_string();
    assert!(message.contains("terrain.fine_cell_m = 2"), "{message}");
}
