//! The stand presets by forest inventory: numbers, diameters, the pattern of stems, regeneration,
//! and that each gives a frame.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]
#![allow(clippy::print_stdout, reason = "what was measured, for --nocapture")]

use nemoral_assets::Species;
use nemoral_pipeline::config::{Assets, Config};
use nemoral_pipeline::plan::Runner;
use nemoral_realism::{clark_evans, row_power};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Semantic, TreeRecord};
use nemoral_tests::{STANDS, TRACKS_ALONE, World};

/// Side of the square that is surveyed, chunks.
const SIDE: i32 = 10;

/// Settings for a short range and a small picture, on which numbers and places do not depend.
const SMALL: [&str; 8] = [
    "chunks.visible_radius_m=30",
    "chunks.undergrowth_radius_m=15",
    "chunks.delete_radius_m=60",
    "camera.width_px=96",
    "camera.height_px=64",
    "camera.edge_samples=1",
    "lidar.pulses=1000",
    "terrain.cell_m=2",
];

fn trees(world: &World, runner: &Runner<'_>) -> Vec<TreeRecord> {
    let square: Vec<ChunkCoord> = (0..SIDE * SIDE)
        .map(|i| ChunkCoord::new(i % SIDE - 5, i / SIDE - 5))
        .collect();
    let assets = runner.get(world.forest.assets, ()).expect("assets");
    let things = runner.demand(world.forest.objects).all(&square);
    let things = things.expect("things");
    let all = things.iter().flat_map(|t| t.0.iter());
    all.filter_map(|t| assets.tree_record(t)).collect()
}

/// The mean diameter that a config asks for, of its truncated distribution and over its species.
fn asked_dbh_m(assets: &Assets) -> f64 {
    let limits = [assets.dbh_min_m, assets.dbh_max_m];
    let (mut sum, mut shares) = (0.0, 0.0);
    for (name, share) in assets.shares().into_iter().filter(|(_, s)| *s > 0.0) {
        let species = name
            .and_then(Species::built_in)
            .expect("a built-in species");
        let of_rank = |i: u32| {
            let rank = (f64::from(i) + 0.5) / 100.0;
            species.dbh_of_rank(assets.dbh_mean_m, assets.dbh_shape, limits, rank)
        };
        sum += share * (0..100).map(of_rank).sum::<f64>() / 100.0;
        shares += share;
    }
    sum / shares
}

/// The two most different stands: rows, and a mixture with gaps and regeneration; with two
/// individuals per species.
#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn rows_and_mixtures_are_as_described() {
    are_as_described(&["eucalyptus-plantation", "oak-mixed"], 2, 0.35);
}

#[test]
#[ignore = "minutes: .ci/full runs it"]
fn every_recipe_gives_the_stand_it_describes() {
    are_as_described(&STANDS, 8, 0.10);
}

/// Asserts that stands are as described. The mean diameter with this many individuals per species
/// is within `dbh_tolerance` of the distribution's.
fn are_as_described(stands: &[&str], individuals: u32, dbh_tolerance: f64) {
    for &name in stands {
        let individuals = format!("assets.individuals={individuals}");
        let mut settings = vec![individuals.as_str()];
        settings.extend(SMALL);
        settings.extend(TRACKS_ALONE);
        let world = World::new(name, &settings);
        let runner = world.runner(2);
        let all = trees(&world, &runner);
        let (young, grown): (Vec<_>, Vec<_>) =
            all.into_iter().partition(|t| t.age_class == "sapling");
        check_stand(name, &world.config, &grown, dbh_tolerance);
        check_regeneration(name, &world.config, &young);
        // A frame of the stand can be recorded.
        let images = &runner.get(world.forest.images, 0).expect("a frame")[0];
        let scans = runner.get(world.forest.scans, 0).expect("a scan");
        assert!(scans[0].len() > 50, "{name}: {} points", scans[0].len());
        let seen = |of: &[Semantic]| {
            let pixels = images.truth.semantic.pixels();
            pixels.iter().filter(|s| of.contains(s)).count()
        };
        let leaves = seen(&[Semantic::Leaf, Semantic::Needle]);
        assert!(leaves > 30, "{name}: {leaves} pixels of leaves");
        assert!(seen(&[Semantic::Sky]) < 96 * 64 / 2, "{name}");
    }
}

