//! The ranges that measures are held to: the page's and the tests'.
#![allow(clippy::print_stdout, reason = "what was measured, for --nocapture")]

/// A measure is in its range, and out of it for each cause.
///
/// # Panics
/// If not.
pub fn leaves(measure: &str, (low, high): (f64, f64), sound: f64, broken: &[(&str, f64)]) {
    println!("{measure}: {sound:.3} in {low}..{high}; {broken:.3?}");
    assert!((low..=high).contains(&sound), "{measure}: {sound}");
    for (cause, value) in broken {
        assert!(!(low..=high).contains(value), "{measure}: {cause}: {value}");
    }
}

/// Pairs of trees that look alike within 30 m, of a million pairs of the same individual: none.
pub const ALIKE: (f64, f64) = (0.0, 0.0);

/// A mean of grown trees over the published relation's.
pub const RELATIONS: (f64, f64) = (0.97, 1.03);

/// A diameter at breast height from a scan, root mean square error, metres.
pub const DBH_RMSE_M: (f64, f64) = (0.0, 0.02);
/// And its mean error, metres: none, as well as some tens of stems tell.
pub const DBH_BIAS_M: (f64, f64) = (-0.003, 0.003);

/// Standard deviation of heights about the height curve, metres, of Scots pine, Norway spruce and birch: Pukkala et
/// al. 2009 have 2.36, 2.10 and 2.00 for all of Finland.
const HEIGHT_SD_M: (f64, f64) = (2.0, 2.4);
/// And of other species, over the curve's height: what is usual (remembered).
const HEIGHT_SD_SHARE: (f64, f64) = (0.08, 0.10);

/// The range of [`HeightScatter::sd_m`](super::HeightScatter::sd_m), of the species that have one in metres.
#[must_use]
pub fn height_sd_m(species: &str) -> Option<(f64, f64)> {
    let northern = ["scots_pine", "norway_spruce", "silver_birch"];
    northern.contains(&species).then_some(HEIGHT_SD_M)
}

/// The range of [`HeightScatter::sd_share`](super::HeightScatter::sd_share), of the others.
#[must_use]
pub fn height_sd_share(species: &str) -> Option<(f64, f64)> {
    height_sd_m(species).is_none().then_some(HEIGHT_SD_SHARE)
}
