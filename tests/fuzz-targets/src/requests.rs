//! Requests of a user, and the files that a request names.

use nemoral_assets::Species;
use nemoral_lidar::{CsvPattern, ScanPattern};
use nemoral_pipeline::config::{Config, ConfigLayers};
use nemoral_pipeline::{Error, fuzz};
use nemoral_trajectory::PoseFormat;

use crate::scratch::Scratch;

/// The greatest length of an error message.
const MESSAGE_BYTES: usize = 64 << 10;

/// Loads a request. An accepted one can be written and read again, and so can its first sequence.
fn load(layers: &ConfigLayers) {
    if let Err(e) = load_sequences(layers) {
        let length = e.to_string().len();
        assert!(length <= MESSAGE_BYTES, "a message of {length} bytes");
    }
}

fn load_sequences(layers: &ConfigLayers) -> Result<(), Error> {
    let sequences = layers.sequences()?;
    let config = sequences.get(0)?.config;
    // Files have other names in a data set, which carries them.
    let names_files = |text: &String| text.contains("\"inputs/");
    let texts = [config.to_toml(), sequences.to_toml()?].into_iter();
    for text in texts.filter(|text| !names_files(text)) {
        let again = Config::from_toml(&text);
        assert_eq!(again.expect("what was written is read"), config);
    }
    sequences.get(sequences.len() - 1)?;
    Ok(())
}

/// Loads a config file.
pub fn config(input: &[u8]) {
    let scratch = Scratch::new();
    let file = Some(scratch.put("config.toml", input));
    load(&ConfigLayers {
        file,
        ..ConfigLayers::default()
    });
}

/// Loads `--set` texts, one on each line; the first line is the preset's name, or empty.
pub fn settings(input: &[u8]) {
    let Ok(text) = std::str::from_utf8(input) else {
        return;
    };
    let mut lines = text.split('\n').map(str::to_owned);
    load(&ConfigLayers {
        preset: lines.next().filter(|name| !name.is_empty()),
        file: None,
        settings: lines.collect(),
    });
}

/// Loads a species file.
pub fn species(input: &[u8]) {
    let Ok(text) = std::str::from_utf8(input) else {
        return;
    };
    if let Err(e) = Species::from_toml(text, "species.toml") {
        let length = e.to_string().len();
        assert!(length <= MESSAGE_BYTES, "a message of {length} bytes");
    }
}

/// Loads a table of pulses.
pub fn pattern(input: &[u8]) {
    match CsvPattern::from_csv(input) {
        Ok(pattern) => {
            let last = pattern.len() as u64 - 1;
            for number in [0, 1, last, last + 1, u64::from(u32::MAX), u64::MAX] {
                let pulse = pattern.pulse(number);
                let length = pulse.direction.length();
                assert!((length - 1.0).abs() < 1e-5, "a direction of {length}");
            }
            assert!(pattern.rate_hz() > 0.0, "{}", pattern.rate_hz());
        }
        Err(e) => {
            let length = e.to_string().len();
            assert!(length <= MESSAGE_BYTES, "a message of {length} bytes");
        }
    }
}

/// Loads poses for the robot; the first byte selects the format.
pub fn robot_poses(input: &[u8]) {
    let Some((format, bytes)) = input.split_first() else {
        return;
    };
    let format = if format % 2 == 0 {
        PoseFormat::Tum
    } else {
        PoseFormat::Kitti
    };
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    match nemoral_trajectory::read_poses(text, "poses.txt", format) {
        Ok(poses) => {
            for (_, pose) in poses {
                let length = pose.rotation.length();
                assert!((length - 1.0).abs() < 1e-6, "a rotation of length {length}");
            }
        }
        Err(e) => {
            let length = e.to_string().len();
            assert!(length <= MESSAGE_BYTES, "a message of {length} bytes");
        }
    }
}

/// Loads a photographed sky.
pub fn sky(input: &[u8]) {
    let scratch = Scratch::new();
    let name = if input.starts_with(b"#?") {
        "sky.hdr"
    } else {
        "sky.exr"
    };
    let _ = fuzz::sky(&scratch.put(name, input));
}