/// A user copies and changes a species file, as the file itself suggests. The whole stand has this
/// species.
#[test]
fn an_own_species_stands_in_the_forest() {
    const BEECH: &str = include_str!("../../../crates/assets/species/beech.toml");
    // The trees are far lower than any beech of their diameter, so that they cannot be ordinary
    // beeches.
    let low = BEECH
        .replace("name = \"beech\"", "name = \"low_beech\"")
        .replace("dominant = [45.0, 32.0]", "dominant = [45.0, 14.0]");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("low_beech.toml");
    std::fs::write(&path, &low).expect("written");
    let species = Species::from_toml(&low, "low_beech.toml").expect("a species");
    let beech = Species::built_in("beech").expect("built in");

    let shares = Config::default().assets.shares();
    let built_in = shares.into_iter().filter_map(|(name, _)| name);
    let mut settings: Vec<String> = built_in.map(|name| format!("assets.{name}=0")).collect();
    settings.extend(SMALL.map(str::to_owned));
    settings.extend([
        format!("assets.own_species={}", path.display()),
        "assets.own_share=1".to_owned(),
        "assets.individuals=1".to_owned(),
        "assets.snags=0".to_owned(),
        "placement.trees=4".to_owned(),
        "placement.regeneration.saplings=1".to_owned(),
    ]);
    let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
    let world = World::without_cameras("demo", &settings);
    let all = trees(&world, &world.runner(2));
    assert!(all.len() > 200, "{} trees", all.len());
    for t in &all {
        assert_eq!(t.species, "low_beech", "{t:?}");
    }
    let grown: Vec<_> = all.iter().filter(|t| t.age_class != "sapling").collect();
    assert!((200..all.len()).contains(&grown.len()), "young and grown");
    for t in grown {
        // The scatter of heights is 8 %, and its limit is 2.5 times that.
        let (own, other) = (species.mean_height_m(t.dbh_m), beech.mean_height_m(t.dbh_m));
        assert!((0.75..1.25).contains(&(t.height_m / own)), "{own}: {t:?}");
        assert!(t.height_m < 0.8 * other, "{other}: {t:?}");
    }
}

fn check_stand(name: &str, config: &Config, grown: &[TreeRecord], dbh_tolerance: f64) {
    let (size_m, target) = (config.chunks.size_m, config.placement.trees);
    let mean = grown.len() as f64 / f64::from(SIDE * SIDE);
    let places: Vec<DVec2> = grown.iter().map(|t| t.position_m.truncate()).collect();
    let edge_m = size_m * f64::from(SIDE);
    let r = clark_evans(&places, DVec2::splat(-5.0 * size_m), edge_m, 25.0);
    let dbh_m = grown.iter().map(|t| t.dbh_m).sum::<f64>() / grown.len() as f64;
    let asked_m = asked_dbh_m(&config.assets);
    let rows = &config.placement.rows;
    let heading = |deg: f64| row_power(&places, rows.heading_deg + deg, 3.0);
    println!(
        "{name}: {mean:.1} of {target} trees a chunk, R = {r:.2}, DBH {dbh_m:.3} of {asked_m:.3} \
         m, rows {:.0}",
        heading(0.0)
    );
    // The tolerance is 5 %, or 3 sigma of random points in a hundred chunks.
    let tolerance = 0.05_f64.max(3.0 / (target * 100.0).sqrt());
    assert!((mean / target - 1.0).abs() < tolerance, "{name}: {mean}");
    assert!(
        (dbh_m / asked_m - 1.0).abs() < dbh_tolerance,
        "{name}: {dbh_m} {asked_m}"
    );
    if rows.spacing_m > 0.0 {
        assert!(r > 1.5, "{name}: rows are even: {r}");
        assert!(
            heading(0.0) > 0.5 * grown.len() as f64,
            "{name}: rows are seen"
        );
        assert!(
            heading(20.0) < 0.02 * grown.len() as f64,
            "{name}: there only"
        );
    } else {
        assert!((0.9..1.4).contains(&r), "{name}: {r}");
        assert!(heading(0.0) < 0.02 * grown.len() as f64, "{name}: no rows");
    }
    let snags = grown.iter().filter(|t| !t.alive).count() as f64 / grown.len() as f64;
    let wanted = config.assets.snags;
    assert!(
        (snags - wanted).abs() < 0.2 * wanted + 0.004,
        "{name}: {snags}"
    );
}

fn check_regeneration(name: &str, config: &Config, young: &[TreeRecord]) {
    let target = config.placement.regeneration.saplings;
    let mean = young.len() as f64 / f64::from(SIDE * SIDE);
    println!("{name}: {mean:.1} of {target} saplings a chunk");
    // Clusters scatter more than random points.
    assert!((mean - target).abs() < 0.2 * target + 0.5, "{name}: {mean}");
    for t in young {
        assert!((0.6..5.0).contains(&t.height_m), "{name}: {t:?}");
        assert!(t.dbh_m < 0.07 && t.alive, "{name}: {t:?}");
        assert!(t.height_m > 1.3 || t.dbh_m == 0.0, "{name}: {t:?}");
    }
    let heights = young.iter().map(|t| t.height_m);
    let smallest = heights.fold(f64::INFINITY, f64::min);
    assert!(
        young.is_empty() || smallest < 1.5,
        "{name}: some are small: {smallest}"
    );
}
