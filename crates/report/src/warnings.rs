//! What a person should look at before training on a data set.

use nemoral_dataset::{Dataset, Stats};

/// A median share of points seen before above this makes frames hardly different.
const SAME: f64 = 0.9;
/// A class with more than this share of all pixels outweighs the others.
const LOPSIDED: f64 = 0.8;
/// Mean brightness of pictures that are too dark or too bright to learn from, 0 to 255.
const DARK: f64 = 12.0;
const BRIGHT: f64 = 235.0;

/// In whole sentences; `brightness` is that of pictures, 0 to 255.
pub(crate) fn warnings(dataset: &Dataset, stats: &Stats, brightness: &[f64]) -> Vec<String> {
    let manifest = dataset.manifest();
    let sequences = &manifest.header.sequences;
    let mut found = Vec::new();
    if !dataset.is_untouched() {
        found.push("dataset.json was changed after it was written.".to_owned());
    }
    let made: usize = manifest.frames.len();
    let driven: u64 = manifest.tracks.iter().map(|t| t.length).sum();
    if (made as u64) < driven {
        found.push(format!(
            "{made} of the {driven} frames of its drives are here."
        ));
    }
    if manifest.tracks.len() < sequences.len() {
        let (here, all) = (manifest.tracks.len(), sequences.len());
        found.push(format!("{here} of {all} sequences have frames here."));
    }
    if sequences.len() > 1 && sequences.iter().all(|s| s.split.is_none()) {
        found.push(
            "Its sequences are not divided for training and testing ([splits] of the config)."
                .to_owned(),
        );
    }
    if let Some(overlap) = stats.overlap.filter(|o| o.median > SAME) {
        let percent = 100.0 * overlap.median;
        found.push(format!(
            "Frames hardly differ: half of them show {percent:.0} % or more of the frame before."
        ));
    }
    let missing: Vec<&str> = (stats.classes.iter())
        .filter(|c| c.pixels == 0 && c.points == 0)
        .map(|c| c.name.as_str())
        .collect();
    if !missing.is_empty() {
        found.push(format!(
            "No pixel and no point is of {}.",
            missing.join(", ")
        ));
    }
    for class in &stats.classes {
        let share = class.pixels as f64 / stats.pixels().max(1) as f64;
        if share > LOPSIDED {
            found.push(format!(
                "{:.0} % of all pixels are {}.",
                100.0 * share,
                class.name
            ));
        }
    }
    let dark = brightness.iter().filter(|&&b| b < DARK).count();
    let bright = brightness.iter().filter(|&&b| b > BRIGHT).count();
    for (count, how) in [(dark, "dark"), (bright, "bright")] {
        if count > 0 {
            found.push(format!(
                "{count} of {} pictures are very {how}.",
                brightness.len()
            ));
        }
    }
    let has_lidar = sequences.iter().any(|s| !s.lidars.is_empty());
    let empty = (manifest.frames.iter()).filter(|f| f.point_classes.values().all(|&n| n == 0));
    let empty = empty.count();
    if has_lidar && empty > 0 {
        found.push(format!("{empty} of {made} frames have no LiDAR point."));
    }
    if sequences
        .iter()
        .flat_map(|s| &s.lidars)
        .any(|l| !l.well_placed())
    {
        found.push(
            "Some scans are not where the pictures are: they are raw, or have errors of pointing."
                .to_owned(),
        );
    }
    found
}
