//! Diameters at breast height from scans; docs/measurements/realism.md has those of every stand
//! preset.

use nemoral_pipeline::ForestPlan;
use nemoral_pipeline::plan::{Runner, Store};
use nemoral_realism::ranges::{DBH_BIAS_M, DBH_RMSE_M};
use nemoral_realism::{STATIONS, ScannedDiameters};
use nemoral_tests::{STANDS, config, store};

/// Settings for four scans of a forest that grows quickly.
const SMALL: [&str; 7] = [
    "assets.individuals=3",
    "chunks.undergrowth_radius_m=0",
    "undergrowth.cover=0",
    "frames=4",
    "robot.stations.columns=2",
    "robot.stations.rows=2",
    "robot.stations.distance_m=26",
];

fn scanned(preset: &str, store: &Store, settings: &[&str]) -> ScannedDiameters {
    let config = config(preset, &[&STATIONS[..], settings].concat());
    let forest = ForestPlan::new(&config).unwrap_or_else(|e| panic!("{e}"));
    // The keys in the store include the settings that matter, so that what does not depend on them
    // is computed once.
    let runner = Runner::new(forest.plan(), store, 2);
    let found = ScannedDiameters::of(&forest, &config, &runner);
    println!(
        "{preset}: {} stems of {:.3} m on average: bias {:+.1} mm, RMSE {:.1} mm",
        found.stems.len(),
        found.mean_m(),
        1000.0 * found.bias_m(),
        1000.0 * found.rmse_m()
    );
    found
}

fn within((low, high): (f64, f64), value: f64) -> bool {
    (low..=high).contains(&value)
}

fn is_sound(found: &ScannedDiameters) {
    assert!(found.stems.len() >= 20, "{} stems", found.stems.len());
    assert!(within(DBH_RMSE_M, found.rmse_m()), "{found:?}");
    assert!(within(DBH_BIAS_M, found.bias_m()), "{found:?}");
}

/// A circle gives the diameter, but not with range errors, nor with a wide beam,
/// which at a stem's border averages the stem and what is behind it.
#[test]
#[ignore = "a minute: .ci/full runs it"]
fn a_circle_in_a_slice_gives_the_diameter() {
    let store = store();
    is_sound(&scanned("medium", &store, &SMALL));
    let errs = ["lidar.noise.model=laconte", "lidar.noise.sigma_m=0.05"];
    let wide = ["lidar.beam.rings=2"];
    for cause in [&errs[..], &wide] {
        let broken = scanned("medium", &store, &[&SMALL[..], cause].concat());
        println!("  {cause:?}");
        assert!(!within(DBH_RMSE_M, broken.rmse_m()), "{cause:?}");
        assert!(!within(DBH_BIAS_M, broken.bias_m()), "{cause:?}");
    }
}

#[test]
#[ignore = "minutes: .ci/full runs it"]
fn every_stand_gives_its_diameters() {
    for preset in STANDS {
        is_sound(&scanned(preset, &store(), &[]));
    }
}
