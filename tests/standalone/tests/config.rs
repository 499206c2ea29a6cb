//! Use of `nemoral-config` alone: requests that are read, drawn and refused.

use nemoral_config::{Config, ConfigLayers, Error, ErrorLocation, InputFiles};

fn layers(settings: &[&str]) -> ConfigLayers {
    ConfigLayers {
        preset: Some("demo".to_owned()),
        file: None,
        settings: settings.iter().map(|&s| s.to_owned()).collect(),
    }
}

#[test]
fn what_is_written_is_read_again() -> Result<(), Error> {
    let config = layers(&["placement.trees=31", "lidar.device=mid70"]).load()?;
    assert_eq!(config.placement.trees, 31.0);
    assert_eq!(Config::from_toml(&config.to_toml())?, config);
    Ok(())
}

#[test]
fn an_error_is_at_its_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("forest.toml");
    std::fs::write(&file, "[terrain]\nscale_m = 40\noctaves = 99\n").expect("written");
    let layers = ConfigLayers {
        file: Some(file),
        ..ConfigLayers::default()
    };
    let Err(Error::Config(errors)) = layers.load() else {
        panic!("it has too many octaves");
    };
    let [error] = &errors.errors[..] else {
        panic!("{errors}");
    };
    assert_eq!(error.path, "terrain.octaves");
    let Some(ErrorLocation::File { line, .. }) = &error.location else {
        panic!("{error:?}");
    };
    assert_eq!(*line, 3);
}

#[test]
fn a_file_is_read_once() -> Result<(), Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let pulses = folder.path().join("pulses.csv");
    std::fs::write(&pulses, "0, 0, 0\n0.001, 1, 0\n").expect("written");
    let setting = format!("lidar.table.path={}", pulses.display());
    let (config, inputs) = layers(&[&setting]).load_with_inputs()?;
    assert_eq!(inputs.paths().collect::<Vec<_>>(), [pulses.as_path()]);
    std::fs::remove_file(&pulses).expect("it is there");
    // What was read stays, and nothing is read again but where it is asked for.
    config.check(&inputs)?;
    assert!(config.lidar.scan_pattern("lidar", &inputs).is_ok());
    assert!(InputFiles::read(&config).is_err());
    Ok(())
}
